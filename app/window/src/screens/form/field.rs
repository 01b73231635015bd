//! A parameter of a protocol as it is typed, and a label of the session.

use palpate_model::metadata::MetadataKey;
use palpate_model::rig::RigDescription;
use palpate_model::typed_number::plain_text;
use palpate_model::units::MmPerS;
use palpate_protocols::file::{ProtocolParameter, ProtocolValue, QuantityKind, ValueContent};

/// A parameter being typed.
#[derive(Clone, Debug)]
pub struct ParamField {
    pub parameter: ProtocolParameter,
    pub text: String,
    /// Of a number that is typed without a unit; empty where there is none.
    pub unit: &'static str,
    /// As the protocol takes it, or what is wrong.
    pub value: Result<String, String>,
    /// What the protocol has against the value.
    pub objection: Option<String>,
}

impl ParamField {
    /// The field of a parameter, with its usual value.
    #[must_use]
    pub fn new(parameter: ProtocolParameter) -> Self {
        let usual = &parameter.default;
        let first = match &usual.content {
            ValueContent::List(items) => items.first().unwrap_or(usual),
            _ => usual,
        };
        let (number, unit) = split(first, parameter.kind);
        let text = match &usual.content {
            ValueContent::None => String::new(),
            ValueContent::List(_) => usual.text.clone(),
            _ => number,
        };
        Self { value: Ok(usual.text.clone()), objection: None, text, unit, parameter }
    }

    /// Reads the text again; the rig must be able to make the speed and have the travel.
    pub fn check(&mut self, rig: &RigDescription) {
        self.value = self.read(rig);
    }

    fn read(&self, rig: &RigDescription) -> Result<String, String> {
        let text = self.text.trim();
        if text.is_empty() {
            return match (&self.parameter.default.content, self.parameter.kind) {
                (ValueContent::None, _) => Ok("none".into()),
                (_, QuantityKind::Text) => Err("type a text here".into()),
                _ => Err(format!("type a number here, such as {}", self.parameter.default.text)),
            };
        }
        let value = match (self.parameter.kind, self.parameter.is_list) {
            (QuantityKind::Text, _) => self.with_unit(text),
            (_, true) => self.list(text)?,
            (_, false) => self.with_unit(&plain_text(text).map_err(|err| err.to_string())?),
        };
        let given = self.parameter.read(&value)?;
        check_reach(&given, rig)?;
        Ok(value)
    }

    /// Values between semicolons, or between commas where no comma is a decimal sign.
    fn list(&self, text: &str) -> Result<String, String> {
        let plain = plain_text(text).map_err(|err| err.to_string())?;
        let values = plain.split([',', ';']).map(|one| self.with_unit(one));
        Ok(values.collect::<Vec<_>>().join(", "))
    }

    /// Whether a sentence of the protocol is about this field.
    pub fn is_named_in(&self, words: &str) -> bool {
        let mut words = words.split(|one: char| !(one.is_alphanumeric() || "_-".contains(one)));
        words.any(|word| word == self.parameter.name)
    }

    /// A number without a unit gets the one of the field.
    fn with_unit(&self, text: &str) -> String {
        let text = text.trim();
        if self.unit.is_empty() || text.parse::<f64>().is_err() {
            text.to_owned()
        } else {
            format!("{text} {}", self.unit)
        }
    }

    /// The unit to show next to the field: none where the text has a unit of its own.
    pub fn shown_unit(&self) -> &'static str {
        let text = plain_text(self.text.trim()).unwrap_or_default();
        if text.is_empty() || text.parse::<f64>().is_ok() { self.unit } else { "" }
    }

    /// Meaning, range and source of the usual value, a line each.
    pub fn hint(&self) -> String {
        let one = &self.parameter;
        let mut lines = vec![one.about.clone()];
        let unit = one.kind.unit();
        let range = match (one.min, one.max) {
            (Some(min), Some(max)) => Some(format!("from {min} to {max} {unit}")),
            (Some(min), None) => Some(format!("from {min} {unit}")),
            (None, Some(max)) => Some(format!("up to {max} {unit}")),
            (None, None) => None,
        };
        lines.extend(range.map(|range| range.trim_end().to_owned()));
        let usual = &one.default.text;
        lines.push(match one.source.as_str() {
            "" => format!("usual: {usual}"),
            source => format!("usual: {usual} ({source})"),
        });
        lines.join("\n")
    }
}

