//! The thread that owns a link, and the handle by which a rig talks to it.

use super::dialogue::{Dialogue, LinkStats};
use super::halt::{HaltHandle, StopCounters, mark_link_owner, run_deferred_work};
use super::link::Link;
use super::{HostClock, lock};
use crate::device::OpenError;
use crate::priority::{self, GrantedPriority};
use crate::rig::{RigEvent, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, RawBytes, RigCommand, SampleAge};
use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError, TryLockError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest wait for bytes: so late can a stop be that comes just after the wait began.
const READ_MAX: Nanos = Nanos(500_000);
/// Commands that may wait for the thread; as many as a controller's input buffer holds.
const COMMANDS_MAX: usize = 64;
/// Reports that may wait for the rig's owner: some seconds of samples. The oldest samples go first.
const REPORTS_MAX: usize = 16_384;
/// Bytes of the raw tap that may wait, in pieces.
const PIECES_MAX: usize = 65_536;
/// Longest read, in bytes.
const CHUNK: usize = 4096;

/// A command with the number of stops that were sent before it.
pub(super) type NumberedCommand = (u64, RigCommand);

#[derive(Default)]
struct Reports {
    events: VecDeque<RigEvent>,
    raw: Vec<RawBytes>,
    stats: LinkStats,
    /// Reports were asked for since the thread looked.
    is_attended: bool,
    is_over: bool,
}

impl Reports {
    /// Takes over what is new. Where there is no room left the oldest samples go first.
    fn take(&mut self, events: &mut Vec<RigEvent>, raw: &mut Vec<RawBytes>) {
        if self.raw.len() + raw.len() > PIECES_MAX {
            self.raw.clear();
        }
        self.raw.append(raw);
        for event in events.drain(..) {
            if self.events.len() >= REPORTS_MAX {
                let is_reading = |event: &RigEvent| matches!(event.body, RigEventBody::Reading(_));
                let oldest = self.events.iter().position(is_reading).unwrap_or(0);
                self.events.remove(oldest);
            }
            self.events.push_back(event);
        }
    }
}

type Shared = Arc<(Mutex<Reports>, Condvar)>;

