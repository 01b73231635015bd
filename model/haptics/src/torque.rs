//! From the force on the hand to the bias voltage of the master's motor.

use super::rig::{DriveInput, Motor, Pinion};
use super::{Flags, SettingError, SettingRange};
use palpate_model::units::{MmPerS, Newtons, Volts};
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DriveKind {
    /// The bias voltage, times the amplifier's gain, stands on the winding: the source's way. Motion makes a voltage
    /// of its own against it, which damps ([`Motor::voltage_damping`]).
    Voltage {
        /// Volts on the winding per volt of bias.
        gain: f64,
    },
    /// The bias voltage sets the current: no damping from the motor.
    Current {
        /// Amperes per volt of bias.
        amps_per_volt: f64,
    },
}

/// The converter that makes the bias voltage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Converter {
    /// Its range is this either way, in V.
    pub volts_max: f64,
    /// Steps in the whole range as a power of two; `None` for one without steps.
    pub bits: Option<u8>,
}

/// Motor, drive and converter between force and bias voltage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TorqueSettings {
    pub pinion: Pinion,
    pub motor: Motor,
    pub drive: DriveKind,
    /// The converter before the drive.
    pub converter: Converter,
    /// Share of the motor's friction that is taken off where the device moves, 0 to 1. Above what friction there is,
    /// the device would run by itself.
    pub friction_share: f64,
}

impl Default for TorqueSettings {
    /// The source's: voltage drive, no compensation; a card of 12 bits and 10 V either way.
    fn default() -> Self {
        Self {
            pinion: Pinion::default(),
            motor: Motor::SOURCE,
            drive: DriveKind::Voltage { gain: 1.0 },
            converter: Converter { volts_max: 10.0, bits: Some(12) },
            friction_share: 0.0,
        }
    }
}

impl TorqueSettings {
    /// Itself if it can drive a motor; the motor is checked by [`Motor::checked`].
    pub fn checked(self) -> Result<Self, SettingError> {
        const DRIVE: &str = "a motor drive";
        let (DriveKind::Voltage { gain } | DriveKind::Current { amps_per_volt: gain }) = self.drive;
        let positive = [
            ("radius of the pinion", self.pinion.radius_mm(), " mm"),
            ("gain", gain, ""),
            ("largest bias voltage", self.converter.volts_max, " V"),
        ];
        SettingRange::Positive.check(DRIVE, &positive)?;
        let bits = self.converter.bits.map_or(1.0, f64::from);
        SettingRange::PositiveUpTo(32.0).check(DRIVE, &[("bits", bits, "")])?;
        SettingRange::UpTo(1.0).check(DRIVE, &[("share of friction", self.friction_share, "")])?;
        Ok(self)
    }

    /// Bias voltage per force at the rack, at rest, in V/N.
    pub fn volts_per_newton(&self) -> f64 {
        let amps = self.pinion.radius_mm() / self.motor.torque_constant;
        match self.drive {
            DriveKind::Voltage { gain } => amps * self.motor.resistance / gain,
            DriveKind::Current { amps_per_volt } => amps / amps_per_volt,
        }
    }

    /// The input of the drive at a bias voltage.
    pub fn drive(&self, bias: Volts) -> DriveInput {
        match self.drive {
            DriveKind::Voltage { gain } => DriveInput::Voltage(gain * bias.0),
            DriveKind::Current { amps_per_volt } => DriveInput::Current(amps_per_volt * bias.0),
        }
    }

    /// Current at a bias voltage with the motor at rest, in A.
    pub fn amps_at_rest(&self, bias: Volts) -> f64 {
        let most = self.motor.volts_max / self.motor.resistance;
        let amps = match self.drive(bias) {
            DriveInput::Voltage(volts) => volts / self.motor.resistance,
            DriveInput::Current(amps) => amps,
        };
        amps.clamp(-most, most)
    }

    /// Damping at the rack that the drive adds, in N s/mm.
    pub fn damping(&self) -> f64 {
        match self.drive {
            DriveKind::Voltage { .. } => self.motor.voltage_damping(self.pinion.radius_mm()),
            DriveKind::Current { .. } => 0.0,
        }
    }

    /// Friction of the motor at the rack.
    pub fn friction(&self) -> Newtons {
        Newtons(self.motor.friction / self.pinion.radius_mm())
    }

