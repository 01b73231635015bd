//! Records as the load cell reported them: what the fit predicts is the signal in volts.
//!
//! `signal = curve(force) + zero(t) + noise`, with `curve` the calibration's volts of newtons. Noise is then what
//! the cell makes it, and the curve's flat stretch gives no bias: the force of a noisy voltage is not the force of
//! the mean voltage. The zero is a slow process that is seen wherever the probe touches nothing; the contact
//! position enters with the uncertainty with which the touches found it. After linearisation all of it is one
//! Gaussian problem. The zero is eliminated record by record, so that what is left has the columns of any other
//! record, and search, steps, sharing and profiles are the same.

mod drift;
mod pass;
mod zero;

pub(super) use drift::Drift;
use palpate_model::calibration::CalibrationCurve;
use palpate_model::units::{Seconds, Volts};

use super::sample::FitSample;

/// Mean of the signal over a short time in which the probe touches nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnloadedMean {
    /// The middle of that time, on the clock of the record; it may lie before its first sample.
    pub t: Seconds,
    pub volts: Volts,
    /// Samples in it.
    pub count: usize,
}

/// What the load cell reported during a record, and what is known of it otherwise.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Signal in V at each sample of the record.
    pub volts: Vec<f64>,
    /// The signal out of contact, in the order of time.
    pub unloaded: Vec<UnloadedMean>,
    pub curve: CalibrationCurve,
    /// Standard uncertainty in mm of the contact position, from which depths count.
    pub contact_error_mm: f64,
}

/// A record, with its signal where one was recorded.
#[derive(Clone, Copy, Debug)]
pub struct SignalRecord<'a> {
    pub name: &'a str,
    pub samples: &'a [FitSample],
    pub signal: Option<&'a Signal>,
}

/// A signal in a system of records.
#[derive(Clone, Copy, Debug)]
pub(super) struct SignalTerm<'a> {
    pub signal: &'a Signal,
    pub drift: Drift,
    /// Contact position in mm before the record was looked at.
    pub contact_mm: f64,
    /// Whether anything was known of it then.
    pub is_contact_known: bool,
}

impl<'a> SignalTerm<'a> {
    /// `None` where too little of the signal is out of contact to know the zero.
    pub fn new(record: SignalRecord<'a>, contact_mm: Option<f64>) -> Option<Self> {
        let signal = record.signal?;
        let (first, last) = (record.samples.first()?.t.0, record.samples.last()?.t.0);
        let times = || signal.unloaded.iter().map(|one| one.t.0);
        let (start, end) = (times().fold(first, f64::min), times().fold(last, f64::max));
        let drift = Drift::estimate(&signal.unloaded, start, end)?;
        let is_contact_known = contact_mm.is_some();
        let contact_mm = contact_mm.unwrap_or(0.0);
        let whole = Self { signal, drift, contact_mm, is_contact_known };
        (signal.volts.len() == record.samples.len()).then_some(whole)
    }
}
