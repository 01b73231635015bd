//! A sidecar (docs/sidecar-protocol.md): a slide, a load cell, a thermometer and a trigger line behind one link, with a
//! watchdog of its own. For tests it can lie.

mod device;
mod lies;

pub use lies::SidecarLie;

use crate::EmulatedPlant;
use crate::wire::Outbox;
use palpate_drivers::sidecar::protocol::{HOST_LINE_MAX, HostMessage, SidecarSample, finish_line};
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::{AxisStatus, Course, MotionProfile, SinePath};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds};
use palpate_model::{Nanos, rig::Oscillation};

/// Counts of the converter over 0 to 5 V: 24 bits, signed.
const COUNTS_MAX: i32 = (1 << 23) - 1;
const VOLTS_PER_COUNT: f64 = 5.0 / (1 << 23) as f64;
const NOISE_V: f64 = 0.3e-3;
/// Temperature of the room in °C, its swing and the period of that in s.
const ROOM: (f64, f64, f64) = (21.5, 0.5, 600.0);
/// Sensors are sent with every so-many-th sample.
const SENSORS_EVERY: u64 = 50;
/// Longest time that is caught up in one go: after the computer has slept.
const CATCH_UP: Nanos = Nanos::from_millis(2_000);

#[derive(Clone, Debug, PartialEq)]
pub struct EmulatedSidecarSettings {
    /// Specimen, seed and so on, as for the simulated rig.
    pub sim: SimSettings,
    pub name: String,
    pub mm_per_pulse: f64,
    pub travel_mm: f64,
    pub speed_max: f64,
    pub acceleration: f64,
    /// Samples a second.
    pub rate: f64,
    pub silence: Nanos,
    /// From a line to its answer and its effect.
    pub reaction: Nanos,
    pub has_checksum: bool,
    pub has_frames: bool,
    /// Error of its crystal; positive is fast.
    pub clock_ppm: f64,
    /// Its clock at the start, in ticks of a microsecond.
    pub first_tick: u32,
}

