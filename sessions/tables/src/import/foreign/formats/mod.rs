//! The known layouts, one file each: how to recognise a layout, and how to divide a file into measurements. Columns, units
//! and numbers are detected in the same way for all layouts.

mod anton_paar;
mod bluehill;
mod jpk;
mod legacy;
mod mach1;
mod optics11;
mod rheometer;
mod unzipped;
mod workbook;

use super::super::header::Quantity;
use super::columns::LayoutNames;
use super::rows::{Cell, Delimiter};
use palpate_model::rig::Phase;

const ALL: &[Layout] = &[
    // For text that no other layout claims.
    TABLE,
    mach1::LAYOUT,
    optics11::LAYOUT,
    rheometer::LAYOUT,
    // A JPK archive is a zip archive, as an .xlsx is, and goes first.
    jpk::LAYOUT,
    workbook::LAYOUT,
    bluehill::LAYOUT,
    anton_paar::LAYOUT,
];

#[derive(Debug)]
pub(super) struct Layout {
    /// Name on the command line and in a session.
    pub name: &'static str,
    /// Source of the files, as in `a Mach-1's`.
    source: &'static str,
    pub content: Content,
    /// Lower-case column names in addition to those of every layout.
    pub words: LayoutNames,
}

/// How a file is recognised and divided. Errors are one sentence with the line.
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
    source: "delimited text",
    content: Content::Text {
        is_it: |_, _| false,
        cut: |lines, _| Ok(vec![TextPart { lines, ..TextPart::default() }]),
    },
    words: &[],
};

#[derive(Clone, Copy, Debug)]
pub struct ForeignFormat(pub(super) &'static Layout);

impl ForeignFormat {
    /// The layout of a file that is not text.
    pub(super) fn of_bytes(bytes: &[u8]) -> Option<Self> {
        let claims =
            |one: &&Layout| matches!(one.content, Content::Sheets { is_it, .. } if is_it(bytes));
        ALL.iter().find(claims).map(Self)
    }

    pub(super) fn of_text(lines: &[Line<'_>], delimiter: Delimiter) -> Self {
        let claims = |one: &&Layout| matches!(one.content, Content::Text { is_it, .. } if is_it(lines, delimiter));
        Self(ALL.iter().find(claims).unwrap_or(&ALL[0]))
    }

    #[must_use]
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// All names, as in `table, mach-1 or workbook`.
    #[must_use]
    pub fn names() -> String {
        in_words(ALL.iter().map(|one| one.name))
    }

    /// All sources, as in `delimited text, a Mach-1's or a workbook`.
    #[must_use]
    pub fn sources() -> String {
        in_words(ALL.iter().map(|one| one.source))
    }
}

fn in_words(all: impl Iterator<Item = &'static str>) -> String {
    let mut words: Vec<&str> = all.collect();
    let last = words.pop().unwrap_or_default();
    format!("{} or {last}", words.join(", "))
}

impl std::str::FromStr for ForeignFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = ALL.iter().find(|one| one.name == text);
        found.map(Self).ok_or_else(|| format!("give {}", Self::names()))
    }
}

/// A line with its number in the file, from 1.
pub(super) type Line<'a> = (usize, &'a str);

/// A sheet by name.
pub(super) struct Sheet {
    pub name: String,
    pub facts: Vec<(String, String)>,
    /// With their numbers.
    pub rows: Vec<(usize, Vec<Cell>)>,
}

/// One measurement, before its columns are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TextPart<'a> {
    /// Empty if the file has one measurement only.
    pub name: String,
    pub facts: Vec<(String, String)>,
    /// Position of the column names, if the layout fixes it.
    pub head: Option<Head>,
    /// Includes the lines of names and units.
    pub lines: Vec<Line<'a>>,
    /// One sentence each.
    pub remarks: Vec<String>,
    /// The blocks that it is joined of, in order; empty where the file has it as one.
    pub stages: Vec<Stage>,
    /// The part that has its rows, too. It is then read on request alone.
    pub included_in: Option<String>,
}

/// A block of a joined part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stage {
    /// Line number of its first row.
    pub first: usize,
    /// Its time 0 after that of the part, in s.
    pub start_s: f64,
    pub kind: StageKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StageKind {
    /// Ends at the contact.
    Contact,
    /// At rest at the contact.
    Rest,
    /// A ramp and the hold after it.
    Press,
}

impl StageKind {
    /// The phase of its first rows.
    pub fn first_phase(self) -> Phase {
        match self {
            Self::Contact => Phase::Contact,
            Self::Rest => Phase::Rest,
            Self::Press => Phase::Ramp,
        }
    }
}

/// Line numbers of column names and units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub names: usize,
    pub units: Option<usize>,
}

/// Largest number of facts about a part; longer facts are cut.
pub(super) const FACTS_MAX: usize = 128;
const FACT_LENGTH_MAX: usize = 200;

/// Non-blank lines with their numbers. Files of very old computers end lines with a carriage return alone.
pub(super) fn lines_of(text: &str) -> Vec<Line<'_>> {
    let ending = if text.contains('\n') { '\n' } else { '\r' };
    let lines = text.split(ending).map(|line| line.strip_suffix('\r').unwrap_or(line));
    let numbered = lines.enumerate().map(|(index, line)| (index + 1, line));
    numbered.filter(|(_, line)| !line.trim().is_empty()).collect()
}

/// Parses `key: value` or `key<tab>value`.
pub(super) fn parse_fact(line: &str) -> Option<(String, String)> {
    let (key, value) = line.split_once('\t').or_else(|| line.split_once(':'))?;
    fact(key, value)
}

/// A fact, cut to its largest length; `None` without a value.
pub(super) fn fact(key: &str, value: &str) -> Option<(String, String)> {
    let cut = |text: &str| text.trim().chars().take(FACT_LENGTH_MAX).collect::<String>();
    let (key, value) = (cut(key.trim().trim_end_matches(':')), cut(value));
    (!key.is_empty() && !value.is_empty()).then_some((key, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carriage_return_alone_ends_a_line() {
        let old = lines_of("a;b\r1;2\r");
        assert_eq!(old, [(1, "a;b"), (2, "1;2")]);
    }
}
