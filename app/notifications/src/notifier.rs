//! The thread that sends: a queue and a connection for each target, so that none waits for another.

use crate::housekeeping::Housekeeping;
use crate::notice::Notice;
use crate::queue::{NoticeQueue, WaitingNotice};
use crate::send::{ATTEMPT_MAX, SILENCE_MAX, SendError, Sender};
use crate::target::Target;
use futures_util::future::{Either, join_all, select};
use std::collections::VecDeque;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::{Notify, watch};

/// How long the end of a program waits for what is not sent yet: long enough for two attempts at a server that answers,
/// short enough for a person who closes a window.
pub const END_WITHIN: Duration = Duration::from_secs(10);

/// How long a notifier waits for servers.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// The longest attempt to send a notice.
    pub attempt: Duration,
    /// The longest wait at the end of the program.
    pub end: Duration,
    /// The longest silence of a connection that stays open.
    pub silence: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { attempt: ATTEMPT_MAX, end: END_WITHIN, silence: SILENCE_MAX }
    }
}

/// Wait between attempts, and for the last word to a broker, while the program ends.
const LAST_WAIT: Duration = Duration::from_secs(1);

/// Notices that were not sent, as a front end can show them.
pub const UNSENT_MAX: usize = 50;

/// A notice that did not reach a target and is given up.
#[derive(Clone, Debug, PartialEq)]
pub struct UnsentNotice {
    pub notice: Notice,
    pub target: String,
    /// Why, in words.
    pub reason: String,
}

/// Sends notices from a thread of its own. Dropped, it takes [`Patience::end`] at most.
pub struct Notifier {
    lines: Vec<Arc<Line>>,
    shared: Arc<Shared>,
    closing: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    unsent: Mutex<VecDeque<UnsentNotice>>,
}

/// A target and what waits for it.
struct Line {
    target: Target,
    name: String,
    queue: Mutex<NoticeQueue>,
    news: Notify,
    shared: Arc<Shared>,
}

