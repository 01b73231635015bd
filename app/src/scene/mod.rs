//! A surface in three dimensions as egui draws it: triangles with a colour at each corner, back to front.
//!
//! [`camera`] says where points are in a picture and what is under the pointer, [`facets`] makes triangles of heights.
//! Both are pure, so a picture is the same on every computer.

pub mod camera;
pub mod facets;
