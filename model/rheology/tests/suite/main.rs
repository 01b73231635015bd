//! Models and fits through the crate's public door.
#![cfg(test)]

mod abilities;
mod coverage;
mod curve_likelihood;
mod cycles;
mod expected;
#[cfg(feature = "extremes")]
mod extremes;
mod families;
mod fit_recovers;
mod honest;
mod joint;
mod live_fit;
mod master_curve;
mod maxwell;
mod messages;
mod random_bodies;
mod real_recordings;
mod select_picks;
mod signal;
