//! The shortest protocol of each family that reaches wanted intervals.
//!
//! Speeds go down from the fastest that rig and force ceiling allow in steps of a fifth, each rounded
//! to what the rig makes. For each speed the shortest hold (or the smallest number of cycles) that
//! reaches every target is found by bisection. No randomness: the same question, the same answer.

use super::information::{ExpectedError, ExpectedPrecision, PARAMETER_NAMES, check_resolved};
use super::measurement::Measurement;
use super::protocol::ProtocolPath;
use super::rig::{DesignLimits, TURNS, allowed_speeds, has_tension};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use serde::Serialize;

/// Rest between presses in relaxation times: what is left of the first press is `e^-10`.
const REST_TAUS: f64 = 10.0;
/// Longest series of cycles.
const CYCLES_MAX: usize = 64;
/// Holds closer than this are the same.
const HOLD_RATIO: f64 = 1.003;

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PrecisionTarget {
    /// One of [`PARAMETER_NAMES`].
    pub parameter: &'static str,
    /// Half-width of its 95 % interval, in percent of its value.
    pub percent: f64,
}

impl PrecisionTarget {
    /// A target for a parameter by name; `tau` is short for `tau_eps`.
    pub fn new(name: &str, percent: f64) -> Result<Self, ExpectedError> {
        let full = if name == "tau" { "tau_eps" } else { name };
        let known = PARAMETER_NAMES.into_iter().find(|known| *known == full);
        let parameter =
            known.ok_or_else(|| ExpectedError::UnknownParameter { name: name.to_owned() })?;
        if percent > 0.0 && percent.is_finite() {
            Ok(Self { parameter, percent })
        } else {
            Err(ExpectedError::BadNumber { what: "target interval in percent", value: percent })
        }
    }
}

/// The kinds of protocol that are tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "family", rename_all = "kebab-case")]
pub enum ProtocolFamily {
    RampHold {
        speed: MmPerS,
        hold: Seconds,
    },
    /// Two ramps and holds, fitted together, with a rest out of the tissue between them.
    TwoSpeeds {
        speeds: [MmPerS; 2],
        hold: Seconds,
        rest: Seconds,
    },
    /// Loading and unloading between a shallower and a deeper turning point.
    Cycles {
        speed: MmPerS,
        between: [Depth; 2],
        count: usize,
    },
}

impl ProtocolFamily {
    pub fn protocol(&self, rig: &DesignLimits) -> ProtocolPath {
        let (depth, rate) = (rig.depth, rig.sample_rate_hz);
        match *self {
            Self::RampHold { speed, hold } => ProtocolPath::ramp_hold(speed, depth, hold, rate),
            Self::TwoSpeeds { speeds, hold, rest } => {
                ProtocolPath::two_speeds(speeds, depth, hold, rest, rate)
            }
            Self::Cycles { speed, between, count } => {
                ProtocolPath::cycles(speed, between, count, rate)
            }
        }
    }
}

/// The shortest protocol of one family that reaches every target.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProtocolProposal {
    #[serde(flatten)]
    pub family: ProtocolFamily,
    /// The precision it is expected to reach.
    #[serde(flatten)]
    pub expected: ExpectedPrecision,
    /// Why these settings, in words.
    pub reason: String,
}

/// Searches ramps and holds, pairs of speeds and cycles, in this order, and returns the shortest of
/// each family that reaches every target; a family that cannot is left out.
pub fn find_shortest_protocols(
    body: &ModifiedKelvin,
    measurement: Measurement<'_>,
    targets: &[PrecisionTarget],
    rig: &DesignLimits,
) -> Result<Vec<ProtocolProposal>, ExpectedError> {
    measurement.check()?;
    let speeds = allowed_speeds(&body.checked()?, rig)?;
    check_resolved(body.tau_eps, rig.sample_rate_hz, rig.duration_max.0)?;
    let mut search = Search { body, measurement, targets, rig, closest: None };
    for target in targets {
        let value = value_of(body, target.parameter);
        if value.abs() <= 0.0 {
            return Err(ExpectedError::ZeroParameter { name: target.parameter });
        }
    }
    let found = [search.ramp_hold(&speeds), search.two_speeds(&speeds), search.cycles(&speeds)];
    let proposals: Vec<ProtocolProposal> = found.into_iter().flatten().collect();
    match (proposals.is_empty(), search.closest) {
        (true, Some((_, target, reached))) => Err(ExpectedError::Unreachable {
            name: target.parameter,
            wanted: target.percent,
            reached: format!("{reached:.3}"),
            longest_s: rig.duration_max.0,
        }),
        (true, None) => Err(ExpectedError::Inseparable { names: PARAMETER_NAMES.join(", ") }),
        (false, _) => Ok(proposals),
    }
}

