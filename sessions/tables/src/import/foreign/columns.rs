//! Which column is what and in which unit, from its name, from a row of units, or as told.

use super::super::header::{Quantity, Scale};
use super::layout::Header;
use super::said::Said;
use super::told::Told;

/// One quantity's column and how its values are read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub index: usize,
    /// To s, mm, N or V.
    pub scale: Scale,
    pub is_turned: bool,
    /// What is taken off, in s, mm, N or V.
    pub zero: Zero,
}

/// What counts as zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zero {
    AsItIs,
    First,
    At(f64),
}

/// The columns that are read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    pub time: Column,
    pub depth: Column,
    pub force: Column,
    pub signal: Option<Column>,
    pub phase: Option<usize>,
}

/// Names by which testers of several makers and languages know a quantity, in small letters.
fn words(quantity: Quantity) -> &'static [&'static str] {
    match quantity {
        Quantity::Time => &[
            "t",
            "time",
            "test time",
            "elapsed time",
            "total time",
            "step time",
            "interval time",
            "zeit",
            "prüfzeit",
            "temps",
            "temps d'essai",
        ],
        Quantity::Depth => &[
            "x",
            "d",
            "depth",
            "indentation",
            "displacement",
            "extension",
            "deformation",
            "position",
            "position (z)",
            "travel",
            "standard travel",
            "crosshead travel",
            "weg",
            "standardweg",
            "traversenweg",
            "verformung",
            "déplacement",
            "déformation",
            "déplacement standard",
        ],
        Quantity::Force => &[
            "f",
            "fz",
            "force",
            "load",
            "standard force",
            "normal force",
            "axial force",
            "kraft",
            "standardkraft",
            "prüfkraft",
            "normalkraft",
            "force standard",
            "charge",
        ],
        Quantity::Signal => &["signal", "voltage", "spannung", "tension"],
    }
}

fn is_known_unit(text: &str) -> bool {
    Quantity::ALL.into_iter().any(|one| one.scale(text).is_some())
}

/// Names of columns that only one layout has.
type Words = &'static [(Quantity, &'static [&'static str])];

fn quantity_in(name: &str, words: Words) -> Option<Quantity> {
    let name = name.trim().to_lowercase();
    let of_name =
        |(_, words): &&(Quantity, &'static [&'static str])| words.contains(&name.as_str());
    words.iter().find(of_name).map(|(quantity, _)| *quantity)
}

fn quantity_of(name: &str) -> Option<Quantity> {
    let name = name.trim().replace('_', " ").to_lowercase();
    Quantity::ALL.into_iter().find(|quantity| words(*quantity).contains(&name.as_str()))
}

/// A column's name and its unit, if the name ends in one: `Time, s`, `Force [mN]`, `x_mm`, `Weg in µm`.
fn split_unit(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    if let Some((name, unit)) = cell.strip_suffix(']').and_then(|cell| cell.rsplit_once('[')) {
        return (name.trim(), Some(unit.trim()));
    }
    if let Some((name, unit)) = cell.strip_suffix(')').and_then(|cell| cell.rsplit_once('(')) {
        // `Position (z)` names an axis.
        let is_axis = matches!(unit.trim(), "x" | "y" | "z");
        return if is_axis { (cell, None) } else { (name.trim(), Some(unit.trim())) };
    }
    for mark in [",", " in ", "/"] {
        if let Some((name, unit)) = cell.rsplit_once(mark) {
            return (name.trim(), Some(unit.trim()));
        }
    }
    let last = cell.rsplit_once(['_', ' ']);
    match last.filter(|(name, unit)| {
        is_known_unit(unit) || quantity_of(name).is_some() && quantity_of(cell).is_none()
    }) {
        Some((name, unit)) => (name.trim(), Some(unit)),
        None => (cell, None),
    }
}

/// Whether a cell could be a unit in a row of units.
pub(super) fn is_unit_cell(cell: &str) -> bool {
    let bare = bare_unit(cell);
    is_known_unit(bare) || bare.chars().count() <= 8 && quantity_of(cell).is_none()
}

