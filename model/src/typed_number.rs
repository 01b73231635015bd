//! Numbers as people type them: decimal commas, spaces between thousands, long minus signs, units in their usual forms.
//!
//! Files keep to points and plain signs; only what a person types comes through here. What could mean two numbers is
//! refused and never guessed.

use std::borrow::Cow;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TypedNumberError {
    /// Three digits behind the comma.
    #[error("'{typed}' could be {as_decimal} or {as_thousands}; type one of them")]
    Ambiguous { typed: String, as_decimal: String, as_thousands: String },
    #[error("'{typed}' has several decimal signs; type one number such as 1234.5")]
    Signs { typed: String },
}

/// Spaces that type-setters and number formats put between digits: no-break, figure, thin and narrow no-break space.
const THIN_SPACES: [char; 4] = ['\u{a0}', '\u{2007}', '\u{2009}', '\u{202f}'];

/// The text with decimal points, plain minus signs, plain spaces, and units as the table of units has them.
///
/// A comma counts as a decimal sign only between two digits, so that a list such as `0.75, 1.5` stays one.
pub fn plain_text(typed: &str) -> Result<Cow<'_, str>, TypedNumberError> {
    let is_unusual = |c: char| c == ',' || !c.is_ascii() || c == '/' || c == '^';
    if !typed.contains(is_unusual) {
        return Ok(Cow::Borrowed(typed));
    }
    let letters: Vec<char> = without_thousands(typed);
    let mut plain = String::with_capacity(typed.len());
    let mut at = 0;
    while at < letters.len() {
        if letters[at].is_ascii_digit() {
            let end = number_end(&letters, at);
            plain += &decimal(&letters[at..end].iter().collect::<String>())?;
            at = end;
        } else {
            plain.push(plain_letter(letters[at]));
            at += 1;
        }
    }
    Ok(Cow::Owned(usual_units(&plain)))
}

/// The end of digits with commas and points between them.
fn number_end(letters: &[char], start: usize) -> usize {
    let mut end = start;
    while let Some(letter) = letters.get(end) {
        let is_mark =
            matches!(letter, ',' | '.') && letters.get(end + 1).is_some_and(char::is_ascii_digit);
        if !(letter.is_ascii_digit() || is_mark) {
            break;
        }
        end += 1;
    }
    end
}

/// A number with a point for its comma.
fn decimal(typed: &str) -> Result<String, TypedNumberError> {
    let Some((whole, part)) = typed.split_once(',') else { return Ok(typed.to_owned()) };
    if whole.contains('.') || part.contains([',', '.']) {
        return Err(TypedNumberError::Signs { typed: typed.to_owned() });
    }
    // With a zero in front it cannot be a thousand.
    if part.len() == 3 && whole.len() <= 3 && !whole.starts_with('0') {
        return Err(TypedNumberError::Ambiguous {
            typed: typed.to_owned(),
            as_decimal: format!("{whole}.{part}"),
            as_thousands: format!("{whole}{part}"),
        });
    }
    Ok(format!("{whole}.{part}"))
}

/// Leaves out thin spaces between a digit and a group of three.
fn without_thousands(typed: &str) -> Vec<char> {
    let letters: Vec<char> = typed.chars().collect();
    let is_digit = |at: usize| letters.get(at).is_some_and(char::is_ascii_digit);
    let kept = letters.iter().enumerate().filter(|(at, letter)| {
        let is_between = THIN_SPACES.contains(letter) && *at > 0 && is_digit(at - 1);
        let is_group = (1..=3).all(|next| is_digit(at + next)) && !is_digit(at + 4);
        !(is_between && is_group)
    });
    kept.map(|(_, letter)| *letter).collect()
}

fn plain_letter(letter: char) -> char {
    match letter {
        // Minus sign, en dash and figure dash.
        '\u{2212}' | '\u{2013}' | '\u{2012}' => '-',
        // The Greek letter for the micro sign.
        '\u{3bc}' => '\u{b5}',
        // The ring and the ordinal indicator for the degree sign.
        '˚' | 'º' => '°',
        one if THIN_SPACES.contains(&one) => ' ',
        one => one,
    }
}

/// `mm s⁻¹`, `mm·s^-1` and `mm / s` as `mm/s`.
fn usual_units(text: &str) -> String {
    let mut text = text.replace(" / ", "/").replace('⁻', "^-").replace('¹', "1");
    for per in ["s", "min"] {
        for joint in ["·", "⋅", " "] {
            text = text.replace(&format!("{joint}{per}^-1"), &format!("/{per}"));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_people_write_them() {
        for (typed, plain) in [
            ("0.75", "0.75"),
            ("0,75", "0.75"),
            ("0,750 mm/s", "0.750 mm/s"),
            ("1\u{202f}234,5 mm", "1234.5 mm"),
            ("12\u{2009}345\u{2009}678", "12345678"),
            ("\u{2212}4,5\u{a0}°C", "-4.5 °C"),
            ("30 \u{3bc}m", "30 \u{b5}m"),
            ("0,75 mm / s", "0.75 mm/s"),
            ("0.75 mm\u{b7}s\u{207b}\u{b9}", "0.75 mm/s"),
            ("2 N min^-1", "2 N/min"),
            ("0,75 mm/s, 1,5 mm/s", "0.75 mm/s, 1.5 mm/s"),
            ("100 g, 200 g", "100 g, 200 g"),
            ("1234,567", "1234.567"),
            ("20\u{a0}mm", "20 mm"),
            ("pig 7, fundus", "pig 7, fundus"),
        ] {
            assert_eq!(plain_text(typed).unwrap(), plain, "{typed}");
        }
    }

    #[test]
    fn what_could_be_two_numbers_is_refused() {
        for (typed, words) in [
            ("1,234", "'1,234' could be 1.234 or 1234"),
            ("999,000 N", "'999,000' could be 999.000 or 999000"),
            ("1.234,5", "several decimal signs"),
            ("1,234.5", "several decimal signs"),
            ("10,20,30", "several decimal signs"),
        ] {
            let refusal = plain_text(typed).unwrap_err().to_string();
            assert!(refusal.contains(words), "{typed}: {refusal}");
        }
    }
}
