//! The records every participant fits.

use palpate_rheology::fit::FitSample;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_test_support::record::{noisy, ramp_hold, respond};
use std::io::Write;
use std::path::Path;

/// Seed of the noise.
const SEED: u64 = 1;
/// Standard deviation of the noise in N, as `respond` states it for each sample.
pub const NOISE_N: f64 = 0.02;
/// Length of the thesis protocol in s: 0.75 mm/s to 30 mm, then a hold of 50 s.
pub const LENGTH_S: f64 = 90.0;

/// The thesis protocol on the thesis body, twice.
pub struct Records {
    /// The exact force.
    pub noiseless: Vec<FitSample>,
    /// With seeded white noise.
    pub noisy: Vec<FitSample>,
}

impl Records {
    /// `intervals + 1` samples.
    pub fn new(intervals: u32) -> Self {
        let noiseless = noiseless(intervals);
        let noisy = noisy(&noiseless, SEED);
        Self { noiseless, noisy }
    }

    /// Writes t, depth, force, noisy force, one array after the other, as little-endian doubles.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let columns: [Vec<f64>; 4] = [
            self.noiseless.iter().map(|sample| sample.t.0).collect(),
            self.noiseless.iter().map(|sample| sample.depth.0).collect(),
            self.noiseless.iter().map(|sample| sample.force.0).collect(),
            self.noisy.iter().map(|sample| sample.force.0).collect(),
        ];
        for value in columns.iter().flatten() {
            file.write_all(&value.to_le_bytes())?;
        }
        file.flush()
    }
}

/// The noiseless record alone.
pub fn noiseless(intervals: u32) -> Vec<FitSample> {
    let dt = LENGTH_S / f64::from(intervals);
    let path = ramp_hold(0.75, LENGTH_S - 40.0, dt);
    respond(&ModifiedKelvin::THESIS, &path)
}
