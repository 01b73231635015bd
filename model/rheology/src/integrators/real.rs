//! The two precisions in which an integrator can run.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `f64` or `f32`.
pub trait Real:
    Copy
    + PartialOrd
    + std::fmt::Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + sealed::Sealed
{
    const ZERO: Self;
    /// Far below the last digit of any force, far above the subnormal numbers, which are slow.
    const NEGLIGIBLE: Self;
    /// The nearest number to a double.
    fn of(value: f64) -> Self;
    fn to_f64(self) -> f64;
    /// Whether it is neither infinite nor NaN.
    fn is_finite(self) -> bool;
    fn abs(self) -> Self;
}

mod sealed {
    pub trait Sealed {}
}

macro_rules! real {
    ($real:ty, $negligible:expr) => {
        impl sealed::Sealed for $real {}

        impl Real for $real {
            const ZERO: Self = 0.0;
            const NEGLIGIBLE: Self = $negligible;
            #[inline]
            fn of(value: f64) -> Self {
                value as $real
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                self.is_finite()
            }
            #[inline]
            fn abs(self) -> Self {
                self.abs()
            }
        }
    };
}

real!(f64, palpate_model::viscoelastic::NEGLIGIBLE);
real!(f32, 1e-30);

/// The force with its rounding error carried along, as in the exact step of the families: at small
/// steps an increment is below the last digit of the force long before the force has settled.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompensatedForce<R> {
    pub value: R,
    carry: R,
}

impl<R: Real> CompensatedForce<R> {
    pub fn new(value: R) -> Self {
        Self { value, carry: R::ZERO }
    }

    /// A filter left alone decays for ever. Cold, so that the check stays a branch beside the sum
    /// instead of a choice within it.
    #[cold]
    fn faded() -> Self {
        Self::new(R::ZERO)
    }

    /// The value after `weighted - share * value` is added.
    #[inline]
    pub fn relaxed(self, weighted: R, share: R) -> Self {
        let increment = weighted - share * self.value + self.carry;
        let value = self.value + increment;
        if value.abs() < R::NEGLIGIBLE {
            return Self::faded();
        }
        Self { value, carry: increment - (value - self.value) }
    }
}
