//! The queue of specimens in a window: changes are written one after another on a thread, and the state shown is the one
//! that is on the disk.

use super::Job;
use eframe::egui::Context;
use palpate_analysis::session_actions::Attribution;
use palpate_analysis::specimen_queue::{
    change, judge_session, named_specimens, read_specimens, session_path,
};
use palpate_sessions::specimen_queue::{
    QueueChange, QueueItem, QueueVerdict, SpecimenQueue, SpecimenState,
};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// What is to be done with the queue.
#[derive(Clone, Debug, PartialEq)]
pub enum QueueWork {
    Read,
    Change(QueueChange),
    /// Adds specimens by name, with the protocol of this name or file.
    AddNamed(Vec<String>, String),
    /// Adds those of a table; the protocol is for rows that name none.
    AddTable(PathBuf, String),
    /// Shuffles those that wait.
    Shuffle(u64),
    /// Judges a session, and its run where it is one of the queue.
    Judge(PathBuf, QueueVerdict),
}

type QueueAnswer = Result<SpecimenQueue, String>;

pub struct QueueDesk {
    library: Result<PathBuf, String>,
    queue: SpecimenQueue,
    is_read: bool,
    waiting: VecDeque<(QueueWork, Attribution)>,
    job: Job<QueueAnswer>,
    /// The work of the job.
    doing: Option<QueueWork>,
    /// Why the last work was refused.
    pub refusal: Option<String>,
    /// The last session that was judged.
    judged: Option<(PathBuf, Result<QueueVerdict, String>)>,
    /// The specimen of the run that is about to begin.
    to_begin: Option<u32>,
}

impl QueueDesk {
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            library,
            queue: SpecimenQueue::default(),
            is_read: false,
            waiting: VecDeque::new(),
            job: Job::default(),
            doing: None,
            refusal: None,
            judged: None,
            to_begin: None,
        }
    }

    /// As it is on the disk, as far as is known.
    pub fn queue(&self) -> &SpecimenQueue {
        &self.queue
    }

    pub fn is_read(&self) -> bool {
        self.is_read
    }

    pub fn is_busy(&self) -> bool {
        self.job.is_busy() || !self.waiting.is_empty()
    }

    /// Asks for work, which is done in order.
    pub fn ask(&mut self, work: QueueWork, by: &str, reason: &str) {
        let by = palpate_analysis::edits::author(Some(by).filter(|name| !name.is_empty()));
        self.waiting.push_back((work, Attribution { by, reason: reason.trim().to_owned() }));
    }

    /// Fetches an answer and begins the next work.
    pub fn poll(&mut self, ctx: &Context) {
        let was_busy = self.job.is_busy();
        let answer = self.job.poll();
        if was_busy && !self.job.is_busy() {
            let gone = "the work on the queue ended unexpectedly; try again";
            self.take(answer.unwrap_or_else(|| Err(gone.into())));
        }
        if self.job.is_busy() {
            return;
        }
        let Some((work, who)) = self.waiting.pop_front() else { return };
        let (library, doing) = (self.library.clone(), work.clone());
        let started = self.job.start("queue", ctx, move || carry_out(library, work, &who));
        match started {
            Ok(()) => self.doing = Some(doing),
            Err(err) => self.refusal = Some(format!("the queue cannot be changed: {err}")),
        }
    }

    fn take(&mut self, answer: QueueAnswer) {
        let doing = self.doing.take();
        if let Some(QueueWork::Judge(session, verdict)) = &doing {
            let said = answer.as_ref().map(|_| *verdict).map_err(Clone::clone);
            self.judged = Some((session.clone(), said));
        }
        match answer {
            Ok(queue) => {
                self.queue = queue;
                self.is_read = true;
                if doing != Some(QueueWork::Read) {
                    self.refusal = None;
                }
            }
            Err(reason) => self.refusal = Some(reason),
        }
    }

    /// The specimen of this number, if it waits and no run is without a verdict.
    pub fn waiting(&self, number: u32) -> Result<QueueItem, String> {
        if let Some(open) = self.queue.open_run() {
            return Err(format!(
                "the run of {} has no verdict yet; accept, reject or repeat it first",
                open.wanted.specimen
            ));
        }
        let item = self.queue.items.iter().find(|item| item.number == number);
        let item = item.filter(|item| item.state == SpecimenState::Waiting);
        item.cloned().ok_or_else(|| "this specimen does not wait any more".into())
    }

    /// Says which run is about to start: one of a specimen of the queue counts there, if it is what the queue asks for.
    pub fn start(&mut self, specimen: &str, protocol: &str) -> Result<(), String> {
        self.to_begin = None;
        let Some(item) = self.queue.find(specimen) else { return Ok(()) };
        match item.state {
            SpecimenState::Waiting if item.wanted.protocol == protocol => {}
            SpecimenState::Waiting => {
                return Err(format!(
                    "the queue asks for the protocol {} on {specimen}; press 'Measure the next specimen' on the screen Today, or choose that protocol",
                    item.wanted.protocol
                ));
            }
            SpecimenState::Begun => {
                return Err(format!(
                    "the run of {specimen} has no verdict yet; accept, reject or repeat it first"
                ));
            }
            SpecimenState::Accepted | SpecimenState::Rejected | SpecimenState::Skipped => {
                return Err(format!(
                    "{specimen} is {} in the queue; choose the next specimen on the screen Today, or let it wait again there",
                    item.state
                ));
            }
        }
        self.to_begin = Some(item.number);
        Ok(())
    }

    /// Says that the run was refused.
    pub fn cancel_start(&mut self) {
        self.to_begin = None;
    }

    /// Says that the run has begun in this folder.
    pub fn begun(&mut self, session: &Path, by: &str) {
        let (Some(number), Ok(library)) = (self.to_begin.take(), &self.library) else { return };
        let session = session_path(library, session);
        self.ask(QueueWork::Change(QueueChange::Begun { number, session }), by, "");
    }

    /// What was said of a session in this window, or why it could not be written.
    pub fn verdict_of(&self, session: &Path) -> Option<&Result<QueueVerdict, String>> {
        self.judged.as_ref().filter(|(own, _)| own == session).map(|(_, said)| said)
    }
}

fn carry_out(library: Result<PathBuf, String>, work: QueueWork, who: &Attribution) -> QueueAnswer {
    if let QueueWork::Judge(session, verdict) = &work {
        // A session elsewhere can be judged without a library.
        return judge_session(library.as_deref().ok(), session, *verdict, who);
    }
    let library = &library?;
    let read = || SpecimenQueue::read(library).map_err(|err| err.to_string());
    match work {
        QueueWork::Read | QueueWork::Judge(..) => read(),
        QueueWork::Change(wanted) => change(library, who, wanted),
        QueueWork::AddNamed(names, protocol) => {
            let specimens = named_specimens(library, &names, &protocol)?;
            change(library, who, QueueChange::Added { specimens })
        }
        QueueWork::AddTable(file, protocol) => {
            let specimens = read_specimens(library, &file, &protocol)?;
            change(library, who, QueueChange::Added { specimens })
        }
        QueueWork::Shuffle(seed) => change(library, who, read()?.shuffle(seed)),
    }
}
