//! Records as the load cell reported them: what the fit predicts is the signal in volts.
//!
//! `signal = curve(force) + zero(t) + noise`, with `curve` the calibration's volts of newtons. Noise is then what
//! the cell makes it, and the curve's flat stretch gives no bias: the force of a noisy voltage is not the force of
//! the mean voltage. The zero is a slow process that is seen wherever the probe touches nothing; the contact
//! position enters with the uncertainty with which the touches found it. After linearisation all of it is one
//! Gaussian problem. The zero is eliminated record by record, so that what is left has the columns of any other
//! record, and search, steps, sharing and profiles are the same.

mod compliance;
mod drift;
mod expected;
mod lag;
mod pass;
mod zero;

pub use compliance::{PressedSignal, estimate_zero, fit_compliance_to_signal};
pub(super) use drift::{Drift, DriftSizes};
pub use expected::ExpectedSignal;
use palpate_model::calibration::{CalibrationCurve, HysteresisLoop};
use palpate_model::units::{Newtons, Seconds, Volts};

use super::sample::FitSample;
use std::ops::Range;
use std::sync::Arc;

/// About the force at which a search for contact ends: enough to be felt, too little to deform.
const TOUCH_FORCE: Newtons = Newtons(0.15);

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
    /// How far the load cell lags behind its force; `None` where its calibration does not tell.
    pub hysteresis: Option<HysteresisLoop>,
    /// Where the contact position is now known to lie, in mm from where depths count from.
    pub contact_shift_mm: f64,
    /// Standard uncertainty in mm of the contact position, from which depths count, if the zero did nothing but
    /// drift steadily while it was searched.
    pub contact_error_mm: f64,
    /// Time in s over which it was searched.
    pub search_secs: f64,
}

/// A record, with its signal where one was recorded.
#[derive(Clone, Copy, Debug)]
pub struct SignalRecord<'a> {
    pub name: &'a str,
    pub samples: &'a [FitSample],
    pub signal: Option<&'a Signal>,
}

/// A signal in a system of records.
#[derive(Clone, Debug)]
pub(super) struct SignalTerm<'a> {
    pub signal: &'a Signal,
    /// What is possible where the probe touches nothing, and what is taken.
    pub sizes: DriftSizes,
    pub drift: Drift,
    /// Contact position in mm before the record was looked at.
    pub contact_mm: f64,
    /// Its standard uncertainty in mm, the wandering of the zero included; `None` where nothing was known of it.
    pub contact_error_mm: Option<f64>,
}

/// Where an error of the calibration acts.
#[derive(Clone, Debug)]
pub(super) struct ErrorPlace {
    pub record: usize,
    /// Samples of the record.
    pub samples: Range<usize>,
    /// Modelled force in N.
    pub force: f64,
    /// What the load cell lags behind it, as a share of half the width of its loop.
    pub lag: f64,
}

/// Errors of calibrations and compliances that are found with the parameters, none where these are taken as exact.
#[derive(Clone, Debug, Default)]
pub(super) struct ErrorColumns {
    pub count: usize,
    /// Changes of the force in N, by record and mean.
    pub columns: Arc<Vec<Vec<Vec<f64>>>>,
    /// Each error as found so far: the curve is straight around it.
    pub found: Vec<f64>,
}

impl<'a> SignalTerm<'a> {
    /// `None` where too little of the signal is out of contact to know the zero.
    pub fn new(record: SignalRecord<'a>, contact_mm: Option<f64>) -> Option<Self> {
        let signal = record.signal?;
        let (first, last) = (record.samples.first()?.t.0, record.samples.last()?.t.0);
        let times = || signal.unloaded.iter().map(|one| one.t.0);
        let (start, end) = (times().fold(first, f64::min), times().fold(last, f64::max));
        let sizes = DriftSizes::of(&signal.unloaded, start, end)?;
        let drift = sizes.mean()?;
        let mut whole = Self {
            signal,
            sizes,
            drift,
            contact_error_mm: contact_mm,
            contact_mm: contact_mm.unwrap_or(0.0) + signal.contact_shift_mm,
        };
        whole.take(drift, record.samples);
        (signal.volts.len() == record.samples.len()).then_some(whole)
    }

    /// Of a signal whose noise, wandering and contact position, at depth 0, are known to be so large.
    fn given(signal: &'a Signal, drift: Drift, contact_error_mm: f64) -> Self {
        Self {
            signal,
            sizes: DriftSizes::given(&drift),
            drift,
            contact_mm: 0.0,
            contact_error_mm: Some(contact_error_mm),
        }
    }

    /// Takes noise and wandering of these sizes, with what they make of the contact position.
    fn take(&mut self, drift: Drift, samples: &[FitSample]) {
        self.drift = drift;
        let wander = wander_mm(samples, self.signal, &drift);
        let error = self.signal.contact_error_mm.hypot(wander);
        self.contact_error_mm = self.contact_error_mm.map(|_| error);
    }
}

/// Error in mm of a contact position from the wandering of the zero while it was searched. A random walk of variance
/// `q^2` per second leaves a straight line by `q^2 T / 15` in the mean over a time `T`, and a force in error by so much
/// meets the tissue so much sooner or later, by the stiffness at the force at which a search ends.
fn wander_mm(samples: &[FitSample], signal: &Signal, drift: &Drift) -> f64 {
    let volts = drift.walk * (signal.search_secs / 15.0).sqrt();
    let force = volts / signal.curve.sensitivity_at(Newtons(0.0));
    let is_pressed =
        |one: &&FitSample| one.is_measured() && one.force > TOUCH_FORCE && one.depth.0 > 0.0;
    let touched = samples.iter().find(is_pressed);
    touched.map_or(0.0, |one| force * one.depth.0 / one.force.0)
}
