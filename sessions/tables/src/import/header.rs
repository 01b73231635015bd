//! Which column of a table is which, and in which unit, from its name alone; and every unit that is known.

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

/// A unit as a quotient, each part of which is a float without error where the unit has a decimal or whole
/// factor: what is converted is then rounded once.
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

/// A unit's names, the first being the one shown, and its scale to s, mm, N or V.
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
    /// What a fit takes.
    pub const FITTED: [Self; 3] = [Self::Time, Self::Depth, Self::Force];

    /// A header that would be understood.
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

    /// Scale of a unit to s, mm, N or V.
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

/// What a header cell says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// A quantity with the scale to its unit here.
    Known(Quantity, Scale),
    /// A quantity by its name alone.
    Bare(Quantity),
    /// A quantity whose unit is unknown.
    Unitless(Quantity),
    /// Something else.
    Other,
}

/// Reads `t_s`, `time (s)`, `Force [mN]`, `x mm` and the like.
pub(super) fn meaning(cell: &str) -> Meaning {
    let words: Vec<&str> = cell
        .split(|c: char| c == '_' || c.is_whitespace() || "()[]/,:".contains(c))
        .filter(|word| !word.is_empty())
        .collect();
    let Some((name, rest)) = words.split_first() else {
        return Meaning::Other;
    };
    let name = name.to_lowercase();
    let Some(quantity) = Quantity::FITTED.into_iter().find(|q| q.words().contains(&name.as_str()))
    else {
        return Meaning::Other;
    };
    match rest {
        [] => Meaning::Bare(quantity),
        [unit] => quantity
            .scale(unit)
            .map_or(Meaning::Unitless(quantity), |scale| Meaning::Known(quantity, scale)),
        _ => Meaning::Unitless(quantity),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_units_are_understood() {
        let check = |cell: &str, quantity: Quantity, one: f64| {
            let Meaning::Known(found, scale) = meaning(cell) else {
                panic!("{cell}: {:?}", meaning(cell));
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
    fn names_without_units_and_foreign_names_are_told_apart() {
        assert_eq!(meaning("force"), Meaning::Bare(Quantity::Force));
        assert_eq!(meaning("Time"), Meaning::Bare(Quantity::Time));
        assert_eq!(meaning("depth_furlong"), Meaning::Unitless(Quantity::Depth));
        assert_eq!(meaning("signal_V"), Meaning::Other);
        assert_eq!(meaning(""), Meaning::Other);
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
