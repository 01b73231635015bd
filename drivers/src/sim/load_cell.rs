//! The simulated load cell: force to volts, with the faults of the cell it stands for.

use super::own_cell::OwnCell;
use super::random::{Random, RandomStream};
use super::settings::{SimProfile, SimSettings};
use palpate_model::calibration::{Calibration, CalibrationCurve};
use palpate_model::rig::AdcDescription;
use palpate_model::{Newtons, Seconds, Volts};

/// White noise of the lab cell's signal, rms: the last digit a bench voltmeter shows.
const LAB_NOISE: Volts = Volts(0.001);
/// The lab cell's zero drifts steadily by up to this much in V/s, either way: 0.2 mV per minute.
const DRIFT_RATE_MAX: f64 = 0.2e-3 / 60.0;
/// On top of it the zero wanders: a random walk of 0.05 mV per square root of a minute.
const WANDER_PER_SQRT_MINUTE: f64 = 0.05e-3;
/// Ticks between two steps of the wandering; each step is far below one converter count.
const WANDER_TICKS: u64 = 64;
/// The ideal cell's signal without load; the thesis's cell has the same.
const IDEAL_VOLTS_AT_ZERO: Volts = Volts(1.28);
/// Slope of the ideal cell in V/N: 9 N give 2.63 V, below the 2.80 V at which every run stops.
const IDEAL_VOLTS_PER_NEWTON: f64 = 0.15;
/// Range of the ideal cell's calibration.
const IDEAL_NEWTONS_MAX: Newtons = Newtons(10.0);

/// The lab cell's converter: 16 bits over +-10 V, 0.305 mV per count.
const LAB_ADC: AdcDescription =
    AdcDescription { counts_min: -32_768, counts_max: 32_767, volts_per_count: 20.0 / 65_536.0 };

/// What the laboratory's calibration of this profile's cell says.
pub fn calibration(profile: SimProfile) -> Calibration {
    match profile {
        SimProfile::Lab => Calibration::thesis(),
        SimProfile::Ideal => Calibration::linear(
            "Ideal simulated load cell",
            IDEAL_VOLTS_AT_ZERO,
            IDEAL_VOLTS_PER_NEWTON,
            IDEAL_NEWTONS_MAX,
        ),
    }
}

/// The converter of this profile's cell.
pub fn adc(profile: SimProfile) -> Option<AdcDescription> {
    (profile == SimProfile::Lab).then_some(LAB_ADC)
}

/// White noise of the signal at rest, rms.
pub fn noise_expected(settings: &SimSettings) -> Volts {
    match settings.profile {
        SimProfile::Lab => LAB_NOISE,
        SimProfile::Ideal => Volts(settings.noise.newtons().0 * IDEAL_VOLTS_PER_NEWTON),
    }
}

/// The cell, its amplifier and, in the lab, its converter.
#[derive(Clone, Debug)]
pub struct LoadCell {
    curve: CalibrationCurve,
    own: Option<OwnCell>,
    noise: Random,
    error: CellError,
}

#[derive(Clone, Debug)]
enum CellError {
    Lab { drift: Random, drift_per_tick: f64, wander_step: f64, wander: f64, ticks: u64 },
    Ideal { noise: Newtons },
}

impl LoadCell {
    /// The cell of a rig with these settings, sampled once per `tick`.
    pub fn new(settings: &SimSettings, tick: Seconds) -> Self {
        let curve = calibration(settings.profile)
            .curve()
            .expect("a built-in calibration table rises from step to step");
        let of_run = |cause| Random::of_repeat(settings.seed, settings.repeat, cause);
        let error = match settings.profile {
            SimProfile::Lab => {
                let mut drift = of_run(RandomStream::Drift);
                let rate = drift.between(-DRIFT_RATE_MAX, DRIFT_RATE_MAX);
                let step_minutes = WANDER_TICKS as f64 * tick.0 / 60.0;
                CellError::Lab {
                    drift,
                    drift_per_tick: rate * tick.0,
                    wander_step: WANDER_PER_SQRT_MINUTE * step_minutes.sqrt(),
                    wander: 0.0,
                    ticks: 0,
                }
            }
            SimProfile::Ideal => CellError::Ideal { noise: settings.noise.newtons() },
        };
        let own = OwnCell::of(settings, &curve);
        let curve = own.as_ref().map_or(curve, |own| own.curve.clone());
        Self { curve, own, noise: of_run(RandomStream::Noise), error }
    }

    /// Volts of newtons as they truly are.
    pub fn true_curve(&self) -> &CalibrationCurve {
        &self.curve
    }

    /// The signal under a force at the next tick, as counts where there is a converter.
    pub fn read(&mut self, force: Newtons) -> (Option<i32>, Volts) {
        let signal = self.signal(force);
        match self.error {
            CellError::Ideal { .. } => (None, signal),
            CellError::Lab { .. } => {
                let counts = counts_from_volts(signal, LAB_ADC);
                (Some(counts), volts_from_counts(counts, LAB_ADC))
            }
        }
    }

