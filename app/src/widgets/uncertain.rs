//! Values with their uncertainty, rounded to what the uncertainty supports.

/// Smallest error that plain digits show: two significant digits in five decimals.
const SHORTEST_PLAIN_ERROR: f64 = 1e-4;

/// `value ± error`, the error to two significant digits and the value to the same decimal, in
/// one common power of ten where plain digits would be long (GUM 7.2.6: one or two digits).
#[must_use]
pub fn with_error(value: f64, error: f64) -> String {
    if !(value.is_finite() && error.is_finite() && error > 0.0) {
        return plain(value);
    }
    let magnitude = value.abs().max(error).log10().floor() as i32;
    let are_digits_short = magnitude < 5 && error >= SHORTEST_PLAIN_ERROR;
    let exponent = if are_digits_short { 0 } else { magnitude };
    let scale = 10f64.powi(exponent);
    let (value, error) = (value / scale, error / scale);
    let decimals = (1 - error.log10().floor() as i32).clamp(0, 6) as usize;
    if exponent == 0 {
        format!("{value:.decimals$} ± {error:.decimals$}")
    } else {
        format!("({value:.decimals$} ± {error:.decimals$})e{exponent}")
    }
}

/// A value whose uncertainty is not known: four significant digits.
#[must_use]
pub fn plain(value: f64) -> String {
    if !value.is_finite() {
        return "not a number".into();
    }
    let magnitude = if value == 0.0 {
        0
    } else {
        value.abs().log10().floor() as i32
    };
    if (-3..5).contains(&magnitude) {
        let decimals = (3 - magnitude).clamp(0, 6) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

/// A span as minutes and seconds, `01:12`; hours where there are any.
#[must_use]
pub fn clock(seconds: f64) -> String {
    // A time left that cannot be known is no time left.
    let whole = if seconds.is_finite() {
        seconds.max(0.0).round() as u64
    } else {
        0
    };
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
    fn the_error_rules_the_digits() {
        for (value, error, text) in [
            (1.023_47, 0.002_1, "1.0235 ± 0.0021"),
            (-0.5, 0.13, "-0.50 ± 0.13"),
            (41.235_4, 0.006, "41.2354 ± 0.0060"),
            (1234.5, 25.0, "1234 ± 25"),
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
