//! The layouts that are known, one file each: how a file is told to have it, and how it is cut into the measurements it
//! holds. What the columns are, their units and their numbers is found out in the same way for all.

mod bluehill;
mod legacy;
mod mach1;
mod rheometer;
mod unzipped;
mod workbook;

use super::super::header::Quantity;
use super::rows::{Cell, Delimiter};

/// Every layout.
const ALL: &[Layout] = &[
    // What a text has that no other claims.
    TABLE,
    mach1::LAYOUT,
    rheometer::LAYOUT,
    workbook::LAYOUT,
    bluehill::LAYOUT,
];

/// What is known of a layout.
#[derive(Debug)]
pub(super) struct Layout {
    /// On the command line and in a session.
    pub name: &'static str,
    /// Whose files have it, as in `Files: a Mach-1's`.
    of: &'static str,
    pub content: Content,
    /// Names of columns, in small letters, beside those that every layout may have.
    pub words: &'static [(Quantity, &'static [&'static str])],
}

/// What a file holds, and how it is read. Errors are one sentence with the line.
#[derive(Debug)]
pub(super) enum Content {
    Text {
        is_it: fn(&[Line<'_>], Delimiter) -> bool,
        cut: for<'a> fn(Vec<Line<'a>>, Delimiter) -> Result<Vec<TextPart<'a>>, String>,
    },
    Sheets {
        is_it: fn(&[u8]) -> bool,
        read: fn(&[u8]) -> Result<Vec<Sheet>, String>,
    },
}

const TABLE: Layout = Layout {
    name: "table",
    of: "delimited text",
    content: Content::Text {
        is_it: |_, _| false,
        cut: |lines, _| Ok(vec![TextPart { lines, ..TextPart::default() }]),
    },
    words: &[],
};

/// A layout that is known.
#[derive(Clone, Copy, Debug)]
pub struct Format(pub(super) &'static Layout);

impl Format {
    /// The layout of a file that does not hold text.
    pub(super) fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let claims =
            |one: &&Layout| matches!(one.content, Content::Sheets { is_it, .. } if is_it(bytes));
        ALL.iter().find(claims).map(Self)
    }

    pub(super) fn of_text(lines: &[Line<'_>], delimiter: Delimiter) -> Self {
        let claims = |one: &&Layout| matches!(one.content, Content::Text { is_it, .. } if is_it(lines, delimiter));
        Self(ALL.iter().find(claims).unwrap_or(&ALL[0]))
    }

    /// The name on the command line and in a session.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// The names of all: `table, mach-1 or workbook`.
    #[must_use]
    pub fn names() -> String {
        in_words(ALL.iter().map(|one| one.name))
    }

    /// Whose files are read: `delimited text, a Mach-1's or a workbook`.
    #[must_use]
    pub fn sources() -> String {
        in_words(ALL.iter().map(|one| one.of))
    }
}

fn in_words(all: impl Iterator<Item = &'static str>) -> String {
    let mut words: Vec<&str> = all.collect();
    let last = words.pop().unwrap_or_default();
    format!("{} or {last}", words.join(", "))
}

impl std::str::FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = ALL.iter().find(|one| one.name == text);
        found.map(Self).ok_or_else(|| format!("give {}", Self::names()))
    }
}

/// A line with its number in the file, from 1.
pub(super) type Line<'a> = (usize, &'a str);

/// A sheet by name, its rows with their numbers.
pub(super) type Sheet = (String, Vec<(usize, Vec<Cell>)>);

/// One measurement, before its columns are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TextPart<'a> {
    /// Empty if the file is one measurement.
    pub name: String,
    /// What the file says of it.
    pub facts: Vec<(String, String)>,
    /// Where its columns are named, if the layout tells.
    pub head: Option<Head>,
    /// Those of the measurement, names of columns and units included.
    pub lines: Vec<Line<'a>>,
}

/// The lines of the names and of the units of columns, by their numbers in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub names: usize,
    pub units: Option<usize>,
}

/// Most lines kept of what a file says of a part; longer ones are cut.
const FACTS_MAX: usize = 64;
const FACT_LENGTH_MAX: usize = 200;

/// Lines that are not blank, with their numbers. Files of very old computers end lines with a return alone.
pub(super) fn lines_of(text: &str) -> Vec<Line<'_>> {
    let is_blank = |line: &str| line.trim().is_empty();
    let with_numbers = |(i, line)| (i + 1, line);
    if text.contains('\n') {
        let lines = text.lines().enumerate().map(with_numbers);
        lines.filter(|(_, line)| !is_blank(line)).collect()
    } else {
        let lines = text.split('\r').enumerate().map(with_numbers);
        lines.filter(|(_, line)| !is_blank(line)).collect()
    }
}

/// A line of the form `key: value` or `key<tab>value`.
fn fact(line: &str) -> Option<(String, String)> {
    let cut = |text: &str| text.trim().chars().take(FACT_LENGTH_MAX).collect::<String>();
    let (key, value) = line
        .split_once('\t')
        .or_else(|| line.split_once(':'))
        .map(|(key, value)| (cut(key.trim().trim_end_matches(':')), cut(value)))?;
    (!key.is_empty() && !value.is_empty()).then_some((key, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_return_alone_ends_a_line() {
        let old = lines_of("a;b\r1;2\r");
        assert_eq!(old, [(1, "a;b"), (2, "1;2")]);
    }
}
