//! A session and an emulated stand in simulated time, with nothing but a wire between them; every reading is checked
//! against the commanded path, as the engine does.

use palpate_drivers::RigEventBody;
use palpate_drivers::mark10::gauge::GaugeSettings;
use palpate_drivers::mark10::stand::{ConnectedStand, StandSession, StandSettings, connect};
use palpate_drivers::text::DeviceError;
use palpate_drivers::wire::{Dialogue, HostClock, Link};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::mark10::{EmulatedStand, EmulatedStandSettings};
use palpate_model::Nanos;
use palpate_model::rig::{
    AxisStatus, Fault, MoveTo, PathError, PathTracker, Reading, RigCommand, RigDescription,
};
use palpate_model::units::{MmPerS, MmPerS2, Newtons, Position};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Step of simulated time while a test waits.
const STEP: Nanos = Nanos(200_000);

pub struct Wire {
    pub emulator: EmulatedStand,
    pub now: Nanos,
    arriving: VecDeque<(Nanos, u8)>,
    /// Way of an answer.
    pub delay: Nanos,
    pub is_cut: bool,
    /// Bytes from the stand: what becomes of them.
    pub spoil: Box<dyn FnMut(u8) -> Vec<u8> + Send>,
    /// All bytes from the host.
    pub sent: Vec<u8>,
    pub is_deaf: bool,
}

impl Wire {
    fn pass(&mut self, by: Nanos) {
        self.now = self.now + by;
        self.emulator.advance(self.now);
        let bytes = self.emulator.transmit(0);
        let at = self.now + self.delay;
        for byte in bytes {
            self.arriving.extend((self.spoil)(byte).into_iter().map(|byte| (at, byte)));
        }
    }
}

#[derive(Clone)]
pub struct Shared(pub Arc<Mutex<Wire>>);

impl Shared {
    pub fn new(settings: EmulatedStandSettings) -> Self {
        Self(Arc::new(Mutex::new(Wire {
            emulator: EmulatedStand::new(settings),
            now: Nanos::ZERO,
            arriving: VecDeque::new(),
            delay: Nanos(1_500_000),
            is_cut: false,
            spoil: Box::new(|byte| vec![byte]),
            sent: Vec::new(),
            is_deaf: false,
        })))
    }

    pub fn lock(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().expect("no panic holds the wire")
    }

    pub fn clock(&self) -> HostClock {
        let wire = self.clone();
        Arc::new(move || wire.lock().now)
    }

    pub fn connect(&self, settings: &StandSettings) -> Result<ConnectedStand, DeviceError> {
        connect(&mut self.clone(), &self.clock(), settings, &"stand".into())
    }
}

impl Link for Shared {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let mut wire = self.lock();
        if wire.is_cut {
            return Err(ErrorKind::BrokenPipe.into());
        }
        let end = wire.now + Nanos(wait.as_nanos() as u64);
        loop {
            let now = wire.now;
            if wire.arriving.front().is_some_and(|(at, _)| *at <= now) {
                break;
            }
            if now >= end {
                return Ok(0);
            }
            wire.pass(STEP.min(end.since(now)));
        }
        let mut count = 0;
        let now = wire.now;
        while count < buffer.len() && wire.arriving.front().is_some_and(|(at, _)| *at <= now) {
            let (_, byte) = wire.arriving.pop_front().expect("one is there");
            buffer[count] = byte;
            count += 1;
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut wire = self.lock();
        if wire.is_cut {
            return Err(ErrorKind::BrokenPipe.into());
        }
        wire.sent.extend_from_slice(bytes);
        let now = wire.now;
        if !wire.is_deaf {
            wire.emulator.receive(now, 0, bytes);
        }
        wire.pass(Nanos::ZERO);
        Ok(())
    }
}

pub fn usual() -> StandSettings {
    StandSettings {
        name: "stand".into(),
        travel: Position(100.0),
        speed_max: MmPerS(10.0),
        acceleration: MmPerS2(50.0),
        unseen: RigDescription::UNSEEN_USUAL,
        is_upwards: false,
        gauge: GaugeSettings { capacity: Newtons(25.0), ..GaugeSettings::default() },
    }
}

