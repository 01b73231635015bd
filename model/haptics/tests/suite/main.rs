//! Ticks of touch through the crate's public door.
#![cfg(test)]

mod haptics_gear;
mod haptics_loop;
mod haptics_margin;
mod haptics_model;
mod haptics_system;
mod renderer;
mod scene;
mod surface_plan;
mod surface_shape;
mod surface_time;
mod surface_touch;
