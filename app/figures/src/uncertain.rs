//! Values with their uncertainty, rounded to what the uncertainty supports.

/// Smallest error that plain digits show: two significant digits in five decimals.
const SHORTEST_PLAIN_ERROR: f64 = 1e-4;

/// `value ± error`, the error to two significant digits and the value to the same decimal, in
/// one common power of ten where plain digits would be long (GUM 7.2.6: one or two digits).
#[must_use]
pub fn with_error(value: f64, error: f64) -> String {
    match Digits::of(value, error) {
        Some(digits) => digits.print(&[value, error], ["", " ± ", ""]),
        None => plain(value),
    }
}

/// `value [low, high]`, all in the digits that [`with_error`] finds for `value` and `error`.
#[must_use]
pub fn with_interval(value: f64, error: f64, ends: [f64; 2]) -> String {
    let ends = interval(ends, value, error);
    let alone = with_error(value, error);
    match alone.split_once(" ± ") {
        // `(4.120 ± 0.031)e-5` gives `4.120e-5`.
        Some((value, rest)) => {
            let power = rest.split_once(')').map_or("", |(_, power)| power);
            format!("{}{power} {ends}", value.trim_start_matches('('))
        }
        None => format!("{alone} {ends}"),
    }
}

/// `[low, high]` in the digits in which [`with_error`] prints `value` and `error`.
#[must_use]
pub fn interval([low, high]: [f64; 2], value: f64, error: f64) -> String {
    match Digits::of(value, error) {
        Some(digits) => digits.print(&[low, high], ["[", ", ", "]"]),
        None => format!("[{}, {}]", plain(low), plain(high)),
    }
}

/// An error by itself, to two significant digits.
#[must_use]
pub fn error_alone(error: f64) -> String {
    let Some(digits) = Digits::of(error, error) else {
        return plain(error);
    };
    let scaled = format!("{:.*}", digits.decimals, error / 10f64.powi(digits.exponent));
    match digits.exponent {
        0 => scaled,
        exponent => format!("{scaled}e{exponent}"),
    }
}

/// How many digits an error supports, and in which power of ten.
struct Digits {
    exponent: i32,
    decimals: usize,
}

impl Digits {
    /// `None` if there is no error to go by.
    fn of(value: f64, error: f64) -> Option<Self> {
        if !(value.is_finite() && error.is_finite() && error > 0.0) {
            return None;
        }
        let magnitude = value.abs().max(error).log10().floor() as i32;
        let are_digits_short = magnitude < 5 && error >= SHORTEST_PLAIN_ERROR;
        let exponent = if are_digits_short { 0 } else { magnitude };
        let scaled = error / 10f64.powi(exponent);
        // An error that six decimals do not show is one of rounding.
        if scaled < 5e-7 {
            return None;
        }
        Some(Self { exponent, decimals: (1 - scaled.log10().floor() as i32).clamp(0, 6) as usize })
    }

    /// Two numbers between three marks, in brackets where a power of ten is common to both.
    fn print(&self, numbers: &[f64; 2], [open, between, close]: [&str; 3]) -> String {
        let scale = 10f64.powi(self.exponent);
        let [a, b] = numbers.map(|number| format!("{:.*}", self.decimals, number / scale));
        match (self.exponent, open) {
            (0, _) => format!("{open}{a}{between}{b}{close}"),
            (exponent, "") => format!("({a}{between}{b})e{exponent}"),
            (exponent, _) => format!("{open}{a}{between}{b}{close}e{exponent}"),
        }
    }
}

