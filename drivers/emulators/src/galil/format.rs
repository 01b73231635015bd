//! Numbers as a Galil controller holds and writes them.

/// Numbers have 32 bits before and 16 behind the point (DMC-40x0 user manual, variables).
const FRACTION: f64 = 65_536.0;
/// The largest number.
const LARGEST: f64 = 2_147_483_647.0 + 65_535.0 / FRACTION;

/// The number that the controller holds for a value.
pub fn quantise(value: f64) -> f64 {
    if value.is_nan() {
        return 0.0;
    }
    ((value * FRACTION).trunc() / FRACTION).clamp(-LARGEST, LARGEST)
}

/// How a number is written: `PF`, `VF` and the braces of `MG`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberFormat {
    /// Digits before the point.
    pub whole: usize,
    /// Digits behind it.
    pub decimals: usize,
    /// Whether leading zeros are written.
    pub has_zeros: bool,
    /// Whether it is hexadecimal.
    pub is_hex: bool,
}

impl NumberFormat {
    /// Decimals without leading zeros.
    pub const fn decimal(whole: usize, decimals: usize) -> Self {
        Self { whole, decimals, has_zeros: false, is_hex: false }
    }

    /// Reads the argument of `PF` and `VF`, such as 10.4 or -8.4: negative is hexadecimal.
    pub fn from_number(number: f64, has_zeros: bool) -> Self {
        let size = number.abs();
        Self {
            whole: (size.trunc() as usize).min(15),
            decimals: (((size.fract() * 10.0).round()) as usize).min(4),
            has_zeros,
            is_hex: number < 0.0,
        }
    }

    /// A number in this form. The first place is the sign's: a blank where it is positive, as in
    /// `HX= 1.0000 0.0000`, the answer of a DMC-4183 to `MG "HX=",_HX0,_HX1` (github.com/baileyji/M2FS-Control,
    /// `m2fscontrol/galil.py`). A number with too many digits is written as nines.
    pub fn write(self, value: f64) -> String {
        if self.is_hex {
            let bits = (value * FRACTION) as i64;
            let whole = self.whole.clamp(1, 8);
            let top = (bits >> 16) & ((1_i64 << (4 * whole)) - 1);
            let rest = (bits & 0xffff) as u64;
            return match self.decimals {
                0 => format!("${top:0whole$X}"),
                decimals => {
                    let rest = format!("{rest:04X}");
                    format!("${top:0whole$X}.{}", &rest[..decimals])
                }
            };
        }
        let digits = format!("{:.*}", self.decimals, value.abs());
        let (whole, rest) = digits.split_once('.').unwrap_or((&digits, ""));
        let (whole, rest) = if whole.len() > self.whole.max(1) {
            ("9".repeat(self.whole.max(1)), "9".repeat(rest.len()))
        } else if self.has_zeros {
            (format!("{whole:0>width$}", width = self.whole), rest.into())
        } else {
            (whole.to_owned(), rest.to_owned())
        };
        let is_zero = digits.bytes().all(|byte| matches!(byte, b'0' | b'.'));
        let sign = if value < 0.0 && !is_zero { '-' } else { ' ' };
        let point = if rest.is_empty() { "" } else { "." };
        format!("{sign}{whole}{point}{rest}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_captured_and_documented() {
        let vf = NumberFormat::decimal(10, 4);
        assert_eq!(vf.write(0.0), " 0.0000");
        assert_eq!(vf.write(-1.5), "-1.5000");
        assert_eq!(vf.write(-0.00001), " 0.0000");
        let pf = NumberFormat::decimal(10, 0);
        assert_eq!(pf.write(1234.0), " 1234");
        // DMC-1700/1800 user manual, page 84: `TP X` with leading zeros.
        let zeros = NumberFormat { has_zeros: true, ..pf };
        assert_eq!(zeros.write(0.0), " 0000000000");
        assert_eq!(NumberFormat::decimal(3, 2).write(12_345.0), " 999.99");
        assert_eq!(NumberFormat::from_number(-4.2, false).write(255.5), "$00FF.80");
        assert_eq!(NumberFormat::from_number(-4.0, false).write(-1.0), "$FFFF");
        assert_eq!(NumberFormat::from_number(10.4, false), vf);
    }

    #[test]
    fn numbers_have_sixteen_bits_behind_the_point() {
        assert_eq!(quantise(0.1), 6553.0 / 65_536.0);
        assert_eq!(quantise(1e300), LARGEST);
        assert_eq!(quantise(f64::NAN), 0.0);
        assert_eq!(quantise(-2.5), -2.5);
    }
}