/// A dialogue on a link, in a thread of its own. Dropping it writes the farewell and closes the link.
pub struct LinkThread {
    device: Arc<str>,
    /// Taken before commands that wait.
    stops: SyncSender<NumberedCommand>,
    commands: SyncSender<NumberedCommand>,
    /// Stops sent and stops written, shared with halt handles.
    counters: Arc<StopCounters>,
    reports: Shared,
    is_closing: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LinkThread {
    /// `device` is the name of the device in the log of raw bytes and of the thread; `farewell` is written when the
    /// link is closed, such as a stop.
    pub fn start(
        link: Box<dyn Link>,
        dialogue: impl Dialogue + 'static,
        clock: &HostClock,
        device: Arc<str>,
        farewell: Vec<u8>,
    ) -> Result<Self, OpenError> {
        let (stops, urgent) = sync_channel(COMMANDS_MAX);
        let (commands, queued) = sync_channel(COMMANDS_MAX);
        let reports = Shared::new((
            Mutex::new(Reports {
                // As it was measured when the device was set up.
                stats: dialogue.stats(),
                ..Reports::default()
            }),
            Condvar::new(),
        ));
        let is_closing = Arc::new(AtomicBool::new(false));
        let counters = Arc::new(StopCounters::default());
        let mut owner = LinkOwner {
            link,
            dialogue,
            clock: Arc::clone(clock),
            device: Arc::clone(&device),
            farewell,
            urgent,
            queued,
            arrived: VecDeque::new(),
            is_real_time: false,
            counters: Arc::clone(&counters),
            stops_taken: 0,
            events: Vec::new(),
            raw: Vec::new(),
            reports: Arc::clone(&reports),
        };
        let closing = Arc::clone(&is_closing);
        let thread = std::thread::Builder::new()
            .name(device.to_string())
            .spawn(move || {
                mark_link_owner();
                let _in = tracing::info_span!("device", name = &*owner.device).entered();
                tracing::info!("connected");
                owner.is_real_time =
                    matches!(priority::request_real_time(), GrantedPriority::RealTime(_));
                owner.run(&closing);
            })
            .map_err(|err| OpenError::Thread(err.to_string()))?;
        Ok(Self { device, stops, commands, counters, reports, is_closing, thread: Some(thread) })
    }

    /// The device's name in the log of raw bytes.
    pub fn device(&self) -> &str {
        &self.device
    }

    /// Hands over a command without waiting. One that finds no room is given back.
    pub fn send(&mut self, command: RigCommand) -> Result<(), RigCommand> {
        let (queue, number) = if command.is_stopping() {
            let before = self.counters.sent.fetch_add(1, Ordering::AcqRel);
            (&self.stops, before + 1)
        } else {
            (&self.commands, self.counters.sent.load(Ordering::Acquire))
        };
        queue.try_send((number, command)).map_err(|_| command)
    }

    /// Sends the immediate stop when the owner of the rig no longer can.
    pub fn halt_handle(&self) -> Option<HaltHandle> {
        Some(HaltHandle {
            stops: self.stops.clone(),
            counters: Arc::clone(&self.counters),
            owner: self.thread.as_ref()?.thread().id(),
        })
    }

    /// The oldest report that arrived at or before `until` on the host's clock. Without one it waits so long.
    pub fn next_event(&self, until: Nanos, wait: Duration) -> Option<RigEvent> {
        let mut reports = lock(&self.reports.0);
        reports.is_attended = true;
        let (mut reports, _) = (self.reports.1)
            .wait_timeout_while(reports, wait, |reports| {
                reports.events.is_empty() && !reports.is_over
            })
            .unwrap_or_else(PoisonError::into_inner);
        if reports.events.front()?.at > until {
            return None;
        }
        reports.events.pop_front()
    }

    /// The bytes exchanged since the last call.
    pub fn take_raw(&self) -> Vec<RawBytes> {
        std::mem::take(&mut lock(&self.reports.0).raw)
    }

    pub fn stats(&self) -> LinkStats {
        lock(&self.reports.0).stats
    }

    /// Writes the farewell, closes the link and returns the bytes that were not taken.
    #[must_use]
    pub fn close(mut self) -> Vec<RawBytes> {
        self.end();
        self.take_raw()
    }

    fn end(&mut self) {
        self.is_closing.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It ends within a read and a write; a panic in it was reported as a lost link.
            let _ = thread.join();
        }
    }
}

impl Drop for LinkThread {
    fn drop(&mut self) {
        self.end();
    }
}

/// The thread's side.
struct LinkOwner<D> {
    link: Box<dyn Link>,
    dialogue: D,
    clock: HostClock,
    device: Arc<str>,
    farewell: Vec<u8>,
    urgent: Receiver<NumberedCommand>,
    queued: Receiver<NumberedCommand>,
    /// Taken out of `queued`, not looked at.
    arrived: VecDeque<NumberedCommand>,
    is_real_time: bool,
    counters: Arc<StopCounters>,
    /// The number of the newest stop that the dialogue has.
    stops_taken: u64,
    events: Vec<RigEvent>,
    raw: Vec<RawBytes>,
    reports: Shared,
}

impl<D> Drop for LinkOwner<D> {
    /// However the thread ends, no caller waits for it in vain. If it panics, the farewell stops what moves, since no
    /// other thread has the link; the work that was deferred is done after that.
    fn drop(&mut self) {
        if std::thread::panicking() {
            let _ = self.link.write(&self.farewell);
            run_deferred_work();
            let failed = link_lost("the driver has failed; open the rig again");
            self.events.push(RigEvent::new((self.clock)(), failed));
        }
        let mut reports = lock(&self.reports.0);
        reports.take(&mut self.events, &mut self.raw);
        reports.is_over = true;
        self.reports.1.notify_all();
    }
}

fn describe_error(err: &io::Error) -> String {
    match err.kind() {
        io::ErrorKind::BrokenPipe
        | io::ErrorKind::UnexpectedEof
        | io::ErrorKind::ConnectionReset => {
            "the device has disconnected; check its plug and power".into()
        }
        io::ErrorKind::TimedOut => "the device accepts no data; check its cable".into(),
        _ => err.to_string(),
    }
}

