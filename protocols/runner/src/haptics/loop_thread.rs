//! The real-time thread of a haptic loop.

use super::timing::{LoopCounters, LoopTiming};
use crate::Stopwatch;
use palpate_drivers::priority::{GrantedPriority, request_real_time};
use palpate_haptics::Period;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use triple_buffer::{Output, triple_buffer};

/// After so many overruns in a row the loop rests for a tick after each further one: at real-time priority it would otherwise
/// keep the core from every thread that could stop it.
const OVERRUNS_MAX: u32 = 10;

pub trait LoopTask: Send + 'static {
    type View: Clone + Send + 'static;

    /// `elapsed` ticks are due: one, unless the loop was late. Must not allocate, lock or wait.
    fn tick(&mut self, elapsed: u64);

    /// Whether this tick is shown.
    fn is_shown(&self) -> bool {
        true
    }

    /// Must not allocate.
    fn show(&self, view: &mut Self::View);
}

/// A running loop. Dropping it ends the loop after the tick in progress.
#[derive(Debug)]
pub struct RealTimeLoop<T: LoopTask> {
    thread: Option<JoinHandle<T>>,
    is_ending: Arc<AtomicBool>,
    timing: Arc<LoopCounters>,
    seen: Output<T::View>,
    granted: GrantedPriority,
}

impl<T: LoopTask> RealTimeLoop<T> {
    /// Begins to tick. `first` is what is seen before the first tick.
    pub fn start(task: T, period: Period, first: T::View) -> std::io::Result<Self> {
        let (shown, seen) = triple_buffer(&first);
        let is_ending = Arc::new(AtomicBool::new(false));
        let timing = Arc::new(LoopCounters::default());
        let (sender, receiver) = sync_channel(1);
        let (ending, times) = (Arc::clone(&is_ending), Arc::clone(&timing));
        let thread = std::thread::Builder::new().name("haptics".into()).spawn(move || {
            // `start` waits for this.
            let _ = sender.try_send(request_real_time());
            run(task, period, shown, &ending, &times)
        })?;
        let granted = receiver.recv();
        let granted =
            granted.unwrap_or_else(|_| GrantedPriority::Ordinary("the thread ended".to_owned()));
        Ok(Self { thread: Some(thread), is_ending, timing, seen, granted })
    }

    pub fn granted_priority(&self) -> &GrantedPriority {
        &self.granted
    }

    /// The newest state that was handed over.
    pub fn view(&mut self) -> &T::View {
        self.seen.read()
    }

    pub fn timing(&self) -> LoopTiming {
        self.timing.snapshot()
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

impl<T: LoopTask> Drop for RealTimeLoop<T> {
    fn drop(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The result is not needed.
            let _ = thread.join();
        }
    }
}

fn run<T: LoopTask>(
    mut task: T,
    period: Period,
    mut shown: triple_buffer::Input<T::View>,
    is_ending: &AtomicBool,
    timing: &LoopCounters,
) -> T {
    let watch = Stopwatch::start();
    // Ticks in a row that took longer than their time.
    let mut overruns = 0_u32;
    let mut rested_at = 0;
    // Ticks done; the next one is due after as many periods, and so nothing adds up.
    let mut done = 0_u64;
    let mut before = None;
    while !is_ending.load(Ordering::Relaxed) {
        let due = period.time_of(done).0;
        watch.wait_until(due.max(rested_at));
        let begun = watch.nanos();
        let elapsed = 1 + (begun.saturating_sub(due)) / period.nanos();
        task.tick(elapsed);
        if task.is_shown() {
            task.show(shown.input_buffer_mut());
            shown.publish();
        }
        let ended = watch.nanos();
        done += elapsed;
        timing.late.count(begun.saturating_sub(due));
        timing.work.count(ended.saturating_sub(begun));
        if let Some(before) = before.replace(begun) {
            timing.period.count(begun.saturating_sub(before));
        }
        let is_overrun = ended.saturating_sub(begun) > period.nanos();
        timing.overruns.fetch_add(u64::from(is_overrun), Ordering::Relaxed);
        overruns = if is_overrun { overruns + 1 } else { 0 };
        if overruns >= OVERRUNS_MAX {
            rested_at = ended + period.nanos();
        }
        timing.missed.fetch_add(elapsed - 1, Ordering::Relaxed);
    }
    task
}