fn value_of(body: &ModifiedKelvin, name: &str) -> f64 {
    let values = [body.tau_eps, body.mu[0], body.mu[1], body.mu[2], body.tau_sig];
    PARAMETER_NAMES
        .iter()
        .zip(values)
        .find(|(known, _)| **known == name)
        .map_or(0.0, |(_, value)| value)
}

struct Search<'a> {
    body: &'a ModifiedKelvin,
    measurement: Measurement<'a>,
    targets: &'a [PrecisionTarget],
    rig: &'a DesignLimits,
    /// The smallest worst excess met, as interval over target, with the target and its interval.
    closest: Option<(f64, PrecisionTarget, f64)>,
}

type BestProtocol = Option<(ProtocolFamily, ExpectedPrecision)>;

impl Search<'_> {
    fn ramp_hold(&mut self, speeds: &[MmPerS]) -> Option<ProtocolProposal> {
        let mut best: BestProtocol = None;
        for &speed in speeds {
            let found = self.least_hold(&best, |hold| ProtocolFamily::RampHold { speed, hold });
            best = found.or(best);
        }
        let reason = match best.as_ref()?.0 {
            ProtocolFamily::RampHold { speed, .. } if speed == speeds[0] => {
                self.fastest_speed_words(speed)
            }
            _ => "a faster ramp needs a longer hold".to_owned(),
        };
        self.proposal(best, &reason)
    }

    fn proposal(&self, best: BestProtocol, reason: &str) -> Option<ProtocolProposal> {
        let (family, expected) = best?;
        let name = self.worst(&expected).map_or("nothing", |(target, _)| target.parameter);
        let reason = format!("{name} determines the duration; {reason}");
        Some(ProtocolProposal { family, expected, reason })
    }

    fn two_speeds(&mut self, speeds: &[MmPerS]) -> Option<ProtocolProposal> {
        let rest = Seconds(REST_TAUS * self.body.tau_eps);
        let mut best: BestProtocol = None;
        let coarse: Vec<MmPerS> = speeds.iter().copied().step_by(2).collect();
        for (index, &fast) in coarse.iter().enumerate() {
            for &slow in &coarse[index + 1..] {
                let found = self.least_hold(&best, |hold| ProtocolFamily::TwoSpeeds {
                    speeds: [slow, fast],
                    hold,
                    rest,
                });
                best = found.or(best);
            }
        }
        let reason = format!(
            "both records are fitted together, and the duration includes the rest of {:.1} s between them",
            rest.0
        );
        self.proposal(best, &reason)
    }

    fn cycles(&mut self, speeds: &[MmPerS]) -> Option<ProtocolProposal> {
        let mut best: BestProtocol = None;
        for &speed in speeds {
            for share in TURNS {
                let between = [Depth(share * self.rig.depth.0), self.rig.depth];
                let found = self.least_cycles(&best, speed, between);
                best = found.or(best);
            }
        }
        let reason = "each cycle turns back while the probe still presses, because tissue does not adhere to a probe";
        self.proposal(best, reason)
    }

    /// The shortest hold that reaches every target and beats `best`.
    fn least_hold(
        &mut self,
        best: &BestProtocol,
        family: impl Fn(Seconds) -> ProtocolFamily,
    ) -> BestProtocol {
        let limit = self.limit(best);
        let none = family(Seconds(0.0));
        let protocol = none.protocol(self.rig);
        let spare = (limit - protocol.duration().0) / protocol.presses.len() as f64;
        if spare < 0.0 {
            return None;
        }
        if let Some(expected) = self.evaluate(none) {
            return Some((none, expected));
        }
        let mut high = family(Seconds(spare));
        let mut found = (high, self.evaluate(high)?);
        let (mut low_secs, mut high_secs) = (1e-3 * self.body.tau_eps, spare);
        while high_secs > HOLD_RATIO * low_secs {
            let middle = (low_secs * high_secs).sqrt();
            high = family(Seconds(middle));
            match self.evaluate(high) {
                Some(expected) => (found, high_secs) = ((high, expected), middle),
                None => low_secs = middle,
            }
        }
        // A hold that a person can type; rounded up, it reaches what the exact one does.
        let rounded = family(Seconds(round_up(high_secs)));
        if rounded.protocol(self.rig).duration().0 <= limit
            && let Some(expected) = self.evaluate(rounded)
        {
            found = (rounded, expected);
        }
        Some(found)
    }

    fn least_cycles(
        &mut self,
        best: &BestProtocol,
        speed: MmPerS,
        between: [Depth; 2],
    ) -> BestProtocol {
        let limit = self.limit(best);
        let family = |count| ProtocolFamily::Cycles { speed, between, count };
        let secs = |count| family(count).protocol(self.rig).duration().0;
        if has_tension(self.body, &family(2).protocol(self.rig)) || secs(1) > limit {
            return None;
        }
        let per_cycle = secs(2) - secs(1);
        let most = (1.0 + (limit - secs(1)) / per_cycle).floor() as usize;
        let (mut low, mut high) = (0, most.min(CYCLES_MAX));
        let mut found = (family(high), self.evaluate(family(high))?);
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            match self.evaluate(family(middle)) {
                Some(expected) => (found, high) = ((family(middle), expected), middle),
                None => low = middle,
            }
        }
        Some(found)
    }

    fn limit(&self, best: &BestProtocol) -> f64 {
        let beaten = best.as_ref().map(|(_, expected)| expected.duration.0);
        beaten.unwrap_or(self.rig.duration_max.0)
    }

    /// The expected precision, if the force is allowed and every target is reached.
    fn evaluate(&mut self, family: ProtocolFamily) -> Option<ExpectedPrecision> {
        let protocol = family.protocol(self.rig);
        let expected = self.measurement.precision(self.body, &protocol).ok()?;
        // The rig's own limit is in force; what rounding adds is not.
        if expected.force_max.0 > self.rig.force_max.0 * (1.0 + 1e-9) {
            return None;
        }
        let (target, percent) = self.worst(&expected)?;
        let excess = percent / target.percent;
        if self.closest.is_none_or(|(closest, ..)| excess < closest) {
            self.closest = Some((excess, target, percent));
        }
        (excess <= 1.0).then_some(expected)
    }

    /// The target that is furthest from being reached, with the interval there is.
    fn worst(&self, expected: &ExpectedPrecision) -> Option<(PrecisionTarget, f64)> {
        let excess = |(target, percent): &(PrecisionTarget, f64)| percent / target.percent;
        self.targets
            .iter()
            .filter_map(|target| {
                let mut all = expected.parameters.iter();
                let found = all.find(|one| one.name == target.parameter)?;
                Some((*target, found.percent?))
            })
            .max_by(|one, other| excess(one).total_cmp(&excess(other)))
    }

    fn fastest_speed_words(&self, speed: MmPerS) -> String {
        if speed.0 + self.rig.speed_quantum.0 > self.rig.speed_max.0 * (1.0 + 1e-9) {
            format!("{} mm/s is the rig's fastest speed", displayed(speed))
        } else {
            format!(
                "{} mm/s is the fastest speed that keeps the force under {:.2} N",
                displayed(speed),
                self.rig.force_max.0
            )
        }
    }
}

