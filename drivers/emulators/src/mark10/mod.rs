//! A Mark-10 gauge as it answers, and a stand with one on it.

mod gauge;
mod stand;

pub use gauge::{EmulatedGauge, EmulatedGaugeSettings};
pub use stand::{EmulatedStand, EmulatedStandSettings};
