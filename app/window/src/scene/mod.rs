//! The picture of a scene: `palpate-tissue-view` draws surface and probe, egui the force and the words above them.
//!
//! [`camera`] says where points are on the screen and what is under the pointer, [`hand`] moves the tool as the picture
//! has it, [`look`] has the switches, [`detail`] the time of frames; all are pure. [`graphics`] reaches the adapter,
//! [`overlay`] paints above the picture, and [`view`] brings them together.

pub mod camera;
pub mod detail;
pub mod graphics;
pub mod hand;
pub mod look;
mod overlay;
pub mod view;
