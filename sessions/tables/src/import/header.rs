//! Quantity and unit of a column from its name, and all known units.

palpate_model::named! {
    /// What a fit needs from a table.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum Quantity {
        Time = "time",
        Depth = "depth",
        Force = "force",
        Signal = "signal",
    }
}

/// Factor of a unit as a quotient of two exact floats, so that a conversion rounds once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    times: f64,
    over: f64,
}

impl Scale {
    pub const ONE: Self = Self { times: 1.0, over: 1.0 };

    pub fn apply(self, value: f64) -> f64 {
        value * self.times / self.over
    }
}

/// A unit's names, the displayed one first, and its factor to s, mm, N or V as a quotient.
type Unit = (&'static [&'static str], f64, f64);

const TIMES: &[Unit] = &[
    (&["s", "sec", "secs", "second", "seconds", "sek"], 1.0, 1.0),
    (&["ms", "msec"], 1.0, 1e3),
    (&["µs", "us", "μs"], 1.0, 1e6),
    (&["min", "minutes"], 60.0, 1.0),
    (&["h", "hr", "hours"], 3600.0, 1.0),
];

const DEPTHS: &[Unit] = &[
    (&["mm"], 1.0, 1.0),
    (&["µm", "um", "μm", "micron", "microns"], 1.0, 1e3),
    (&["nm"], 1.0, 1e6),
    (&["cm"], 10.0, 1.0),
    (&["m"], 1e3, 1.0),
    // International inch, exact since 1959.
    (&["in", "inch"], 254.0, 10.0),
];

const FORCES: &[Unit] = &[
    (&["N", "n"], 1.0, 1.0),
    // Letter case separates mN from MN.
    (&["mN", "mn"], 1.0, 1e3),
    (&["µN", "uN", "μN"], 1.0, 1e6),
    (&["cN"], 1.0, 1e2),
    (&["kN"], 1e3, 1.0),
    // Standard gravity, 9.80665 m/s², exact (3rd CGPM, 1901); one pound is 0.45359237 kg, exact.
    (&["gf"], 980_665.0, 1e8),
    (&["kgf", "kp"], 980_665.0, 1e5),
    (&["lbf"], 44_482_216_152_605.0, 1e13),
];

const SIGNALS: &[Unit] =
    &[(&["V", "volt", "volts"], 1.0, 1.0), (&["mV"], 1.0, 1e3), (&["µV", "uV", "μV"], 1.0, 1e6)];

impl Quantity {
    pub const FITTED: [Self; 3] = [Self::Time, Self::Depth, Self::Force];

    /// An example of a valid header.
    pub fn example(self) -> &'static str {
        match self {
            Self::Time => "t_s",
            Self::Depth => "depth_mm",
            Self::Force => "force_N",
            Self::Signal => "signal_V",
        }
    }

    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Time => &["t", "time"],
            Self::Depth => &["x", "depth", "indentation", "displacement", "d"],
            Self::Force => &["f", "force", "load"],
            Self::Signal => &["signal", "voltage"],
        }
    }

    fn units(self) -> &'static [Unit] {
        match self {
            Self::Time => TIMES,
            Self::Depth => DEPTHS,
            Self::Force => FORCES,
            Self::Signal => SIGNALS,
        }
    }

    /// Factor of a unit to s, mm, N or V.
    pub fn scale(self, unit: &str) -> Option<Scale> {
        let known = |(names, ..): &&Unit| names.contains(&unit);
        let (_, times, over) = *self.units().iter().find(known)?;
        Some(Scale { times, over })
    }

    /// The units that are known.
    pub fn known_units(self) -> String {
        let names: Vec<&str> = self.units().iter().map(|(names, ..)| names[0]).collect();
        names.join(", ")
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HeaderCell {
    /// A quantity with the factor of its unit.
    Known(Quantity, Scale),
    /// A quantity without a unit.
    Bare(Quantity),
    /// A quantity with an unknown unit.
    Unitless(Quantity),
    Other,
}

/// Reads `t_s`, `time (s)`, `Force [mN]`, `x mm` and the like.
pub(super) fn parse_header_cell(cell: &str) -> HeaderCell {
    let words: Vec<&str> = cell
        .split(|c: char| c == '_' || c.is_whitespace() || "()[]/,:".contains(c))
        .filter(|word| !word.is_empty())
        .collect();
    let Some((name, rest)) = words.split_first() else {
        return HeaderCell::Other;
    };
    let name = name.to_lowercase();
    let Some(quantity) = Quantity::FITTED.into_iter().find(|q| q.words().contains(&name.as_str()))
    else {
        return HeaderCell::Other;
    };
    match rest {
        [] => HeaderCell::Bare(quantity),
        [unit] => quantity
            .scale(unit)
            .map_or(HeaderCell::Unitless(quantity), |scale| HeaderCell::Known(quantity, scale)),
        _ => HeaderCell::Unitless(quantity),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_units_are_recognised() {
        let check = |cell: &str, quantity: Quantity, one: f64| {
            let HeaderCell::Known(found, scale) = parse_header_cell(cell) else {
                panic!("{cell}: {:?}", parse_header_cell(cell));
            };
            assert_eq!((found, scale.apply(1.0)), (quantity, one), "{cell}");
        };
        check("t_s", Quantity::Time, 1.0);
        check("Time (ms)", Quantity::Time, 1e-3);
        check("depth_mm", Quantity::Depth, 1.0);
        check("x_mm", Quantity::Depth, 1.0);
        check("Indentation [um]", Quantity::Depth, 1e-3);
        check("F_N", Quantity::Force, 1.0);
        check("Force [mN]", Quantity::Force, 1e-3);
        check("Load / kN", Quantity::Force, 1e3);
        check("Force, gf", Quantity::Force, 0.009_806_65);
        check("F [lbf]", Quantity::Force, 4.448_221_615_260_5);
    }

    #[test]
    fn names_without_units_and_foreign_names_are_distinguished() {
        assert_eq!(parse_header_cell("force"), HeaderCell::Bare(Quantity::Force));
        assert_eq!(parse_header_cell("Time"), HeaderCell::Bare(Quantity::Time));
        assert_eq!(parse_header_cell("depth_furlong"), HeaderCell::Unitless(Quantity::Depth));
        assert_eq!(parse_header_cell("signal_V"), HeaderCell::Other);
        assert_eq!(parse_header_cell(""), HeaderCell::Other);
    }

    #[test]
    fn conversion_rounds_once() {
        // 0.3 * 1e-3 is not the float nearest to 0.0003.
        let scale = Quantity::Force.scale("mN").unwrap();
        assert_eq!(scale.apply(0.3), 0.0003);
        let inch = Quantity::Depth.scale("in").unwrap();
        assert_eq!(inch.apply(1.0), 25.4);
    }
}
