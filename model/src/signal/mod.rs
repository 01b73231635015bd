//! Signals: filters, the contact position, work, bounded histories and thinning for plots.

mod contact;
mod filter;
pub mod polyline;
pub mod pyramid;
mod touch;
mod trace;
pub mod track;
mod work;

pub use contact::{ContactEstimate, ContactFitError, ContactPoint, fit_contact};
pub use filter::MovingMean;
pub use touch::{ContactSearchPoint, TouchEstimate, fit_touch};
pub use trace::{LiveTrace, TracePoint};
pub use work::work;
