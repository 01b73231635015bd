//! Quantities and units of the columns: from their names, from a row of units, or from options.

use super::super::header::{Quantity, Scale};
use super::layout::Header;
use super::options::ImportOptions;
use super::readings::ReadingList;

/// The column of a quantity and the conversion of its values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub index: usize,
    pub scale: Scale,
    pub is_inverted: bool,
    pub zero: Zero,
}

/// Offset that is subtracted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zero {
    Unchanged,
    First,
    /// The value of the row with this number.
    Row(usize),
    /// In s, mm, N or V.
    At(f64),
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Columns {
    pub time: Column,
    pub depth: Column,
    pub force: Column,
    pub signal: Option<Column>,
    pub phase: Option<usize>,
}

/// Lower-case names of a quantity in files of several makers and languages.
fn names_of(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Time => {
            "t, time, test time, elapsed time, total time, step time, interval time, zeit, \
                prüfzeit, temps, temps d'essai, tempo, tempo di prova, tiempo, tiempo de ensayo, \
                时间, 试验时间, 测试时间"
        }
        Quantity::Depth => {
            "x, d, depth, indentation, displacement, extension, deformation, position, \
                position (z), travel, standard travel, crosshead travel, weg, standardweg, \
                traversenweg, verformung, déplacement, déformation, déplacement standard, \
                allongement, spostamento, deformazione, desplazamiento, deformación, extensión, 位移, 变形"
        }
        Quantity::Force => {
            "f, fz, force, load, standard force, normal force, axial force, kraft, \
                standardkraft, prüfkraft, normalkraft, force standard, charge, forza, \
                forza standard, carico, fuerza, fuerza estándar, carga, 力, 试验力, 载荷, 负荷"
        }
        Quantity::Signal => "signal, voltage, spannung, tension",
    }
}

fn is_known_unit(text: &str) -> bool {
    Quantity::ALL.into_iter().any(|one| one.scale(text).is_some())
}

/// Lower-case column names of a single layout, by quantity, separated by a comma and a space.
pub(super) type LayoutNames = &'static [(Quantity, &'static str)];

fn is_listed(name: &str, names: &str) -> bool {
    names.split(", ").any(|one| one == name)
}

fn quantity_in(name: &str, names: LayoutNames) -> Option<Quantity> {
    let name = name.trim().to_lowercase();
    names.iter().find(|(_, names)| is_listed(&name, names)).map(|(quantity, _)| *quantity)
}

fn quantity_of(name: &str) -> Option<Quantity> {
    let name = name.trim().replace('_', " ").to_lowercase();
    Quantity::ALL.into_iter().find(|quantity| is_listed(&name, names_of(*quantity)))
}

