//! Anton Paar (formerly CSM) indentation testers: the text export of one indentation, or of all of a session.
//!
//! An indentation has facts (`NHT S/N: 12345`, `EIT = 2,1 GPa`), the line `Measured values`, names, units and rows. A
//! session repeats the whole, each below the line `Indentation`.

use super::super::rows::{Cell, Delimiter};
use super::{Content, FACTS_MAX, Head, Layout, Line, Quantity, TextPart, fact, parse_fact};

pub(super) const LAYOUT: Layout = Layout {
    name: "anton-paar",
    source: "an Anton Paar indentation tester's",
    content: Content::Text {
        is_it: |lines, _| lines.windows(2).any(|pair| is_values(pair[0]) && is_names(pair[1])),
        cut: |lines, delimiter| cut(&lines, delimiter),
    },
    // Penetration depth and normal force.
    words: &[(Quantity::Depth, "pd"), (Quantity::Force, "fn")],
};

/// First line of an indentation in the export of a session.
const INDENTATION: &str = "Indentation";

fn is_values((_, line): Line<'_>) -> bool {
    line.trim() == "Measured values"
}

fn is_names((_, line): Line<'_>) -> bool {
    line.trim_start().starts_with("Time")
}

fn cut<'a>(lines: &[Line<'a>], delimiter: Delimiter) -> Result<Vec<TextPart<'a>>, String> {
    let mut parts: Vec<TextPart<'a>> = Vec::new();
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut rest = lines;
    while let Some((&line, after)) = rest.split_first() {
        rest = after;
        if line.1.trim() == INDENTATION {
            facts.clear();
        } else if is_values(line) {
            let [names, below @ ..] = rest else {
                return Err(format!(
                    "line {}: no names follow 'Measured values'; restore the missing end of the file",
                    line.0
                ));
            };
            let is_row = |row: &&Line<'_>| {
                let cells = delimiter.cells(row.1, row.0).unwrap_or_default();
                cells.iter().find(|cell| !cell.is_empty()).is_some_and(Cell::is_number)
            };
            // Bioindenters write units behind the names.
            let units = below.first().filter(|row| !is_row(row));
            let start = usize::from(units.is_some());
            let count = start + below[start..].iter().take_while(is_row).count();
            parts.push(TextPart {
                name: format!("{INDENTATION} {}", parts.len() + 1),
                facts: std::mem::take(&mut facts),
                head: Some(Head { names: names.0, units: units.map(|row| row.0) }),
                lines: rest[..=count].to_vec(),
                ..TextPart::default()
            });
            rest = &below[count..];
        } else if facts.len() < FACTS_MAX {
            let pair = line.1.split_once('=').and_then(|(key, value)| {
                fact(key, &value.split_whitespace().collect::<Vec<_>>().join(" "))
            });
            facts.extend(pair.or_else(|| parse_fact(line.1)));
        }
    }
    if let [only] = &mut parts[..] {
        only.name.clear();
    }
    Ok(parts)
}
