//! One axis: motion at the sample clock, the smoothing filter of the pulses, switches and stop codes.

use super::profile::AxisProfile;
use super::scope::bits;
use super::settings::{AxisSetting, AxisSettings, NO_LIMIT, round_speed};
use palpate_drivers::galil::ErrorCode;

/// Counts of a position register: 32 bits.
pub const COUNTS_MAX: f64 = 2_147_483_647.0;

/// A pulse counts as given when the filtered place has come this near to it, in counts.
const NEAR: f64 = 1e-6;
/// A filter this near to a command at rest has arrived and gives its last pulse. How long the tail really lasts is not
/// documented; so it is some ten samples.
const SETTLED: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisMotion {
    Rest,
    /// A move to a position.
    Target(f64),
    /// A constant velocity.
    Jog(f64),
    /// Coming to rest at a place, at a rate, with this stop code.
    Stopping(f64, f64, u8),
    /// Until the home switch changes, in a direction; then [`AxisMotion::Stopping`], then a homing goes back.
    Edge {
        side: f64,
        /// State of the input at the start.
        was: bool,
        /// Whether the edge is approached again slowly.
        is_homing: bool,
    },
    /// Second stage of a homing: braked, then slowly back to the edge.
    Back {
        side: f64,
        /// State of the input that ends it.
        until: bool,
        /// Whether the first stage's braking is over.
        is_braked: bool,
    },
    /// Increments of the contour mode.
    Contour,
}

/// The motion that `BG` starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PreparedMotion {
    /// `PA`.
    Target(f64),
    /// `PR`: again with every `BG`.
    Relative(f64),
    /// `JG`.
    Jog(f64),
    /// `FE`, `HM`.
    Edge {
        /// Whether it is `HM`.
        is_homing: bool,
    },
}

/// Levels of the axis's inputs: true is high, which is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisInputs {
    /// Forward limit switch.
    pub forward: bool,
    /// Reverse limit switch.
    pub reverse: bool,
    pub home: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisEvent {
    /// A limit switch or a software limit was met.
    Limit,
    /// A homing has ended: the position becomes zero.
    Homed,
}

/// Polarity of the inputs (`CN`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputPolarity {
    /// 1 when a high level is a closed limit switch, -1 when a low one is.
    pub limit: f64,
    /// -1 when homing starts forwards on a low level, 1 on a high one.
    pub home: f64,
}

#[derive(Clone, Debug)]
pub struct GalilAxis {
    pub settings: AxisSettings,
    pub is_on: bool,
    pub motion: AxisMotion,
    /// Started by `BG`.
    pub prepared: PreparedMotion,
    /// Whether it is in the position tracking mode (`PT`): a new target takes effect at once.
    pub is_tracking: bool,
    /// Commanded place and velocity.
    pub profile: AxisProfile,
    /// Behind the smoothing filter, in counts.
    pub filtered: f64,
    /// Encoder input, in counts: nothing is connected to it on a stepper axis.
    pub encoder: f64,
    /// Of `SC`.
    pub stop_code: u8,
    /// Inputs at the newest sample.
    pub inputs: AxisInputs,
}

impl GalilAxis {
    /// As after a reset: motor off, everything at zero.
    pub fn new(is_stepper: bool) -> Self {
        let mut settings = AxisSettings::new();
        if is_stepper {
            // Active-low pulses (Galil application note 2446).
            settings.set(AxisSetting::MotorType, 2.0);
        }
        Self {
            settings,
            is_on: false,
            motion: AxisMotion::Rest,
            prepared: PreparedMotion::Target(0.0),
            is_tracking: false,
            profile: AxisProfile::default(),
            filtered: 0.0,
            encoder: 0.0,
            stop_code: 1,
            inputs: AxisInputs { forward: true, reverse: true, home: true },
        }
    }

    fn get(&self, setting: AxisSetting) -> f64 {
        self.settings.get(setting)
    }

    /// Whether pulses drive it.
    pub fn is_stepper(&self) -> bool {
        self.get(AxisSetting::MotorType).abs() >= 2.0
    }

    /// `RP`: whole counts at or below the commanded place.
    pub fn reference(&self) -> f64 {
        (self.profile.place + NEAR).floor()
    }

    /// `TD`: pulses given, or on a servo the auxiliary encoder, which nothing is connected to.
    pub fn pulses(&self) -> f64 {
        if self.is_stepper() { (self.filtered + NEAR).floor() } else { 0.0 }
    }