/// Splits a column's name from a unit at its end: `Time, s`, `Force [mN]`, `x_mm`, `Weg in µm`.
fn split_unit(cell: &str) -> (&str, Option<&str>) {
    let cell = cell.trim();
    if let Some((name, unit)) = cell.strip_suffix(']').and_then(|cell| cell.rsplit_once('[')) {
        return (name.trim(), Some(unit.trim()));
    }
    if let Some((name, unit)) = cell.strip_suffix(')').and_then(|cell| cell.rsplit_once('(')) {
        // `(z)` in `Position (z)` is an axis.
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

pub(super) fn is_unit_cell(cell: &str) -> bool {
    let bare = bare_unit(cell);
    is_known_unit(bare) || bare.chars().count() <= 8 && quantity_of(cell).is_none()
}

pub(super) fn is_known_unit_cell(cell: &str) -> bool {
    is_known_unit(bare_unit(cell))
}

/// Whether a cell names a quantity.
pub(super) fn is_quantity_name(cell: &str) -> bool {
    quantity_of(split_unit(cell).0).is_some() || quantity_of(cell).is_some()
}

fn bare_unit(cell: &str) -> &str {
    cell.trim().trim_matches(['[', ']', '(', ')']).trim()
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum ColumnError {
    /// Without a time or rows, the part is not a measurement.
    NoMeasurement(String),
    /// Another column is missing or ambiguous.
    Other(String),
}

pub(super) fn find(
    header: &Header,
    words: LayoutNames,
    options: &ImportOptions,
    readings: &mut ReadingList,
) -> Result<Columns, ColumnError> {
    let other = ColumnError::Other;
    let mut column = |quantity| column(quantity, header, words, options, readings);
    let time = column(Quantity::Time)
        .map_err(other)?
        .ok_or_else(|| ColumnError::NoMeasurement(missing(Quantity::Time, header)))?;
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
        "no column is recognised as the {0} ({1} has {2}); name the column, as in {0}=NAME, or {0}=-NAME to invert its sign",
        quantity.name(),
        header.place,
        names.join(", ")
    )
}

fn column(
    quantity: Quantity,
    header: &Header,
    words: LayoutNames,
    options: &ImportOptions,
    readings: &mut ReadingList,
) -> Result<Option<Column>, String> {
    let what = quantity.name();
    let choice = options.columns.iter().rfind(|one| one.quantity == quantity);
    let found = match choice {
        Some(choice) => Some(find_chosen(&choice.name, header)?),
        None => detect(quantity, header, words)?.map(|index| (index, false)),
    };
    let Some((index, is_inverted)) = found else {
        return Ok(None);
    };
    let name = header.names.get(index).map_or("", String::as_str);
    let in_row = header.units.get(index).map(|unit| bare_unit(unit));
    let in_row = in_row.filter(|unit| !unit.is_empty());
    let in_name = split_unit(name).1;
    let chosen_unit = options.units.iter().rfind(|one| one.quantity == quantity);
    let unit = chosen_unit.map(|one| one.unit.as_str()).or(in_row).or(in_name);
    let (unit, is_assumed) = match unit {
        Some(unit) => (unit, false),
        // All known instruments write times without a unit in seconds.
        None if quantity == Quantity::Time => ("s", true),
        None => {
            return Err(format!(
                "the {what} '{name}' has no unit; give it as {what}=UNIT, where UNIT is one of {}",
                quantity.known_units()
            ));
        }
    };
    let scale = quantity.scale(unit).ok_or_else(|| {
        format!(
            "the unit '{unit}' of the {what} '{name}' is unknown; give {what}=UNIT, where UNIT is one of {}",
            quantity.known_units()
        )
    })?;
    let zero = options.zeros.iter().rfind(|one| one.quantity == quantity);
    let zero = match zero.map(|one| one.value) {
        None => Zero::Unchanged,
        Some(None) => Zero::First,
        Some(Some(value)) => Zero::At(value),
    };
    let inverted = if is_inverted { ", its sign inverted" } else { "" };
    let assumed = if is_assumed { ", assumed because the column has no unit" } else { "" };
    let from = match zero {
        Zero::Unchanged | Zero::Row(_) => String::new(),
        Zero::First => ", counted from the first row".into(),
        Zero::At(value) => format!(", counted from {value}"),
    };
    readings.add(
        what,
        format!("column {} '{name}' in {unit}{assumed}{inverted}{from}", index + 1),
        choice.is_some() || chosen_unit.is_some() || zero != Zero::Unchanged,
        &format!("--column {what}=NAME --unit {what}=UNIT"),
    );
    Ok(Some(Column { index, scale, is_inverted, zero }))
}

/// Finds a column by name or number; a minus before the name inverts its sign.
fn find_chosen(name: &str, header: &Header) -> Result<(usize, bool), String> {
    let find = |name: &str| -> Vec<usize> {
        let is_it = |cell: &str| {
            let same = |one: &str| one.to_lowercase() == name.to_lowercase();
            same(cell.trim()) || same(split_unit(cell).0)
        };
        let names = header.names.iter().enumerate();
        names.filter(|(_, cell)| is_it(cell)).map(|(i, _)| i).collect()
    };
    let (bare, is_inverted) = match name.strip_prefix('-') {
        Some(bare) if find(name).is_empty() => (bare.trim(), true),
        _ => (name, false),
    };
    let number = bare.parse().ok().filter(|n| (1..=header.width).contains(n));
    match (find(bare)[..].as_ref(), number) {
        ([index], _) => Ok((*index, is_inverted)),
        ([], Some(number)) => Ok((number - 1, is_inverted)),
        ([], None) => Err(format!(
            "{} has no column '{bare}'; give the column's name as it is written there, or the column's number",
            header.place
        )),
        ([first, second, ..], _) => Err(format!(
            "columns {} and {} both have the name '{bare}'; give the column's number instead",
            first + 1,
            second + 1
        )),
    }
}

fn detect(
    quantity: Quantity,
    header: &Header,
    words: LayoutNames,
) -> Result<Option<usize>, String> {
    let is_it = |cell: &str| {
        let is_name =
            |name: &str| quantity_of(name).or_else(|| quantity_in(name, words)) == Some(quantity);
        let (name, unit) = split_unit(cell);
        // Below a row of units, the last word of `Traversenweg absolut` is none.
        let may_have_unit = header.units.is_empty() || unit.is_some_and(is_known_unit);
        is_name(cell) || may_have_unit && is_name(name)
    };
    let names = header.names.iter().enumerate();
    let found: Vec<usize> = names.filter(|(_, cell)| is_it(cell)).map(|(i, _)| i).collect();
    // TRIOS writes the time of a step under three names, and the times differ by where they begin.
    let is_time = |index: &&usize| header.names[**index].trim().eq_ignore_ascii_case("time");
    let time = found.iter().find(is_time).filter(|_| quantity == Quantity::Time);
    if let Some(time) = time {
        return Ok(Some(*time));
    }
    match found[..] {
        [] => Ok(None),
        [index] => Ok(Some(index)),
        [first, second, ..] => Err(format!(
            "columns '{}' and '{}' could both be the {what}; choose one, as in {what}=NAME",
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
    fn names_and_units_are_separated() {
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
    fn unit_cells_are_recognised() {
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
