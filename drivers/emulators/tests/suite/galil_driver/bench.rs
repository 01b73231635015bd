//! A session and an emulated controller in simulated time, with nothing but a wire between them.

use palpate_drivers::RigEventBody;
use palpate_drivers::galil::{
    AnalogRange, ConnectedGalil, GalilOpenError, GalilSession, GalilSettings, MotorType, Sampling,
    SwitchLevel, connect,
};
use palpate_drivers::wire::{Dialogue, HostClock, Link};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::{self, GalilEmulator};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, MoveTo, Reading, RigCommand, RigDescription};
use palpate_model::units::{MmPerS, MmPerS2, Position, Volts};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// One way over the wire.
const DELAY: Nanos = Nanos(60_000);
/// Step of simulated time while a test waits.
const STEP: Nanos = Nanos(50_000);

pub struct Wire {
    pub emulator: GalilEmulator,
    pub now: Nanos,
    arriving: VecDeque<(Nanos, u8)>,
    pub is_cut: bool,
    /// Bytes from the controller that are lost, doubled or spoilt, counted from now: what becomes of them.
    pub spoil: Box<dyn FnMut(u8) -> Vec<u8> + Send>,
    /// All lines from the host.
    pub lines: Vec<u8>,
}

impl Wire {
    pub fn pass(&mut self, by: Nanos) {
        self.now = self.now + by;
        self.emulator.advance(self.now);
        let bytes = self.emulator.transmit(0);
        let at = self.now + DELAY;
        for byte in bytes {
            self.arriving.extend((self.spoil)(byte).into_iter().map(|byte| (at, byte)));
        }
    }
}

#[derive(Clone)]
pub struct Shared(pub Arc<Mutex<Wire>>);

impl Shared {
    pub fn lock(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().expect("no panic holds the wire")
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
        wire.pass(DELAY);
        wire.lines.extend_from_slice(bytes);
        let now = wire.now;
        wire.emulator.receive(now, 0, bytes);
        wire.pass(Nanos::ZERO);
        Ok(())
    }
}

pub fn thesis() -> GalilSettings {
    GalilSettings {
        name: "bench".into(),
        axis: 'A',
        input: 1,
        mm_per_pulse: 0.015,
        is_reversed: false,
        travel: Position(150.0),
        speed_max: MmPerS(20.0),
        acceleration: MmPerS2(61.44),
        unseen: RigDescription::UNSEEN_USUAL,
        motor_type: MotorType::ActiveLow,
        limits: SwitchLevel::ActiveLow,
        home: SwitchLevel::ActiveLow,
        range: AnalogRange::Bipolar10,
        bits: 16,
        noise: Volts(0.001),
        filter: None,
        serial_number: None,
        has_watchdog: true,
        sampling: Sampling::Poll,
        sample_us: None,
    }
}

pub fn wired(settings: galil::EmulatedGalilSettings) -> Shared {
    Shared(Arc::new(Mutex::new(Wire {
        emulator: GalilEmulator::new(settings),
        now: Nanos::ZERO,
        arriving: VecDeque::new(),
        is_cut: false,
        spoil: Box::new(|byte| vec![byte]),
        lines: Vec::new(),
    })))
}

pub fn clock_of(wire: &Shared) -> HostClock {
    let wire = wire.clone();
    Arc::new(move || wire.lock().now)
}

pub fn try_connect(
    wire: &Shared,
    settings: &GalilSettings,
) -> Result<ConnectedGalil, GalilOpenError> {
    connect(&mut wire.clone(), &clock_of(wire), settings, &"galil".into())
}

/// The host's side after it has connected.
pub struct Host {
    pub wire: Shared,
    pub session: GalilSession,
    pub connected: ConnectedGalil,
    pub readings: Vec<Reading>,
    pub acks: Vec<RigCommand>,
    pub faults: Vec<Fault>,
    pub is_attended: bool,
    /// Readings that had come before the newest acknowledgement.
    pub acked_behind: usize,
}

impl Host {
    pub fn new(settings: &GalilSettings) -> Self {
        Self::on(wired(galil::EmulatedGalilSettings::default()), settings)
    }

    pub fn on(wire: Shared, settings: &GalilSettings) -> Self {
        let connected = try_connect(&wire, settings).expect("it connects");
        let now = wire.lock().now;
        let session = GalilSession::new(settings.clone(), &connected, now);
        Self {
            wire,
            session,
            connected,
            readings: Vec::new(),
            acks: Vec::new(),
            faults: Vec::new(),
            is_attended: true,
            acked_behind: 0,
        }
    }

    pub fn now(&self) -> Nanos {
        self.wire.lock().now
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
                RigEventBody::Reading(reading) => self.readings.push(reading),
                RigEventBody::Ack(ack) => {
                    self.acked_behind = self.readings.len();
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

    /// Sends a command and waits for its acknowledgement.
    pub fn tell(&mut self, command: RigCommand) -> RigCommand {
        let before = self.acks.len();
        let now = self.now();
        self.session.command(now, command);
        self.until("acknowledged", |host| host.acks.len() > before);
        self.acks[before]
    }

    pub fn newest(&self) -> Reading {
        *self.readings.last().expect("a sample")
    }

    pub fn is_at_rest(&self) -> bool {
        !self.newest().status.has(AxisStatus::MOVING)
    }

    pub fn settle(&mut self) {
        self.until("at rest", Self::is_at_rest);
    }
}

pub fn to(target_pulses: i64, speed: f64) -> RigCommand {
    RigCommand::MoveTo(MoveTo { target_pulses, speed: MmPerS(speed), acceleration: MmPerS2(61.44) })
}
