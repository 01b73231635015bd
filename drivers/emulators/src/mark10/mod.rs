//! An emulated Mark-10 gauge, and a stand with one on it.

mod gauge;
mod stand;

pub use gauge::{EmulatedGauge, EmulatedGaugeSettings};
pub use stand::{EmulatedStand, EmulatedStandSettings};
