//! Gauge Control Language 2: readings, errors and settings of Mark-10 gauges.
//!
//! Commands end with CR or CR LF, answers with CR LF; commands that set something are silent unless they fail (Series 5
//! user's guide, pages 17 to 19; Model 7i user's guide, pages 29 to 31; Series 4 user's guide, page 16).

pub use crate::text::FixedDecimal;

palpate_model::named! {
    /// A unit of force. Gauges have units of torque and units that the user defines too; those are none.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ForceUnit {
        /// `mN`.
        Millinewton = "mN",
        /// `N`.
        Newton = "N",
        /// `kN`.
        Kilonewton = "kN",
        /// `gF`.
        Gram = "gF",
        /// `kgF`.
        Kilogram = "kgF",
        /// `ozF`.
        Ounce = "ozF",
        /// `lbF`.
        Pound = "lbF",
    }
}

/// Newtons of a kilogram-force, exactly (3rd CGPM, 1901).
const KILOGRAM_FORCE: f64 = 9.806_65;
/// Kilograms of an avoirdupois pound, exactly (international yard and pound agreement, 1959).
const POUND: f64 = 0.453_592_37;

impl ForceUnit {
    /// Reads it as readings and settings write it: `lbF`, `LBF`, `LB`.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let is_it = |unit: &Self| {
            let name = unit.name();
            [name, name.trim_end_matches('F')].iter().any(|word| word.eq_ignore_ascii_case(text))
        };
        Self::ALL.into_iter().find(is_it)
    }

    #[must_use]
    pub const fn newtons(self) -> f64 {
        match self {
            Self::Millinewton => 1e-3,
            Self::Newton => 1.0,
            Self::Kilonewton => 1e3,
            Self::Gram => 1e-3 * KILOGRAM_FORCE,
            Self::Kilogram => KILOGRAM_FORCE,
            Self::Ounce => POUND / 16.0 * KILOGRAM_FORCE,
            Self::Pound => POUND * KILOGRAM_FORCE,
        }
    }
}

/// A reading: compression positive, tension negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GaugeReading {
    pub number: FixedDecimal,
    pub unit: ForceUnit,
}

/// A force, or that it is beyond the range of the gauge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaugeForce {
    Reading(GaugeReading),
    Overload,
}

/// The answer to `LIST`: settings, by the abbreviations that set them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GaugeList {
    pub firmware: String,
    /// Unit of force; what stands there when it is another unit.
    pub unit: Result<ForceUnit, String>,
    /// `CUR` for current readings.
    pub mode: String,
    /// Exponent of the filter of displayed readings, 2^n samples.
    pub filter_displayed: Option<u8>,
    pub filter_current: Option<u8>,
    pub has_units: bool,
    /// Whether tension is positive; some firmware does not say.
    pub is_inverted: Option<bool>,
    pub is_unsigned: Option<bool>,
    pub line: String,
}

#[derive(Clone, Debug, PartialEq)]
pub enum GaugeLine {
    Reading(GaugeReading),
    /// A reading beyond the gauge's range.
    Overload,
    /// The last command was refused: `*10` illegal, `*11` not applicable, `*12` invalid specifier, `*22` value too
    /// large (Series 5 user's guide, page 19).
    Error,
    /// The answer to `LIST`.
    List(GaugeList),
    Other(String),
}

impl GaugeLine {
    /// Reads a line without its end.
    #[must_use]
    pub fn parse(line: &str) -> Self {
        let line = line.trim();
        if matches!(line, "*10" | "*11" | "*12" | "*22") {
            return Self::Error;
        }
        if let Some((number, unit)) = line.split_once(' ')
            && let (Some(number), Some(unit)) =
                (FixedDecimal::parse(number), ForceUnit::parse(unit.trim_start()))
        {
            return Self::Reading(GaugeReading { number, unit });
        }
        // A guess: the guides say what the display shows, not what is sent then.
        if line.to_ascii_uppercase().starts_with("OVER") {
            return Self::Overload;
        }
        GaugeList::parse(line).map_or_else(|| Self::Other(line.to_owned()), Self::List)
    }
}

impl GaugeLine {
    pub fn force(&self) -> Option<GaugeForce> {
        match self {
            Self::Reading(reading) => Some(GaugeForce::Reading(*reading)),
            Self::Overload => Some(GaugeForce::Overload),
            _ => None,
        }
    }

    /// The settings of a gauge.
    pub fn list(self) -> Option<GaugeList> {
        match self {
            Self::List(list) => Some(list),
            _ => None,
        }
    }

