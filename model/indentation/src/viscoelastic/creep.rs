//! What a relaxation modulus says of creep and of sines, exactly.

use super::relaxation_modulus::{RelaxationMode, RelaxationModulus};
use crate::invalid_value::{InvalidValue, check, positive};
use palpate_model::viscoelastic::mittag_leffler;
use std::f64::consts::TAU;

/// A shear creep compliance `J(t) = instantaneous + sum of compliance (1 - E_alpha(-(t / time)^alpha))`, with the exponent of its
/// [`RelaxationModulus`]; where that is one, `E_1(-x) = exp(-x)`.
#[derive(Clone, Debug, PartialEq)]
pub struct CreepSeries {
    /// In 1/MPa.
    pub instantaneous_per_mpa: f64,
    /// From the shortest retardation time to the longest.
    pub terms: Vec<CreepTerm>,
    pub exponent: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CreepTerm {
    pub compliance_per_mpa: f64,
    /// Retardation time in s.
    pub time_secs: f64,
}

impl CreepSeries {
    /// The compliance in 1/MPa at a time in s after a step of stress.
    #[must_use]
    pub fn compliance(&self, time_secs: f64) -> f64 {
        let grown = |term: &CreepTerm| {
            let age = (time_secs / term.time_secs).powf(self.exponent);
            term.compliance_per_mpa * (1.0 - mittag_leffler(self.exponent, age))
        };
        self.instantaneous_per_mpa + self.terms.iter().map(grown).sum::<f64>()
    }
}

impl RelaxationModulus {
    /// Storage and loss modulus in MPa at a frequency in Hz.
    #[must_use]
    pub fn dynamic_moduli(&self, frequency_hz: f64) -> [f64; 2] {
        // The real and the imaginary part of z / (1 + z), with z the exponent's power of i times angle.
        let (sin, cos) = (0.25 * TAU * self.exponent).sin_cos();
        let of_term = |[storage, loss]: [f64; 2], term: &RelaxationMode| {
            let power = (TAU * frequency_hz * term.time_secs).powf(self.exponent);
            let share = term.modulus_mpa * power / (1.0 + 2.0 * power * cos + power * power);
            [storage + (power + cos) * share, loss + sin * share]
        };
        self.terms.iter().fold([self.equilibrium_mpa, 0.0], of_term)
    }

    /// The creep compliance of the same solid. The Laplace transforms of modulus and compliance, each times the variable, have
    /// the product one, so retardation times are where that of the modulus is zero: one behind each relaxation time (Park and
    /// Schapery, Int. J. Solids Struct. 36 (1999) 1653-1675, and Baumgaertel and Winter, Rheol. Acta 28 (1989) 511-519). With an
    /// exponent the same holds of the variable to its power.
    ///
    /// Refused without an equilibrium above zero, because what flows creeps without end.
    pub fn creep(&self) -> Result<CreepSeries, InvalidValue> {
        self.check()?;
        let wanted = "a modulus above 0 MPa, as of a solid";
        positive("the equilibrium modulus", self.equilibrium_mpa, wanted)?;
        let powered = |term: &RelaxationMode| RelaxationMode {
            time_secs: term.time_secs.powf(self.exponent),
            ..*term
        };
        let mut terms: Vec<RelaxationMode> =
            self.terms.iter().filter(|term| term.modulus_mpa > 0.0).map(powered).collect();
        terms.sort_by(|a, b| a.time_secs.total_cmp(&b.time_secs));
        for pair in terms.windows(2) {
            let time = pair[1].time_secs;
            let wanted = "times that differ from each other";
            check(time > pair[0].time_secs, "a relaxation time", time, wanted)?;
        }
        let sum: f64 = terms.iter().map(|term| term.modulus_mpa).sum();
        let term = |index: usize| {
            let longer = terms.get(index + 1).map_or(0.0, |next| 1.0 / next.time_secs);
            let rate = self.retardation_rate(&terms, [longer, 1.0 / terms[index].time_secs]);
            let slope = |one: &RelaxationMode| {
                let own = 1.0 / one.time_secs;
                one.modulus_mpa * own / (own - rate).powi(2)
            };
            let slope: f64 = terms.iter().map(slope).sum();
            let time_secs = rate.powf(-1.0 / self.exponent);
            CreepTerm { compliance_per_mpa: 1.0 / (rate * slope), time_secs }
        };
        Ok(CreepSeries {
            instantaneous_per_mpa: 1.0 / (self.equilibrium_mpa + sum),
            terms: (0..terms.len()).map(term).collect(),
            exponent: self.exponent,
        })
    }

