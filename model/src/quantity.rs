//! Numbers with units, as people write them: `0.75 mm/s`, `3 min`, `0.01 N/min`. One table of units for
//! protocol files, and for whoever looks for a value in them.

/// A unit: its symbol, and `times / over` of the base unit of its quantity. Both are whole numbers, so that
/// decimal values stay what they say.
type Unit = (&'static str, f64, f64);

/// Every unit by quantity; the first is the base unit, in which numbers are kept.
const UNITS: [&[Unit]; 9] = [
    &[("mm/s", 1.0, 1.0), ("mm/min", 1.0, 60.0), ("um/s", 1.0, 1e3), ("µm/s", 1.0, 1e3)],
    &[("mm", 1.0, 1.0), ("cm", 10.0, 1.0), ("um", 1.0, 1e3), ("µm", 1.0, 1e3)],
    &[("N", 1.0, 1.0), ("mN", 1.0, 1e3)],
    &[("s", 1.0, 1.0), ("ms", 1.0, 1e3), ("min", 60.0, 1.0), ("h", 3600.0, 1.0)],
    &[("g", 1.0, 1.0), ("kg", 1e3, 1.0)],
    &[("Hz", 1.0, 1.0), ("mHz", 1.0, 1e3)],
    &[("N/s", 1.0, 1.0), ("N/min", 1.0, 60.0), ("mN/s", 1.0, 1e3), ("mN/min", 1.0, 6e4)],
    &[("V", 1.0, 1.0), ("mV", 1.0, 1e3)],
    &[("°C", 1.0, 1.0), ("degC", 1.0, 1.0)],
];

fn row_of(unit: &str) -> Option<&'static [Unit]> {
    let has = |units: &&&[Unit]| units.iter().any(|(known, ..)| *known == unit);
    UNITS.iter().find(has).copied()
}

/// Every unit of the same quantity, the base unit first; empty for what is no unit.
#[must_use]
pub fn units_like(unit: &str) -> Vec<&'static str> {
    let units = row_of(unit).unwrap_or_default();
    units.iter().map(|(unit, ..)| *unit).collect()
}

/// The base unit that numbers of this unit are kept in.
#[must_use]
pub fn base_unit(unit: &str) -> Option<&'static str> {
    Some(row_of(unit)?[0].0)
}

/// A number of a unit, in the base unit.
#[must_use]
pub fn in_base_unit(number: f64, unit: &str) -> Option<f64> {
    let found = row_of(unit)?.iter().find(|(known, ..)| *known == unit);
    found.map(|(_, times, over)| number * times / over)
}

/// The finite number a text begins with, and what follows it without the blanks around.
#[must_use]
pub fn split(text: &str) -> Option<(f64, &str)> {
    let bytes = text.as_bytes();
    let digits_from = |start: usize| {
        let rest = bytes.iter().skip(start);
        start + rest.take_while(|byte| byte.is_ascii_digit() || **byte == b'.').count()
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mut end = digits_from(sign);
    // An exponent only if digits follow: "2 eggs" are no power.
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits_from(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    let number: f64 = text.get(..end)?.parse().ok()?;
    number.is_finite().then(|| (number, text[end..].trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_kept_in_the_first_unit() {
        assert_eq!(split("3 min"), Some((3.0, "min")));
        assert_eq!(split("2 eggs"), Some((2.0, "eggs")));
        assert_eq!(split("-1e-3mm"), Some((-1e-3, "mm")));
        assert_eq!(split("none"), None);
        assert_eq!(in_base_unit(3.0, "min"), Some(180.0));
        assert_eq!(in_base_unit(45.0, "mm/min"), Some(0.75));
        assert_eq!(base_unit("µm"), Some("mm"));
        assert_eq!(base_unit("furlong"), None);
        assert_eq!(units_like("mN"), ["N", "mN"]);
        assert!(units_like("").is_empty());
    }
}
