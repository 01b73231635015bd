//! Sampling of the signal, and aliases that may appear in it.

use super::description::RigDescription;
use crate::units::Seconds;
use serde::{Deserialize, Serialize};

/// Mains frequencies in Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// Harmonics looked at: those that IEC 61000-4-7 has measured.
const HARMONICS: u32 = 40;
/// An alias below this frequency in Hz looks like tissue or drift: a ramp or a relaxation of 100 ms and longer.
const SLOW_HZ: f64 = 10.0;

/// Sampling of the load cell's signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignalFacts {
    /// Samples per second of true time.
    pub sample_rate_hz: f64,
    /// Anti-aliasing filter before the converter, in words.
    pub filter: String,
    /// Lowest and highest signal the converter can tell, in V; `None` without a converter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_v: Option<[f64; 2]>,
    /// One count of the converter in V.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution_v: Option<f64>,
    /// Possible aliases, in words.
    pub aliasing: String,
}

impl RigDescription {
    /// Time between two samples: a tick of the controller, or as many as the rig says.
    pub fn sample_interval(&self) -> Seconds {
        Seconds(self.tick().0 * self.ticks_per_sample.max(1.0))
    }

    pub fn signal(&self) -> SignalFacts {
        let rate = 1.0 / self.sample_interval().0;
        let filter = if self.settings.is_empty() {
            "not known: the rig does not state whether a filter is ahead of the converter"
        } else {
            "none: the simulated signal has no filter"
        };
        SignalFacts {
            sample_rate_hz: rate,
            filter: filter.into(),
            range_v: self.adc.map(|adc| {
                [adc.counts_min, adc.counts_max]
                    .map(|counts| f64::from(counts) * adc.volts_per_count)
            }),
            resolution_v: self.adc.map(|adc| adc.volts_per_count),
            aliasing: self.aliasing(rate),
        }
    }

    fn aliasing(&self, rate: f64) -> String {
        let nyquist = 0.5 * rate;
        let mut sentence = format!(
            "without a filter, signals above {nyquist:.0} Hz are aliased, such as motor steps at speeds above {:.2} mm/s",
            nyquist * self.mm_per_pulse
        );
        for mains in MAINS_HZ {
            let harmonics = (1..=HARMONICS).map(|n| f64::from(n) * mains);
            let worst = harmonics
                .filter(|hz| *hz > nyquist)
                .map(|hz| (hz, (hz - (hz / rate).round() * rate).abs()))
                .find(|(_, seen)| *seen < SLOW_HZ);
            if let Some((hz, seen)) = worst {
                sentence += &format!(
                    "; {hz:.0} Hz, a harmonic of the {mains:.0} Hz mains, would be aliased to {seen:.1} Hz"
                );
            }
        }
        sentence
    }
}

#[cfg(test)]
mod tests {
    use crate::rig::{AdcDescription, RigDescription};
    use crate::units::{MmPerS, MmPerS2, Position, Volts};

    fn rig(tick_nanos: u64) -> RigDescription {
        RigDescription {
            name: "bench".into(),
            identity: "bench".into(),
            settings: std::collections::BTreeMap::new(),
            mm_per_pulse: 0.015,
            travel: Position(100.0),
            tick_nanos,
            speed_quantum: MmPerS(0.03),
            speed_max: MmPerS(9.0),
            acceleration: MmPerS2(15.36),
            adc: Some(AdcDescription {
                counts_min: -32768,
                counts_max: 32767,
                volts_per_count: 0.001,
            }),
            noise_expected: Volts(0.001),
            pulse_lag: crate::units::Seconds(0.0),
            cell_delay: crate::units::Seconds(0.0),
            ticks_per_sample: 1.0,
            unseen_max: RigDescription::UNSEEN_USUAL,
            takes_targets: false,
            sensors: Default::default(),
        }
    }

    #[test]
    fn a_harmonic_on_the_sampling_rate_looks_like_an_offset() {
        let signal = rig(1_000_000).signal();
        assert!((signal.sample_rate_hz - 1000.0).abs() < 1e-9);
        assert_eq!(signal.range_v, Some([-32.768, 32.767]));
        // 20 x 50 Hz is the sampling rate itself; 17 x 60 Hz = 1020 Hz is seen at 20 Hz, which is no slow one.
        let text = &signal.aliasing;
        assert!(text.contains("above 500 Hz") && text.contains("7.50 mm/s"), "{text}");
        assert!(
            text.contains("1000 Hz") && text.contains("50 Hz") && text.contains("0.0 Hz"),
            "{text}"
        );
        assert!(signal.filter.starts_with("not known"));
    }

    #[test]
    fn another_clock_has_other_aliases() {
        // 976 us: 1024.59 Hz; 60 Hz x 17 = 1020 Hz is seen at 4.6 Hz, 50 Hz x 41 is beyond the list.
        let text = rig(976_000).signal().aliasing;
        assert!(
            text.contains("1020 Hz") && text.contains("60 Hz") && text.contains("4.6 Hz"),
            "{text}"
        );
    }

    #[test]
    fn a_clock_that_is_finer_than_its_samples_counts_samples() {
        let fine = RigDescription { ticks_per_sample: 2_000.0, ..rig(1_000) };
        assert!((fine.signal().sample_rate_hz - 500.0).abs() < 1e-9);
    }

    #[test]
    fn a_millisecond_has_as_many_samples_as_the_clock_means() {
        let ticks = [1_000_000, 976_000, 976_562, 2_000_000, 500_000, 50_000, 48_800];
        let samples = ticks.map(|tick| rig(tick).samples_per_ms());
        assert_eq!(samples, [1, 1, 1, 1, 2, 20, 20]);
    }
}
