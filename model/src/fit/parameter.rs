//! One parameter of a fitted model with its uncertainty.

use serde::{Deserialize, Serialize};

/// A parameter as it stands in reports, logs and `--json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Canonical name: `tau_eps`, `mu1`, `mu2`, `mu3`, `tau_sig`, `f0`, `f_offset`, `x_contact`.
    pub name: String,
    /// Value in `unit`.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Standard error in `unit`; `None` if held or not identified.
    pub std_error: Option<f64>,
    /// 95 % interval in `unit`; `None` if held or not identified.
    pub ci95: Option<[f64; 2]>,
    /// Whether the value was given, not fitted.
    pub is_fixed: bool,
}

/// Canonical names and units, in the order of every report.
pub const PARAMETERS: [(&str, &str); 8] = [
    ("tau_eps", "s"),
    ("mu1", "N/mm"),
    ("mu2", "N/mm^2"),
    ("mu3", "N/mm^3"),
    ("tau_sig", "N*s/mm^2"),
    ("f0", "N"),
    ("f_offset", "N"),
    ("x_contact", "mm"),
];
