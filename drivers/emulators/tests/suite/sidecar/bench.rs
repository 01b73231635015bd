//! A session and an emulated sidecar in simulated time, with nothing but a wire between them; every reading is checked
//! against the commanded path, as the engine does.

use palpate_drivers::RigEventBody;
use palpate_drivers::sidecar::sensors::{SensorReports, SharedValues};
use palpate_drivers::sidecar::{
    ConnectedSidecar, SidecarSession, SidecarSettings, connect, describe,
};
use palpate_drivers::text::DeviceError;
use palpate_drivers::wire::{Dialogue, HostClock, Link};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::sidecar::{EmulatedSidecar, EmulatedSidecarSettings};
use palpate_model::Nanos;
use palpate_model::rig::{
    AxisStatus, Fault, MoveTo, PathError, PathTracker, Reading, RigCommand, RigDescription,
    SensorReading,
};
use palpate_model::units::{MmPerS, MmPerS2};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Step of simulated time while a test waits.
const STEP: Nanos = Nanos(200_000);

pub struct Wire {
    pub emulator: EmulatedSidecar,
    pub now: Nanos,
    arriving: VecDeque<(Nanos, u8)>,
    /// Way of a byte to the host.
    pub delay: Nanos,
    pub is_cut: bool,
    /// No byte reaches the device.
    pub is_deaf: bool,
    /// Bytes from the sidecar: what becomes of them.
    pub spoil: Box<dyn FnMut(u8) -> Vec<u8> + Send>,
    /// All bytes from the host.
    pub sent: Vec<u8>,
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
    pub fn new(settings: EmulatedSidecarSettings) -> Self {
        Self(Arc::new(Mutex::new(Wire {
            emulator: EmulatedSidecar::new(settings),
            now: Nanos::ZERO,
            arriving: VecDeque::new(),
            delay: Nanos(700_000),
            is_cut: false,
            is_deaf: false,
            spoil: Box::new(|byte| vec![byte]),
            sent: Vec::new(),
        })))
    }

    pub fn lock(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().expect("no panic holds the wire")
    }

    pub fn clock(&self) -> HostClock {
        let wire = self.clone();
        Arc::new(move || wire.lock().now)
    }

    pub fn connect(&self) -> Result<ConnectedSidecar, DeviceError> {
        connect(&mut self.clone(), &self.clock(), &"sidecar".into(), None)
    }

    /// Lets time pass without the host.
    pub fn pass(&self, seconds: f64) {
        let mut wire = self.lock();
        let end = wire.now + Nanos((seconds * 1e9) as u64);
        while wire.now < end {
            wire.pass(STEP);
        }
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

pub fn usual() -> SidecarSettings {
    SidecarSettings {
        name: "stage".into(),
        serial_number: None,
        travel: None,
        speed_max: MmPerS(10.0),
        acceleration: None,
        unseen: RigDescription::UNSEEN_USUAL,
    }
}

/// The host's side after it has connected.
pub struct Host {
    pub wire: Shared,
    pub session: SidecarSession,
    pub description: RigDescription,
    pub path: PathTracker,
    pub readings: Vec<Reading>,
    /// Count of all readings, also of those that were thrown away.
    pub count: u64,
    pub acks: Vec<RigCommand>,
    pub faults: Vec<Fault>,
    pub path_errors: Vec<PathError>,
    pub values: SharedValues,
    pub is_attended: bool,
    /// The first reading that is not on the commanded path is answered with a stop, as the engine does.
    pub stops_off_path: bool,
    /// The link has ended, with these words.
    pub ending: Option<String>,
}

impl Host {
    pub fn new() -> Self {
        Self::on(Shared::new(EmulatedSidecarSettings::default()))
    }

    pub fn on(wire: Shared) -> Self {
        let connected = wire.connect().expect("it connects");
        let settings = usual();
        let parts = settings.parts(&connected.description).expect("it is a rig");
        let values = SharedValues::default();
        let reports = SensorReports::new(&connected.description, (0, 0), Arc::clone(&values));
        let now = wire.lock().now;
        let session = SidecarSession::new(&settings, &connected, parts, reports, now);
        wire.lock().sent.clear();
        let description = describe(&settings, &connected.description, parts);
        let mut host = Self {
            path: PathTracker::new(&description),
            description,
            wire,
            session,
            readings: Vec::new(),
            count: 0,
            acks: Vec::new(),
            faults: Vec::new(),
            path_errors: Vec::new(),
            values,
            is_attended: true,
            stops_off_path: false,
            ending: None,
        };
        host.pass(0.1);
        host
    }

    pub fn now(&self) -> Nanos {
        self.wire.lock().now
    }

    /// True position by the sidecar's counter, in mm.
    pub fn position_mm(&self) -> f64 {
        self.wire.lock().emulator.position_mm()
    }

    pub fn sent(&self) -> String {
        String::from_utf8_lossy(&self.wire.lock().sent).into_owned()
    }

    pub fn sensors(&self) -> Vec<SensorReading> {
        self.values.lock().expect("no panic").drain(..).collect()
    }

    /// One turn of the link's thread.
    pub fn turn(&mut self) {
        if self.ending.is_some() {
            return self.wire.pass(0.001);
        }
        if let Err(err) = self.exchange() {
            self.ending = Some(err.to_string());
        }
        self.ending = self.ending.take().or_else(|| self.session.is_dead(self.now()));
    }

    fn exchange(&mut self) -> io::Result<()> {
        let now = self.now();
        if self.is_attended {
            self.session.note_attendance(now);
        }
        while let Some(line) = self.session.take_line(self.now()) {
            self.wire.write(&line)?;
        }
        let mut buffer = [0_u8; 4096];
        let wait = self.session.next_at(self.now()).since(self.now());
        let wait = wait.min(Nanos(500_000)).max(Nanos(20_000));
        let count = self.wire.read(&mut buffer, Duration::from_nanos(wait.0))?;
        self.session.handle_bytes(self.now(), &buffer[..count]);
        while let Some((_, body)) = self.session.take_event() {
            match body {
                RigEventBody::Reading(reading) => {
                    if let Err(err) = self.path.on_reading(&reading) {
                        if self.stops_off_path && self.path_errors.is_empty() {
                            self.session.command(now, RigCommand::Stop);
                        }
                        self.path_errors.push(err);
                    }
                    self.count += 1;
                    self.readings.push(reading);
                }
                RigEventBody::Ack(ack) => {
                    match ack.command {
                        RigCommand::MoveTo(to) => self.path.on_move(to),
                        RigCommand::Track(to) => self.path.on_track(to),
                        RigCommand::Oscillate(sine) => self.path.on_oscillate(sine),
                        RigCommand::DefinePosition { pulses } => self.path.on_define(pulses),
                        RigCommand::Stop | RigCommand::Halt => self.path.on_stop_accepted(),
                        RigCommand::EnableMotor => {}
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
            self.turn();
        }
    }

    pub fn until(&mut self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let end = self.now() + Nanos::from_millis(120_000);
        while !is_so(self) {
            assert!(self.now() < end, "{what} never: {:?} {:?}", self.faults, self.ending);
            self.turn();
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

    /// Everything was as it must be.
    pub fn assert_clean(&self) {
        let (faults, errors) = (&self.faults, &self.path_errors);
        assert!(faults.is_empty() && errors.is_empty(), "{faults:?} {errors:?}");
        assert_eq!(self.ending, None);
    }
}

pub fn to(target_pulses: i64, speed: f64) -> RigCommand {
    RigCommand::MoveTo(MoveTo { target_pulses, speed: MmPerS(speed), acceleration: MmPerS2(50.0) })
}