    /// `TP`: the encoder. A servo here follows its command without error.
    pub fn encoder_position(&self) -> f64 {
        if self.is_stepper() { self.encoder } else { self.reference() }
    }

    /// `_BG`: whether the profile is under way. It ends before the filter has given its last pulses.
    pub fn is_running(&self) -> bool {
        self.motion != AxisMotion::Rest
    }

    /// `DP`: sets step count and reference alike. Returns by how much the count has become smaller.
    pub fn define(&mut self, counts: f64) -> Result<f64, ErrorCode> {
        if self.is_running() {
            return Err(ErrorCode::RUNNING);
        }
        let shift = self.filtered - counts;
        self.profile.place = counts;
        self.filtered = counts;
        // `PA?` reads the position; other prepared motions stay.
        if let PreparedMotion::Target(target) = &mut self.prepared {
            *target = counts;
        }
        Ok(shift)
    }

    /// The place becomes zero while pulses may still be on their way; returns by how much the count shrank.
    pub fn zero(&mut self) -> f64 {
        let shift = self.profile.place;
        self.profile.place = 0.0;
        self.filtered -= shift;
        self.prepared = PreparedMotion::Target(0.0);
        shift
    }

    fn is_limit_active(&self, side: f64, polarity: InputPolarity) -> bool {
        let disabled = self.get(AxisSetting::LimitDisable) as u8;
        let is_high_active = polarity.limit > 0.0;
        if side > 0.0 {
            disabled & 1 == 0 && self.inputs.forward == is_high_active
        } else {
            disabled & 2 == 0 && self.inputs.reverse == is_high_active
        }
    }

    /// Whether a place is beyond the software limit in a direction: "activated at n + 1" (`FL`).
    fn is_beyond(&self, side: f64) -> bool {
        let (forward, reverse) =
            (self.get(AxisSetting::ForwardLimit), self.get(AxisSetting::ReverseLimit));
        if side > 0.0 {
            forward < NO_LIMIT && self.profile.place > forward
        } else {
            reverse > -COUNTS_MAX - 1.0 && self.profile.place < reverse
        }
    }

    /// `BG`.
    pub fn begin(&mut self, polarity: InputPolarity) -> Result<(), ErrorCode> {
        if !self.is_on {
            return Err(ErrorCode::MOTOR_OFF);
        }
        if self.is_running() || self.is_tracking {
            return Err(ErrorCode::BEGIN_RUNNING);
        }
        let home = self.inputs.home;
        // "-1 configures HM to drive the motor in the forward direction when the input is low" (`CN`).
        let edge_side = if home == (polarity.home > 0.0) { 1.0 } else { -1.0 };
        let (motion, side) = match self.prepared {
            PreparedMotion::Target(target) => {
                (AxisMotion::Target(target), target - self.profile.place)
            }
            PreparedMotion::Relative(distance) => {
                let target = self.profile.place.round() + distance;
                if target.abs() > COUNTS_MAX {
                    return Err(ErrorCode::OUT_OF_RANGE);
                }
                (AxisMotion::Target(target), distance)
            }
            PreparedMotion::Jog(speed) => (AxisMotion::Jog(speed), speed),
            PreparedMotion::Edge { is_homing } => {
                let motion = AxisMotion::Edge { side: edge_side, was: home, is_homing };
                (motion, edge_side)
            }
        };
        if side != 0.0 && (self.is_limit_active(side, polarity) || self.is_beyond(side)) {
            return Err(ErrorCode::LIMIT_SWITCH);
        }
        self.motion = motion;
        self.stop_code = 0;
        Ok(())
    }

    /// `PA` in the position tracking mode: from the next sample on the axis goes there, at rest or under way.
    pub fn track(&mut self, target: f64, polarity: InputPolarity) -> Result<(), ErrorCode> {
        if !self.is_on {
            return Err(ErrorCode::MOTOR_OFF);
        }
        let side = target - self.profile.place;
        if side != 0.0 && (self.is_limit_active(side, polarity) || self.is_beyond(side)) {
            return Err(ErrorCode::LIMIT_SWITCH);
        }
        self.prepared = PreparedMotion::Target(target);
        self.motion = AxisMotion::Target(target);
        self.stop_code = 0;
        Ok(())
    }

