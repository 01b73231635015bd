//! Parsing of a typed query: days, and a line of words, words of fields, and conditions.

use super::condition::{Condition, ConditionError, is_sign};
use super::field::{FieldWords, SearchField};
use chrono::{DateTime, Days, NaiveDate, NaiveTime, Utc};
use palpate_model::quantity::base_unit;
use thiserror::Error;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum DayError {
    #[error(
        "this is neither a day nor a time; write a day like 2026-03-05, or a time like 2026-03-05T14:15:00Z"
    )]
    Form,
    #[error("the day is too far in the future; give an earlier day")]
    Late,
}

/// Parses a day or a time; the second value is whether it is a day.
fn parse_day_or_time(text: &str) -> Result<(DateTime<Utc>, bool), DayError> {
    let day = text.parse::<NaiveDate>();
    let day = day.map(|day| (day.and_time(NaiveTime::MIN).and_utc(), true));
    let time = DateTime::parse_from_rfc3339(text).map(|time| (time.to_utc(), false));
    day.or(time).map_err(|_| DayError::Form)
}

/// Start of a period: the beginning of a day in UTC, or a time.
pub fn parse_start(text: &str) -> Result<DateTime<Utc>, DayError> {
    parse_day_or_time(text).map(|(at, _)| at)
}

/// End of a period, exclusive: the beginning of the next day in UTC, or a time.
pub fn parse_end(text: &str) -> Result<DateTime<Utc>, DayError> {
    let (at, is_day) = parse_day_or_time(text)?;
    let next = at.checked_add_days(Days::new(u64::from(is_day)));
    next.ok_or(DayError::Late)
}

/// A typed line in its parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QueryLine {
    /// Words of any field.
    pub words: String,
    pub fields: Vec<FieldWords>,
    pub conditions: Vec<Condition>,
}

/// Whether a piece is the name of a field with its colon, whose words follow.
fn is_open_field(piece: &str) -> bool {
    piece.strip_suffix(':').and_then(SearchField::of_name).is_some()
}

/// Parses a line of words, words of fields and conditions in any order: `specimen:pig depth>=2cm fund`.
///
/// A piece with a sign of comparison is a condition, and one with a colon has words of a field. Spaces may surround the
/// sign, precede the unit and follow the colon. Quotes keep spaces within a piece: `specimen:"pig 7"`,
/// `"specimen.source=pig stomach"`.
pub fn parse_query_line(line: &str) -> Result<QueryLine, ConditionError> {
    let mut pieces: Vec<String> = Vec::new();
    for piece in split_unquoted(line) {
        let is_unit = base_unit(&piece).is_some();
        let joins = pieces.last().is_some_and(|before| {
            let has_open_end = before.ends_with(is_sign);
            let has_bare_number = before
                .rsplit(is_sign)
                .next()
                .is_some_and(|value| before.contains(is_sign) && value.parse::<f64>().is_ok());
            has_open_end
                || (is_open_field(before) && !piece.contains(is_sign))
                || piece.starts_with(is_sign)
                || piece.starts_with("!=")
                || (is_unit && has_bare_number)
        });
        match pieces.last_mut().filter(|_| joins) {
            Some(before) => before.push_str(&piece),
            None => pieces.push(piece),
        }
    }
    let (mut parts, mut words) = (QueryLine::default(), Vec::new());
    for piece in pieces {
        if piece.contains(is_sign) {
            parts.conditions.push(piece.parse()?);
        } else if let Some(field) = FieldWords::parse(&piece) {
            parts.fields.push(field?);
        } else {
            words.push(piece);
        }
    }
    parts.words = words.join(" ");
    Ok(parts)
}

/// Splits a line at spaces outside quotes.
fn split_unquoted(line: &str) -> Vec<String> {
    let (mut pieces, mut piece, mut is_within) = (Vec::new(), String::new(), false);
    for letter in line.chars() {
        match letter {
            '"' => is_within = !is_within,
            letter if letter.is_whitespace() && !is_within => {
                pieces.push(std::mem::take(&mut piece));
            }
            letter => piece.push(letter),
        }
    }
    pieces.push(piece);
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_day_is_included_and_a_time_is_exact() {
        let text = |at: Result<DateTime<Utc>, DayError>| at.map(|at| at.to_rfc3339());
        let day = |text: &str| Ok(format!("{text}T00:00:00+00:00"));
        assert_eq!(text(parse_start("2026-03-05")), day("2026-03-05"));
        assert_eq!(text(parse_end("2026-02-28")), day("2026-03-01"));
        let time = "2026-03-05T14:15:00+01:00";
        assert_eq!(text(parse_end(time)), Ok("2026-03-05T13:15:00+00:00".into()));
        for none in ["yesterday", "2026-02-30", "", "5.3.2026"] {
            assert_eq!(parse_start(none), Err(DayError::Form), "{none}");
        }
        assert_eq!(parse_end("+262142-12-31"), Err(DayError::Late));
    }

    #[test]
    fn words_fields_and_conditions_stand_in_one_line() {
        for (line, words, fields, conditions) in [
            ("", "", &[][..], &[][..]),
            ("  pig   fund ", "pig fund", &[], &[]),
            ("pig depth>=2cm fund", "pig fund", &[], &["depth>=2cm"]),
            ("depth >= 20 mm pig", "pig", &[], &["depth>=20mm"]),
            ("depth>= 20 depth <30", "", &[], &["depth>=20", "depth<30"]),
            ("depth=20 Ada", "Ada", &[], &["depth=20"]),
            ("mode != slow", "", &[], &["mode!=slow"]),
            ("\"stomach 7\" good!", "stomach 7 good!", &[], &[]),
            ("\"specimen.source=pig stomach\"", "", &[], &["specimen.source=pig stomach"]),
            ("specimen:pig depth>=20mm", "", &["specimen:pig"], &["depth>=20mm"]),
            ("tag: pilot ada specimen:\"pig 7\"", "ada", &["tag:pilot", "specimen:pig 7"], &[]),
            ("at 14:30 :x", "at 14:30 :x", &[], &[]),
        ] {
            let wanted: Vec<Condition> =
                conditions.iter().map(|one| one.parse().unwrap()).collect();
            let read = parse_query_line(line).unwrap();
            assert_eq!((read.words.as_str(), read.conditions), (words, wanted), "{line}");
            let read: Vec<String> = read.fields.iter().map(ToString::to_string).collect();
            assert_eq!(read, fields, "{line}");
        }
        for line in
            ["pig >=", "depth=", "= 3", "depth_mm>2cm", "specimen: depth>2", "tag:-", "specimn:pig"]
        {
            assert!(parse_query_line(line).is_err(), "{line}");
        }
    }
}
