//! Numbers as devices write them in their lines.

/// Digits of a reading: force gauges show five, 24-bit converters seven.
const DIGITS_MAX: usize = 8;
const DECIMALS_MAX: usize = 5;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedDecimal {
    /// Its digits without the point, signed.
    pub digits: i32,
    pub decimals: u8,
}

impl FixedDecimal {
    /// Reads digits with at most a minus before and a point within them: `+` is never sent (Model 7i user's guide, page
    /// 30, `OPOL`).
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let (sign, rest) = text.strip_prefix('-').map_or((1, text), |rest| (-1, rest));
        let (whole, part) = rest.split_once('.').unwrap_or((rest, ""));
        let is_point_last = rest.ends_with('.');
        let joined = format!("{whole}{part}");
        let is_number = !whole.is_empty()
            && !is_point_last
            && joined.len() <= DIGITS_MAX
            && part.len() <= DECIMALS_MAX
            && joined.bytes().all(|b| b.is_ascii_digit());
        if !is_number {
            return None;
        }
        Some(Self { digits: sign * joined.parse::<i32>().ok()?, decimals: part.len() as u8 })
    }

    #[must_use]
    pub fn step(self) -> f64 {
        10_f64.powi(-i32::from(self.decimals))
    }

    #[must_use]
    pub fn value(self) -> f64 {
        // Divided by a whole number, so that 4.285 is the double nearest to it.
        f64::from(self.digits) / 10_f64.powi(i32::from(self.decimals))
    }
}
