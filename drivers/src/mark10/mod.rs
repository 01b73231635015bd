//! Mark-10 force gauges, and the motorised stand ESM301 or ESM303 with one on it.
//!
//! Read [`protocol`] first: what gauges of Series 5 and 7i, and those that others sell under their names (Omega
//! DFG55, Checkline Series 5), say in the Gauge Control Language 2. [`gauge`] is a gauge on a line of its own,
//! [`stand`] a rig.

pub mod gauge;
pub mod protocol;
pub mod stand;

pub use gauge::GaugeSettings;
pub use stand::{StandDevice, StandRig, StandSettings};
