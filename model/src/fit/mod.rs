//! Identification of force models.

mod live;
mod parameter;

pub use live::{LiveEstimate, LiveFit};
pub use parameter::{PARAMETERS, Parameter};
