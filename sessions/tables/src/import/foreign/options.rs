//! Options for reading a foreign file; everything else is detected.

use super::super::header::Quantity;
use super::decimal::DecimalSign;
use super::encoding::TextEncoding;
use super::formats::ForeignFormat;
use super::rows::Delimiter;

/// An option that is not set is detected.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    pub format: Option<ForeignFormat>,
    pub delimiter: Option<Delimiter>,
    pub encoding: Option<TextEncoding>,
    pub decimal: Option<DecimalSign>,
    /// Names of all columns, in order, for a file without names.
    pub names: Vec<String>,
    pub columns: Vec<ColumnChoice>,
    pub units: Vec<UnitChoice>,
    pub zeros: Vec<ZeroChoice>,
    /// Line of the column names, from 1.
    pub header_row: Option<usize>,
    /// Line of the units, from 1; 0 for none.
    pub units_row: Option<usize>,
    /// Sheets, blocks or intervals by name or number from 1; empty for all.
    pub parts: Vec<String>,
    /// Rows to leave out instead of refusing them.
    pub skip: Vec<RowFault>,
}

palpate_model::named! {
    /// A fault of a row.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RowFault {
        /// A value is empty or NaN.
        Missing = "missing",
        /// The time equals that of the row before.
        Repeated = "repeated",
        /// The time is less than that of the row before.
        Backward = "backward",
    }
}

impl std::str::FromStr for RowFault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|one| one.name() == text);
        found.ok_or_else(|| format!("give {}", Self::ALL.map(Self::name).join(", ")))
    }
}

fn split_quantity(text: &str, what: &str) -> Result<(Quantity, String), String> {
    let names = || Quantity::ALL.map(Quantity::name).join(", ");
    let wrong = || format!("give QUANTITY={what}, where QUANTITY is one of {}", names());
    let (name, rest) = text.split_once('=').ok_or_else(wrong)?;
    let quantity =
        Quantity::ALL.into_iter().find(|one| one.name() == name.trim()).ok_or_else(wrong)?;
    match rest.trim() {
        "" => Err(wrong()),
        rest => Ok((quantity, rest.to_owned())),
    }
}

/// `depth=NAME`; a minus before the name inverts the sign of the values.
#[derive(Clone, Debug)]
pub struct ColumnChoice {
    pub(super) quantity: Quantity,
    pub(super) name: String,
}

impl std::str::FromStr for ColumnChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (quantity, name) = split_quantity(text, "NAME")?;
        Ok(Self { quantity, name })
    }
}

/// `force=gf`.
#[derive(Clone, Debug)]
pub struct UnitChoice {
    pub(super) quantity: Quantity,
    pub(super) unit: String,
}

impl std::str::FromStr for UnitChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (quantity, unit) = split_quantity(text, "UNIT")?;
        if quantity.scale(&unit).is_none() {
            return Err(format!(
                "the unit '{unit}' of the {} is unknown; give one of {}",
                quantity.name(),
                quantity.known_units()
            ));
        }
        Ok(Self { quantity, unit })
    }
}

/// `depth=first` or `depth=12.5`, in s, mm, N or V.
#[derive(Clone, Debug)]
pub struct ZeroChoice {
    pub(super) quantity: Quantity,
    /// `None` for the value of the first row.
    pub(super) value: Option<f64>,
}

impl std::str::FromStr for ZeroChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (quantity, rest) = split_quantity(text, "first|NUMBER")?;
        if quantity == Quantity::Time {
            return Err("time always counts from the first row and has no other zero; name depth, force or signal".into());
        }
        let value = match rest.as_str() {
            "first" => None,
            number => {
                let value = number.parse().ok().filter(|value: &f64| value.is_finite());
                Some(value.ok_or("give 'first' or a number in mm, N or V")?)
            }
        };
        Ok(Self { quantity, value })
    }
}