/// Speeds and lengths that no protocol can ask of this rig.
fn check_reach(given: &ProtocolValue, rig: &RigDescription) -> Result<(), String> {
    match &given.content {
        ValueContent::Number(QuantityKind::Speed, speed) => rig.check_speed(MmPerS(*speed)),
        ValueContent::Number(QuantityKind::Length, mm) if *mm > rig.travel.0 => Err(format!(
            "{mm} mm is beyond the travel of rig {}, which ends at {}; give less",
            rig.name, rig.travel
        )),
        ValueContent::List(items) => items.iter().try_for_each(|item| check_reach(item, rig)),
        _ => Ok(()),
    }
}

/// The number of a value as it was written, and its unit.
fn split(given: &ProtocolValue, kind: QuantityKind) -> (String, &'static str) {
    let units = kind.units();
    let parts = units.iter().find_map(|unit| {
        let number = given.text.strip_suffix(unit)?.trim();
        number.parse::<f64>().ok()?;
        Some((number.to_owned(), *unit))
    });
    parts.unwrap_or_else(|| (given.text.clone(), kind.unit()))
}

/// A label of the session as it is typed, such as its operator.
#[derive(Clone, Debug)]
pub struct LabelField {
    pub key: &'static MetadataKey,
    pub text: String,
    pub error: Option<String>,
    /// The protocol requires it.
    pub is_required: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_drivers::sim::SimSettings;
    use palpate_protocols::file::built_in;

    fn fields(name: &str) -> Vec<ParamField> {
        let protocol = built_in(name).unwrap().unwrap();
        protocol.parameters.into_iter().map(ParamField::new).collect()
    }

    fn read(field: &ParamField, text: &str) -> Result<String, String> {
        let rig = palpate_drivers::open("sim", &SimSettings::default()).unwrap();
        let mut field = field.clone();
        field.text = text.into();
        field.check(rig.description());
        field.value
    }

    #[test]
    fn a_number_without_a_unit_has_that_of_the_field() {
        let of = |name: &str, field: &str| {
            let mut all = fields(name).into_iter();
            all.find(|one| one.parameter.name == field).unwrap()
        };
        let rest = of("preconditioning", "rest");
        assert_eq!((rest.text.as_str(), rest.unit), ("3", "min"));
        assert_eq!(read(&rest, " 2 ").unwrap(), "2 min");
        assert_eq!(read(&rest, "5 s").unwrap(), "5 s");
        assert_eq!(read(&rest, "0,5").unwrap(), "0.5 min");
        assert_eq!(rest.shown_unit(), "min");
        let own = ParamField { text: "5 s".into(), ..rest.clone() };
        assert_eq!(own.shown_unit(), "");
        let masses = of("load-cell-calibration", "masses");
        assert_eq!(read(&masses, "500, 0.6 kg").unwrap(), "500 g, 0.6 kg");
        assert_eq!(read(&masses, "500; 0,6 kg").unwrap(), "500 g, 0.6 kg");
        let unload = of("ramp-hold", "unload");
        assert_eq!((unload.text.as_str(), unload.unit), ("", "mm/s"));
        assert_eq!(read(&unload, "").unwrap(), "none");
        let speeds = of("validation-series", "speeds");
        for (field, text, words) in [
            (&speeds, "0.75, 900", "outside the range of rig sim"),
            (&rest, "", "type a number here"),
            (&rest, "soon", "\"soon\" is not a time"),
            (&rest, "1,234", "could be 1.234 or 1234"),
            (&masses, "500,600", "could be 500.600 or 500600"),
        ] {
            let reason = read(field, text).unwrap_err();
            assert!(reason.contains(words), "{text}: {reason}");
        }
        assert!(rest.hint().contains("usual: 3 min (source thesis"));
        assert!(of("preconditioning", "cycles").hint().contains("from 1 to 200"));
    }
}