/// A value that is written whole, so that a panic elsewhere leaves it usable.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Notifier {
    /// Starts the thread.
    pub fn start(targets: Vec<Target>, patience: Patience) -> std::io::Result<Self> {
        Self::start_with(targets, patience, Arc::default())
    }

    pub(crate) fn start_with(
        targets: Vec<Target>,
        patience: Patience,
        housekeeping: Arc<Housekeeping>,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let line = |target: Target| {
            Arc::new(Line {
                name: target.name(),
                target,
                queue: Mutex::default(),
                news: Notify::new(),
                shared: Arc::clone(&shared),
            })
        };
        let lines: Vec<Arc<Line>> = targets.into_iter().map(line).collect();
        let (closing, is_closing) = watch::channel(false);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let served = lines.clone();
        let thread = std::thread::Builder::new().name("notifications".into()).spawn(move || {
            runtime.block_on(serve(&served, patience, housekeeping, is_closing));
            // The name of a server may be looked up for longer than anybody waits.
            runtime.shutdown_background();
            served.iter().for_each(|line| line.give_up_all());
        })?;
        Ok(Self { lines, shared, closing, thread: Some(thread) })
    }

    /// Queues a notice for every target that wants it. It never waits for a network.
    pub fn send(&self, notice: &Notice) {
        for line in self.lines.iter().filter(|line| line.target.wants(notice.kind)) {
            let dropped = lock(&line.queue).push(notice.clone());
            if let Some(dropped) = dropped {
                line.record(dropped, "too many notices waited for this target");
            }
            line.news.notify_one();
        }
    }

    /// The notices that were given up, the oldest first; at most the newest [`UNSENT_MAX`].
    #[must_use]
    pub fn unsent(&self) -> Vec<UnsentNotice> {
        lock(&self.shared.unsent).iter().cloned().collect()
    }

    /// Sends what waits, within [`Patience::end`], and returns what could not be sent since the start.
    #[must_use]
    pub fn finish(mut self) -> Vec<UnsentNotice> {
        self.end();
        self.unsent()
    }

    fn end(&mut self) {
        let _ = self.closing.send(true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for Notifier {
    fn drop(&mut self) {
        self.end();
    }
}

async fn serve(
    lines: &[Arc<Line>],
    patience: Patience,
    housekeeping: Arc<Housekeeping>,
    mut closing: watch::Receiver<bool>,
) {
    let tasks =
        lines.iter().map(|line| tokio::spawn(Arc::clone(line).serve(patience, closing.clone())));
    let mut tasks: Vec<_> = tasks.collect();
    tasks.push(tokio::spawn(housekeeping.serve(closing.clone())));
    // An error means that the notifier is gone, which is an end too.
    let _ = closing.wait_for(|is_closing| *is_closing).await;
    let _ = tokio::time::timeout(patience.end, join_all(tasks)).await;
}

/// Waits until it is so, but not once the program ends.
pub(crate) async fn unless_closing(
    event: impl Future<Output = ()>,
    closing: &mut watch::Receiver<bool>,
) {
    if *closing.borrow() {
        return;
    }
    let (event, ending) = (pin!(event), pin!(closing.changed()));
    select(event, ending).await;
}

impl Line {
    async fn serve(self: Arc<Self>, patience: Patience, mut closing: watch::Receiver<bool>) {
        let longest = patience.attempt;
        let mut sender = Sender::new(&self.target);
        if let Ok(sender) = &mut sender {
            // A broker is to know at once that palpate is there.
            unless_closing(sender.keep_alive(longest), &mut closing).await;
        }
        loop {
            let first = lock(&self.queue).first().cloned();
            let is_closing = *closing.borrow();
            match first {
                Some(first) => {
                    if sender.is_err() {
                        sender = Sender::new(&self.target);
                    }
                    let result = match &mut sender {
                        Ok(sender) => sender.send(&first.notice, longest).await,
                        Err(err) => Err(err.clone()),
                    };
                    if let Some(wait) = self.judge(&first, result) {
                        self.pause(first.number, wait, &mut closing).await;
                    }
                }
                None if is_closing => break,
                None => {
                    let is_quiet = self.wait_for_news(patience.silence, &mut closing).await;
                    if let (true, Ok(sender)) = (is_quiet, &mut sender) {
                        unless_closing(sender.keep_alive(longest), &mut closing).await;
                    }
                }
            }
        }
        if let Ok(sender) = &mut sender {
            // Whoever has nothing to send does not wait for a broker that is gone.
            let _ = tokio::time::timeout(LAST_WAIT, sender.close()).await;
        }
    }

    /// Waits for a notice or the end of the program; true if neither came for so long.
    async fn wait_for_news(&self, silence: Duration, closing: &mut watch::Receiver<bool>) -> bool {
        let mut is_quiet = false;
        let news = async {
            is_quiet = tokio::time::timeout(silence, self.news.notified()).await.is_err();
        };
        unless_closing(news, closing).await;
        is_quiet
    }

    /// Waits after a failed attempt; not longer than until something more important comes, nor long once the program ends.
    async fn pause(&self, tried: u64, wait: Duration, closing: &mut watch::Receiver<bool>) {
        if *closing.borrow() {
            return tokio::time::sleep(wait.min(LAST_WAIT)).await;
        }
        let waiting = async {
            let mut sleep = pin!(tokio::time::sleep(wait));
            while let Either::Right(_) = select(sleep.as_mut(), pin!(self.news.notified())).await {
                if lock(&self.queue).first().is_some_and(|first| first.number != tried) {
                    return;
                }
            }
        };
        unless_closing(waiting, closing).await;
    }

    /// What an attempt means for the queue; how long to wait before the next.
    fn judge(&self, tried: &WaitingNotice, result: Result<(), SendError>) -> Option<Duration> {
        match result {
            Ok(()) => {
                lock(&self.queue).take(tried.number);
                tracing::info!("notice '{}' was sent: {}", tried.notice.kind, self.name);
                None
            }
            Err(err) if err.is_final => {
                let taken = lock(&self.queue).take(tried.number);
                taken.into_iter().for_each(|one| self.record(one, &err.reason));
                None
            }
            Err(err) => {
                let failed = lock(&self.queue).fail(tried.number, &err.reason);
                match failed {
                    Ok(wait) => Some(wait),
                    Err(given_up) => {
                        given_up.into_iter().for_each(|one| self.record(*one, &err.reason));
                        None
                    }
                }
            }
        }
    }

    fn record(&self, waiting: WaitingNotice, reason: &str) {
        tracing::warn!(
            "notice '{}' was not sent to {}: {reason}; {}",
            waiting.notice.kind,
            self.name,
            waiting.notice.text
        );
        let mut unsent = lock(&self.shared.unsent);
        if unsent.len() == UNSENT_MAX {
            unsent.pop_front();
        }
        unsent.push_back(UnsentNotice {
            notice: waiting.notice,
            target: self.name.clone(),
            reason: reason.to_owned(),
        });
    }

    /// What waits when the program has ended is not sent.
    fn give_up_all(&self) {
        let left = lock(&self.queue).take_all();
        for one in left {
            let reason = match one.reason.as_str() {
                "" => "palpate ended before the server answered".to_owned(),
                reason => format!("palpate ended before another attempt: {reason}"),
            };
            self.record(one, &reason);
        }
    }
}

/// What a test of one target gave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TargetTest {
    pub target: String,
    /// `webhook`, `email` or `mqtt`.
    pub way: &'static str,
    /// Why the notice did not arrive, or nothing if it did.
    pub result: Result<(), String>,
}

/// Sends a notice once to each target, whatever its rules; all at the same time.
pub fn test_targets(targets: &[Target], notice: &Notice) -> std::io::Result<Vec<TargetTest>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let one = |target: &Target| {
        let target = target.clone();
        async move {
            let result = match Sender::new(&target) {
                Ok(mut sender) => {
                    let result = sender.send(notice, ATTEMPT_MAX).await;
                    let _ = tokio::time::timeout(LAST_WAIT, sender.close()).await;
                    result
                }
                Err(err) => Err(err),
            };
            TargetTest {
                target: target.name(),
                way: target.way(),
                result: result.map_err(|err| err.reason),
            }
        }
    };
    let tests = runtime.block_on(join_all(targets.iter().map(one)));
    runtime.shutdown_background();
    Ok(tests)
}
