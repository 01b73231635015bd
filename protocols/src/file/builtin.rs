//! The protocols that come with the program: files like any other, and the examples to copy.

use super::Protocol;
use super::document::text_crc32;
use super::problem::{ProtocolProblem, nearest};

macro_rules! built_in {
    ($($name:literal)*) => {
        /// Name and text of every built-in protocol, in the order of a day's work.
        pub const BUILT_IN: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../builtin/", $name, ".toml")))),*
        ];
    };
}

built_in! {
    "daily-check"
    "load-cell-calibration"
    "zeroing"
    "check-home"
    "stiff-surface"
    "preconditioning"
    "preconditioning-force"
    "ramp-hold"
    "validation-series"
    "relaxation-series"
    "multi-step-relaxation"
    "creep"
    "sine"
    "frequency-sweep"
    "free-jog"
}

/// The built-in protocol of a name, `None` if there is none.
#[must_use]
pub fn built_in(name: &str) -> Option<Result<Protocol, Vec<ProtocolProblem>>> {
    let (_, text) = BUILT_IN.iter().find(|(known, _)| *known == name)?;
    Some(Protocol::read(text))
}

/// Whether a plan of this name was written out from the text of the built-in protocol, by the CRC-32 of its text: a file
/// may have any name.
#[must_use]
pub fn is_built_in(plan_name: &str, crc32: Option<&str>) -> bool {
    let known = BUILT_IN.iter().find(|(name, _)| *name == plan_name);
    known.is_some_and(|(_, text)| crc32 == Some(&text_crc32(text)))
}

/// The built-in name nearest to one that is not known, for a hint; `None` if nothing is near.
#[must_use]
pub fn nearest_built_in(name: &str) -> Option<&'static str> {
    nearest(name, BUILT_IN.iter().map(|(known, _)| *known))
}
