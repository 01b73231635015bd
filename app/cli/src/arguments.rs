//! Values of arguments that several commands share.

use super::{Failure, steps};
use chrono::{DateTime, Utc};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use palpate_model::typed_number::plain_text;
use palpate_runner::wall_now;
use std::str::FromStr;

/// A word, the value it stands for, and its help.
pub(super) type Choice<T> = (&'static str, T, &'static str);

/// Accepts the words of a table.
pub(super) fn choice<T: Clone + Send + Sync + 'static>(
    table: &'static [Choice<T>],
) -> impl TypedValueParser<Value = T> {
    let words = table.iter().map(|(word, _, help)| PossibleValue::new(*word).help(*help));
    PossibleValuesParser::new(words).try_map(|text| {
        let row = table.iter().find(|(word, ..)| *word == text);
        row.map(|(_, value, _)| value.clone()).ok_or("this is not one of the allowed values")
    })
}

/// A finite number, or one sentence.
pub(super) fn parse_number(text: &str) -> Result<f64, String> {
    let plain = plain_text(text).map_err(|err| err.to_string())?;
    match plain.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("this is not a finite number; give a number such as 0.75".into()),
    }
}

/// A finite number above 0, or one sentence.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match parse_number(text)? {
        value if value > 0.0 => Ok(value),
        _ => Err("this is not a positive number; give a number such as 0.75".into()),
    }
}

/// Refuses a number that is not above 0 and up to `max`.
pub(super) fn above_zero(flag: &str, value: f64, max: f64, unit: &str) -> Result<f64, Failure> {
    if value > 0.0 && value <= max {
        return Ok(value);
    }
    Err(Failure::usage(format!(
        "--{flag} {value} is out of range; give a number above 0 and up to {max} {unit}"
    )))
}

/// Parses the names of `--columns`.
pub(super) fn parse_columns<T: FromStr<Err: ToString>>(
    names: Option<&str>,
) -> Result<Option<T>, Failure> {
    let columns = names.map(str::parse).transpose();
    columns.map_err(|reason: T::Err| Failure::usage(format!("--columns: {}", reason.to_string())))
}

/// When a page is made: now, or the time that the environment states, so that the same page can be made again.
pub(super) fn date_of_pages() -> DateTime<Utc> {
    let stated = std::env::var(steps::DATE).ok().and_then(|text| text.parse().ok());
    let stated = stated.and_then(|seconds| DateTime::from_timestamp(seconds, 0));
    stated.unwrap_or_else(|| wall_now().into())
}
