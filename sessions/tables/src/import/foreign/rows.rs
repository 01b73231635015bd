//! The rows of a part: lines of text or rows of a sheet.

use super::super::cells::split;
use super::decimal::looks_numeric;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Empty,
    Text(String),
    /// A number of a spreadsheet.
    Number(f64),
}

impl Cell {
    pub fn is_empty(&self) -> bool {
        *self == Self::Empty
    }

    pub fn is_number(&self) -> bool {
        match self {
            Self::Number(_) => true,
            Self::Text(text) => looks_numeric(text),
            Self::Empty => false,
        }
    }

    pub fn text(&self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Text(text) => text.clone(),
            Self::Number(number) => number.to_string(),
        }
    }

    fn of_text(text: String) -> Self {
        if text.is_empty() { Self::Empty } else { Self::Text(text) }
    }
}

/// Separator between the cells of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delimiter(char);

impl Delimiter {
    const NAMES: [(&'static str, char); 4] =
        [("tab", '\t'), ("comma", ','), ("semicolon", ';'), ("space", ' ')];
    /// In the order of trial: characters that occur in numbers and words come last.
    const ALL: [Self; 5] = [Self('\t'), Self(';'), Self('|'), Self(','), Self(' ')];

    pub(super) fn name(self) -> String {
        let named = Self::NAMES.iter().find(|(_, one)| *one == self.0);
        named.map_or_else(|| format!("'{}'", self.0), |(name, _)| (*name).to_owned())
    }

    pub(super) fn cells(self, line: &str, number: usize) -> Result<Vec<Cell>, String> {
        if self.0 == ' ' {
            let words = line.split_whitespace();
            return Ok(words.map(|word| Cell::Text(word.to_owned())).collect());
        }
        Ok(split(line, self.0, number)?.into_iter().map(Cell::of_text).collect())
    }

    /// Detects the delimiter from the first lines with numbers.
    pub(super) fn detect(lines: &[(usize, &str)]) -> Option<Self> {
        // Enough for a header and numbers after a long introduction.
        const LINES_MAX: usize = 4000;
        let lines = &lines[..lines.len().min(LINES_MAX)];
        let starts_like_number =
            |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
        let count = |delimiter: Self, is_strict: bool| {
            let holds_numbers = |&&(number, line): &&(usize, &str)| {
                let Ok(cells) = delimiter.cells(line, number) else {
                    return false;
                };
                let numbers = cells.iter().filter(|cell| cell.is_number()).count();
                // A number that is split at the wrong sign leaves a piece that begins like a number.
                let is_cut = |cell: &Cell| {
                    !cell.is_number()
                        && matches!(cell, Cell::Text(text) if starts_like_number(text))
                };
                numbers >= 2 && !(is_strict && cells.iter().any(is_cut))
            };
            lines.iter().filter(holds_numbers).count()
        };
        [true, false].into_iter().find_map(|is_strict| {
            let counts = Self::ALL.map(|delimiter| count(delimiter, is_strict));
            let most = *counts.iter().max()?;
            let place = counts.iter().position(|&one| most > 0 && 2 * one >= most)?;
            Some(Self::ALL[place])
        })
    }
}

impl std::str::FromStr for Delimiter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = Self::NAMES.iter().find(|(name, _)| *name == text).map(|(_, one)| *one);
        let mut characters = text.chars();
        match (named, characters.next(), characters.next()) {
            (Some(one), ..) => Ok(Self(one)),
            (_, Some(one), None) if one != '"' && !one.is_alphanumeric() => Ok(Self(one)),
            _ if text == "\\t" => Ok(Self('\t')),
            _ => Err("give tab, comma, semicolon, space or one character".into()),
        }
    }
}

/// Rows with their numbers in the file, from 1.
#[derive(Clone, Debug)]
pub(super) enum Rows<'a> {
    Lines { lines: Vec<(usize, &'a str)>, delimiter: Delimiter },
    Cells(Vec<(usize, Vec<Cell>)>),
}

impl Rows<'_> {
    pub fn len(&self) -> usize {
        match self {
            Self::Lines { lines, .. } => lines.len(),
            Self::Cells(rows) => rows.len(),
        }
    }

    /// `line` or `row`.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Lines { .. } => "line",
            Self::Cells(_) => "row",
        }
    }

    pub fn number(&self, index: usize) -> usize {
        match self {
            Self::Lines { lines, .. } => lines[index].0,
            Self::Cells(rows) => rows[index].0,
        }
    }

    /// The cells of a row; the error is a sentence with its number.
    pub fn cells(&self, index: usize) -> Result<Vec<Cell>, String> {
        match self {
            Self::Lines { lines, delimiter } => {
                let (number, line) = lines[index];
                delimiter.cells(line, number)
            }
            Self::Cells(rows) => Ok(rows[index].1.clone()),
        }
    }

    /// The cells of a row of text; a row with an unclosed quote is one cell.
    pub fn words(&self, index: usize) -> Vec<Cell> {
        self.cells(index).unwrap_or_else(|_| match self {
            Self::Lines { lines, .. } => vec![Cell::Text(lines[index].1.trim().to_owned())],
            Self::Cells(_) => Vec::new(),
        })
    }

    pub fn index_of(&self, number: usize) -> Option<usize> {
        (0..self.len()).find(|&index| self.number(index) == number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delimiter_is_detected_from_the_numbers() {
        for (lines, expected) in [
            (&["a\tb", "1\t2"][..], "tab"),
            (&["a;b", "0,5;1,5", "1,5;2,5"], "semicolon"),
            (&["a,b", "0.5,1.5"], "comma"),
            (&["t x", "0,5 1,5", "1,5 2,5"], "space"),
            (&["a|b", "1.0|2.0"], "'|'"),
            (&["note; note", "at,t,x", "2024-01-02 10:00,0.1,3"], "comma"),
        ] {
            let lines: Vec<(usize, &str)> = lines.iter().map(|line| (1, *line)).collect();
            let found = Delimiter::detect(&lines).unwrap();
            assert_eq!(found.name(), expected, "{lines:?}");
        }
        assert_eq!(Delimiter::detect(&[(1, "no numbers")]), None);
    }
}