    /// The command for a force against motion into the tissue, with the device moving at `speed`.
    pub fn tick(&self, force: Newtons, speed: MmPerS) -> TorqueTick {
        let requested = if force.0.is_finite() { force.0 } else { 0.0 };
        let help = if speed.0 > 0.0 {
            self.friction_share
        } else if speed.0 < 0.0 {
            -self.friction_share
        } else {
            0.0
        };
        // Friction is against the motion; what helps it is less force against it.
        let effective = requested - help * self.friction().0;
        let torque = effective * self.pinion.radius_mm();
        let volts = effective * self.volts_per_newton();
        let most = self.converter.volts_max;
        let within = volts.clamp(-most, most);
        let bias = match self.converter.bits {
            Some(bits) => {
                let step = 2.0 * most / (1u64 << bits) as f64;
                (within / step).round() * step
            }
            None => within,
        };
        let flags = Flags::SATURATED.when(within != volts)
            | Flags::CONTINUOUS.when(torque.abs() > self.motor.continuous);
        TorqueTick { torque, bias: Volts(bias), flags }
    }
}

/// One command of the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueTick {
    /// Torque commanded in N mm, before the converter's range and steps.
    pub torque: f64,
    /// Bias voltage; positive against motion into the tissue.
    pub bias: Volts,
    pub flags: Flags,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_s_motor_gives_5_25_newtons_a_volt() {
        let voltage = TorqueSettings::default().checked().unwrap();
        assert!((1.0 / voltage.volts_per_newton() - 5.25).abs() < 1e-12);
        assert!((voltage.damping() * 1e3 - 17.64).abs() < 0.005);
        assert!((voltage.friction().0 - 0.81).abs() < 1e-12);
        // 11 N are the 110 mN m it may give for ever, at 2.1 V.
        let tick = voltage.tick(Newtons(11.0), MmPerS(0.0));
        assert!((tick.bias.0 - 2.095).abs() < 0.0025 && tick.flags == Flags::NONE);
        let tick = voltage.tick(Newtons(11.1), MmPerS(0.0));
        assert_eq!(tick.flags, Flags::CONTINUOUS);
        let tick = voltage.tick(Newtons(60.0), MmPerS(0.0));
        assert!(tick.flags.has(Flags::SATURATED) && tick.bias.0 == 10.0);
        let current =
            TorqueSettings { drive: DriveKind::Current { amps_per_volt: 1.0 }, ..voltage };
        assert_eq!(current.damping(), 0.0);
        assert_eq!(current.drive(Volts(2.0)), DriveInput::Current(2.0));
    }

    #[test]
    fn steps_of_the_converter_are_those_of_12_bits() {
        let settings = TorqueSettings::default();
        for i in 0..1000 {
            let force = 0.037 * f64::from(i - 500);
            let exact = force * settings.volts_per_newton();
            let bias = settings.tick(Newtons(force), MmPerS(0.0)).bias.0;
            // Half of 4.9 mV, 0.013 N.
            assert!((bias - exact).abs() <= 0.5 * 20.0 / 4096.0 + 1e-15);
        }
    }

    #[test]
    fn compensation_helps_the_motion_either_way_and_not_at_rest() {
        let settings = TorqueSettings { friction_share: 0.5, ..TorqueSettings::default() };
        let torque = |speed: f64| settings.tick(Newtons(2.0), MmPerS(speed)).torque;
        assert!((torque(1.0) - (20.0 - 4.05)).abs() < 1e-12);
        assert!((torque(-1.0) - (20.0 + 4.05)).abs() < 1e-12);
        assert_eq!((torque(0.0), torque(f64::NAN)), (20.0, 20.0));
        assert_eq!(settings.tick(Newtons(f64::NAN), MmPerS(0.0)).bias, Volts(0.0));
    }

    #[test]
    fn what_cannot_drive_is_refused() {
        let bad = TorqueSettings { friction_share: 1.1, ..TorqueSettings::default() };
        assert!(bad.checked().unwrap_err().to_string().contains("from 0 to 1"));
        let bad =
            TorqueSettings { drive: DriveKind::Voltage { gain: 0.0 }, ..TorqueSettings::default() };
        assert!(bad.checked().unwrap_err().to_string().contains("gain = 0"));
    }
}
