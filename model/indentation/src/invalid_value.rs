//! Values that no law takes.

use thiserror::Error;

/// A value outside of what a law takes.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{name} is {value}; give {wanted}")]
pub struct InvalidValue {
    pub name: &'static str,
    pub value: f64,
    pub wanted: &'static str,
}

/// Refuses a value that is not finite or not above zero.
pub(crate) fn positive(
    name: &'static str,
    value: f64,
    wanted: &'static str,
) -> Result<(), InvalidValue> {
    check(value > 0.0 && value.is_finite(), name, value, wanted)
}

/// Refuses a value where `is_valid` is false.
pub(crate) fn check(
    is_valid: bool,
    name: &'static str,
    value: f64,
    wanted: &'static str,
) -> Result<(), InvalidValue> {
    if is_valid { Ok(()) } else { Err(InvalidValue { name, value, wanted }) }
}

/// Refuses a Poisson's ratio outside of what an isotropic specimen that grows no wider under tension can have.
pub(crate) fn check_poisson(poisson: f64) -> Result<(), InvalidValue> {
    check((0.0..=0.5).contains(&poisson), "Poisson's ratio", poisson, "a number from 0 to 0.5")
}