/// A value whose uncertainty is not known: four significant digits.
#[must_use]
pub fn plain(value: f64) -> String {
    if !value.is_finite() {
        return "not a number".into();
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if (-3..5).contains(&magnitude) {
        let decimals = (3 - magnitude).clamp(0, 6) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

/// A number to so many significant digits, without an exponent where people write none.
#[must_use]
pub fn significant(value: f64, count: i32) -> String {
    let magnitude = value.abs().log10().floor();
    if !magnitude.is_finite() {
        return shortest(value);
    }
    let decimals = (f64::from(count) - 1.0 - magnitude).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// A number as short as it can be written, without the rounding of its arithmetic.
#[must_use]
pub fn shortest(value: f64) -> String {
    let rounded: f64 = format!("{value:.9e}").parse().unwrap_or(value);
    format!("{rounded}")
}

/// A span as minutes and seconds, `01:12`; hours where there are any.
#[must_use]
pub fn clock(seconds: f64) -> String {
    // A time left that cannot be known is no time left.
    let whole = if seconds.is_finite() { seconds.max(0.0).round() as u64 } else { 0 };
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes:02}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_do() {
        assert_eq!(shortest(49.0 * 0.03), "1.47");
        assert_eq!(shortest(8.1), "8.1");
        assert_eq!(significant(0.000_434_5, 4), "0.0004345");
        assert_eq!(significant(1234.5, 3), "1234");
        assert_eq!(significant(0.0, 3), "0");
    }

    #[test]
    fn the_error_rules_the_digits() {
        for (value, error, text) in [
            (1.023_47, 0.002_1, "1.0235 ± 0.0021"),
            (-0.5, 0.13, "-0.50 ± 0.13"),
            (41.235_4, 0.006, "41.2354 ± 0.0060"),
            (1234.5, 25.0, "1234 ± 25"),
            (19.657_28, 1e-9, "19.66"),
            (4.12e-5, 3.1e-7, "(4.120 ± 0.031)e-5"),
            (-0.008_732, 2.9e-6, "(-8.7320 ± 0.0029)e-3"),
            (0.985_73, 0.000_99, "0.98573 ± 0.00099"),
            (0.0, 2.0e-6, "(0.0 ± 2.0)e-6"),
            (5.0, f64::NAN, "5.000"),
        ] {
            assert_eq!(with_error(value, error), text);
        }
    }

    #[test]
    fn an_interval_has_the_digits_of_its_value() {
        for (ends, value, error, text) in [
            ([1.019_4, 1.027_6], 1.023_47, 0.002_1, "[1.0194, 1.0276]"),
            ([-8.737_8e-3, -8.726_3e-3], -0.008_732, 2.9e-6, "[-8.7378, -8.7263]e-3"),
            ([1185.2, 1283.8], 1234.5, 25.0, "[1185, 1284]"),
            ([0.5, 2.0], 1.0, 0.0, "[0.5000, 2.000]"),
        ] {
            assert_eq!(interval(ends, value, error), text);
            assert!(with_interval(value, error, ends).ends_with(text));
        }
    }

    #[test]
    fn a_value_before_its_interval_has_its_own_power() {
        for (value, error, ends, text) in [
            (1.023_47, 0.002_1, [1.0, 2.0], "1.0235 [1.0000, 2.0000]"),
            (4.12e-5, 3.1e-7, [4.0e-5, 5.0e-5], "4.120e-5 [4.000, 5.000]e-5"),
            (-0.008_732, 2.9e-6, [-0.009, 0.0], "-8.7320e-3 [-9.0000, 0.0000]e-3"),
        ] {
            assert_eq!(with_interval(value, error, ends), text);
        }
    }

    #[test]
    fn values_alone_show_four_digits() {
        for (value, text) in [
            (0.0, "0.000"),
            (0.012_345, "0.01235"),
            (7.5, "7.500"),
            (123_456.0, "1.235e5"),
            (f64::INFINITY, "not a number"),
        ] {
            assert_eq!(plain(value), text);
        }
    }

    #[test]
    fn spans_read_like_a_clock() {
        for (seconds, text) in [
            (0.2, "00:00"),
            (72.4, "01:12"),
            (3_671.0, "1:01:11"),
            (-3.0, "00:00"),
            (f64::NAN, "00:00"),
        ] {
            assert_eq!(clock(seconds), text);
        }
    }
}
