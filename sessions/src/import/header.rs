//! Which column of a table is which, and in which unit, from its name alone.

/// What a fit needs from a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Time,
    Depth,
    Force,
}

impl Quantity {
    pub const ALL: [Self; 3] = [Self::Time, Self::Depth, Self::Force];

    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Depth => "depth",
            Self::Force => "force",
        }
    }

    /// A header that would be understood.
    pub fn example(self) -> &'static str {
        match self {
            Self::Time => "t_s",
            Self::Depth => "depth_mm",
            Self::Force => "force_N",
        }
    }

    fn words(self) -> &'static [&'static str] {
        match self {
            Self::Time => &["t", "time"],
            Self::Depth => &["x", "depth", "indentation", "displacement", "d"],
            Self::Force => &["f", "force", "load"],
        }
    }

    /// Factor to s, mm or N. Letter case separates mN from MN, so only N may also be written n.
    fn factor(self, unit: &str) -> Option<f64> {
        let factor = match (self, unit) {
            (Self::Time, "s" | "sec") => 1.0,
            (Self::Time, "ms") => 1e-3,
            (Self::Time, "min") => 60.0,
            (Self::Depth, "mm") => 1.0,
            (Self::Depth, "um" | "µm" | "μm") => 1e-3,
            (Self::Depth, "m") => 1e3,
            (Self::Force, "N" | "n") => 1.0,
            (Self::Force, "mN" | "mn") => 1e-3,
            (Self::Force, "kN") => 1e3,
            _ => return None,
        };
        Some(factor)
    }
}

/// What a header cell says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meaning {
    /// A quantity with the factor to its unit here.
    Known(Quantity, f64),
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
    let Some(quantity) = Quantity::ALL
        .into_iter()
        .find(|q| q.words().contains(&name.as_str()))
    else {
        return Meaning::Other;
    };
    match rest {
        [] => Meaning::Bare(quantity),
        [unit] => quantity
            .factor(unit)
            .map_or(Meaning::Unitless(quantity), |factor| {
                Meaning::Known(quantity, factor)
            }),
        _ => Meaning::Unitless(quantity),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_units_are_understood() {
        let check = |cell: &str, quantity, factor| {
            assert_eq!(meaning(cell), Meaning::Known(quantity, factor), "{cell}")
        };
        check("t_s", Quantity::Time, 1.0);
        check("Time (ms)", Quantity::Time, 1e-3);
        check("depth_mm", Quantity::Depth, 1.0);
        check("x_mm", Quantity::Depth, 1.0);
        check("Indentation [um]", Quantity::Depth, 1e-3);
        check("F_N", Quantity::Force, 1.0);
        check("Force [mN]", Quantity::Force, 1e-3);
        check("Load / kN", Quantity::Force, 1e3);
    }

    #[test]
    fn names_without_units_and_foreign_names_are_told_apart() {
        assert_eq!(meaning("force"), Meaning::Bare(Quantity::Force));
        assert_eq!(meaning("Time"), Meaning::Bare(Quantity::Time));
        assert_eq!(meaning("depth_furlong"), Meaning::Unitless(Quantity::Depth));
        assert_eq!(meaning("signal_V"), Meaning::Other);
        assert_eq!(meaning(""), Meaning::Other);
    }
}