impl Default for EmulatedSidecarSettings {
    fn default() -> Self {
        Self {
            sim: SimSettings::default(),
            name: "emulated".into(),
            mm_per_pulse: 0.0025,
            travel_mm: 150.0,
            speed_max: 10.0,
            acceleration: 50.0,
            rate: 500.0,
            silence: Nanos::from_millis(200),
            reaction: Nanos(300_000),
            has_checksum: false,
            has_frames: false,
            clock_ppm: 0.0,
            first_tick: 4_000_000,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Motion {
    course: Course,
    begun: Nanos,
    is_stopping: bool,
}

pub struct EmulatedSidecar {
    settings: EmulatedSidecarSettings,
    plant: EmulatedPlant,
    now: Nanos,
    boot: u64,
    booted: Nanos,
    line: Vec<u8>,
    is_too_long: bool,
    /// Lines that take effect later.
    waiting: Vec<(Nanos, Vec<u8>)>,
    has_introduced: bool,
    is_sending: bool,
    sends_frames: bool,
    motion: Option<Motion>,
    /// Acceleration of the motion under way, with which it brakes.
    acceleration: f64,
    position_mm: f64,
    is_motor_on: bool,
    heard: Nanos,
    samples: u64,
    next_sample: Nanos,
    output: Outbox,
    lie: Option<SidecarLie>,
    /// Distance between true and reported position, in pulses.
    pulse_error: i64,
    /// Ticks that its clock has jumped.
    tick_error: i64,
    /// Where its clock stands still.
    stuck_tick: u32,
}

impl EmulatedSidecar {
    #[must_use]
    pub fn new(settings: EmulatedSidecarSettings) -> Self {
        let period = Seconds(1.0 / settings.rate);
        let mut sidecar = Self {
            plant: EmulatedPlant::new(&settings.sim, period),
            settings,
            now: Nanos::ZERO,
            boot: 1,
            booted: Nanos::ZERO,
            line: Vec::new(),
            is_too_long: false,
            waiting: Vec::new(),
            has_introduced: false,
            is_sending: false,
            sends_frames: false,
            motion: None,
            acceleration: 1.0,
            position_mm: 0.0,
            is_motor_on: false,
            heard: Nanos::ZERO,
            samples: 0,
            next_sample: Nanos::ZERO,
            output: Outbox::default(),
            lie: None,
            pulse_error: 0,
            tick_error: 0,
            stuck_tick: 0,
        };
        sidecar.say_boot();
        sidecar
    }

    pub fn plant(&self) -> &EmulatedPlant {
        &self.plant
    }

    /// True position by its own counter, in mm.
    pub fn position_mm(&self) -> f64 {
        self.position_mm
    }

    /// Whether the axis truly moves.
    pub fn is_moving(&self) -> bool {
        self.motion.is_some()
    }

    /// Samples that were taken since the start.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Begins to lie, or is honest again.
    pub fn set_lie(&mut self, lie: Option<SidecarLie>) {
        self.lie = lie;
        self.begin_lie();
    }

    fn send(&mut self, text: &str) {
        let line = finish_line(text, self.settings.has_checksum && self.has_introduced);
        self.output.push(&line);
    }

    fn say_boot(&mut self) {
        let text = format!(r#"{{"boot":{}}}"#, self.boot);
        self.send(&text);
    }

    fn description(&self, number: u64) -> String {
        let EmulatedSidecarSettings {
            name,
            mm_per_pulse,
            travel_mm,
            speed_max,
            acceleration,
            rate,
            silence,
            has_checksum,
            has_frames,
            ..
        } = &self.settings;
        let silence_ms = silence.0 as f64 * 1e-6;
        format!(
            concat!(
                r#"{{"ok":{number},"sidecar":1,"name":"{name}","serial":"E1","boot":{boot},"tick_ns":1000,"#,
                r#""rate":{rate},"silence_ms":{silence_ms},"crc":{has_checksum},"binary":{has_frames},"#,
                r#""axis":{{"mm_per_pulse":{mm_per_pulse},"travel_mm":{travel_mm},"speed_max":{speed_max},"#,
                r#""acceleration":{acceleration},"sine":true}},"#,
                r#""cell":{{"counts_min":{least},"counts_max":{most},"volts_per_count":{volts},"noise_v":{noise}}},"#,
                r#""sensors":[{{"name":"temperature","unit":"\u00b0C"}},{{"name":"trigger","unit":"1","kind":"input"}}]}}"#
            ),
            number = number,
            name = name,
            boot = self.boot,
            rate = rate,
            silence_ms = silence_ms,
            has_checksum = has_checksum,
            has_frames = has_frames,
            mm_per_pulse = mm_per_pulse,
            travel_mm = travel_mm,
            speed_max = speed_max,
            acceleration = acceleration,
            least = -COUNTS_MAX - 1,
            most = COUNTS_MAX,
            volts = VOLTS_PER_COUNT,
            noise = NOISE_V,
        )
    }

    /// Its clock now.
    fn ticks(&self) -> u32 {
        let micros =
            self.now.since(self.booted).0 as f64 * 1e-3 * (1.0 + self.settings.clock_ppm * 1e-6);
        self.settings
            .first_tick
            .wrapping_add((micros as u64).wrapping_add_signed(self.tick_error) as u32)
    }

    fn take_byte(&mut self, byte: u8) {
        match byte {
            b'\n' => {
                let line = std::mem::take(&mut self.line);
                let is_too_long = std::mem::take(&mut self.is_too_long);
                if is_too_long {
                    self.send(r#"{"no":null,"why":"the line is too long"}"#);
                } else if !line.is_empty() {
                    self.waiting.push((self.now + self.settings.reaction, line));
                }
            }
            b'\r' => {}
            _ if self.line.len() >= HOST_LINE_MAX + 5 => self.is_too_long = true,
            byte => self.line.push(byte),
        }
    }

    fn on_line(&mut self, line: &[u8]) {
        let text = String::from_utf8_lossy(line);
        let has_checksum = self.settings.has_checksum && self.has_introduced;
        let (number, message) = match HostMessage::parse(&text, has_checksum) {
            Ok(parsed) => parsed,
            Err(err) => {
                let number = err.number.map_or("null".to_owned(), |number| number.to_string());
                let why = err.why.replace(['"', '\\'], " ");
                return self.send(&format!(r#"{{"no":{number},"why":"{why}"}}"#));
            }
        };
        if self.is_mute() {
            return;
        }
        if !self.has_introduced && message != HostMessage::Hello {
            return self.send(&format!(r#"{{"no":{number},"why":"hello first"}}"#));
        }
        self.heard = self.now;
        match self.obey(message, number) {
            Ok(extra) if message != HostMessage::Hello && message != HostMessage::Bye => {
                self.send(&format!(r#"{{"ok":{number}{extra}}}"#));
            }
            Ok(_) => {}
            Err(why) => self.send(&format!(r#"{{"no":{number},"why":"{why}"}}"#)),
        }
    }

    /// Does what a line says; gives further keys of the answer, or why not.
    fn obey(&mut self, message: HostMessage, number: u64) -> Result<String, &'static str> {
        match message {
            HostMessage::Hello => {
                self.brake(self.now);
                self.is_sending = false;
                // Its answer never has a checksum.
                self.has_introduced = false;
                let text = self.description(number);
                self.send(&text);
                self.has_introduced = true;
            }
            HostMessage::Start { is_binary } => {
                self.is_sending = true;
                self.sends_frames = is_binary && self.settings.has_frames;
            }
            HostMessage::Beat => return Ok(format!(r#","t":{}"#, self.ticks())),
            HostMessage::Enable => self.is_motor_on = true,
            HostMessage::Move { to, speed, acceleration } => {
                let end = to as f64 * self.settings.mm_per_pulse;
                let course =
                    MotionProfile::to_rest(self.place(), Position(end), speed, acceleration);
                self.begin_motion(Course::Move(course), speed, acceleration)?;
            }
            HostMessage::Sine { amplitude, period, cycles, acceleration } => {
                let sine = Oscillation {
                    amplitude_pulses: amplitude,
                    period_ticks: period,
                    cycles,
                    acceleration,
                };
                let path =
                    SinePath::new(self.place(), &sine, self.settings.mm_per_pulse, Seconds(1e-6));
                self.begin_motion(Course::Sine(path), path.speed_max(), acceleration)?;
            }
            HostMessage::Stop if self.is_deaf_to_stops() => {}
            HostMessage::Stop => self.brake(self.now),
            HostMessage::Halt if self.is_deaf_to_stops() => {}
            HostMessage::Halt => {
                self.settle();
                self.motion = None;
            }
            HostMessage::Bye => {
                self.brake(self.now);
                self.is_sending = false;
            }
        }
        Ok(String::new())
    }

    fn place(&self) -> Position {
        Position(self.position_mm)
    }

    fn begin_motion(
        &mut self,
        course: Course,
        speed: MmPerS,
        acceleration: MmPerS2,
    ) -> Result<(), &'static str> {
        let settings = &self.settings;
        let slack = 1.0 + 1e-9;
        if !self.is_motor_on {
            return Err("the motor is off");
        }
        if self.motion.is_some() {
            return Err("the axis is moving");
        }
        if speed.0 > settings.speed_max * slack || acceleration.0 > settings.acceleration * slack {
            return Err("speed or acceleration is too high");
        }
        // Its counter's zero is not at home, so its travel is an allowance either way.
        if course.end().0.abs() > 2.0 * settings.travel_mm {
            return Err("the target is beyond the travel");
        }
        if self.is_lazy() {
            return Ok(());
        }
        self.acceleration = acceleration.0;
        let begun = self.now;
        if course.duration().0 > 0.0 {
            self.motion = Some(Motion { course, begun, is_stopping: false });
        }
        Ok(())
    }

    /// Brings the position up to now.
    fn settle(&mut self) {
        if let Some(motion) = self.motion {
            let since = self.now.since(motion.begun).seconds();
            self.position_mm = motion.course.position(since).0;
            if since >= motion.course.duration() {
                self.motion = None;
            }
        }
    }

    fn brake(&mut self, now: Nanos) {
        self.settle();
        if let Some(motion) = &mut self.motion
            && !motion.is_stopping
        {
            let since = now.since(motion.begun).seconds();
            let (from, velocity) = (motion.course.position(since), motion.course.velocity(since));
            let braking = MotionProfile::braking(from, velocity, MmPerS2(self.acceleration));
            *motion = Motion { course: Course::Move(braking), begun: now, is_stopping: true };
        }
    }

    /// What the axis does by itself: silence and limit switches.
    fn guard(&mut self) {
        if self.now.since(self.heard) >= self.settings.silence && !self.is_without_watchdog() {
            self.brake(self.now);
        }
        let direction = self
            .motion
            .map_or(0.0, |motion| motion.course.velocity(self.now.since(motion.begun).seconds()).0);
        let is_at_end = direction > 0.0 && self.plant.is_forward_limit()
            || direction < 0.0 && self.plant.is_reverse_limit();
        if is_at_end {
            self.brake(self.now);
        }
    }

    fn status(&self) -> AxisStatus {
        let is_stopping = self.motion.is_some_and(|motion| motion.is_stopping);
        let bits = [
            (self.motion.is_some(), AxisStatus::MOVING),
            (is_stopping, AxisStatus::STOPPING),
            (self.plant.is_home(), AxisStatus::HOME),
            (self.plant.is_forward_limit(), AxisStatus::FORWARD_LIMIT),
            (self.plant.is_reverse_limit(), AxisStatus::REVERSE_LIMIT),
            (self.is_motor_on, AxisStatus::MOTOR_ON),
        ];
        let set = bits.into_iter().filter(|(is_set, _)| *is_set);
        set.fold(AxisStatus(0), |all, (_, bit)| all | bit)
    }

    fn sample(&mut self) {
        self.samples += 1;
        let period = Seconds(1.0 / self.settings.rate);
        self.plant.advance(self.position_mm, period);
        if !self.is_sending || self.is_mute() {
            return;
        }
        let counts = (self.plant.volts().0 / VOLTS_PER_COUNT).round();
        let pulses = (self.position_mm / self.settings.mm_per_pulse).round() as i64;
        let has_values = self.samples % SENSORS_EVERY == 1;
        let mut sample = SidecarSample {
            ticks: self.ticks(),
            counts: Some((counts as i32).clamp(-COUNTS_MAX - 1, COUNTS_MAX)),
            pulses: Some(pulses.saturating_add(self.pulse_error)),
            status: self.status().0,
            values: if has_values { self.values() } else { Vec::new() },
        };
        self.falsify(&mut sample);
        let bytes = if self.sends_frames && sample.values.is_empty() {
            sample.frame()
        } else {
            sample.line(self.settings.has_checksum)
        };
        for _ in 0..self.copies() {
            let bytes = self.garble(bytes.clone());
            self.output.push(&bytes);
        }
    }

    fn values(&self) -> Vec<Option<f64>> {
        let (mean, swing, period) = ROOM;
        let seconds = self.now.seconds().0;
        let celsius = mean + swing * (std::f64::consts::TAU * seconds / period).sin();
        let is_pressed = self.plant.force().0 > 0.1;
        vec![Some((celsius * 100.0).round() / 100.0), Some(f64::from(u8::from(is_pressed)))]
    }

    /// It loses its supply for a moment: it stands, and everything is as at first.
    fn restart(&mut self) {
        self.settle();
        self.motion = None;
        self.plant.shift_counter(-self.position_mm);
        self.position_mm = 0.0;
        self.boot += 1;
        self.booted = self.now;
        (self.is_motor_on, self.is_sending, self.has_introduced) = (false, false, false);
        self.line.clear();
        self.waiting.clear();
        self.output.clear();
        (self.pulse_error, self.tick_error) = (0, 0);
        self.say_boot();
    }

    /// Advances to a time at which something happens.
    fn advance_to(&mut self, at: Nanos) {
        self.now = self.now.max(at);
        self.settle();
        self.guard();
    }
}
