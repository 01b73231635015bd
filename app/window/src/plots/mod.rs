//! Plots of the run in progress, drawn from points converted once per snapshot, and of recorded sessions, drawn
//! from what is left of their samples at the zoom at hand.

pub mod course;
pub mod figure;
pub mod force_depth;
pub mod force_time;
pub mod margin;
pub mod navigate;
pub mod over_depth;
pub mod over_time;
mod points;
pub mod residual;
pub mod stretches;
pub mod strip;
pub(crate) mod style;

pub use points::{CycleLoop, PlotCache};