/// A speed without the rounding of its multiplication.
fn displayed(speed: MmPerS) -> f64 {
    (speed.0 * 1e6).round() * 1e-6
}

/// The next number of three digits.
fn round_up(value: f64) -> f64 {
    let digits = 2 - value.log10().floor() as i32;
    // Dividing by a power of ten gives the nearest number to the decimal fraction; multiplying by a
    // negative power does not.
    if digits >= 0 {
        let scale = 10f64.powi(digits);
        (value * scale).ceil() / scale
    } else {
        let scale = 10f64.powi(-digits);
        (value / scale).ceil() * scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_are_rounded_up_to_what_a_person_types() {
        for (value, rounded) in [(12.301, 12.4), (0.012_31, 0.0124), (1234.0, 1240.0), (5.0, 5.0)] {
            assert!((round_up(value) / rounded - 1.0).abs() < 1e-12, "{value}");
        }
    }

    #[test]
    fn names_and_percentages_are_checked() {
        assert_eq!(PrecisionTarget::new("tau", 1.0).unwrap().parameter, "tau_eps");
        let text = PrecisionTarget::new("nu", 1.0).unwrap_err().to_string();
        assert!(text.contains("'nu'") && text.contains("mu3, tau_sig"), "{text}");
        assert!(PrecisionTarget::new("mu1", 0.0).is_err());
    }
}