    /// The amplified signal under a force at the next tick, before any converter.
    pub fn signal(&mut self, force: Newtons) -> Volts {
        let noise = self.noise.normal();
        let force = self.own.as_mut().map_or(force, |own| own.lagged(force));
        match &mut self.error {
            CellError::Ideal { noise: rms } => {
                let noisy = Newtons(force.0 + rms.0 * noise);
                self.curve.volts_from_newtons(noisy)
            }
            CellError::Lab { drift, drift_per_tick, wander_step, wander, ticks } => {
                *ticks += 1;
                if ticks.is_multiple_of(WANDER_TICKS) {
                    *wander += *wander_step * drift.normal();
                }
                let zero_shift = *drift_per_tick * *ticks as f64 + *wander;
                let volts = self.curve.volts_from_newtons(force).0;
                Volts(volts + zero_shift + LAB_NOISE.0 * noise)
            }
        }
    }
}

/// The nearest count, or the end of the range.
pub fn counts_from_volts(volts: Volts, adc: AdcDescription) -> i32 {
    let counts = (volts.0 / adc.volts_per_count).round();
    // A float-to-integer cast saturates, and the range is inside i32.
    (counts as i32).clamp(adc.counts_min, adc.counts_max)
}

/// The signal a count stands for.
pub fn volts_from_counts(counts: i32, adc: AdcDescription) -> Volts {
    Volts(f64::from(counts) * adc.volts_per_count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(profile: SimProfile, seed: u64) -> LoadCell {
        let settings = SimSettings { profile, seed, ..SimSettings::default() };
        LoadCell::new(&settings, Seconds(0.001))
    }

    fn mean_and_rms(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        (mean, (square / values.len() as f64).sqrt())
    }

    #[test]
    fn the_lab_cell_reads_the_thesis_table() {
        let adc = LAB_ADC;
        let mut lab = cell(SimProfile::Lab, 5);
        for step in Calibration::thesis().steps {
            let volts: Vec<f64> = (0..4000)
                .map(|_| {
                    let (counts, volts) = lab.read(step.newtons());
                    assert_eq!(volts, volts_from_counts(counts.unwrap(), adc));
                    volts.0
                })
                .collect();
            let (mean, rms) = mean_and_rms(&volts);
            // 44 s of drift stay below 0.2 mV + 3 * 0.05 mV; the mean of 4000 is known to 0.016 mV.
            assert!((mean - step.volts.0).abs() < 0.4e-3, "{step:?} {mean}");
            assert!((rms - 1.0e-3).abs() < 0.06e-3, "{step:?} {rms}");
        }
    }

    #[test]
    fn the_lab_cell_drifts_as_documented() {
        let mut drifts = Vec::new();
        for seed in 0..12 {
            let mut lab = cell(SimProfile::Lab, seed);
            let mut mean = |count: u32| {
                (0..count).map(|_| lab.read(Newtons(0.0)).1.0).sum::<f64>() / f64::from(count)
            };
            let first = mean(10_000);
            mean(100_000);
            let drift = mean(10_000) - first;
            // 110 s: 0.37 mV of steady drift and four standard deviations of 0.07 mV wander.
            assert!(drift.abs() < 0.65e-3, "seed {seed}: {drift}");
            drifts.push(drift);
        }
        assert!(mean_and_rms(&drifts).1 > 0.05e-3, "{drifts:?}");
    }

    #[test]
    fn the_ideal_cell_has_white_force_noise_and_nothing_else() {
        let mut ideal = cell(SimProfile::Ideal, 9);
        let line = calibration(SimProfile::Ideal).curve().unwrap();
        let newtons: Vec<f64> = (0..100_000)
            .map(|_| {
                let (counts, volts) = ideal.read(Newtons(4.0));
                assert_eq!(counts, None);
                line.newtons_from_volts(volts).0 - 4.0
            })
            .collect();
        let (mean, rms) = mean_and_rms(&newtons);
        // Four standard errors: 0.02 / sqrt(1e5), 0.02 / sqrt(2e5).
        assert!(mean.abs() < 2.6e-4, "{mean}");
        assert!((rms - 0.02).abs() < 1.8e-4, "{rms}");
        let lag_one: f64 = newtons.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / 1e5 / 4e-4;
        assert!(lag_one.abs() < 0.013, "{lag_one}");
        assert!(line.volts_from_newtons(Newtons(9.0)).0 < 2.80);
    }

    #[test]
    fn the_converter_rounds_and_clips() {
        let adc = LAB_ADC;
        assert_eq!(counts_from_volts(Volts(0.49 * adc.volts_per_count), adc), 0);
        assert_eq!(counts_from_volts(Volts(0.51 * adc.volts_per_count), adc), 1);
        assert_eq!(counts_from_volts(Volts(11.0), adc), 32_767);
        assert_eq!(counts_from_volts(Volts(-1e12), adc), -32_768);
        let mut lab = cell(SimProfile::Lab, 2);
        assert_eq!(lab.read(Newtons(1e6)).0, Some(32_767));
    }
}
