//! The board without its port: bytes in, bytes out, torques on the arm.

use super::arm::{HapiArm, HapiArmSettings};
use super::{HapiFault, HapiLie};
use palpate_haptics::SettingError;
use palpate_model::Nanos;
use std::collections::VecDeque;

/// Largest torque of a motor in N m, and steps up to it.
const TORQUE_MAX: f64 = 0.123;
const DUTY_MAX: f64 = 1023.0;
/// The firmware takes one command in so long.
const TURN: Nanos = Nanos(50_000);
/// For the rest of a packet it waits so long (`Stream` of Arduino).
const PATIENCE: Nanos = Nanos::from_millis(1000);
/// The firmware counts every second edge of the encoders.
const EDGES: f64 = 2.0;
/// What is read where nothing has arrived.
const NOTHING: u8 = 0xff;
/// After so many packets the hand takes the arm from its home: not by time, as a busy computer has little of it.
const PACKETS_AT_HOME: u64 = 100;
/// Bytes that the USB driver keeps.
const INPUT_MAX: usize = 256;

/// What is emulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapiBoardSettings {
    pub arm: HapiArmSettings,
    /// From a packet to its answer, in addition to the firmware's turn.
    pub reply_delay: Nanos,
    /// Whether the board runs on when its cable is pulled. Not known; a board that its cable feeds does not.
    pub has_own_power: bool,
}

impl Default for HapiBoardSettings {
    fn default() -> Self {
        Self { arm: HapiArmSettings::default(), reply_delay: Nanos::ZERO, has_own_power: false }
    }
}

/// A motor and its encoder at a port of the board, as set up.
#[derive(Clone, Copy, Debug, Default)]
struct Port {
    motor: Option<u8>,
    encoder: Option<u8>,
    motor_direction: u8,
    encoder_direction: u8,
    counts: f64,
    /// Degrees to add to those that the arm has turned since the set-up, and where it was.
    offset: f64,
    zero: f64,
    duty: f64,
}

/// What a cut packet is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Values {
    Torques { device: u8 },
    Encoders { device: u8 },
}

/// The board.
#[derive(Clone, Debug)]
pub struct HapiBoard {
    settings: HapiBoardSettings,
    arm: HapiArm,
    input: VecDeque<u8>,
    /// A packet whose values are not all there, their number, and since when.
    pending: Option<(Values, usize, Nanos)>,
    /// Values of the packet before: what lies where the missing ones were to be.
    stale: [u8; 16],
    ports: [Port; 2],
    next_turn: Nanos,
    output: VecDeque<(Nanos, u8)>,
    now: Nanos,
    fault: Option<HapiFault>,
    fault_at: Option<Nanos>,
    zero_since: Option<Nanos>,
    /// Packets with torques received.
    packets: u64,
}

/// Port 1 has motor 2, and port 2 motor 1.
fn motor_of(port: usize) -> usize {
    1 - port
}

impl HapiBoard {
    /// With its arm in the home position.
    pub fn new(settings: HapiBoardSettings) -> Result<Self, SettingError> {
        Ok(Self {
            arm: HapiArm::new(settings.arm)?,
            settings,
            input: VecDeque::new(),
            pending: None,
            stale: [0; 16],
            ports: [Port::default(); 2],
            next_turn: Nanos::ZERO,
            output: VecDeque::new(),
            now: Nanos::ZERO,
            fault: None,
            fault_at: None,
            zero_since: Some(Nanos::ZERO),
            packets: 0,
        })
    }

    /// Begins a fault, or ends it.
    pub fn set_fault(&mut self, now: Nanos, fault: Option<HapiFault>) {
        self.fault = fault;
        self.fault_at = fault.map(|_| now);
        if fault == Some(HapiFault::Cut) {
            self.input.clear();
            self.output.clear();
            if !self.settings.has_own_power {
                self.restart(now);
            }
        }
    }

    pub fn fault(&self) -> Option<HapiFault> {
        self.fault
    }

    /// When the fault began.
    pub fn fault_at(&self) -> Option<Nanos> {
        self.fault_at
    }

