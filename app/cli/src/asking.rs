//! Questions of a run on real wires, asked on the terminal: a person does what is asked and presses Enter.

use super::Failure;
use super::output::Output;
use palpate_model::time::Nanos;
use palpate_model::units::Seconds;
use palpate_protocols::engine::{Operator, Outcome};
use palpate_runner::{PromptView, Request, RunView};
use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};

/// Lines that may wait; a person types them.
const LINES_MAX: usize = 16;

/// The terminal's side of the questions.
pub(super) struct Asking {
    requests: SyncSender<Request>,
    lines: Receiver<String>,
    asked: Option<(String, Seconds)>,
    is_closed: bool,
    /// How far the question after a stop is.
    stopped: Stopped,
    /// Whether that question waits for an answer, for whoever presses Ctrl-C.
    is_asking: Arc<AtomicBool>,
}

/// The question whether to retract.
#[derive(Clone, Copy, Debug)]
enum Stopped {
    /// Not put.
    No,
    /// Put at this session time.
    Asked(Nanos),
    /// Answered at this session time; the runner has yet to take it.
    Answered(Nanos),
}

/// Longest wait for an answer after a stop: who watches a run is there within minutes, and a run that nobody watches
/// must end.
const STOPPED_MAX: Seconds = Seconds(300.0);

/// Until when an answer has surely been taken: thirty looks at the run.
const ANSWERED_MAX: Seconds = Seconds(1.0);

impl Asking {
    /// Listens to standard input and answers to a runner.
    pub fn start(
        requests: SyncSender<Request>,
        is_asking: Arc<AtomicBool>,
    ) -> Result<Self, Failure> {
        let (sender, lines) = sync_channel(LINES_MAX);
        std::thread::Builder::new()
            .name("answers".into())
            .spawn(move || {
                for line in std::io::stdin().lock().lines() {
                    let Ok(line) = line else { return };
                    if sender.send(line).is_err() {
                        return;
                    }
                }
            })
            .map_err(Failure::failed)?;
        Ok(Self { requests, lines, asked: None, is_closed: false, stopped: Stopped::No, is_asking })
    }

    /// Tells a new question and passes on an answer to it. What was typed before the question is no answer.
    pub fn look(&mut self, view: &RunView, output: &Output) {
        let typed = self.typed();
        match (&view.holding, &view.outcome) {
            (Some(stop), None) => self.look_stopped(view, stop, typed, output),
            _ => {
                self.stopped = Stopped::No;
                self.is_asking.store(false, Ordering::Relaxed);
                self.look_prompt(view.prompt.as_ref(), typed, output);
            }
        }
    }

    fn look_prompt(&mut self, prompt: Option<&PromptView>, typed: Option<String>, output: &Output) {
        let Some(prompt) = prompt else {
            self.asked = None;
            return;
        };
        let is_same = self.asked.as_ref().is_some_and(|(message, left)| {
            *message == prompt.message && prompt.time_left.0 <= left.0
        });
        self.asked = Some((prompt.message.clone(), prompt.time_left));
        if !is_same {
            let how = if self.is_closed {
                "nobody can answer, because standard input is closed"
            } else {
                "press Enter when it is done, or type no"
            };
            let left = prompt.time_left.0.round();
            output.note(&format!("{} ({how}; {left} s left)", prompt.message));
            return;
        }
        let again = "press Enter when it is done, or type no; Ctrl-C stops the run";
        let choice = match answer(typed, again, output) {
            Some(true) => Operator::Confirm,
            Some(false) => Operator::Decline,
            None => return,
        };
        // A runner that is swamped or gone ends the run by itself.
        let _ = self.requests.try_send(Request::Operator(choice));
    }

    /// After a stop the probe stands where it is, maybe deep in the tissue: it leaves where somebody wants that.
    fn look_stopped(
        &mut self,
        view: &RunView,
        stop: &Outcome,
        typed: Option<String>,
        output: &Output,
    ) {
        if let Stopped::Answered(at) = self.stopped {
            if view.now.since(at).seconds() < ANSWERED_MAX {
                return;
            }
            // A retract that was stopped at once is another stop.
            self.stopped = Stopped::No;
        }
        let choice = match (self.stopped, &view.can_retract) {
            (_, Err(reason)) => {
                output.note(&format!("the probe stays where it stands: {reason}"));
                Operator::Close
            }
            (Stopped::No, Ok(())) if self.is_closed => Operator::Close,
            (Stopped::No, Ok(())) => {
                self.stopped = Stopped::Asked(view.now);
                self.is_asking.store(true, Ordering::Relaxed);
                let (ending, reason, left) = (&stop.ending, &stop.reason, STOPPED_MAX.0);
                output.note(&format!(
                    "{ending}: {reason}. Retract the probe? (press Enter to retract, or type no to leave it there; {left} s left)"
                ));
                return;
            }
            (Stopped::Asked(since), Ok(()))
                if view.now.since(since).seconds().0 > STOPPED_MAX.0 =>
            {
                output.note("nobody answered; the probe stays where it stands");
                Operator::Close
            }
            (Stopped::Asked(_) | Stopped::Answered(_), Ok(())) => {
                let again = "press Enter to retract, or type no to leave the probe where it stands";
                match answer(typed, again, output) {
                    Some(true) => Operator::Retract,
                    Some(false) => Operator::Close,
                    // A last line may come before the end of the input.
                    None if self.is_closed => Operator::Close,
                    None => return,
                }
            }
        };
        // A runner that is swamped is asked again.
        if self.requests.try_send(Request::Operator(choice)).is_ok() {
            self.stopped = Stopped::Answered(view.now);
        }
    }

    /// The newest line, if any.
    fn typed(&mut self) -> Option<String> {
        let mut newest = None;
        loop {
            match self.lines.try_recv() {
                Ok(line) => newest = Some(line),
                Err(TryRecvError::Empty) => return newest,
                Err(TryRecvError::Disconnected) => {
                    self.is_closed = true;
                    return newest;
                }
            }
        }
    }
}

/// What was typed, as yes or no; `again` says what may be typed.
fn answer(typed: Option<String>, again: &str, output: &Output) -> Option<bool> {
    match typed?.trim() {
        "" | "y" | "yes" | "done" => Some(true),
        "n" | "no" => Some(false),
        _ => {
            output.note(again);
            None
        }
    }
}