/// Whether a cell is a unit that is known.
pub(super) fn is_known_unit_cell(cell: &str) -> bool {
    is_known_unit(bare_unit(cell))
}

/// Whether a cell names something that is read.
pub(super) fn is_named(cell: &str) -> bool {
    quantity_of(split_unit(cell).0).is_some() || quantity_of(cell).is_some()
}

fn bare_unit(cell: &str) -> &str {
    cell.trim().trim_matches(['[', ']', '(', ')']).trim()
}

/// Why the columns of a part are not known.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Unknown {
    /// It has no time or no rows: it is no measurement.
    NoMeasurement(String),
    /// It has one, and something else is missing or unclear.
    Other(String),
}

/// Finds the columns of a part.
pub(super) fn find(
    header: &Header,
    words: Words,
    told: &Told,
    said: &mut Said,
) -> Result<Columns, Unknown> {
    let other = Unknown::Other;
    let mut column = |quantity| column(quantity, header, words, told, said);
    let time = column(Quantity::Time)
        .map_err(other)?
        .ok_or_else(|| Unknown::NoMeasurement(missing(Quantity::Time, header)))?;
    let mut needed = |quantity| {
        column(quantity)
            .and_then(|found| found.ok_or_else(|| missing(quantity, header)))
            .map_err(other)
    };
    Ok(Columns {
        time,
        depth: needed(Quantity::Depth)?,
        force: needed(Quantity::Force)?,
        signal: column(Quantity::Signal).map_err(other)?,
        phase: header.names.iter().position(|name| name == "phase"),
    })
}

fn missing(quantity: Quantity, header: &Header) -> String {
    let names: Vec<String> = header
        .names
        .iter()
        .filter(|name| !name.is_empty())
        .map(|name| format!("'{name}'"))
        .collect();
    format!(
        "no column is known as the {0} ({1} has {2}); say which is, as in {0}=NAME, or {0}=-NAME to turn its sign",
        quantity.name(),
        header.place,
        names.join(", ")
    )
}

fn column(
    quantity: Quantity,
    header: &Header,
    words: Words,
    told: &Told,
    said: &mut Said,
) -> Result<Option<Column>, String> {
    let what = quantity.name();
    let choice = told.columns.iter().rfind(|one| one.quantity == quantity);
    let found = match choice {
        Some(choice) => Some(chosen(&choice.name, header)?),
        None => named(quantity, header, words)?.map(|index| (index, false)),
    };
    let Some((index, is_turned)) = found else {
        return Ok(None);
    };
    let name = header.names.get(index).map_or("", String::as_str);
    let in_row = header.units.get(index).map(|unit| bare_unit(unit));
    let in_row = in_row.filter(|unit| !unit.is_empty());
    let in_name = split_unit(name).1;
    let told_unit = told.units.iter().rfind(|one| one.quantity == quantity);
    let unit = told_unit.map(|one| one.unit.as_str()).or(in_row).or(in_name);
    let (unit, is_assumed) = match unit {
        Some(unit) => (unit, false),
        // A time by its name alone is in seconds in every instrument's table we know.
        None if quantity == Quantity::Time => ("s", true),
        None => {
            return Err(format!(
                "the {what} '{name}' has no unit; say it, as in {what}=UNIT, one of {}",
                quantity.known_units()
            ));
        }
    };
    let scale = quantity.scale(unit).ok_or_else(|| {
        format!(
            "the unit '{unit}' of the {what} '{name}' is not known; say one, as in {what}=UNIT, known are {}",
            quantity.known_units()
        )
    })?;
    let zero = told.zeros.iter().rfind(|one| one.quantity == quantity);
    let zero = match zero.map(|one| one.value) {
        None => Zero::AsItIs,
        Some(None) => Zero::First,
        Some(Some(value)) => Zero::At(value),
    };
    let turned = if is_turned { ", its sign turned" } else { "" };
    let assumed = if is_assumed { ", assumed for want of a unit" } else { "" };
    let from = match zero {
        Zero::AsItIs => String::new(),
        Zero::First => ", counted from the first row".into(),
        Zero::At(value) => format!(", counted from {value}"),
    };
    said.say(
        what,
        format!("column {} '{name}' in {unit}{assumed}{turned}{from}", index + 1),
        choice.is_some() || told_unit.is_some() || zero != Zero::AsItIs,
        &format!("--column {what}=NAME --unit {what}=UNIT"),
    );
    Ok(Some(Column { index, scale, is_turned, zero }))
}

