//! Haptic devices that can be bought, behind [`HapticDevice`](palpate_haptics::HapticDevice).
//!
//! [`inverse`] is Haply's Inverse3 through its Inverse service, [`hapi`] Haply's 2DIY on a board at a serial port. [`fit`] brings a device's metres and axes to the scene's
//! millimetres, [`gate`] decides in every exchange whether the hand gets a force, and [`figures`] says what the margin
//! before play needs to know.
//!
//! A device on a wire has a thread of its own. The scene's loop hands over its newest force and takes the newest pose;
//! it neither waits nor locks nor allocates. Nothing here reads a clock: the caller hands one in.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod figures;
pub mod fit;
pub mod gate;
mod hand_over;
pub mod hapi;
mod http;
pub mod inverse;
mod linked;

pub use figures::{DeviceFigures, RoundTrip};
pub use fit::{DeviceAxis, FitError, WorkspaceFit};
pub use gate::{ForceGate, ForceLimits, ForceStop};
pub use hand_over::{DeviceMonitor, LinkReport, NO_POSE, SensedPose};
pub use hapi::{HapiError, HapiOptions, open_hapi};
pub use inverse::{InverseError, InverseOptions, open_inverse};
pub use linked::LinkedDevice;
