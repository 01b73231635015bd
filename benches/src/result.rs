//! What a participant found and how long it took.

use serde::{Deserialize, Serialize};
use std::time::Instant;

/// The parameters compared, with the values that made the record.
pub const BODY: [(&str, f64); 5] = [
    ("tau_eps", 1.023),
    ("mu1", 0.05333),
    ("mu2", -0.0086),
    ("mu3", 0.0004345),
    ("tau_sig", 0.06),
];

/// One fit of one record, in the order of [`BODY`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fit {
    /// Median wall time.
    pub seconds: f64,
    /// Parameter values.
    pub values: [f64; 5],
    /// Standard errors, where the participant gives them.
    pub std_errors: Option<[f64; 5]>,
}

impl Fit {
    /// Largest relative difference of a parameter to the values that made the record.
    pub fn error(&self) -> f64 {
        worst(&self.values, &BODY.map(|(_, exact)| exact))
    }

    /// Largest relative difference of a parameter to another fit's.
    pub fn difference(&self, other: &Self) -> f64 {
        worst(&self.values, &other.values)
    }
}

fn worst(values: &[f64; 5], exact: &[f64; 5]) -> f64 {
    let relative = values.iter().zip(exact).map(|(v, e)| (v / e - 1.0).abs());
    // A NaN is the worst of all.
    relative.fold(0.0, |worst: f64, next| {
        if next > worst || next.is_nan() {
            next
        } else {
            worst
        }
    })
}

/// Wall seconds of a piece of work, and its result.
#[expect(
    clippy::disallowed_methods,
    reason = "a benchmark is the one program whose result is the time it takes"
)]
pub fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

/// The middle of some times; NaN of none.
pub fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}