    /// Power off and on: no torque and no set-up.
    pub fn restart(&mut self, now: Nanos) {
        self.input.clear();
        self.output.clear();
        self.pending = None;
        self.ports = [Port::default(); 2];
        self.note_torques(now);
    }

    /// Torques of motors 1 and 2 in N m.
    #[must_use]
    pub fn torques(&self) -> [f64; 2] {
        [1, 0].map(|port| TORQUE_MAX * self.ports[port].duty / DUTY_MAX)
    }

    /// The force on the hand in N along the plane's x and y.
    #[must_use]
    pub fn force(&self) -> [f64; 2] {
        self.arm.force(self.torques())
    }

    /// Since when there is no torque; `None` while there is one.
    #[must_use]
    pub fn zero_since(&self) -> Option<Nanos> {
        self.zero_since
    }

    /// Whether both motors and encoders are set up.
    #[must_use]
    pub fn is_set_up(&self) -> bool {
        self.ports.iter().all(|port| port.motor.is_some() && port.encoder.is_some())
    }

    /// Bytes of the computer.
    pub fn receive(&mut self, now: Nanos, bytes: &[u8]) {
        self.advance(now);
        let mut kept = bytes.len();
        match self.fault {
            Some(HapiFault::Cut) => kept = 0,
            Some(HapiFault::CutPacket(lost)) => {
                kept = kept.saturating_sub(usize::from(lost));
                self.fault = None;
            }
            _ => {}
        }
        self.input.extend(&bytes[..kept]);
        self.input.truncate(INPUT_MAX);
        self.next_turn = self.next_turn.max(now);
    }

    /// Moves the arm to `now`, and takes the commands that are there.
    pub fn advance(&mut self, now: Nanos) {
        self.now = now;
        if self.fault != Some(HapiFault::Hung) {
            while self.next_turn <= now && self.take_command(self.next_turn) {
                self.next_turn = self.next_turn + TURN;
            }
        }
        self.arm.advance(now, self.torques());
    }

    /// Bytes for the computer that leave up to now.
    pub fn transmit(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some((_, byte)) = self.output.front().copied().filter(|(at, _)| *at <= self.now) {
            self.output.pop_front();
            bytes.push(byte);
        }
        bytes
    }

    fn read(&mut self) -> u8 {
        self.input.pop_front().unwrap_or(NOTHING)
    }

    /// One turn of the firmware's loop; whether there was something to do.
    fn take_command(&mut self, now: Nanos) -> bool {
        if let Some((values, count, since)) = self.pending {
            if self.input.len() < count && self.now.since(since) < PATIENCE {
                return false;
            }
            self.pending = None;
            self.take_values(now, values, count);
            return true;
        }
        let Some(command) = self.input.pop_front() else {
            return false;
        };
        match command {
            0 => {
                // The motors are forgotten, and turn on.
                self.read();
                self.forget();
            }
            1 => self.begin_setup(now),
            2 => {
                let device = self.read();
                let motors = self.ports.iter().filter(|port| port.motor == Some(device)).count();
                self.await_values(now, Values::Torques { device }, 4 * motors);
            }
            _ => {}
        }
        true
    }

    fn await_values(&mut self, now: Nanos, values: Values, count: usize) {
        if self.input.len() < count {
            self.pending = Some((values, count, now));
        } else {
            self.take_values(now, values, count);
        }
    }

    fn forget(&mut self) {
        for port in &mut self.ports {
            (port.motor, port.encoder) = (None, None);
        }
    }

    fn begin_setup(&mut self, now: Nanos) {
        self.forget();
        let device = self.read();
        let motors = self.read();
        for port in 0..2 {
            if motors >> port & 1 == 1 {
                self.ports[port].motor_direction = self.read();
                self.ports[port].motor = Some(device);
            }
        }
        let encoders = self.read();
        let mut count = 0;
        for port in 0..2 {
            if encoders >> port & 1 == 1 {
                self.ports[port].encoder_direction = self.read();
                self.ports[port].encoder = Some(device);
                count += 8;
            }
        }
        for _ in 0..2 {
            // Sensors and pulses: pins that the arm does not have.
            for _ in 0..self.read() {
                self.read();
            }
        }
        self.await_values(now, Values::Encoders { device }, count);
    }

