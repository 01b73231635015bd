//! The thread that owns a link, and the handle by which a rig talks to it.

use super::HostClock;
use super::dialogue::{Dialogue, LinkStats};
use super::halt::{HaltHandle, StopCounters, farewell_said, owns_link};
use super::link::Link;
use crate::device::OpenError;
use crate::priority::{self, Granted};
use crate::rig::{RigEvent, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{Age, Fault, RawBytes, RigCommand};
use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
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
/// So much of what a device sends is read at once.
const CHUNK: usize = 4096;

#[derive(Clone, Debug)]
pub struct LinkThreadSettings {
    /// The device's name in the log of raw bytes, such as `controller`; the thread is called so too.
    pub device: Arc<str>,
    /// Bytes written when the line is closed, such as a stop.
    pub farewell: Vec<u8>,
}

/// A command with the number of stops that were sent before it.
pub(super) type NumberedCommand = (u64, RigCommand);

#[derive(Default)]
struct Reports {
    events: VecDeque<RigEvent>,
    raw: Vec<RawBytes>,
    stats: LinkStats,
    /// Somebody has asked for reports since the thread looked.
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

/// A dialogue on a link, in a thread of its own. Dropped it says farewell and closes the link.
pub struct LinkThread {
    device: Arc<str>,
    stops: SyncSender<NumberedCommand>,
    commands: SyncSender<NumberedCommand>,
    /// Stops sent and stops written, shared with those who may have to send one when nobody else can.
    standing: Arc<StopCounters>,
    reports: Shared,
    is_closing: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LinkThread {
    pub fn start(
        link: Box<dyn Link>,
        dialogue: impl Dialogue + 'static,
        clock: &HostClock,
        settings: LinkThreadSettings,
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
        let device = Arc::clone(&settings.device);
        let standing = Arc::new(StopCounters::default());
        let mut owner = LinkOwner {
            link,
            dialogue,
            clock: Arc::clone(clock),
            settings,
            urgent,
            queued,
            arrived: VecDeque::new(),
            is_real_time: false,
            standing: Arc::clone(&standing),
            stops_taken: 0,
            events: Vec::new(),
            raw: Vec::new(),
            reports: Arc::clone(&reports),
        };
        let closing = Arc::clone(&is_closing);
        let thread = std::thread::Builder::new()
            .name(device.to_string())
            .spawn(move || {
                owns_link();
                let _in = tracing::info_span!("device", name = &*owner.settings.device).entered();
                tracing::info!("connected");
                owner.is_real_time = matches!(priority::ask(), Granted::RealTime(_));
                owner.run(&closing);
            })
            .map_err(|err| OpenError::thread(&err))?;
        Ok(Self { device, stops, commands, standing, reports, is_closing, thread: Some(thread) })
    }

    /// What the device is called in the log of raw bytes.
    pub fn device(&self) -> &str {
        &self.device
    }

    /// Hands over a command without waiting. One that finds no room is given back.
    pub fn send(&mut self, command: RigCommand) -> Result<(), RigCommand> {
        let (queue, number) = if command.is_stopping() {
            let before = self.standing.sent.fetch_add(1, Ordering::AcqRel);
            (&self.stops, before + 1)
        } else {
            (&self.commands, self.standing.sent.load(Ordering::Acquire))
        };
        queue.try_send((number, command)).map_err(|err| {
            let (TrySendError::Full((_, command)) | TrySendError::Disconnected((_, command))) = err;
            command
        })
    }

    /// What sends the immediate stop when the rig's owner cannot any more.
    pub fn halt_handle(&self) -> Option<HaltHandle> {
        let thread = self.thread.as_ref()?.thread().id();
        Some(HaltHandle::new(self.stops.clone(), Arc::clone(&self.standing), thread))
    }

    /// The oldest report that arrived at or before `until` on the host's clock. Without one it waits so long.
    pub fn next_event(&self, until: Nanos, wait: Duration) -> Option<RigEvent> {
        let (reports, came) = &*self.reports;
        let mut reports = reports.lock().unwrap_or_else(PoisonError::into_inner);
        reports.is_attended = true;
        let (mut reports, _) = came
            .wait_timeout_while(reports, wait, |reports| {
                reports.events.is_empty() && !reports.is_over
            })
            .unwrap_or_else(PoisonError::into_inner);
        if reports.events.front()?.at > until {
            return None;
        }
        reports.events.pop_front()
    }

    /// The bytes exchanged since this was last asked.
    pub fn take_raw(&self) -> Vec<RawBytes> {
        let (reports, _) = &*self.reports;
        let mut reports = reports.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut reports.raw)
    }

    pub fn stats(&self) -> LinkStats {
        let (reports, _) = &*self.reports;
        let reports = reports.lock().unwrap_or_else(PoisonError::into_inner);
        reports.stats
    }
}

impl LinkThread {
    /// Says farewell, closes the link and gives the bytes that nobody has taken.
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
    settings: LinkThreadSettings,
    urgent: Receiver<NumberedCommand>,
    queued: Receiver<NumberedCommand>,
    /// Taken out of `queued`, not looked at.
    arrived: VecDeque<NumberedCommand>,
    is_real_time: bool,
    standing: Arc<StopCounters>,
    /// The number of the newest stop that the dialogue has.
    stops_taken: u64,
    events: Vec<RigEvent>,
    raw: Vec<RawBytes>,
    reports: Shared,
}

impl<D> Drop for LinkOwner<D> {
    /// However the thread ends, nobody waits for it. If it panics the farewell stops what moves, since nobody else has
    /// the link; what was to be said of the panic is said after that.
    fn drop(&mut self) {
        if std::thread::panicking() {
            let _ = self.link.write(&self.settings.farewell);
            farewell_said();
            let failed = link_lost("the driver has failed; open the rig again");
            self.events.push(RigEvent::new((self.clock)(), failed));
        }
        let (reports, came) = &*self.reports;
        let mut reports = reports.lock().unwrap_or_else(PoisonError::into_inner);
        reports.take(&mut self.events, &mut self.raw);
        reports.is_over = true;
        came.notify_all();
    }
}

fn describe_error(err: &io::Error) -> String {
    match err.kind() {
        io::ErrorKind::BrokenPipe
        | io::ErrorKind::UnexpectedEof
        | io::ErrorKind::ConnectionReset => {
            "the device has hung up; check its plug and power".into()
        }
        io::ErrorKind::TimedOut => "the device takes no bytes; check its cable".into(),
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
                let farewell = self.settings.farewell.clone();
                // Nobody is left who could be told.
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
            // A stop may have come while this was looked at.
            self.take_stops();
        }
        loop {
            self.take_stops();
            let Some(line) = self.dialogue.take_line((self.clock)()) else {
                break;
            };
            self.write(line)?;
        }
        self.standing.written.store(self.stops_taken, Ordering::Release);
        let now = (self.clock)();
        let wait = self.dialogue.next_at(now).since(now).min(READ_MAX);
        let mut buffer = [0_u8; CHUNK];
        let count = self.link.read(&mut buffer, Duration::from_nanos(wait.0.max(1)))?;
        let now = (self.clock)();
        if count > 0 {
            self.tap(now, false, buffer[..count].to_vec());
            self.dialogue.received(now, &buffer[..count]);
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

    /// How long before a time of the host a sample of the device was taken.
    fn age(&self, at: Nanos, tick: u64) -> Option<Age> {
        Some(Age {
            by: at.since(self.dialogue.host_time(tick)?),
            within: self.dialogue.uncertainty(at)?,
        })
    }

    fn take_stops(&mut self) {
        while let Ok((number, stop)) = self.urgent.try_recv() {
            // What was sent before it is in the queue by now, or was there.
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
        self.raw.push(RawBytes { at, device: Arc::clone(&self.settings.device), is_sent, bytes });
    }

    /// Hands over what there is, unless somebody reads at this moment: who is to write a stop waits for no reader.
    fn report(&mut self) {
        let (reports, came) = &*self.reports;
        let mut reports = match reports.try_lock() {
            Ok(reports) => reports,
            Err(TryLockError::Poisoned(err)) => err.into_inner(),
            Err(TryLockError::WouldBlock) => return,
        };
        reports.stats = LinkStats { is_real_time: self.is_real_time, ..self.dialogue.stats() };
        if std::mem::take(&mut reports.is_attended) {
            self.dialogue.attended((self.clock)());
        }
        let is_news = !self.events.is_empty();
        reports.take(&mut self.events, &mut self.raw);
        drop(reports);
        if is_news {
            came.notify_all();
        }
    }
}

#[cfg(test)]
mod tests;