    /// A text that was asked for; `Some(None)` where the gauge does not know the command. A serial number may be all
    /// digits; a reading always has its unit.
    pub fn text_or_error(self) -> Option<Option<String>> {
        match self {
            Self::Other(text) => Some(Some(text)),
            Self::Error => Some(None),
            _ => None,
        }
    }
}

impl GaugeList {
    fn parse(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split(';').map(str::trim).collect();
        let firmware = fields.first()?.strip_prefix('V')?;
        let is_version = firmware.starts_with(|c: char| c.is_ascii_digit());
        if !is_version || fields.len() < 4 {
            return None;
        }
        let after = |name: &str| fields.iter().find_map(|field| field.strip_prefix(name));
        let flag = |name: &str| match after(name) {
            Some("1") => Some(true),
            Some("0") => Some(false),
            _ => None,
        };
        let small = |name: &str| after(name).and_then(|n| n.parse().ok());
        Some(Self {
            firmware: firmware.to_owned(),
            unit: ForceUnit::parse(fields[1]).ok_or_else(|| fields[1].to_owned()),
            mode: fields[2].to_owned(),
            filter_displayed: small("FLTC"),
            filter_current: small("FLTP"),
            has_units: fields.contains(&"FULL"),
            is_inverted: flag("IPOL"),
            is_unsigned: flag("OPOL"),
            line: line.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(line: &str) -> Option<(i32, u8, ForceUnit)> {
        match GaugeLine::parse(line) {
            GaugeLine::Reading(GaugeReading { number, unit }) => {
                Some((number.digits, number.decimals, unit))
            }
            _ => None,
        }
    }

    #[test]
    fn readings_of_the_series_4_guide() {
        // Page 16, "Example return strings".
        assert_eq!(reading("-18.78 lbF"), Some((-1878, 2, ForceUnit::Pound)));
        assert_eq!(reading("4.285 N"), Some((4285, 3, ForceUnit::Newton)));
        let number = FixedDecimal::parse("4.285").unwrap();
        assert_eq!((number.value(), number.step()), (4.285, 1e-3));
        assert_eq!(FixedDecimal::parse("-0.005").unwrap().value(), -0.005);
    }

    #[test]
    fn lines_without_number_and_unit_are_no_readings() {
        for wrong in [
            "4.285",
            "+4.285 N",
            "4.285 NM",
            "4,285 N",
            "4.2.5 N",
            ". N",
            "4. N",
            ".5 N",
            "- N",
            "1e3 N",
            "N",
            "123456789 N",
            "4.285 N N",
            "0.123456 N",
            "nan N",
        ] {
            assert_eq!(reading(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn settings_of_the_series_5_guide() {
        // Page 19, "example LIST output".
        let line = "V1.00;LBF;CUR;FLTC8;FLTP1;AOUT00;AOFF5;FULL;MIT;POL;B0";
        let GaugeLine::List(list) = GaugeLine::parse(line) else {
            panic!("no list");
        };
        assert_eq!(list.firmware, "1.00");
        assert_eq!(list.unit, Ok(ForceUnit::Pound));
        assert_eq!(list.mode, "CUR");
        assert_eq!((list.filter_displayed, list.filter_current), (Some(8), Some(1)));
        assert!(list.has_units);
        assert_eq!((list.is_inverted, list.is_unsigned), (None, None));
        let GaugeLine::List(list) = GaugeLine::parse("V2.1;LBIN;PT;IPOL1;OPOL0;NUM;AOUT125") else {
            panic!("no list");
        };
        assert_eq!(list.unit, Err("LBIN".to_owned()));
        assert_eq!((list.is_inverted, list.is_unsigned), (Some(true), Some(false)));
        assert!(!list.has_units);
    }

    #[test]
    fn errors_of_the_series_5_guide() {
        // Page 19.
        for line in ["*10", "*11", "*12", "*22"] {
            assert_eq!(GaugeLine::parse(line), GaugeLine::Error, "{line}");
        }
        assert_eq!(GaugeLine::parse("*13"), GaugeLine::Other("*13".into()));
    }

    #[test]
    fn units_are_those_of_the_tables() {
        // NIST SP 811, appendix B.8: lbf 4.448222, ozf 0.2780139, kgf 9.80665.
        for (name, newtons) in [
            ("mN", 1e-3),
            ("N", 1.0),
            ("kN", 1e3),
            ("gF", 9.80665e-3),
            ("kgF", 9.80665),
            ("ozF", 0.278_013_9),
            ("lbF", 4.448_222),
        ] {
            let unit = ForceUnit::parse(name).unwrap();
            assert_eq!(unit.name(), name);
            assert!((unit.newtons() / newtons - 1.0).abs() < 2e-7, "{name}");
        }
        assert_eq!(ForceUnit::parse("LBFT"), None);
    }
}
