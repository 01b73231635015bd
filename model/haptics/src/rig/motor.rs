//! A direct-current motor with its drive.

use super::thermal::Thermal;
use crate::{SettingError, SettingRange};
use serde::{Deserialize, Serialize};

/// Motor constants. Torque is in N mm, which is mN m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motor {
    /// Resistance of the winding in ohm.
    pub resistance: f64,
    /// Inductance of the winding in H.
    pub inductance: f64,
    /// Torque per current, in N mm/A; a thousandth of it is the voltage per speed in V s/rad.
    pub torque_constant: f64,
    /// Coulomb friction in N mm.
    pub friction: f64,
    /// Inertia of the rotor in kg mm^2.
    pub inertia_kg_mm2: f64,
    /// Torque that it may give for ever, in N mm.
    pub continuous: f64,
    /// Largest voltage of its drive, in V.
    pub volts_max: f64,
    pub thermal: Thermal,
}

impl Motor {
    /// The source's motor, its 24 V column scaled from the legible 12 V one (0.16 ohm, 16.8 mN m/A, 8.1
    /// mN m, 110 mN m): constants double, resistance becomes four times as large. Inductance and inertia are in
    /// neither; 130 uH and 110 g cm^2 are of the size of the successor's 180 uH and 120 g cm^2.
    pub const SOURCE: Self = Self {
        resistance: 0.64,
        inductance: 130e-6,
        torque_constant: 33.6,
        friction: 8.1,
        inertia_kg_mm2: 11.0,
        continuous: 110.0,
        volts_max: 24.0,
        thermal: Thermal::SUCCESSOR,
    };

    /// Itself if its numbers are a motor's.
    pub fn checked(self) -> Result<Self, SettingError> {
        const MOTOR: &str = "a motor";
        let thermal = &self.thermal;
        let positive = [
            ("resistance", self.resistance, " ohm"),
            ("torque constant", self.torque_constant, " N mm/A"),
            ("inertia", self.inertia_kg_mm2, " kg mm²"),
            ("continuous torque", self.continuous, " N mm"),
            ("largest voltage", self.volts_max, " V"),
            ("thermal resistance of the winding", thermal.winding_case, " K/W"),
            ("thermal resistance of the case", thermal.case_air, " K/W"),
            ("time constant of the winding", thermal.winding_s, " s"),
            ("time constant of the case", thermal.case_s, " s"),
            ("largest temperature rise", thermal.winding_max_c - thermal.air_c, " K"),
        ];
        SettingRange::Positive.check(MOTOR, &positive)?;
        let rest = [("inductance", self.inductance, " H"), ("friction", self.friction, " N mm")];
        SettingRange::NotNegative.check(MOTOR, &rest)?;
        Ok(self)
    }

    /// Voltage per speed in V s/rad.
    pub fn back_emf(&self) -> f64 {
        self.torque_constant * 1e-3
    }

    /// Torque at a current, before friction.
    pub fn torque(&self, amps: f64) -> f64 {
        self.torque_constant * amps
    }

    /// Damping at the rack that a voltage drive adds, in N s/mm: the motor as a brake, `kM kE / (R r^2)`.
    pub fn voltage_damping(&self, radius_mm: f64) -> f64 {
        self.torque_constant * self.back_emf() / (self.resistance * radius_mm * radius_mm)
    }

    /// The current after `dt` s, the speed held over it: exact for the winding's own time constant.
    pub fn after(&self, state: MotorState, drive: DriveInput, omega: f64, dt: f64) -> MotorState {
        let emf = self.back_emf() * omega;
        let limit = |volts: f64| volts.clamp(-self.volts_max, self.volts_max);
        let settled = |volts: f64| (volts - emf) / self.resistance;
        let (amps, is_saturated) = match drive {
            DriveInput::Voltage(volts) => {
                let within = limit(volts);
                let to = settled(within);
                let share = if self.inductance > 0.0 {
                    -(-dt * self.resistance / self.inductance).exp_m1()
                } else {
                    1.0
                };
                (state.amps + (to - state.amps) * share, within != volts)
            }
            // The inner loop of a current drive is fast compared with a tick, but it is limited to its voltage.
            DriveInput::Current(amps) => {
                let within = amps.clamp(settled(-self.volts_max), settled(self.volts_max));
                (within, within != amps)
            }
        };
        MotorState { amps, is_saturated }
    }
}

/// The input of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveInput {
    /// Volts on the winding.
    Voltage(f64),
    /// Amperes through it.
    Current(f64),
}

/// The winding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorState {
    /// Current in A.
    pub amps: f64,
    /// Whether the drive is at its limit.
    pub is_saturated: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scaled_winding_agrees_with_itself() {
        let motor = Motor::SOURCE.checked().unwrap();
        // No-load current 8.1 / 33.6 = 0.241 A, 284 rpm/V from 33.6 mN m/A, 17.6 N s/m at 10 mm.
        assert!((motor.friction / motor.torque_constant - 0.241).abs() < 5e-4);
        let rpm_per_volt = 60.0 / (std::f64::consts::TAU * motor.back_emf());
        assert!((rpm_per_volt - 284.0).abs() < 0.5, "{rpm_per_volt}");
        assert!((motor.voltage_damping(10.0) * 1e3 - 17.64).abs() < 0.005);
        // The torque for ever and the heat agree within what such lines are rounded to.
        let amps = motor.continuous / motor.torque_constant;
        let hot = motor.thermal.settled(amps * amps * motor.resistance).winding_c;
        assert!((60.0..125.0).contains(&hot), "{hot}");
    }

    #[test]
    fn voltage_lags_by_the_winding_and_current_does_not() {
        let motor = Motor::SOURCE;
        let dt = motor.inductance / motor.resistance;
        let one = motor.after(MotorState::default(), DriveInput::Voltage(2.0), 0.0, dt);
        assert!((one.amps - 2.0 / 0.64 * (1.0 - (-1f64).exp())).abs() < 1e-12);
        let one = motor.after(MotorState::default(), DriveInput::Current(3.0), 10.0, dt);
        assert_eq!((one.amps, one.is_saturated), (3.0, false));
        // 24 V less the speed's own voltage is all there is.
        let one = motor.after(MotorState::default(), DriveInput::Current(100.0), 100.0, dt);
        assert!(one.is_saturated && (one.amps - (24.0 - 3.36) / 0.64).abs() < 1e-12);
        let one = motor.after(MotorState::default(), DriveInput::Voltage(-30.0), 0.0, 1.0);
        assert!(one.is_saturated && (one.amps + 37.5).abs() < 1e-12);
    }
}
