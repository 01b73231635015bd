//! A session and an emulated board in simulated time, with nothing but a wire between them.

use palpate_drivers::RigEventBody;
use palpate_drivers::grbl::{
    ConnectedGrbl, GrblOpenError, GrblSession, GrblSettings, HomeSwitch, SharedTrack, connect,
};
use palpate_drivers::sim::SimSettings;
use palpate_drivers::split_rig::AxisTrack;
use palpate_drivers::wire::{Dialogue, HostClock, Link};
use palpate_emulators::EmulatedPlant;
use palpate_emulators::bench::{EmulatedAxis, SlideSwitches};
use palpate_emulators::grbl::{self, Grbl};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, MoveTo, RigCommand, RigDescription};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds};
use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// One way over the wire: 3 ms is usual for the USB converter of an Uno.
const DELAY: Nanos = Nanos(3_000_000);
/// Step of simulated time while a test waits.
const STEP: Nanos = Nanos(1_000_000);

pub struct Wire {
    pub board: Grbl,
    pub plant: EmulatedPlant,
    pub now: Nanos,
    stepped: Nanos,
    leaving: VecDeque<(Nanos, u8)>,
    arriving: VecDeque<(Nanos, u8)>,
    pub is_cut: bool,
    /// Bytes from the board that are lost, doubled or spoilt: what becomes of them.
    pub spoil: Box<dyn FnMut(u8) -> Vec<u8> + Send>,
    /// Whether a byte from the host is lost.
    pub lose: Box<dyn FnMut(u8) -> bool + Send>,
    /// All bytes from the host.
    pub sent: Vec<u8>,
}

