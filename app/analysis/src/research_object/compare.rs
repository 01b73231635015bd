//! A result file beside the same file computed again: equal to the bit, equal within the bounds, or the first difference.

use crate::report::dossier::SEAL;
use serde::Serialize;

/// How far two numbers may be from each other, as a share of the larger, where another version or another class of
/// computer computed them.
///
/// Where the last bit of a function differs, a fit takes the same steps and ends within what its equations make of that
/// bit. Between the GNU C Library with and without fused multiply-adds, the largest difference among the results of all
/// commands that a step may be is 6e-11. A fit that is decided by the last bit takes one step more, which moves its
/// parameters by less than a thousandth of a standard error (`fit/refine.rs` of `palpate-rheology`): 1e-6 of a parameter
/// that is known to a thousandth of itself. A paper prints three or four digits.
pub const RELATIVE_BOUND: f64 = 1e-6;

/// How a file compares with the one computed again.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "result", rename_all = "kebab-case")]
pub enum FileResult {
    /// The same bytes.
    Same,
    /// Other bytes, whose numbers are within the bounds.
    WithinBounds {
        /// The largest difference, as a share of the larger number.
        largest: f64,
    },
    /// The first difference.
    Different {
        /// Of the file in the crate, from 1; 0 for a file that is not text.
        line: usize,
        in_crate: String,
        now: String,
    },
    /// The crate has it, and it was not computed again.
    NotComputed,
    /// It was computed, and the crate lacks it.
    NotInCrate,
}

impl FileResult {
    #[must_use]
    pub const fn is_equal(&self) -> bool {
        matches!(self, Self::Same | Self::WithinBounds { .. })
    }
}

/// Which differences count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance<'a> {
    /// Every byte.
    Exact,
    /// Numbers beyond [`RELATIVE_BOUND`]; the version of the program that made the crate is no difference.
    Bounded { made_by: &'a str },
}

/// Compares the bytes of a file in the crate with those that were computed.
#[must_use]
pub fn compare(in_crate: &[u8], now: &[u8], tolerance: Tolerance<'_>) -> FileResult {
    if in_crate == now {
        return FileResult::Same;
    }
    let (Ok(before), Ok(after)) = (std::str::from_utf8(in_crate), std::str::from_utf8(now)) else {
        let place = in_crate.iter().zip(now).take_while(|(a, b)| a == b).count();
        let at = |bytes: &[u8]| match bytes.get(place) {
            Some(byte) => format!("byte {byte:02x} at {place}"),
            None => format!("end at {place}"),
        };
        return FileResult::Different { line: 0, in_crate: at(in_crate), now: at(now) };
    };
    match tolerance {
        Tolerance::Exact => first_line(before, after),
        Tolerance::Bounded { made_by } => {
            let own = format!("palpate {}", env!("CARGO_PKG_VERSION"));
            let before = before.replace(&format!("palpate {made_by}"), &own);
            compare_numbers(&comparable(&before), &comparable(after))
        }
    }
}

/// The first line in which two texts that differ do so.
fn first_line(before: &str, after: &str) -> FileResult {
    let end = "the end of the file";
    let (mut ours, mut theirs) = (before.split_inclusive('\n'), after.split_inclusive('\n'));
    for line in 1.. {
        match (ours.next(), theirs.next()) {
            (None, None) => break,
            (a, b) if a == b => {}
            (a, b) => {
                let [in_crate, now] = around(a.unwrap_or(end), b.unwrap_or(end));
                return FileResult::Different { line, in_crate, now };
            }
        }
    }
    FileResult::Same
}

/// Letters shown of a line that differs.
const SHOWN: usize = 60;

/// The parts of two texts around their first difference, from the beginning of its line on: a line of JSON may be the whole
/// file.
fn around(a: &str, b: &str) -> [String; 2] {
    let same = || a.chars().zip(b.chars()).take_while(|(a, b)| a == b);
    let count = same().count();
    let line = same().enumerate().filter(|(_, (letter, _))| *letter == '\n').last();
    let line = line.map_or(0, |(place, _)| place + 1);
    let start = line.max(count.saturating_sub(SHOWN / 2));
    [a, b].map(|text| {
        let part: String = text.chars().skip(start).take(SHOWN).collect();
        let before = if start > line { "..." } else { "" };
        let after = if text.trim_end().chars().count() > start + SHOWN { "..." } else { "" };
        format!("{before}{}{after}", part.trim_end().replace('\n', " "))
    })
}

