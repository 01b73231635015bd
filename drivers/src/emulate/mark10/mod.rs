//! A Mark-10 gauge as it answers.

mod gauge;

pub use gauge::{EmulatedGauge, EmulatedGaugeSettings};
