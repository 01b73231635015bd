//! Ticks of touch through the crate's public door.
#![cfg(test)]

mod haptics_gear;
mod haptics_loop;
mod haptics_margin;
mod haptics_model;
mod haptics_system;
mod mesh_build;
mod mesh_files;
mod mesh_materials;
mod mesh_neighbourhood;
mod mesh_scene;
mod mesh_support;
mod mesh_touch;
mod mesh_walks;
mod messages;
mod renderer;
mod scene;
mod surface_plan;
mod surface_shape;
mod surface_time;
mod surface_touch;
