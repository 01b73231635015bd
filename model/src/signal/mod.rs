//! Signals: filters, the contact position, bounded histories for plots.

mod contact;
mod filter;
mod trace;

pub use contact::{ContactError, ContactEstimate, ContactPoint, fit_contact};
pub use filter::MovingMean;
pub use trace::{LiveTrace, TracePoint};