    /// The values of a packet; what is missing is what was there before.
    fn take_values(&mut self, now: Nanos, values: Values, count: usize) {
        let mut bytes = self.stale;
        for byte in bytes.iter_mut().take(count) {
            if let Some(arrived) = self.input.pop_front() {
                *byte = arrived;
            }
        }
        self.stale = bytes;
        let mut numbers = bytes
            .chunks_exact(4)
            .map(|four| f64::from(f32::from_le_bytes([four[0], four[1], four[2], four[3]])));
        let mut next = || numbers.next().unwrap_or_default();
        let degrees = self.arm.degrees();
        match values {
            Values::Encoders { device } => {
                for (index, port) in self.ports.iter_mut().enumerate() {
                    if port.encoder == Some(device) {
                        (port.offset, port.counts) = (next(), next() / EDGES);
                        port.zero = degrees[motor_of(index)];
                    }
                }
            }
            Values::Torques { device } => {
                self.packets += 1;
                if self.packets == PACKETS_AT_HOME {
                    self.arm.lead_from(now);
                }
                for port in self.ports.iter_mut().filter(|port| port.motor == Some(device)) {
                    port.duty = duty(next(), port.motor_direction);
                }
                self.answer(now, device);
            }
        }
        self.note_torques(now);
    }

    fn note_torques(&mut self, now: Nanos) {
        if self.ports.iter().all(|port| port.duty == 0.0) {
            self.zero_since.get_or_insert(now);
        } else {
            self.zero_since = None;
        }
    }

    fn answer(&mut self, now: Nanos, device: u8) {
        let degrees = self.arm.degrees();
        let mut angles = Vec::new();
        for (index, port) in self.ports.iter().enumerate() {
            if port.encoder == Some(device) {
                let turned = degrees[motor_of(index)] - port.zero;
                let sign = if port.encoder_direction == 1 { 1.0 } else { -1.0 };
                let step = 360.0 / port.counts;
                angles.push(((port.offset + sign * turned) / step).round() * step);
            }
        }
        let mut bytes = vec![device];
        bytes.extend(angles.iter().flat_map(|angle| (*angle as f32).to_le_bytes()));
        match self.fault {
            Some(HapiFault::Lie(lie)) => bytes = lying(bytes, lie),
            Some(HapiFault::Mute | HapiFault::Cut) => bytes.clear(),
            _ => {}
        }
        let due = now + self.settings.reply_delay;
        self.output.extend(bytes.into_iter().map(|byte| (due, byte)));
    }
}

/// A torque in N m as a whole number of steps. No number is the worst that the firmware's arithmetic may make of it.
fn duty(torque: f64, direction: u8) -> f64 {
    let sign = if direction == 1 { 1.0 } else { -1.0 };
    let torque = if torque.is_nan() { TORQUE_MAX } else { torque.clamp(-TORQUE_MAX, TORQUE_MAX) };
    sign * (DUTY_MAX * torque / TORQUE_MAX).trunc()
}

fn lying(mut bytes: Vec<u8>, lie: HapiLie) -> Vec<u8> {
    let mut set = |at: usize, angle: f32| {
        if let Some(four) = bytes.get_mut(at..at + 4) {
            four.copy_from_slice(&angle.to_le_bytes());
        }
    };
    match lie {
        HapiLie::NotANumber => set(1, f32::NAN),
        HapiLie::Infinite => set(5, f32::INFINITY),
        HapiLie::Huge => set(5, 1e30),
        HapiLie::Jump => {
            let angle = bytes
                .get(1..5)
                .map_or(0.0, |four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
            if let Some(four) = bytes.get_mut(1..5) {
                four.copy_from_slice(&(angle + 40.0).to_le_bytes());
            }
        }
        HapiLie::OtherDevice => bytes[0] = bytes[0].wrapping_add(1),
        HapiLie::Cut => bytes.truncate(bytes.len() / 2),
        HapiLie::Twice => bytes.extend_from_within(..),
        HapiLie::Noise => bytes = b"\r\nboard error\r\n".to_vec(),
    }
    bytes
}