/// A piece of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Piece<'a> {
    Text(&'a str),
    Number(&'a str),
}

fn compare_numbers(before: &str, after: &str) -> FileResult {
    let (mut largest, mut line): (f64, usize) = (0.0, 1);
    let mut theirs = Pieces { rest: after, before: Before::default() };
    for ours in (Pieces { rest: before, before: Before::default() }) {
        let other = theirs.next();
        let is_same = match (ours, other) {
            (Piece::Number(a), Some(Piece::Number(b))) => match distance(a, b) {
                Some(share) => {
                    largest = largest.max(share);
                    true
                }
                None => false,
            },
            (Piece::Text(a), Some(Piece::Text(b))) => a == b,
            _ => false,
        };
        if !is_same {
            let end = Piece::Text("the end of the file");
            let [in_crate, now] = match (ours, other.unwrap_or(end)) {
                (Piece::Number(a), Piece::Number(b)) => [a.to_owned(), b.to_owned()],
                (Piece::Text(a) | Piece::Number(a), Piece::Text(b) | Piece::Number(b)) => {
                    let same = a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b);
                    line += same.filter(|(byte, _)| *byte == b'\n').count();
                    around(a, b)
                }
            };
            return FileResult::Different { line, in_crate, now };
        }
        if let Piece::Text(text) = ours {
            line += text.matches('\n').count();
        }
    }
    match theirs.next() {
        None => FileResult::WithinBounds { largest },
        Some(Piece::Text(more) | Piece::Number(more)) => {
            let [in_crate, now] = around("the end of the file", more);
            FileResult::Different { line, in_crate, now }
        }
    }
}

/// A text without the line of a page's own hash, which is another where one number is another; and with one sign between
/// folders, which is another on Windows, and doubled in JSON.
fn comparable(text: &str) -> String {
    let lines = text.split_inclusive('\n').filter(|line| !line.starts_with(SEAL));
    lines.collect::<String>().replace("\\\\", "/").replace('\\', "/")
}

/// How far two numbers are from each other as a share of the larger; `None` beyond the bound. A rounded number may
/// differ by one in its last digit.
fn distance(a: &str, b: &str) -> Option<f64> {
    if a == b {
        return Some(0.0);
    }
    let (x, y): (f64, f64) = (a.parse().ok()?, b.parse().ok()?);
    let difference = (x - y).abs();
    let share = difference / x.abs().max(y.abs()).max(f64::MIN_POSITIVE);
    // The difference of two decimal numbers is itself rounded.
    let digit = 1.000_001 * last_digit(a).max(last_digit(b));
    (share <= RELATIVE_BOUND || difference <= digit).then_some(share)
}

/// The value of one in the last digit of a number.
fn last_digit(number: &str) -> f64 {
    let (digits, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let decimals = digits.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    // A whole number is a count, which has no last digit to round.
    if decimals == 0 && exponent == "0" {
        return 0.0;
    }
    let power = exponent.parse::<i32>().unwrap_or(0) - decimals as i32;
    10f64.powi(power)
}

/// The two letters before a place.
#[derive(Clone, Copy, Debug, Default)]
struct Before {
    last: Option<char>,
    last_but_one: Option<char>,
}

impl Before {
    fn after(text: &str, earlier: Self) -> Self {
        let mut letters = text.chars().rev();
        match (letters.next(), letters.next()) {
            (None, _) => earlier,
            (last, None) => Self { last, last_but_one: earlier.last },
            (last, last_but_one) => Self { last, last_but_one },
        }
    }

    /// Whether a digit here begins a number. In `mu1` and `#1a2b` it does not; in the `L4` of a drawn line it does.
    fn may_begin_number(self) -> bool {
        let is_word = |letter: char| letter.is_alphanumeric() || matches!(letter, '_' | '#');
        let is_name = |letter: char| letter.is_alphabetic() || matches!(letter, '_' | '#');
        match self.last {
            None => true,
            Some(letter) if letter.is_ascii_alphabetic() => !self.last_but_one.is_some_and(is_name),
            Some(letter) => !is_word(letter) && letter != '.',
        }
    }
}

/// Texts and numbers in turn.
struct Pieces<'a> {
    rest: &'a str,
    before: Before,
}

