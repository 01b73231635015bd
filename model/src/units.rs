//! Units as types: mm, N, V, s. A number crosses a crate boundary only inside one of these,
//! so a depth cannot be taken for a machine position nor a voltage for a force.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::{Add, Neg, Sub};

macro_rules! unit {
    ($(#[$doc:meta])* $name:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub f64);

        impl $name {
            pub const UNIT: &'static str = $unit;
            /// The bare number, in the unit of this type.
            #[must_use]
            pub const fn get(self) -> f64 { self.0 }
            #[must_use]
            pub fn is_finite(self) -> bool { self.0.is_finite() }
            #[must_use]
            pub fn abs(self) -> Self { Self(self.0.abs()) }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match f.precision() {
                    Some(digits) => write!(f, "{:.*} {}", digits, self.0, $unit),
                    None => write!(f, "{} {}", self.0, $unit),
                }
            }
        }
    };
}

macro_rules! linear {
    ($($name:ident),*) => {$(
        impl Add for $name { type Output = Self; fn add(self, other: Self) -> Self { Self(self.0 + other.0) } }
        impl Sub for $name { type Output = Self; fn sub(self, other: Self) -> Self { Self(self.0 - other.0) } }
        impl Neg for $name { type Output = Self; fn neg(self) -> Self { Self(-self.0) } }
    )*};
}

unit!(
    /// Force in newtons, positive in compression.
    Newtons, "N"
);
unit!(
    /// Load-cell signal in volts.
    Volts, "V"
);
unit!(
    /// A span of time in seconds.
    Seconds, "s"
);
unit!(
    /// Machine position in millimetres from home, positive towards the tissue.
    Position, "mm"
);
unit!(
    /// Indentation depth in millimetres from contact, positive into the tissue.
    Depth, "mm"
);
unit!(
    /// Speed in millimetres per second.
    MmPerS, "mm/s"
);
unit!(
    /// Acceleration in millimetres per second squared.
    MmPerS2, "mm/s2"
);

linear!(Newtons, Volts, Seconds, Depth);

impl Position {
    /// The depth of this position when contact is at `contact`.
    #[must_use]
    pub fn depth_from(self, contact: Self) -> Depth {
        Depth(self.0 - contact.0)
    }

    /// This position moved by a signed distance in mm.
    #[must_use]
    pub fn moved_by(self, distance_mm: f64) -> Self {
        Self(self.0 + distance_mm)
    }

    /// Signed distance in mm from `other` to here.
    #[must_use]
    pub fn distance_from(self, other: Self) -> f64 {
        self.0 - other.0
    }
}

impl Depth {
    /// The machine position of this depth when contact is at `contact`.
    #[must_use]
    pub fn position_from(self, contact: Position) -> Position {
        Position(contact.0 + self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_and_position_are_inverse() {
        let contact = Position(41.25);
        let depth = Position(71.25).depth_from(contact);
        assert_eq!(depth, Depth(30.0));
        assert_eq!(depth.position_from(contact), Position(71.25));
    }

    #[test]
    fn display_carries_the_unit() {
        assert_eq!(format!("{:.2}", Newtons(5.5914)), "5.59 N");
        assert_eq!(format!("{}", MmPerS(0.75)), "0.75 mm/s");
    }
}
