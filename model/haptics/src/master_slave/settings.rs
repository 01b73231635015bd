//! What a master-slave system is made of, and what makes none.

use crate::buzz::BuzzSettings;
use crate::contact::{ContactSettings, ContactThresholdError};
use crate::controller::ControllerSettings;
use crate::force::{LawError, LawSettings};
use crate::guard::GuardSettings;
use crate::margin::{Device, Watch};
use crate::observer::DELAY_MAX;
use crate::rig::{Encoder, EncoderError, GearError, MotorError, SlaveDrive};
use crate::torque::{TorqueError, TorqueSettings};
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Everything a master-slave system is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MasterSlaveSettings {
    /// The force law and the tick.
    pub law: LawSettings,
    /// Bounds of the force.
    pub guard: GuardSettings,
    /// The passivity controller; `None` for none. Its delay is that of the system.
    pub controller: Option<ControllerSettings>,
    /// What counts as a buzz; `None` for two counts above 8 Hz.
    pub buzz: Option<BuzzSettings>,
    /// Thresholds of contact.
    pub contact: ContactSettings,
    /// The master's encoder.
    pub encoder: Encoder,
    /// The slave's drive.
    pub slave: SlaveDrive,
    /// The master's motor and what drives it.
    pub torque: TorqueSettings,
    /// The master's own damping without its motor, in N s/mm, for the margin.
    pub damping: f64,
    /// Ticks from a count to the force made of it, for the margin; the controller takes the nearest whole number.
    pub delay_ticks: f64,
    /// Way of the slave from its start to the surface, in mm.
    pub surface_mm: f64,
}

impl MasterSlaveSettings {
    /// The source's hardware for a law, with the guards as they are by default, contact at 50 mN, the surface where the
    /// slave starts, and a count's force made within its tick.
    #[must_use]
    pub fn of(law: LawSettings) -> Self {
        let torque = TorqueSettings::default();
        let radius = torque.pinion.radius_mm();
        Self {
            law,
            guard: GuardSettings::default(),
            controller: Some(ControllerSettings::of(
                torque.motor.inertia_kg_mm2 / (radius * radius),
            )),
            buzz: None,
            contact: ContactSettings { on: Newtons(0.05), off: Newtons(0.02) },
            encoder: Encoder::default(),
            slave: SlaveDrive::default(),
            torque,
            damping: 0.0,
            delay_ticks: 0.0,
            surface_mm: 0.0,
        }
    }

    /// Way of the master per count, in mm.
    pub fn count_mm(&self) -> f64 {
        self.encoder.count_mm(&self.torque.pinion)
    }

    /// Whether they make a system.
    pub(super) fn checked(&self) -> Result<(), MasterSlaveError> {
        self.contact.checked()?;
        self.encoder.checked()?;
        self.torque.motor.checked()?;
        self.torque.checked()?;
        let device = [
            ("damping", self.damping, "N s/mm", f64::MAX),
            ("delay", self.delay_ticks, "ticks", DELAY_MAX as f64),
        ];
        for (name, value, unit, most) in device {
            if !(0.0..=most).contains(&value) {
                return Err(MasterSlaveError::Device { name, value, unit, most });
            }
        }
        if !self.surface_mm.is_finite() {
            return Err(MasterSlaveError::Surface(self.surface_mm));
        }
        Ok(())
    }

    /// The margin of these settings, for before play and during it.
    pub fn watch(&self) -> Watch {
        Watch {
            body: self.law.body,
            scheme: self.law.scheme,
            period: self.law.period,
            device: Device {
                damping: self.damping + self.torque.damping(),
                friction: self.torque.friction(),
                count_mm: self.count_mm(),
                delay_ticks: self.delay_ticks,
            },
        }
    }
}

/// Settings that make no system.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MasterSlaveError {
    /// The law.
    #[error(transparent)]
    Law(#[from] LawError),
    /// The thresholds.
    #[error(transparent)]
    Contact(#[from] ContactThresholdError),
    /// The encoder.
    #[error(transparent)]
    Encoder(#[from] EncoderError),
    /// The gear.
    #[error(transparent)]
    Gear(#[from] GearError),
    /// The motor.
    #[error(transparent)]
    Motor(#[from] MotorError),
    /// Its drive.
    #[error(transparent)]
    Torque(#[from] TorqueError),
    /// The device's own numbers.
    #[error("a master with {name} = {value} {unit} is not possible; it is from 0 to {most} {unit}")]
    Device {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The largest there is.
        most: f64,
    },
    /// The surface.
    #[error("the surface cannot be {0} mm from where the slave starts; give a finite distance")]
    Surface(f64),
}