/// The column of a name or number, and whether its sign is to be turned.
fn chosen(name: &str, header: &Header) -> Result<(usize, bool), String> {
    let find = |name: &str| -> Vec<usize> {
        let is_it = |cell: &str| {
            let same = |one: &str| one.to_lowercase() == name.to_lowercase();
            same(cell.trim()) || same(split_unit(cell).0)
        };
        let names = header.names.iter().enumerate();
        names.filter(|(_, cell)| is_it(cell)).map(|(i, _)| i).collect()
    };
    let (bare, is_turned) = match name.strip_prefix('-') {
        Some(bare) if find(name).is_empty() => (bare.trim(), true),
        _ => (name, false),
    };
    let number = bare.parse().ok().filter(|n| (1..=header.width).contains(n));
    match (find(bare)[..].as_ref(), number) {
        ([index], _) => Ok((*index, is_turned)),
        ([], Some(number)) => Ok((number - 1, is_turned)),
        ([], None) => Err(format!(
            "no column is called '{bare}' in {}; give a name as it stands there, or the column's number",
            header.place
        )),
        ([first, second, ..], _) => Err(format!(
            "columns {} and {} are both called '{bare}'; give the column's number instead",
            first + 1,
            second + 1
        )),
    }
}

fn named(quantity: Quantity, header: &Header, words: Words) -> Result<Option<usize>, String> {
    let is_it = |cell: &str| {
        let is_name =
            |name: &str| quantity_of(name).or_else(|| quantity_in(name, words)) == Some(quantity);
        is_name(cell) || is_name(split_unit(cell).0)
    };
    let names = header.names.iter().enumerate();
    let found: Vec<usize> = names.filter(|(_, cell)| is_it(cell)).map(|(i, _)| i).collect();
    match found[..] {
        [] => Ok(None),
        [index] => Ok(Some(index)),
        [first, second, ..] => Err(format!(
            "columns '{}' and '{}' could both be the {what}; say which, as in {what}=NAME",
            header.names[first],
            header.names[second],
            what = quantity.name()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_units_come_apart() {
        for (cell, expected) in [
            ("Time, s", ("Time", Some("s"))),
            ("Position (z), mm", ("Position (z)", Some("mm"))),
            ("Position (z)", ("Position (z)", None)),
            ("Fz, gf", ("Fz", Some("gf"))),
            ("Force [mN]", ("Force", Some("mN"))),
            ("Force (furlong)", ("Force", Some("furlong"))),
            ("x_mm", ("x", Some("mm"))),
            ("Weg in µm", ("Weg", Some("µm"))),
            ("Standard force", ("Standard force", None)),
            ("Step time", ("Step time", None)),
            ("depth_furlong", ("depth", Some("furlong"))),
            ("Load/kN", ("Load", Some("kN"))),
        ] {
            assert_eq!(split_unit(cell), expected, "{cell}");
        }
    }

    #[test]
    fn what_a_row_of_units_is_made_of() {
        for (cell, is_unit, is_known) in [
            ("[s]", true, true),
            ("mm", true, true),
            ("%", true, false),
            ("Force", false, false),
            ("[mPa·s]", true, false),
            ("Test time remaining", false, false),
        ] {
            assert_eq!(
                (is_unit_cell(cell), is_known_unit_cell(cell)),
                (is_unit, is_known),
                "{cell}"
            );
        }
    }
}
