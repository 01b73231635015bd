//! The master-slave rig of the source (chapter 5): a motor that drives a rack through a pinion, its encoder, the
//! gear to the slave's pulses, and a hand for simulation. In addition the linkage of a planar haptic device.

mod encoder;
mod gear;
mod hand;
mod motor;
mod pantograph;
mod rack;
mod thermal;

pub use encoder::{Encoder, EncoderCounter};
pub use gear::{Gear, GearError, GearRatio, GearTick, SlaveDrive};
pub use hand::{HandPath, SimulatedHand};
pub use motor::{DriveInput, Motor, MotorState};
pub use pantograph::Pantograph;
pub use rack::{Pinion, Rack, RackEnergies, RackForces};
pub use thermal::{Thermal, ThermalState};
