//! The thread of the loop.

use super::timing::{Kept, Timing};
use crate::Metronome;
use palpate_drivers::priority::{Granted, ask};
use palpate_haptics::Period;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;
use triple_buffer::{Output, triple_buffer};

/// So many overruns in a row, and the loop rests for a tick after each further one: at real-time priority nobody else, who might
/// stop it, would have the core.
const OVERRUNS_MAX: u32 = 10;

/// What a loop does.
pub trait Ticking: Send + 'static {
    /// What others see of it.
    type View: Clone + Send + 'static;

    /// So many ticks are due: one, unless the loop was away. Neither allocates, locks nor waits.
    fn tick(&mut self, elapsed: u64);

    /// Whether this tick is shown.
    fn is_shown(&self) -> bool {
        true
    }

    /// Copies what is to be seen into its place, without allocating.
    fn show(&self, view: &mut Self::View);
}

/// A loop on its way. Dropping it ends it after the tick under way.
#[derive(Debug)]
pub struct Beat<T: Ticking> {
    thread: Option<JoinHandle<T>>,
    is_ending: Arc<AtomicBool>,
    timing: Arc<Timing>,
    seen: Output<T::View>,
    granted: Granted,
}

impl<T: Ticking> Beat<T> {
    /// Begins to tick. `first` is what is seen before the first tick.
    pub fn start(task: T, period: Period, first: T::View) -> std::io::Result<Self> {
        let (shown, seen) = triple_buffer(&first);
        let is_ending = Arc::new(AtomicBool::new(false));
        let timing = Arc::new(Timing::default());
        let (tell, told) = sync_channel(1);
        let (ending, times) = (Arc::clone(&is_ending), Arc::clone(&timing));
        let thread = std::thread::Builder::new().name("haptics".into()).spawn(move || {
            // Whoever started it waits for this.
            let _ = tell.try_send(ask());
            run(task, period, shown, &ending, &times)
        })?;
        Ok(Self { thread: Some(thread), is_ending, timing, seen, granted: granted(&told) })
    }

    /// The priority that the system gave.
    pub fn granted(&self) -> &Granted {
        &self.granted
    }

    /// The newest state that was handed over.
    pub fn seen(&mut self) -> &T::View {
        self.seen.read()
    }

    /// How the loop kept its time so far.
    pub fn kept(&self) -> Kept {
        self.timing.kept()
    }

    /// Whether it still ticks; it does until it is ended, unless its work failed.
    pub fn is_alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Ends it and gives back what it did; `None` if that failed.
    pub fn end(mut self) -> Option<T> {
        self.is_ending.store(true, Ordering::Relaxed);
        self.thread.take()?.join().ok()
    }
}

impl<T: Ticking> Drop for Beat<T> {
    fn drop(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // What it did is of no interest any more.
            let _ = thread.join();
        }
    }
}

fn granted(told: &Receiver<Granted>) -> Granted {
    told.recv().unwrap_or_else(|_| Granted::Ordinary("the thread ended".to_owned()))
}

fn run<T: Ticking>(
    mut task: T,
    period: Period,
    mut shown: triple_buffer::Input<T::View>,
    is_ending: &AtomicBool,
    timing: &Timing,
) -> T {
    let metronome = Metronome::start();
    // Ticks in a row that took longer than their time.
    let mut overruns = 0_u32;
    let mut rested_at = 0;
    // Ticks done; the next one is due after as many periods, and so nothing adds up.
    let mut done = 0_u64;
    let mut before = None;
    while !is_ending.load(Ordering::Relaxed) {
        let due = period.time_of(done).0;
        metronome.wait(due.max(rested_at));
        let begun = metronome.now();
        let elapsed = 1 + (begun.saturating_sub(due)) / period.nanos();
        task.tick(elapsed);
        if task.is_shown() {
            task.show(shown.input_buffer_mut());
            shown.publish();
        }
        let ended = metronome.now();
        done += elapsed;
        timing.late.count(begun.saturating_sub(due));
        timing.work.count(ended.saturating_sub(begun));
        if let Some(before) = before.replace(begun) {
            timing.period.count(begun.saturating_sub(before));
        }
        if ended.saturating_sub(begun) > period.nanos() {
            timing.overruns.fetch_add(1, Ordering::Relaxed);
            overruns += 1;
        } else {
            overruns = 0;
        }
        if overruns >= OVERRUNS_MAX {
            rested_at = ended + period.nanos();
        }
        timing.missed.fetch_add(elapsed - 1, Ordering::Relaxed);
    }
    task
}
