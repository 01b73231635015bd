//! From the model to touch: what happens in one tick of a haptic loop, without the loop.
//!
//! A tick takes encoder counts and a load cell's force and gives pulses for the slave and a bias
//! voltage for the master's motor ([`MasterSlave`]). On its way are the force law ([`ForceLaw`]), what
//! keeps its force within bounds ([`ForceGuard`]), what sees and undoes energy that the loop makes
//! ([`PassivityObserver`], [`PassivityController`]), what hears a contact buzz ([`BuzzDetector`]) and,
//! before play, what damping the device must have ([`margin`]). [`closed_loop`] puts a simulated device and
//! hand around it.
//!
//! Everything in a tick is total (any input gives a finite answer, with [`Flags`] that say what was
//! wrong with it), deterministic to the bit, and free of allocation: states are [`Copy`] and made
//! beforehand. Time is counted in ticks.
//!
//! Units: mm, N, V, A, s. Energy is N mm = mJ, damping N s/mm, stiffness N/mm, torque N mm = mN m.
//! Mass is given in kg; in N s^2/mm that is a thousandth ([`inertia`]).
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod buzz;
mod calibrate;
pub mod check;
pub mod closed_loop;
mod contact;
mod controller;
pub mod device;
mod flags;
mod force;
mod guard;
pub mod margin;
mod master_slave;
mod observer;
mod period;
pub mod rig;
pub mod scene;
mod setting_error;
pub mod simulation;
pub mod surface;
mod torque;
pub mod triangles;

pub use buzz::{Buzz, BuzzDetector, BuzzSettings};
pub use calibrate::{BiasBranch, BiasCalibration, BiasError, BiasPoint};
pub use contact::{ContactDetector, ContactSettings, ContactThresholdError};
pub use controller::{ControllerSettings, ControllerTick, PassivityController};
pub use device::HapticDevice;
pub use flags::Flags;
pub use force::{ForceLaw, LawError, LawSettings, LawTick};
pub use guard::{ForceGuard, GuardSettings, GuardTick};
pub use master_slave::{
    MasterSlave, MasterSlaveError, MasterSlaveInput, MasterSlaveOutput, MasterSlaveSettings,
    MasterSlaveSnapshot,
};
pub use observer::{DELAY_MAX, PassivityObserver};
pub use period::{Period, PeriodError};
pub use setting_error::{SettingError, SettingRange};
pub use torque::{Converter, DriveKind, TorqueSettings, TorqueTick};

/// Mass in N s^2/mm of so many kg: 1 N = 1 kg m/s^2 = 1000 kg mm/s^2.
#[must_use]
pub fn inertia(kg: f64) -> f64 {
    kg * 1e-3
}
