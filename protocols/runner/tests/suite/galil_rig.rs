//! An emulated Galil controller as a rig in simulated time: the driver's session, with nothing but a wire between them.

use palpate_drivers::galil::{
    AnalogRange, GalilSession, GalilSettings, MotorType, Sampling, SwitchLevel, connect,
};
use palpate_drivers::wire::{Dialogue, HostClock, Link};
use palpate_drivers::{Rig, RigEvent};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::{EmulatedGalilSettings, GalilEmulator};
use palpate_model::Nanos;
use palpate_model::rig::{RigCommand, RigDescription};
use palpate_model::units::{MmPerS, MmPerS2, Position, Volts};
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// One way over the wire: that of a network.
const DELAY: Nanos = Nanos(60_000);
/// Step of simulated time while nothing arrives.
const STEP: Nanos = Nanos(50_000);

struct Wire {
    emulator: GalilEmulator,
    now: Nanos,
    arriving: VecDeque<(Nanos, u8)>,
}

impl Wire {
    fn pass(&mut self, by: Nanos) {
        self.now = self.now + by;
        self.emulator.advance(self.now);
        let at = self.now + DELAY;
        self.arriving.extend(self.emulator.transmit(0).into_iter().map(|byte| (at, byte)));
    }

    fn take(&mut self, count: usize) -> Vec<u8> {
        let here = self.arriving.partition_point(|(at, _)| *at <= self.now);
        self.arriving.drain(..here.min(count)).map(|(_, byte)| byte).collect()
    }
}

#[derive(Clone)]
struct SharedWire(Arc<Mutex<Wire>>);

impl SharedWire {
    fn lock(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().expect("no panic holds the wire")
    }
}

impl Link for SharedWire {
    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        let mut wire = self.lock();
        let end = wire.now + Nanos(wait.as_nanos() as u64);
        while wire.arriving.front().is_none_or(|(at, _)| *at > wire.now) && wire.now < end {
            let step = STEP.min(end.since(wire.now));
            wire.pass(step);
        }
        let bytes = wire.take(buffer.len());
        buffer[..bytes.len()].copy_from_slice(&bytes);
        Ok(bytes.len())
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut wire = self.lock();
        wire.pass(DELAY);
        let now = wire.now;
        wire.emulator.receive(now, 0, bytes);
        wire.pass(Nanos::ZERO);
        Ok(())
    }
}

/// The rig of the source thesis on an emulated controller.
pub struct GalilRig {
    wire: SharedWire,
    session: GalilSession,
    description: RigDescription,
    /// What came too late for its call.
    held: Option<RigEvent>,
}

impl GalilRig {
    pub fn new() -> Self {
        let settings = GalilSettings {
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
        };
        let wire = SharedWire(Arc::new(Mutex::new(Wire {
            emulator: GalilEmulator::new(EmulatedGalilSettings::default()),
            now: Nanos::ZERO,
            arriving: VecDeque::new(),
        })));
        let shared = wire.clone();
        let clock: HostClock = Arc::new(move || shared.lock().now);
        let connected = connect(&mut wire.clone(), &clock, &settings, &"galil".into()).unwrap();
        let session = GalilSession::new(settings, &connected, clock());
        Self { wire, session, description: connected.description, held: None }
    }

    fn turn(&mut self, until: Nanos) {
        let now = self.wire.lock().now;
        self.session.note_attendance(now);
        let now = loop {
            let now = self.wire.lock().now;
            match self.session.take_line(now) {
                Some(line) => self.wire.write(&line).unwrap(),
                None => break now,
            }
        };
        let wait = self.session.next_at(now).min(until).since(now);
        let wait = wait.min(Nanos(500_000)).max(Nanos(20_000));
        let mut buffer = [0_u8; 256];
        let count = self.wire.read(&mut buffer, Duration::from_nanos(wait.0)).unwrap();
        let now = self.wire.lock().now;
        self.session.handle_bytes(now, &buffer[..count]);
    }
}

impl Rig for GalilRig {
    fn description(&self) -> &RigDescription {
        &self.description
    }

    fn send(&mut self, command: RigCommand) {
        let now = self.wire.lock().now;
        self.session.command(now, command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        loop {
            let event = self
                .held
                .take()
                .or_else(|| self.session.take_event().map(|(at, body)| RigEvent::new(at, body)));
            // A turn may end a little behind `until`, by the ways over the wire: what it brings waits for the next call.
            if event.as_ref().is_some_and(|event| event.at > until) {
                self.held = event;
                return None;
            }
            if event.is_some() {
                return event;
            }
            if self.wire.lock().now >= until {
                return None;
            }
            self.turn(until);
        }
    }

    fn is_virtual(&self) -> bool {
        true
    }
}
