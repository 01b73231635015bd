//! Fitted parameters as everybody speaks of them: who fits, who decides by a fit, who shows one.

use serde::{Deserialize, Serialize};

/// One parameter of a fitted model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    pub name: String,
    pub value: f64,
    /// The unit of value, error and interval.
    pub unit: String,
    /// Standard error, the memory of the residuals allowed for; `None` where it was fixed or not
    /// determined.
    pub std_error: Option<f64>,
    /// 95 % interval from Student's t.
    pub ci95: Option<[f64; 2]>,
    /// Whether it was kept at a given value.
    pub is_fixed: bool,
    /// Standard uncertainty that the calibration adds, the same in every repeat; `None` where it is not
    /// known or not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub systematic_error: Option<f64>,
    /// 95 % interval of everything that is known to be uncertain: the statistical interval and the systematic error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub total95: Option<[f64; 2]>,
    /// The independent sources of its uncertainty; empty where they are not told apart.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budget: Vec<BudgetEntry>,
}

impl FittedParameter {
    /// Whether the value, which takes the calibration as exact, lies outside of the total interval, which uses what the
    /// record tells of the calibration.
    #[must_use]
    pub fn is_displaced(&self) -> bool {
        self.total95.is_some_and(|[low, high]| self.value < low || self.value > high)
    }
}

/// One source of a parameter's uncertainty (JCGM 100:2008, "uncertainty budget").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BudgetEntry {
    pub source: String,
    /// Its standard uncertainty, in the unit of the parameter.
    pub error: f64,
}

/// Whether the record so far determines one parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identifiability {
    pub parameter: String,
    /// Whether path and noise so far determine it.
    pub is_identified: bool,
    /// If not, why and what would help, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Parameters estimated during a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveEstimate {
    /// The five of the body, then `f0` and `f_offset`. Without a standard error a parameter is not
    /// identified yet.
    pub parameters: Vec<FittedParameter>,
    /// Weighted root mean square residual in N.
    #[serde(alias = "rmse_n")]
    pub rmse_weighted_n: f64,
    /// Samples whose force was taken.
    pub samples: u64,
    /// One for each parameter, in their order; none in a session recorded before there were any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub verdicts: Vec<Identifiability>,
}

impl LiveEstimate {
    /// A parameter by name, if the record so far identifies it.
    pub fn identified_parameter(&self, name: &str) -> Option<&FittedParameter> {
        let is_refused =
            self.verdicts.iter().any(|verdict| verdict.parameter == name && !verdict.is_identified);
        self.parameters
            .iter()
            .find(|parameter| parameter.name == name)
            .filter(|parameter| parameter.std_error.is_some() && !is_refused)
    }
}

/// The 97.5 % point of Student's t: exact for 1 and 2 degrees of freedom, else the expansion of
/// Abramowitz & Stegun 26.7.5, good to 1e-2 at 3 and to 1e-4 from 6 on.
#[must_use]
pub fn student_t975(degrees_of_freedom: f64) -> f64 {
    let z: f64 = 1.959_963_984_540_054;
    let at = |from: f64, [high, low]: [f64; 2]| {
        let share = (1.0 / from - 1.0 / degrees_of_freedom) * from * (from + 1.0);
        high * (low / high).powf(share)
    };
    match degrees_of_freedom.floor() {
        ..1.0 => f64::NAN,
        // Between the exact values of 1, 2 and 3, straight in their logarithm over 1/n; the series is for more.
        ..2.0 => at(1.0, [12.706_204_736, 4.302_652_730]),
        ..3.0 => at(2.0, [4.302_652_730, 3.182_446_305]),
        _ => {
            let n = degrees_of_freedom;
            let (z3, z5) = (z.powi(3), z.powi(5));
            let (z7, z9) = (z.powi(7), z.powi(9));
            z + (z3 + z) / (4.0 * n)
                + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n.powi(2))
                + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n.powi(3))
                + (79.0 * z9 + 776.0 * z7 + 1482.0 * z5 - 1920.0 * z3 - 945.0 * z)
                    / (92160.0 * n.powi(4))
        }
    }
}

/// Standard uncertainties in half of a 95 % interval of a number of this variance: Student's t for as many degrees of freedom as
/// Welch's and Satterthwaite's formula gives where one standard uncertainty in it has its own and all others have infinitely many
/// (JCGM 100:2008, G.4.1).
#[must_use]
pub fn coverage_factor(uncertainty: f64, freedom: f64, variance: f64) -> f64 {
    // Where there is no variance the ratio is no number, and there is no share.
    let share = (uncertainty * uncertainty / variance).max(0.0);
    student_t975(freedom / (share * share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_quantiles_match_the_table() {
        for (n, exact, allowed) in [
            (3.0, 3.182_446, 1.5e-2),
            (6.0, 2.446_912, 1e-3),
            (10.0, 2.228_139, 1e-4),
            (30.0, 2.042_272, 1e-6),
            (1000.0, 1.962_339, 1e-6),
        ] {
            assert!((student_t975(n) - exact).abs() < allowed, "{n}");
        }
    }
}
