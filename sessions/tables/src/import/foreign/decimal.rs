//! Numbers in text: detection of the decimal sign, and parsing.

palpate_model::named! {
    /// The decimal sign of a text.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DecimalSign {
        /// 1.5
        Point = "point",
        /// 1,5
        Comma = "comma",
    }
}

impl DecimalSign {
    /// The decimal sign, and the sign between groups of three digits.
    fn signs(self) -> (char, char) {
        match self {
            Self::Point => ('.', ','),
            Self::Comma => (',', '.'),
        }
    }
}

impl std::str::FromStr for DecimalSign {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "." | "point" => Ok(Self::Point),
            "," | "comma" => Ok(Self::Comma),
            _ => Err("give point or comma".into()),
        }
    }
}

/// Parses a number. The other sign may only separate groups of three digits.
pub(in crate::import) fn parse(cell: &str, decimal: DecimalSign) -> Option<f64> {
    let is_of_number = |c: char| c.is_ascii_digit() || "+-.,eE".contains(c);
    if cell.is_empty() || !cell.chars().all(is_of_number) {
        return None;
    }
    let (sign, grouping) = decimal.signs();
    let (whole, rest) = match cell.find(|c: char| c == sign || "eE".contains(c)) {
        Some(place) => cell.split_at(place),
        None => (cell, ""),
    };
    if rest.contains(grouping) || rest.matches(sign).count() > 1 {
        return None;
    }
    let mut text = String::with_capacity(cell.len());
    let mut groups = whole.split(grouping);
    let first = groups.next()?;
    text.push_str(first);
    let mut is_grouped = false;
    for group in groups {
        if group.len() != 3 || !group.bytes().all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        is_grouped = true;
        text.push_str(group);
    }
    let digits = first.trim_start_matches(['+', '-']);
    if is_grouped && !(1..=3).contains(&digits.len()) {
        return None;
    }
    text += &rest.replace(',', ".");
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Whether a cell is a number with either decimal sign.
pub(super) fn looks_numeric(cell: &str) -> bool {
    parse(cell, DecimalSign::Point).is_some() || parse(cell, DecimalSign::Comma).is_some()
}

/// What a cell reveals of the decimal sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::import) enum Evidence {
    /// It has no such sign or is not a number.
    None,
    /// It is a number only with this sign.
    Only(DecimalSign),
    /// Both signs give numbers, and different ones.
    Either,
}

pub(in crate::import) fn evidence(cell: &str) -> Evidence {
    let readings = [DecimalSign::Point, DecimalSign::Comma].map(|decimal| parse(cell, decimal));
    match readings {
        [Some(_), None] => Evidence::Only(DecimalSign::Point),
        [None, Some(_)] => Evidence::Only(DecimalSign::Comma),
        [Some(point), Some(comma)] if point.to_bits() != comma.to_bits() => {
            // A zero never precedes a group of thousands: 0,125 is an eighth.
            let digits = cell.trim_start_matches(['+', '-']);
            match digits.strip_prefix('0').and_then(|rest| rest.chars().next()) {
                Some('.') => Evidence::Only(DecimalSign::Point),
                Some(',') => Evidence::Only(DecimalSign::Comma),
                _ => Evidence::Either,
            }
        }
        _ => Evidence::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use DecimalSign::{Comma, Point};

    #[test]
    fn numbers_are_parsed_exactly_or_refused() {
        for (cell, point, comma) in [
            ("1.5", Some(1.5), None),
            ("-0,25", None, Some(-0.25)),
            ("1,234", Some(1234.0), Some(1.234)),
            ("1.234.567,5", None, Some(1_234_567.5)),
            ("1,234,567.5e-3", Some(1234.5675), None),
            ("+3E2", Some(300.0), Some(300.0)),
            (".5", Some(0.5), None),
            ("12.03.2024", None, None),
            ("1234,567", None, Some(1234.567)),
            ("1,23,456", None, None),
            ("1e999", None, None),
            ("inf", None, None),
            ("nan", None, None),
            ("", None, None),
            ("-", None, None),
            ("1e5,5", None, None),
            (",234", None, Some(0.234)),
        ] {
            assert_eq!((parse(cell, Point), parse(cell, Comma)), (point, comma), "{cell}");
        }
    }

    #[test]
    fn evidence_shows_the_only_possible_sign() {
        for (cell, expected) in [
            ("12", Evidence::None),
            ("text", Evidence::None),
            ("1,234", Evidence::Either),
            ("12.345", Evidence::Either),
            ("0,125", Evidence::Only(Comma)),
            ("-0.125", Evidence::Only(Point)),
            ("1,5", Evidence::Only(Comma)),
            ("1,234.5", Evidence::Only(Point)),
            ("1.234,5", Evidence::Only(Comma)),
        ] {
            assert_eq!(evidence(cell), expected, "{cell}");
        }
    }
}
