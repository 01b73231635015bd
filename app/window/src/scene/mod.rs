//! A surface in three dimensions as egui draws it: triangles with a colour at each corner, back to front.
//!
//! [`camera`] says where points are in a picture and what is under the pointer, [`facets`] makes triangles of heights,
//! [`hand`] moves the tool as the picture has it; all three are pure. [`view`] draws them, with the contact point, the
//! stylus and the force.

pub mod camera;
pub mod facets;
pub mod hand;
pub mod view;