    /// The rate between two rates of relaxation at which the transform of the modulus is zero; it falls all the way.
    fn retardation_rate(&self, terms: &[RelaxationMode], [mut low, mut high]: [f64; 2]) -> f64 {
        loop {
            let rate = 0.5 * (low + high);
            if rate <= low || rate >= high {
                return rate;
            }
            let part =
                |term: &RelaxationMode| term.modulus_mpa * rate / (1.0 / term.time_secs - rate);
            let is_above = self.equilibrium_mpa > terms.iter().map(part).sum::<f64>();
            if is_above { low = rate } else { high = rate }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(equilibrium_mpa: f64, terms: &[(f64, f64)]) -> RelaxationModulus {
        let term = |&(modulus_mpa, time_secs)| RelaxationMode { modulus_mpa, time_secs };
        RelaxationModulus {
            equilibrium_mpa,
            terms: terms.iter().map(term).collect(),
            exponent: 1.0,
        }
    }

    /// The standard linear solid: `1 / J` is `G` at both ends, and the retardation time is the relaxation time times `G(0)` over
    /// the equilibrium.
    #[test]
    fn one_term_has_its_closed_form() {
        let creep = series(0.01, &[(0.03, 2.0)]).creep().unwrap();
        assert!((creep.instantaneous_per_mpa - 25.0).abs() < 1e-12);
        assert!((creep.terms[0].time_secs - 8.0).abs() < 1e-12, "{creep:?}");
        assert!((creep.terms[0].compliance_per_mpa - 75.0).abs() < 1e-10, "{creep:?}");
        assert!((creep.compliance(1e9) - 100.0).abs() < 1e-10);
    }

    /// The integral of `G(t - s) J(s)` up to `t` is `t`, whatever the body; here by Simpson's rule.
    #[test]
    fn modulus_and_compliance_convolve_to_the_time() {
        let body = series(0.004, &[(0.03, 0.1), (0.02, 1.0), (0.015, 8.0)]);
        let creep = body.creep().unwrap();
        for pair in creep.terms.iter().zip(&body.terms) {
            assert!(pair.0.time_secs > pair.1.time_secs, "{creep:?}");
        }
        for t in [0.05, 0.7, 4.0, 40.0] {
            let steps = 200_000;
            let width = t / f64::from(steps);
            let integrand = |k: i32| {
                let s = width * f64::from(k);
                body.modulus(t - s) * creep.compliance(s)
            };
            let weight = |k: i32| match k {
                0 => 1.0,
                k if k == steps => 1.0,
                k if k % 2 == 1 => 4.0,
                _ => 2.0,
            };
            let sum: f64 = (0..=steps).map(|k| weight(k) * integrand(k)).sum();
            assert!((width / 3.0 * sum / t - 1.0).abs() < 1e-9, "{t}");
        }
    }

    /// A Maxwell element: `G i w tau / (1 + i w tau)`.
    #[test]
    fn sine_on_a_maxwell_element_has_its_closed_form() {
        let [storage, loss] = series(0.01, &[(0.03, 1.0 / TAU)]).dynamic_moduli(2.0);
        assert!((storage - (0.01 + 0.03 * 4.0 / 5.0)).abs() < 1e-15);
        assert!((loss - 0.03 * 2.0 / 5.0).abs() < 1e-15);
    }

    /// The fractional Zener model: with one term the retardation time is the relaxation time times the `alpha`-th root of `G(0)`
    /// over the equilibrium (Mainardi, 2010, section 3.2).
    #[test]
    fn one_fractional_term_has_its_closed_form() {
        let body = RelaxationModulus { exponent: 0.5, ..series(0.01, &[(0.03, 2.0)]) };
        let creep = body.creep().unwrap();
        assert!((creep.terms[0].time_secs - 32.0).abs() < 1e-11, "{creep:?}");
        assert!((creep.terms[0].compliance_per_mpa - 75.0).abs() < 1e-10, "{creep:?}");
        // E_(1/2)(-1) = e erfc(1), Abramowitz & Stegun, 7.1.
        let half = 0.427_583_576_155_807;
        assert!((body.modulus(2.0) - (0.01 + 0.03 * half)).abs() < 1e-15);
        assert!((creep.compliance(32.0) - (100.0 - 75.0 * half)).abs() < 1e-11);
        // sqrt(i) / (1 + sqrt(i)) = (1 + i (sqrt(2) - 1)) / 2.
        let [storage, loss] = body.dynamic_moduli(0.5 / TAU);
        assert!((storage - 0.025).abs() < 1e-15, "{storage}");
        assert!((loss - 0.015 * (2f64.sqrt() - 1.0)).abs() < 1e-15, "{loss}");
    }

    #[test]
    fn what_flows_has_no_such_series() {
        let refused = |body: RelaxationModulus| body.creep().unwrap_err().to_string();
        assert!(refused(series(0.0, &[(0.03, 1.0)])).contains("the equilibrium modulus is 0"));
        let twice = refused(series(0.01, &[(0.03, 1.0), (0.02, 1.0)]));
        assert!(twice.contains("a relaxation time is 1"), "{twice}");
        let steep = refused(RelaxationModulus { exponent: 1.2, ..series(0.01, &[(0.03, 1.0)]) });
        assert!(steep.contains("the exponent is 1.2"), "{steep}");
    }
}
