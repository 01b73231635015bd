//! Plots of the run in progress, drawn from points converted once per snapshot, and of recorded sessions, drawn
//! from the samples that are needed at the zoom shown.

pub mod course;
pub mod distribution;
pub mod figure;
pub mod margin;
pub mod navigate;
pub mod over_depth;
pub mod over_time;
mod run;
pub mod small;
pub mod stretches;
pub mod style;

pub use run::PlotCache;
