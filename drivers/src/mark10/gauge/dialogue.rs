//! A gauge in progress: it sends readings by itself.
//!
//! The language has no checksum. A reading counts only with the unit and as many digits behind the point as when the
//! gauge was opened; a digit lost or changed before the point is not seen here, only as a jump of the force.

use crate::cell::{CellProtocol, CellReports, LineCell, silence_max};
use crate::mark10::protocol::{ForceUnit, GaugeForce, GaugeLine, GaugeReading};
use palpate_model::Nanos;
use palpate_model::rig::AdcDescription;
use palpate_model::units::Newtons;

/// Gauges show no number beyond 110 % of their capacity: a guess, to be checked on the device.
const RANGE: f64 = 1.1;

pub(crate) const BEYOND_RANGE: &str =
    "the force is beyond the gauge's range; take the load off before the gauge is damaged";

/// Conversion of readings to counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaugeScale {
    pub unit: ForceUnit,
    pub decimals: u8,
    /// Largest count of its range.
    pub counts_max: i32,
}

impl GaugeScale {
    #[must_use]
    pub fn new(like: GaugeReading, capacity: Newtons) -> Self {
        let per_count = like.unit.newtons() * like.number.step();
        // Saturates for a capacity beyond all counts.
        let counts_max = (RANGE * capacity.0 / per_count).round() as i32;
        Self { unit: like.unit, decimals: like.number.decimals, counts_max }
    }

    /// Volts of one count: one volt a newton.
    pub fn volts_per_count(&self) -> f64 {
        self.unit.newtons() * 10_f64.powi(-i32::from(self.decimals))
    }

    pub(crate) fn adc(&self) -> AdcDescription {
        AdcDescription {
            counts_min: -self.counts_max,
            counts_max: self.counts_max,
            volts_per_count: self.volts_per_count(),
        }
    }

    /// Counts of a force. An overload is the end of the range on the side of the last counts, so that every limit sees
    /// it. `None` for a reading with another unit or resolution.
    pub(crate) fn counts(&self, force: GaugeForce, last: i32) -> Option<i32> {
        match force {
            GaugeForce::Reading(GaugeReading { number, unit }) => {
                let is_same = unit == self.unit && number.decimals == self.decimals;
                is_same.then_some(number.digits)
            }
            GaugeForce::Overload if last < 0 => Some(-self.counts_max),
            GaugeForce::Overload => Some(self.counts_max),
        }
    }

    pub(crate) const fn is_beyond_range(&self, counts: i32) -> bool {
        counts.saturating_abs() >= self.counts_max
    }
}

pub type GaugeDialogue = LineCell<GaugeReadings>;

pub struct GaugeReadings {
    scale: GaugeScale,
    silence_max: Nanos,
    counts: i32,
}

impl GaugeDialogue {
    /// Goes on with a gauge that sends so many readings a second, from `now`.
    #[must_use]
    pub fn new(scale: GaugeScale, per_second: f64, now: Nanos) -> Self {
        let readings = GaugeReadings { scale, silence_max: silence_max(per_second), counts: 0 };
        Self::start(readings, now)
    }
}

impl CellProtocol for GaugeReadings {
    fn take(&mut self, now: Nanos, line: &str, reports: &mut CellReports) -> bool {
        let force = GaugeLine::parse(line).force();
        let Some(counts) = force.and_then(|force| self.scale.counts(force, self.counts)) else {
            return false;
        };
        self.counts = counts;
        reports.set_beyond_range(self.scale.is_beyond_range(counts), BEYOND_RANGE);
        reports.push_counts(now, None, counts, self.scale.volts_per_count());
        true
    }

    fn is_dead(&self, now: Nanos, newest: Nanos) -> Option<String> {
        (now.since(newest) > self.silence_max).then(|| {
            "the gauge has fallen silent; check its cable and battery, zero it and open the rig again"
                .into()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::CellDialogue;
    use crate::mark10::protocol::FixedDecimal;

    fn dialogue() -> GaugeDialogue {
        let like =
            GaugeReading { number: FixedDecimal::parse("0.000").unwrap(), unit: ForceUnit::Newton };
        GaugeDialogue::new(GaugeScale::new(like, Newtons(25.0)), 250.0, Nanos::ZERO)
    }

    #[test]
    fn one_volt_is_one_newton() {
        let mut dialogue = dialogue();
        dialogue.handle_bytes(Nanos(5), b"4.285 N\r\n-0.015 N\r\n");
        let sample = dialogue.take_sample().unwrap();
        assert_eq!((sample.counts, sample.at), (4285, Nanos(5)));
        assert!((sample.volts.0 - 4.285).abs() < 1e-12);
        assert_eq!(dialogue.take_sample().unwrap().counts, -15);
        assert_eq!(dialogue.garbled(), 0);
    }

    #[test]
    fn pounds_are_converted() {
        let like =
            GaugeReading { number: FixedDecimal::parse("-18.78").unwrap(), unit: ForceUnit::Pound };
        let scale = GaugeScale::new(like, Newtons(500.0));
        let mut dialogue = GaugeDialogue::new(scale, 10.0, Nanos::ZERO);
        dialogue.handle_bytes(Nanos(5), b"-18.78 lbF\r\n18.78 N\r\n");
        let sample = dialogue.take_sample().unwrap();
        assert!((sample.volts.0 + 18.78 * 4.448_221_615).abs() < 1e-6);
        assert_eq!((dialogue.take_sample(), dialogue.garbled()), (None, 1));
    }

    #[test]
    fn lines_with_other_units_or_digits_count_as_garbled() {
        let mut dialogue = dialogue();
        for line in ["4.285 mN", "4.28 N", "4285 N", "4.285N", "*10", "RS", "4.2\u{7f}5 N"] {
            dialogue.handle_bytes(Nanos(5), format!("{line}\r\n").as_bytes());
        }
        assert_eq!((dialogue.take_sample(), dialogue.garbled()), (None, 7));
    }

    #[test]
    fn beyond_its_range_it_reads_the_end_of_it() {
        let mut dialogue = dialogue();
        dialogue.handle_bytes(Nanos(1), b"-20.000 N\r\nOVER\r\nOVER\r\n27.500 N\r\n3.000 N\r\n");
        let counts: Vec<i32> =
            std::iter::from_fn(|| dialogue.take_sample()).map(|sample| sample.counts).collect();
        assert_eq!(counts, [-20_000, -27_500, -27_500, 27_500, 3_000]);
        assert!(dialogue.take_trouble().unwrap().contains("beyond"));
        assert_eq!(dialogue.take_trouble(), None);
    }

    #[test]
    fn silent_gauge_counts_as_gone() {
        let mut dialogue = dialogue();
        let at = Nanos::from_millis(500);
        dialogue.handle_bytes(at, b"0.000 N\r\n");
        assert_eq!(dialogue.is_dead(at + silence_max(1e3)), None);
        let later = at + silence_max(1e3) + Nanos(1);
        assert!(dialogue.is_dead(later).unwrap().contains("silent"));
    }
}
