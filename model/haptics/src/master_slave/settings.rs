//! Settings of a master-slave system.

use crate::buzz::BuzzSettings;
use crate::contact::{ContactSettings, ContactThresholdError};
use crate::controller::ControllerSettings;
use crate::force::{LawError, LawSettings};
use crate::guard::GuardSettings;
use crate::margin::{LoopDevice, MarginSettings};
use crate::observer::DELAY_MAX;
use crate::rig::{Encoder, GearError, SlaveDrive};
use crate::setting_error::{SettingError, SettingRange};
use crate::torque::TorqueSettings;
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Everything a master-slave system is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MasterSlaveSettings {
    pub law: LawSettings,
    pub guard: GuardSettings,
    /// The passivity controller; `None` for none. Its delay is that of the system.
    pub controller: Option<ControllerSettings>,
    /// What counts as a buzz; `None` for two counts above 8 Hz.
    pub buzz: Option<BuzzSettings>,
    /// Thresholds of contact.
    pub contact: ContactSettings,
    pub encoder: Encoder,
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
        let damping = [("damping", self.damping, " N s/mm")];
        SettingRange::NotNegative.check("a master", &damping)?;
        let delay = [("delay", self.delay_ticks, " ticks")];
        SettingRange::UpTo(DELAY_MAX as f64).check("a master", &delay)?;
        if !self.surface_mm.is_finite() {
            return Err(MasterSlaveError::Surface(self.surface_mm));
        }
        Ok(())
    }

    /// The margin of these settings, for before play and during it.
    pub fn watch(&self) -> MarginSettings {
        MarginSettings {
            body: self.law.body,
            scheme: self.law.scheme,
            period: self.law.period,
            device: LoopDevice {
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
    #[error(transparent)]
    Law(#[from] LawError),
    #[error(transparent)]
    Contact(#[from] ContactThresholdError),
    #[error(transparent)]
    Gear(#[from] GearError),
    /// A number of encoder, motor, drive or master.
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(
        "the distance from the start of the slave to the surface is {0} mm; give a finite distance"
    )]
    Surface(f64),
}