    /// Brakes at a rate and ends with a stop code; a stop ends the position tracking mode too.
    pub fn stop(&mut self, rate: AxisSetting, code: u8) {
        self.is_tracking = false;
        if !matches!(self.motion, AxisMotion::Rest | AxisMotion::Stopping(..)) {
            let rate = self.get(rate);
            self.motion = AxisMotion::Stopping(self.profile.rest(rate), rate, code);
            self.stop_code = code;
        }
    }

    /// `AB`: at rest at once.
    pub fn abort(&mut self, code: u8) {
        self.is_tracking = false;
        if self.is_running() {
            self.motion = AxisMotion::Rest;
            self.profile = AxisProfile { place: self.reference(), velocity: 0.0 };
            self.stop_code = code;
        }
    }

    /// `JG`: takes effect at once where the axis already jogs.
    pub fn jog(&mut self, speed: f64, tm: f64) {
        let speed = round_speed(speed, tm);
        self.prepared = PreparedMotion::Jog(speed);
        if matches!(self.motion, AxisMotion::Jog(_)) {
            self.motion = AxisMotion::Jog(speed);
        }
    }

    /// One sample of `dt` seconds; the axis brakes at `limit_rate` at a limit.
    pub fn sample(
        &mut self,
        dt: f64,
        polarity: InputPolarity,
        limit_rate: AxisSetting,
    ) -> Option<AxisEvent> {
        let ac = self.get(AxisSetting::Acceleration);
        let dc = self.get(AxisSetting::Deceleration);
        let speed = self.get(AxisSetting::Speed);
        match self.motion {
            AxisMotion::Rest | AxisMotion::Contour => {}
            AxisMotion::Target(target) => {
                if self.profile.towards(target, speed, ac, dc, dt) {
                    self.end(1);
                }
            }
            AxisMotion::Jog(speed) => self.profile.jog(speed, ac, dc, dt),
            AxisMotion::Stopping(place, rate, code) => {
                let fast = self.profile.velocity.abs();
                if self.profile.towards(place, fast, rate, rate, dt) {
                    self.end(code);
                }
            }
            AxisMotion::Edge { side, was, is_homing } => {
                self.profile.jog(side * speed, ac, dc, dt);
                if self.inputs.home != was {
                    if is_homing {
                        self.motion =
                            AxisMotion::Back { side: -side, until: was, is_braked: false };
                    } else {
                        self.stop(AxisSetting::Deceleration, 9);
                    }
                }
            }
            AxisMotion::Back { side, until, is_braked } => {
                // 256 counts/s (DMC-18x2 command reference, `HM`, the second stage), `HV` where it is set.
                let slow = if is_braked { self.get(AxisSetting::HomeSpeed) } else { 0.0 };
                self.profile.jog(side * slow, ac, dc, dt);
                let is_braked = is_braked || self.profile.velocity == 0.0;
                self.motion = AxisMotion::Back { side, until, is_braked };
                if is_braked && self.inputs.home == until {
                    self.abort(10);
                    return Some(AxisEvent::Homed);
                }
            }
        }
        let side = self.profile.velocity;
        let is_met = side != 0.0
            && !matches!(self.motion, AxisMotion::Stopping(..))
            && (self.is_limit_active(side, polarity) || self.is_beyond(side));
        if is_met {
            self.stop(limit_rate, if side > 0.0 { 2 } else { 3 });
        }
        is_met.then_some(AxisEvent::Limit)
    }

    fn end(&mut self, code: u8) {
        self.motion = AxisMotion::Rest;
        self.stop_code = code;
    }

    /// The smoothing filter of the pulses at a sample: a single pole whose time constant is 3 KS samples
    /// (DMC-2x00 user manual, pages 117-118: KS 1.313 is 3.939 samples).
    pub fn smooth_pulses(&mut self) {
        if !self.is_stepper() {
            self.filtered = self.profile.place;
            return;
        }
        let remaining = self.profile.place - self.filtered;
        let keeps = (-1.0 / (3.0 * self.get(AxisSetting::Smoothing))).exp();
        if !self.is_running() && remaining.abs() < SETTLED {
            self.filtered = self.profile.place;
        } else {
            self.filtered = self.profile.place - keeps * remaining;
        }
    }

    /// The byte of `TS` (DMC-1400 user manual, page 211).
    pub fn switches(&self) -> u8 {
        let AxisInputs { forward, reverse, home } = self.inputs;
        // Bit 0: no latch is armed or has occurred. Bits 4 and 6 are not used.
        let all = [true, home, reverse, forward, false, !self.is_on, false, self.is_running()];
        bits(all.into_iter())
    }
}
