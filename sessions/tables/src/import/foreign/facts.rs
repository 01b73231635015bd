//! What the rows outside a table say of the measurement, as `load cell;KA-001` or `speed;0.1;mm/s`.

use super::columns::{is_known_unit_cell, is_unit_cell};
use super::formats::{FACTS_MAX, fact, parse_fact};
use super::rows::{Cell, Rows};

/// Facts in the first so many rows.
pub(super) fn in_first_rows(rows: &Rows<'_>, count: usize) -> Vec<(String, String)> {
    (0..count).filter_map(|index| fact_of(&rows.words(index))).take(FACTS_MAX).collect()
}

/// A name with its value, and perhaps a unit.
fn fact_of(cells: &[Cell]) -> Option<(String, String)> {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty());
    let key = filled.next().filter(|key| !key.is_number())?.text();
    if is_known_unit_cell(&key) {
        return None;
    }
    let values: Vec<String> = filled.map(Cell::text).collect();
    match &values[..] {
        [] => parse_fact(&key).filter(|_| key.contains(": ")),
        [_] => fact(&key, &values[0]),
        [value, unit] if is_unit_cell(unit) => fact(&key, &format!("{value} {unit}")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_a_value_and_perhaps_a_unit_are_facts() {
        let cells = |texts: &[&str]| -> Vec<Cell> {
            let cell = |text: &&str| match *text {
                "" => Cell::Empty,
                text => Cell::Text(text.to_owned()),
            };
            texts.iter().map(cell).collect()
        };
        for (row, expected) in [
            (&["Prüfer:", "Ada"][..], Some(("Prüfer", "Ada"))),
            (&["Vorkraft", "0,05", "N"], Some(("Vorkraft", "0,05 N"))),
            (&["Date", "44335.4", ""], Some(("Date", "44335.4"))),
            (&["Specimen: gel 3"], Some(("Specimen", "gel 3"))),
            (&["P002-1"], None),
            (&["1", "2"], None),
            (&["", "N", "mm"], None),
            (&["N°", "Fmax", "dL at Fmax"], None),
            (&["a", "b", "c", "d"], None),
            (&["", ""], None),
        ] {
            let expected = expected.map(|(key, value)| (key.to_owned(), value.to_owned()));
            assert_eq!(fact_of(&cells(row)), expected, "{row:?}");
        }
    }
}