fn link_lost(detail: impl Into<String>) -> RigEventBody {
    RigEventBody::Fault(Fault::LinkLost { detail: detail.into() })
}

impl<D: Dialogue> LinkOwner<D> {
    fn run(&mut self, is_closing: &AtomicBool) {
        let ending = loop {
            if is_closing.load(Ordering::Relaxed) {
                let farewell = self.farewell.clone();
                // The link may be gone already; then nothing can be written.
                let _ = self.write(farewell);
                tracing::info!("closed");
                return;
            }
            if let Err(err) = self.turn() {
                break describe_error(&err);
            }
            if let Some(why) = self.dialogue.is_dead((self.clock)()) {
                break why;
            }
        };
        tracing::warn!("link lost: {ending}");
        self.events.push(RigEvent::new((self.clock)(), link_lost(ending)));
    }

    fn turn(&mut self) -> io::Result<()> {
        self.take_stops();
        self.arrived.extend(self.queued.try_iter());
        while let Some((_, command)) = self.arrived.pop_front() {
            self.dialogue.command((self.clock)(), command);
            // A stop may have come meanwhile.
            self.take_stops();
        }
        loop {
            self.take_stops();
            let Some(line) = self.dialogue.take_line((self.clock)()) else {
                break;
            };
            self.write(line)?;
        }
        self.counters.written.store(self.stops_taken, Ordering::Release);
        let now = (self.clock)();
        let wait = self.dialogue.next_at(now).since(now).min(READ_MAX);
        let mut buffer = [0_u8; CHUNK];
        let count = self.link.read(&mut buffer, Duration::from_nanos(wait.0.max(1)))?;
        let now = (self.clock)();
        if count > 0 {
            self.tap(now, false, buffer[..count].to_vec());
            self.dialogue.handle_bytes(now, &buffer[..count]);
        }
        while let Some((at, mut body)) = self.dialogue.take_event() {
            if let RigEventBody::Reading(reading) = &mut body {
                reading.age = reading.age.or_else(|| self.age(at, reading.tick));
            }
            self.events.push(RigEvent { at, body });
        }
        self.report();
        Ok(())
    }

    /// Age of a sample of the device at a time of the host.
    fn age(&self, at: Nanos, tick: u64) -> Option<SampleAge> {
        Some(SampleAge {
            by: at.since(self.dialogue.host_time(tick)?),
            within: self.dialogue.uncertainty(at)?,
        })
    }

    fn take_stops(&mut self) {
        while let Ok((number, stop)) = self.urgent.try_recv() {
            // Commands sent before it are in the queue by now.
            self.arrived.extend(self.queued.try_iter());
            while let Some((_, command)) = self.arrived.pop_front_if(|(stops, _)| *stops < number) {
                self.dialogue.overtaken((self.clock)(), command);
            }
            self.dialogue.command((self.clock)(), stop);
            self.stops_taken = number;
        }
    }

    fn write(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        self.link.write(&bytes)?;
        self.tap((self.clock)(), true, bytes);
        Ok(())
    }

    fn tap(&mut self, at: Nanos, is_sent: bool, bytes: Vec<u8>) {
        self.raw.push(RawBytes { at, device: Arc::clone(&self.device), is_sent, bytes });
    }

    /// Hands over events and bytes, unless they are being read at this moment: the thread that writes stops never
    /// waits for a reader.
    fn report(&mut self) {
        let mut reports = match self.reports.0.try_lock() {
            Ok(reports) => reports,
            Err(TryLockError::Poisoned(err)) => err.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        reports.stats = LinkStats { is_real_time: self.is_real_time, ..self.dialogue.stats() };
        if std::mem::take(&mut reports.is_attended) {
            self.dialogue.note_attendance((self.clock)());
        }
        let has_events = !self.events.is_empty();
        reports.take(&mut self.events, &mut self.raw);
        drop(reports);
        if has_events {
            self.reports.1.notify_all();
        }
    }
}

#[cfg(test)]
mod tests;
