//! The haptic loop: a thread that ticks at a fixed period, and how well it keeps to it.
//!
//! What happens in a tick is pure and lives in `palpate_haptics`; here are the thread ([`RealTimeLoop`]), its
//! priority ([`priority`]) and its measured times ([`timing`]). A tick neither allocates nor locks nor waits;
//! what others see of it is handed over by a triple buffer, of which the tick always has a part of its own.

pub mod device_recording;
mod guided_device;
mod loop_scene;
mod loop_thread;
mod mesh_frame;
pub mod scene;
pub mod scene_file;
pub mod scene_mesh;
mod simulated;
pub mod slave;
mod stylus;
pub mod timing;

pub use guided_device::{GuidedDevice, GuidedDeviceView, HandTarget, TRAIL, TrailPoint};
pub use loop_scene::{Laps, LoopScene};
pub use loop_thread::{LoopTask, RealTimeLoop};
pub use mesh_frame::{MeshFrame, SunkVertex};
pub use palpate_drivers::priority;
pub use scene::{SceneEnd, SceneFrame, SceneLoop};
pub use simulated::SimulatedMasterSlave;
pub use stylus::Stylus;
