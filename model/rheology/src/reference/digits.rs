//! Numbers of many binary digits.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;

/// A number that carries its precision; results take that of their arguments.
pub(super) type Big = FBig<HalfEven, 2>;

/// Makes numbers of one precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Digits {
    bits: usize,
}

impl Digits {
    /// At least so many decimal digits, log2(10) = 3.32 bits each.
    pub const fn decimal(digits: usize) -> Self {
        Self { bits: digits * 3322 / 1000 + 1 }
    }

    pub fn bits(self) -> usize {
        self.bits
    }

    /// The number a finite double stands for, exactly; zero for one that is not finite, which the
    /// borders of this module refuse.
    pub fn exact(self, value: f64) -> Big {
        let value = Big::try_from(value).unwrap_or(Big::ZERO);
        value.with_precision(self.bits).value()
    }

    pub fn whole(self, value: usize) -> Big {
        Big::from(value).with_precision(self.bits).value()
    }

    pub fn zero(self) -> Big {
        self.whole(0)
    }
}

/// The nearest double; infinite where there is none.
pub(super) fn nearest(value: &Big) -> f64 {
    value.to_f64().value()
}

pub(super) fn is_zero(value: &Big) -> bool {
    *value == Big::ZERO
}

pub(super) fn is_negative(value: &Big) -> bool {
    *value < Big::ZERO
}
