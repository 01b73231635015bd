//! Plots of the run in progress, drawn from points converted once per snapshot.

pub mod course;
pub mod force_depth;
pub mod force_time;
pub mod log_scatter;
mod points;
pub mod residual;
pub(crate) mod style;

pub use points::{CycleLoop, PlotCache};