/// The host's side after it has connected.
pub struct Host {
    pub wire: Shared,
    pub session: StandSession,
    pub connected: ConnectedStand,
    pub path: PathTracker,
    pub readings: Vec<Reading>,
    pub acks: Vec<RigCommand>,
    pub faults: Vec<Fault>,
    pub path_errors: Vec<PathError>,
    pub is_attended: bool,
}

impl Host {
    pub fn new() -> Self {
        Self::on(Shared::new(EmulatedStandSettings::default()))
    }

    pub fn on(wire: Shared) -> Self {
        let settings = usual();
        let connected = wire.connect(&settings).expect("it connects");
        let now = wire.lock().now;
        let session = StandSession::new(settings, &connected, now);
        wire.lock().sent.clear();
        Self {
            path: PathTracker::new(&connected.description),
            wire,
            session,
            connected,
            readings: Vec::new(),
            acks: Vec::new(),
            faults: Vec::new(),
            path_errors: Vec::new(),
            is_attended: true,
        }
    }

    pub fn now(&self) -> Nanos {
        self.wire.lock().now
    }

    pub fn travel(&self) -> f64 {
        self.wire.lock().emulator.travel()
    }

    pub fn sent(&self) -> String {
        String::from_utf8_lossy(&self.wire.lock().sent).into_owned()
    }

    pub fn turn(&mut self) -> io::Result<()> {
        let now = self.now();
        if self.is_attended {
            self.session.note_attendance(now);
        }
        while let Some(line) = self.session.take_line(self.now()) {
            self.wire.write(&line)?;
        }
        let mut buffer = [0_u8; 256];
        let wait = self.session.next_at(self.now()).since(self.now());
        let wait = wait.min(Nanos(500_000)).max(Nanos(20_000));
        let count = self.wire.read(&mut buffer, Duration::from_nanos(wait.0))?;
        self.session.handle_bytes(self.now(), &buffer[..count]);
        while let Some((_, body)) = self.session.take_event() {
            match body {
                RigEventBody::Reading(reading) => {
                    if let Err(err) = self.path.on_reading(&reading) {
                        self.path_errors.push(err);
                    }
                    self.readings.push(reading);
                }
                RigEventBody::Ack(ack) => {
                    match ack.command {
                        RigCommand::MoveTo(to) => self.path.on_move(to),
                        RigCommand::DefinePosition { pulses } => self.path.on_define(pulses),
                        _ => {}
                    }
                    self.acks.push(ack.command);
                }
                RigEventBody::Fault(fault) => self.faults.push(fault),
            }
        }
        Ok(())
    }

    pub fn pass(&mut self, seconds: f64) {
        let end = self.now() + Nanos((seconds * 1e9) as u64);
        while self.now() < end {
            self.turn().expect("the wire is whole");
        }
    }

    pub fn until(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let end = self.now() + Nanos::from_millis(120_000);
        while !is_so(self) {
            assert!(self.now() < end, "{what} never: {:?}", self.faults);
            self.turn().expect("the wire is whole");
        }
    }

    pub fn send(&mut self, command: RigCommand) {
        let now = self.now();
        self.session.command(now, command);
    }

    /// Sends a command and waits for its acknowledgement.
    pub fn tell(&mut self, command: RigCommand) -> RigCommand {
        let before = self.acks.len();
        self.send(command);
        self.until("acknowledged", |host| host.acks.len() > before);
        self.acks[before]
    }

    pub fn newest(&self) -> Reading {
        *self.readings.last().expect("a sample")
    }

    pub fn is_moving(&self) -> bool {
        self.readings.last().is_some_and(|newest| newest.status.has(AxisStatus::MOVING))
    }

    /// Makes a whole move.
    pub fn go(&mut self, target: i64, speed: f64) {
        self.tell(to(target, speed));
        self.until("begun", Self::is_moving);
        self.until("at rest", |host| !host.is_moving());
    }
}

pub fn to(target_pulses: i64, speed: f64) -> RigCommand {
    RigCommand::MoveTo(MoveTo { target_pulses, speed: MmPerS(speed), acceleration: MmPerS2(50.0) })
}