impl Wire {
    /// What is on the way to the host, as text; it does not arrive any more.
    pub fn take_output(&mut self) -> String {
        let bytes: Vec<u8> = self.arriving.drain(..).map(|(_, byte)| byte).collect();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    pub fn pass(&mut self, by: Nanos) {
        self.now = self.now + by;
        while self.stepped + STEP <= self.now {
            self.stepped = self.stepped + STEP;
            let now = self.stepped;
            let due = self.leaving.iter().take_while(|(at, _)| *at <= now).count();
            let bytes: Vec<u8> = self.leaving.drain(..due).map(|(_, byte)| byte).collect();
            self.board.receive(now, &bytes);
            let switches = SlideSwitches {
                is_home: self.plant.is_home(),
                is_forward: self.plant.is_forward_limit(),
                is_reverse: self.plant.is_reverse_limit(),
            };
            self.board.advance(now, switches);
            let shift = self.board.take_counter_shift();
            if shift != 0.0 {
                self.plant.shift_counter(shift);
            }
            self.plant.advance(self.board.counter_mm(), Seconds(0.001));
            let at = now + DELAY;
            for byte in self.board.transmit() {
                let bytes = (self.spoil)(byte);
                self.arriving.extend(bytes.into_iter().map(|byte| (at, byte)));
            }
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
        while wire.arriving.front().is_none_or(|(at, _)| *at > wire.now) {
            if wire.now >= end {
                return Ok(0);
            }
            let by = STEP.min(end.since(wire.now));
            wire.pass(by);
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
        let at = wire.now + DELAY;
        for byte in bytes {
            if !(wire.lose)(*byte) {
                wire.leaving.push_back((at, *byte));
            }
        }
        Ok(())
    }
}

pub fn slide() -> GrblSettings {
    GrblSettings {
        name: "bench".into(),
        axis: 'X',
        mm_per_pulse: 0.0025,
        is_reversed: false,
        travel: Position(150.0),
        speed_max: MmPerS(20.0),
        acceleration: MmPerS2(60.0),
        unseen: RigDescription::UNSEEN_USUAL,
        home: HomeSwitch::Limit,
        is_closed_home: false,
        build_info: None,
        is_unlocking: false,
    }
}

pub fn wired(settings: grbl::EmulatedGrblSettings) -> Shared {
    Shared(Arc::new(Mutex::new(Wire {
        board: Grbl::new(settings),
        plant: EmulatedPlant::new(&SimSettings::default(), Seconds(0.001)),
        now: Nanos::ZERO,
        stepped: Nanos::ZERO,
        leaving: VecDeque::new(),
        arriving: VecDeque::new(),
        is_cut: false,
        spoil: Box::new(|byte| vec![byte]),
        lose: Box::new(|_| false),
        sent: Vec::new(),
    })))
}

pub fn try_connect(wire: &Shared, settings: &GrblSettings) -> Result<ConnectedGrbl, GrblOpenError> {
    let clock: HostClock = {
        let wire = wire.clone();
        Arc::new(move || wire.lock().now)
    };
    connect(&mut wire.clone(), &clock, settings, &"grbl".into())
}

/// The host's side after it has connected.
pub struct Host {
    pub wire: Shared,
    pub session: GrblSession,
    pub track: SharedTrack,
    pub connected: ConnectedGrbl,
    pub acks: Vec<RigCommand>,
    pub faults: Vec<Fault>,
    pub is_attended: bool,
}

impl Host {
    pub fn new(settings: &GrblSettings) -> Self {
        Self::on(wired(grbl::EmulatedGrblSettings::default()), settings)
    }

    pub fn on(wire: Shared, settings: &GrblSettings) -> Self {
        let connected = try_connect(&wire, settings).expect("it connects");
        let track =
            Arc::new(Mutex::new(AxisTrack::at_rest(settings.sign() * connected.parameters.steps)));
        let now = wire.lock().now;
        let session = GrblSession::new(
            settings.clone(),
            connected.parameters,
            Arc::clone(&track),
            connected.stats,
            now,
        );
        let mut host = Self {
            wire,
            session,
            track,
            connected,
            acks: Vec::new(),
            faults: Vec::new(),
            is_attended: true,
        };
        host.tell(RigCommand::EnableMotor);
        host
    }

    pub fn now(&self) -> Nanos {
        self.wire.lock().now
    }

    pub fn turn(&mut self) -> io::Result<()> {
        if self.is_attended {
            self.session.note_attendance(self.now());
        }
        while let Some(line) = self.session.take_line(self.now()) {
            self.wire.write(&line)?;
        }
        let mut buffer = [0_u8; 256];
        let count = self.wire.read(&mut buffer, Duration::from_micros(500))?;
        self.session.handle_bytes(self.now(), &buffer[..count]);
        while let Some((_, body)) = self.session.take_event() {
            match body {
                RigEventBody::Reading(_) => panic!("a board has no samples"),
                RigEventBody::Ack(ack) => self.acks.push(ack.command),
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

    pub fn ask(&mut self, command: RigCommand) {
        let now = self.now();
        self.session.command(now, command);
    }

    /// Sends a command and waits for its acknowledgement.
    pub fn tell(&mut self, command: RigCommand) -> RigCommand {
        let before = self.acks.len();
        self.ask(command);
        self.until("acknowledged", |host| host.acks.len() > before);
        self.acks[before]
    }

    /// Sends a command that is refused, and gives the words.
    pub fn refused(&mut self, command: RigCommand) -> String {
        let before = self.faults.len();
        self.ask(command);
        self.until("refused", |host| host.faults.len() > before);
        self.faults[before].to_string()
    }

    pub fn pulses(&self) -> f64 {
        self.track.lock().expect("no panic holds it").at(self.now()).pulses
    }

    pub fn has(&self, status: AxisStatus) -> bool {
        self.track.lock().expect("no panic holds it").at(self.now()).status.has(status)
    }

    pub fn settle(&mut self) {
        self.until("at rest", |host| !host.has(AxisStatus::MOVING));
    }

    /// Where the slide really is on the board's counter, in pulses.
    pub fn truth(&self) -> f64 {
        (self.wire.lock().board.counter_mm() / 0.0025).round()
    }
}

pub fn to(target_pulses: i64, speed: f64) -> RigCommand {
    RigCommand::MoveTo(MoveTo { target_pulses, speed: MmPerS(speed), acceleration: MmPerS2(60.0) })
}
