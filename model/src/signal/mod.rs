//! Signals: filters, the contact position, work, bounded histories for plots.

mod contact;
mod filter;
mod touch;
mod trace;
mod work;

pub use contact::{ContactError, ContactEstimate, ContactPoint, fit_contact};
pub use filter::MovingMean;
pub use touch::{TouchEstimate, TouchPoint, fit_touch};
pub use trace::{LiveTrace, TracePoint};
pub use work::work;