impl<'a> Iterator for Pieces<'a> {
    type Item = Piece<'a>;

    fn next(&mut self) -> Option<Piece<'a>> {
        if self.rest.is_empty() {
            return None;
        }
        let mut before = self.before;
        let mut start = None;
        for (place, letter) in self.rest.char_indices() {
            if is_digits(&self.rest[place..]) && before.may_begin_number() {
                start = Some(place);
                break;
            }
            before = Before { last: Some(letter), last_but_one: before.last };
        }
        let end = match start {
            Some(0) => number_length(self.rest),
            Some(place) => place,
            None => self.rest.len(),
        };
        let (piece, rest) = self.rest.split_at(end);
        self.before = Before::after(piece, self.before);
        self.rest = rest;
        Some(if start == Some(0) { Piece::Number(piece) } else { Piece::Text(piece) })
    }
}

/// Whether a text begins with the digits of a number, after a sign or not.
fn is_digits(text: &str) -> bool {
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    digits.starts_with(|letter: char| letter.is_ascii_digit())
}

/// How long the number is that a text begins with.
fn number_length(text: &str) -> usize {
    let count = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut end = usize::from(text.starts_with(['-', '+']));
    end += count(end);
    if text[end..].starts_with('.') && count(end + 1) > 0 {
        end += 1 + count(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let sign = usize::from(text[end + 1..].starts_with(['-', '+']));
        let digits = count(end + 1 + sign);
        if digits > 0 {
            end += 1 + sign + digits;
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounded(a: &str, b: &str) -> FileResult {
        compare(a.as_bytes(), b.as_bytes(), Tolerance::Bounded { made_by: "0.1.0" })
    }

    #[test]
    fn numbers_within_the_bound_and_their_last_digits_are_equal() {
        for (a, b) in [
            ("{\"mu1\":0.12345678}", "{\"mu1\":0.12345679}"),
            ("M10.25,3.00L4.10,5", "M10.26,3.00L4.11,5"),
            ("1e-300 x", "1.0000001e-300 x"),
            ("\"sessions\\\\a\" 1.0", "\"sessions/a\" 1.0"),
            ("palpate 0.1.0 says 1.5", &format!("palpate {} says 1.5", env!("CARGO_PKG_VERSION"))),
        ] {
            assert!(matches!(bounded(a, b), FileResult::WithinBounds { .. }), "{a}, {b}");
        }
    }

    #[test]
    fn first_difference_is_found_with_its_line_and_values() {
        for (a, b, line, values) in [
            ("one\ntwo 1.5000\n", "one\ntwo 1.6000\n", 2, ["1.5000", "1.6000"]),
            ("7 samples", "8 samples", 1, ["7", "8"]),
            ("mu1 = 2.0", "mu2 = 2.0", 1, ["mu1 =", "mu2 ="]),
            ("#a1b2", "#a1c2", 1, ["#a1b", "#a1c"]),
            ("a\nb", "a\nb\nc 1", 2, ["b", "b c"]),
        ] {
            let FileResult::Different { line: at, in_crate, now } = bounded(a, b) else {
                panic!("{a}, {b}: {:?}", bounded(a, b));
            };
            assert_eq!((at, [in_crate.as_str(), now.as_str()]), (line, values), "{a}");
        }
    }

    #[test]
    fn one_bit_differs_where_every_byte_counts() {
        let (a, b) = ("{\n\"x\":0.10000000000000001}", "{\n\"x\":0.10000000000000002}");
        let found = compare(a.as_bytes(), b.as_bytes(), Tolerance::Exact);
        assert!(matches!(found, FileResult::Different { line: 2, .. }), "{found:?}");
        assert_eq!(compare(a.as_bytes(), a.as_bytes(), Tolerance::Exact), FileResult::Same);
        let binary = compare(&[0xff, 1], &[0xff, 2], Tolerance::Exact);
        assert!(matches!(binary, FileResult::Different { line: 0, .. }), "{binary:?}");
    }
}
