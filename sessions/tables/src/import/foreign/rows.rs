//! The rows of a part of a file, whether lines of text or cells of a sheet.

use super::super::cells::split;
use super::decimal::looks_numeric;

/// What stands in one place of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cell {
    Empty,
    Text(String),
    /// A number that a spreadsheet keeps as one.
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

    /// As it would be shown.
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

/// What stands between the cells of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delimiter(char);

impl Delimiter {
    /// In the order they are tried: what stands in numbers and words comes last.
    const ALL: [Self; 5] = [Self('\t'), Self(';'), Self('|'), Self(','), Self(' ')];

    pub(super) fn name(self) -> String {
        match self.0 {
            '\t' => "tab".into(),
            ';' => "semicolon".into(),
            ',' => "comma".into(),
            ' ' => "space".into(),
            other => format!("'{other}'"),
        }
    }

    pub(super) fn cells(self, line: &str, number: usize) -> Result<Vec<Cell>, String> {
        if self.0 == ' ' {
            let words = line.split_whitespace();
            return Ok(words.map(|word| Cell::Text(word.to_owned())).collect());
        }
        Ok(split(line, self.0, number)?.into_iter().map(Cell::of_text).collect())
    }

    /// Told from the first lines that hold numbers.
    pub(super) fn detect(lines: &[(usize, &str)]) -> Option<Self> {
        // Where numbers and a header are, however long the words before them.
        const LINES_LOOKED_AT: usize = 4000;
        let lines = &lines[..lines.len().min(LINES_LOOKED_AT)];
        let starts_like_number =
            |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
        let count = |delimiter: Self, is_strict: bool| {
            let holds_numbers = |&&(number, line): &&(usize, &str)| {
                let Ok(cells) = delimiter.cells(line, number) else {
                    return false;
                };
                let numbers = cells.iter().filter(|cell| cell.is_number()).count();
                // Half a number cut at the wrong sign begins like one and is none.
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
        let mut characters = text.chars();
        match (text, characters.next(), characters.next()) {
            ("tab" | "\\t", ..) => Ok(Self('\t')),
            ("comma", ..) => Ok(Self(',')),
            ("semicolon", ..) => Ok(Self(';')),
            ("space", ..) => Ok(Self(' ')),
            (_, Some(one), None) if one != '"' && !one.is_alphanumeric() => Ok(Self(one)),
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

    /// The cells of a row; the error is a sentence that names it.
    pub fn cells(&self, index: usize) -> Result<Vec<Cell>, String> {
        match self {
            Self::Lines { lines, delimiter } => {
                let (number, line) = lines[index];
                delimiter.cells(line, number)
            }
            Self::Cells(rows) => Ok(rows[index].1.clone()),
        }
    }

    /// The cells of a row that may be words: with a quote that is never closed, it is one cell.
    pub fn words(&self, index: usize) -> Vec<Cell> {
        self.cells(index).unwrap_or_else(|_| match self {
            Self::Lines { lines, .. } => vec![Cell::Text(lines[index].1.trim().to_owned())],
            Self::Cells(_) => Vec::new(),
        })
    }

    /// The row of a number, if it is there.
    pub fn index_of(&self, number: usize) -> Option<usize> {
        (0..self.len()).find(|&index| self.number(index) == number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delimiters_are_told_from_the_numbers() {
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
