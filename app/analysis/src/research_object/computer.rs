//! The kind of computer that a number was computed on, as far as the last digit depends on it.
//!
//! The fit itself has the same bits on every processor (decision 0005). Two things differ: the functions of the
//! system's mathematics library, whose last digit is not standardised (IEEE 754-2019, clause 9.2, only recommends
//! correct rounding), and products of matrices, which choose their kernel by the processor's vectors.

use palpate_sessions::text::sha256;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Two computers of one class give the same bits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ComputerClass {
    /// Such as `x86_64`.
    pub architecture: String,
    /// Such as `linux`.
    pub system: String,
    /// Widest vectors of the processor: a level of the x86-64 psABI, or empty elsewhere.
    pub vectors: String,
    /// First eight digits of the SHA-256 of what the functions of the mathematics library give.
    pub functions: String,
}

impl ComputerClass {
    /// The class of this computer.
    #[must_use]
    pub fn here() -> Self {
        Self {
            architecture: std::env::consts::ARCH.to_owned(),
            system: std::env::consts::OS.to_owned(),
            vectors: vectors().to_owned(),
            functions: functions(),
        }
    }
}

impl fmt::Display for ComputerClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.architecture, self.system)?;
        if !self.vectors.is_empty() {
            write!(f, ", vectors {}", self.vectors)?;
        }
        write!(f, ", functions {}", self.functions)
    }
}

#[cfg(target_arch = "x86_64")]
fn vectors() -> &'static str {
    use std::arch::is_x86_feature_detected as has;
    if has!("avx512f") && has!("avx512bw") && has!("avx512vl") {
        "x86-64-v4"
    } else if has!("avx2") && has!("fma") {
        "x86-64-v3"
    } else {
        "x86-64"
    }
}

#[cfg(not(target_arch = "x86_64"))]
const fn vectors() -> &'static str {
    ""
}

/// A function and, in it, what it is computed by here.
type Function = fn(f64) -> f64;

const FUNCTIONS: [Function; 18] = [
    |x| (-x).exp(),
    f64::exp,
    |x| (-x).exp_m1(),
    f64::ln,
    f64::ln_1p,
    f64::log10,
    f64::sin,
    f64::cos,
    f64::tan,
    f64::atan,
    f64::sinh,
    f64::cosh,
    f64::tanh,
    f64::cbrt,
    |x| x.powf(1.7),
    |x| x.powf(-0.3),
    |x| x.atan2(1.3),
    |x| x.hypot(0.7),
];

/// From a millionth to thirty, in equal ratios: enough arguments that two libraries that round differently anywhere
/// differ in one of them.
fn functions() -> String {
    let mut bits = Vec::new();
    let mut x = 1e-6;
    while x < 30.0 {
        bits.extend(FUNCTIONS.iter().flat_map(|function| function(x).to_bits().to_le_bytes()));
        x *= 1.0173;
    }
    sha256(&bits)[..8].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn class_is_the_same_each_time_and_says_what_it_is_of() {
        let here = ComputerClass::here();
        assert_eq!(here, ComputerClass::here());
        let words = here.to_string();
        assert!(words.starts_with(std::env::consts::ARCH), "{words}");
        assert!(words.ends_with(&here.functions) && here.functions.len() == 8, "{words}");
    }
}
