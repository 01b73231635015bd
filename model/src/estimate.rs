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
