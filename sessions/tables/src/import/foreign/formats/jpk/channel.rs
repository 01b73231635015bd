//! A channel of a JPK segment: whole numbers, and the chain of linear conversions to volts, metres or newtons.

use super::archive::Properties;

/// How the whole numbers of a channel are stored, the most significant byte first.
#[derive(Clone, Copy)]
enum Encoder {
    SignedShort,
    UnsignedShort,
    SignedInteger,
    UnsignedInteger,
    SignedLong,
}

impl Encoder {
    const ALL: [(&'static str, Self); 5] = [
        ("signedshort", Self::SignedShort),
        ("unsignedshort", Self::UnsignedShort),
        ("signedinteger", Self::SignedInteger),
        ("unsignedinteger", Self::UnsignedInteger),
        ("signedlong", Self::SignedLong),
    ];

    fn bytes(self) -> usize {
        match self {
            Self::SignedShort | Self::UnsignedShort => 2,
            Self::SignedInteger | Self::UnsignedInteger => 4,
            Self::SignedLong => 8,
        }
    }

    fn number(self, bytes: &[u8]) -> f64 {
        let unsigned = bytes.iter().fold(0u64, |sum, byte| sum << 8 | u64::from(*byte));
        match self {
            Self::UnsignedShort | Self::UnsignedInteger => unsigned as f64,
            Self::SignedShort => f64::from(unsigned as i16),
            Self::SignedInteger => f64::from(unsigned as i32),
            Self::SignedLong => unsigned as i64 as f64,
        }
    }
}

/// `value * multiplier + offset`.
struct Linear {
    multiplier: f64,
    offset: f64,
}

impl Linear {
    fn of(properties: &Properties, scaling: &str) -> Result<Self, String> {
        let style = properties.text(&format!("{scaling}.style"));
        if let Some(style) = style.filter(|style| *style != "offsetmultiplier") {
            return Err(format!(
                "the property {scaling}.style is '{style}', not 'offsetmultiplier'; export the curve as text"
            ));
        }
        let number = |name: &str| {
            let key = format!("{scaling}.{name}");
            properties.number(&key).ok_or_else(|| {
                format!("the property {key} is missing or no number; calibrate the curve in the instrument's software and save it again")
            })
        };
        Ok(Self { multiplier: number("multiplier")?, offset: number("offset")? })
    }

    fn apply(&self, value: f64) -> f64 {
        self.multiplier * value + self.offset
    }
}

/// Longest chain of conversions; real ones have two.
const CONVERSIONS_MAX: usize = 16;

pub(super) struct Channel<'p> {
    properties: &'p Properties,
    name: &'p str,
}

impl<'p> Channel<'p> {
    pub fn new(properties: &'p Properties, name: &'p str) -> Self {
        Self { properties, name }
    }

    /// Path of its numbers below the folder of the segment.
    pub fn path(&self) -> String {
        let key = format!("channel.{}.data.file.name", self.name);
        let default = || format!("channels/{}.dat", self.name);
        self.properties.text(&key).map_or_else(default, str::to_owned)
    }

    /// The conversion that the instrument's software shows.
    pub fn default_slot(&self) -> Option<&'p str> {
        self.properties.text(&format!("channel.{}.conversion-set.conversions.default", self.name))
    }

    /// The factor of a conversion alone, such as the spring constant of `force` in N/m.
    pub fn multiplier(&self, slot: &str) -> Option<f64> {
        self.properties.number(&format!("{}.scaling.multiplier", self.conversion(slot)))
    }

    fn conversion(&self, slot: &str) -> String {
        format!("channel.{}.conversion-set.conversion.{slot}", self.name)
    }

    /// The unit of a conversion, such as `m`.
    fn unit(&self, slot: &str) -> Option<&'p str> {
        let scaling = format!("{}.scaling", self.conversion(slot));
        let unit = self.properties.text(&format!("{scaling}.unit.unit"));
        unit.or_else(|| self.properties.text(&format!("{scaling}.unit")))
    }

    /// From the whole numbers to a conversion, in the order of use.
    fn chain(&self, slot: &str) -> Result<Vec<Linear>, String> {
        let name = self.name;
        let base = format!("channel.{name}.conversion-set.conversions.base");
        let base = self.properties.text(&base).unwrap_or_default();
        let mut chain = Vec::new();
        let mut slot = slot;
        while slot != base {
            let conversion = self.conversion(slot);
            let from = self.properties.text(&format!("{conversion}.base-calibration-slot"));
            let Some(from) = from.filter(|_| chain.len() < CONVERSIONS_MAX) else {
                return Err(format!(
                    "the channel {name} has no conversion '{slot}'; calibrate the curve in the instrument's software and save it again"
                ));
            };
            chain.push(Linear::of(self.properties, &format!("{conversion}.scaling"))?);
            slot = from;
        }
        chain.push(Linear::of(self.properties, &format!("{}.scaling", self.encoder_key()))?);
        chain.reverse();
        Ok(chain)
    }

    /// The place of the encoder since version 2.0 of the format, or before.
    fn encoder_key(&self) -> String {
        let new = format!("channel.{}.encoder", self.name);
        match self.properties.text(&format!("{new}.type")) {
            Some(_) => new,
            None => format!("channel.{}.data.encoder", self.name),
        }
    }

    /// The values of a conversion whose unit must be `unit`.
    pub fn values(&self, bytes: &[u8], slot: &str, unit: &str) -> Result<Vec<f64>, String> {
        let name = self.name;
        let chain = self.chain(slot)?;
        if let Some(other) = self.unit(slot).filter(|other| *other != unit) {
            return Err(format!(
                "the conversion '{slot}' of the channel {name} is in '{other}', not '{unit}'; export the curve as text"
            ));
        }
        let encoder = self.properties.text(&format!("{}.type", self.encoder_key()));
        let encoder = encoder.unwrap_or_default();
        let known = Encoder::ALL.iter().find(|(one, _)| *one == encoder);
        let (_, known) = known.ok_or_else(|| {
            format!("the channel {name} has the encoder '{encoder}', which is unknown; export the curve as text")
        })?;
        if !bytes.len().is_multiple_of(known.bytes()) {
            return Err(format!(
                "the channel {name} ends within a number; copy the file again from the instrument"
            ));
        }
        let numbers = bytes.chunks_exact(known.bytes()).map(|bytes| known.number(bytes));
        Ok(numbers.map(|one| chain.iter().fold(one, |value, step| step.apply(value))).collect())
    }
}
