//! What a rig reports apart from load cell and axis: digital inputs, the temperature of the bath that the specimen lies in,
//! and channels with a name and a unit of their own.

use crate::{Nanos, is_default};
use serde::{Deserialize, Serialize};

/// Most digital inputs of a rig.
pub const DIGITAL_INPUTS_MAX: usize = 8;
/// Most channels of a rig.
pub const CHANNELS_MAX: usize = 16;
const NAME_MAX: usize = 64;
const UNIT_MAX: usize = 16;

/// One value, as it came.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "sensor", rename_all = "snake_case")]
pub enum SensorReading {
    /// A digital input.
    DigitalInput {
        /// Its number, from 1 to [`DIGITAL_INPUTS_MAX`].
        number: u8,
        is_high: bool,
    },
    /// The specimen's bath.
    Bath { celsius: f64 },
    /// A channel of [`RigSensors::channels`].
    Channel {
        /// Its number, from 1.
        number: u8,
        /// In the channel's unit.
        value: f64,
        /// How long before it is reported it was measured; zero where that is not known.
        #[serde(default, skip_serializing_if = "is_default")]
        age: Nanos,
    },
}

impl SensorReading {
    /// Whether it is a value that can be: of an input that can be, and a number.
    pub fn is_possible(&self) -> bool {
        match self {
            Self::DigitalInput { number, .. } => {
                (1..=DIGITAL_INPUTS_MAX).contains(&usize::from(*number))
            }
            Self::Bath { celsius } => celsius.is_finite(),
            Self::Channel { number, value, .. } => {
                (1..=CHANNELS_MAX).contains(&usize::from(*number)) && value.is_finite()
            }
        }
    }
}

/// A channel, such as a thermometer in the room, the position of a second axis or the frames of a camera.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorChannel {
    /// Letters, digits, `-`, `_` and `.`; no other channel of the rig has it.
    pub name: String,
    /// Its unit, such as `°C`; `1` where it has none.
    pub unit: String,
}

impl SensorChannel {
    /// Whether a channel can be called so.
    #[must_use]
    pub fn is_name(name: &str) -> bool {
        let is_letter = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'_' | b'.');
        (1..=NAME_MAX).contains(&name.len()) && name.bytes().all(is_letter)
    }

    /// Whether a unit can be written so.
    #[must_use]
    pub fn is_unit(unit: &str) -> bool {
        let is_plain = |c: char| !c.is_control() && !c.is_whitespace() && !"\"',;".contains(c);
        (1..=UNIT_MAX).contains(&unit.chars().count()) && unit.chars().all(is_plain)
    }
}

/// Which sensors a rig has.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSensors {
    /// Digital inputs, numbered from 1.
    pub digital_inputs: u8,
    /// Whether it reports the temperature of a bath.
    pub has_bath: bool,
    /// Channels with a name of their own, numbered from 1.
    #[serde(default, skip_serializing_if = "is_default")]
    pub channels: Vec<SensorChannel>,
}

impl RigSensors {
    /// The number of the channel of this name.
    #[must_use]
    pub fn channel_number(&self, name: &str) -> Option<u8> {
        let index = self.channels.iter().position(|channel| channel.name == name)?;
        u8::try_from(index + 1).ok()
    }
}

/// The newest value of each sensor; none before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorValues {
    digital_inputs: [Option<bool>; DIGITAL_INPUTS_MAX],
    bath_celsius: Option<f64>,
    channels: [Option<f64>; CHANNELS_MAX],
}

impl SensorValues {
    /// Takes a reading; one that cannot be changes nothing.
    pub fn update(&mut self, reading: &SensorReading) {
        if !reading.is_possible() {
            return;
        }
        match *reading {
            SensorReading::DigitalInput { number, is_high } => {
                self.digital_inputs[usize::from(number) - 1] = Some(is_high);
            }
            SensorReading::Bath { celsius } => self.bath_celsius = Some(celsius),
            SensorReading::Channel { number, value, .. } => {
                self.channels[usize::from(number) - 1] = Some(value);
            }
        }
    }

    /// Whether a digital input, numbered from 1, is high.
    pub fn is_high(&self, number: u8) -> Option<bool> {
        let index = usize::from(number).checked_sub(1)?;
        *self.digital_inputs.get(index)?
    }

    /// Value of a channel, numbered from 1.
    pub fn channel(&self, number: u8) -> Option<f64> {
        let index = usize::from(number).checked_sub(1)?;
        *self.channels.get(index)?
    }

    /// Temperature of the bath in °C.
    pub fn bath_celsius(&self) -> Option<f64> {
        self.bath_celsius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newest_possible_value_of_each_sensor_is_known() {
        let input = |number, is_high| SensorReading::DigitalInput { number, is_high };
        let bath = |celsius| SensorReading::Bath { celsius };
        let mut values = SensorValues::default();
        let said = [
            input(0, true),
            input(1, true),
            input(8, true),
            input(8, false),
            input(9, true),
            bath(36.5),
            bath(f64::NAN),
        ];
        said.iter().for_each(|reading| values.update(reading));
        let high = [0, 1, 2, 8, 9].map(|number| values.is_high(number));
        assert_eq!(high, [None, Some(true), None, Some(false), None]);
        assert_eq!(values.bath_celsius(), Some(36.5));
        let channel = |number, value| SensorReading::Channel { number, value, age: Nanos::ZERO };
        for reading in [channel(0, 1.0), channel(2, 1.5), channel(2, f64::NAN), channel(17, 2.0)] {
            values.update(&reading);
        }
        assert_eq!(
            [0, 1, 2, 17].map(|number| values.channel(number)),
            [None, None, Some(1.5), None]
        );
    }

    #[test]
    fn rigs_without_channels_are_written_as_before() {
        let sensors = RigSensors { digital_inputs: 1, has_bath: true, ..RigSensors::default() };
        let text = serde_json::to_string(&sensors).unwrap();
        assert_eq!(text, r#"{"digital_inputs":1,"has_bath":true}"#);
        assert_eq!(serde_json::from_str::<RigSensors>(&text).unwrap(), sensors);
        for name in ["room.temperature", "frame-1", "Z_2"] {
            assert!(SensorChannel::is_name(name), "{name}");
        }
        for name in ["", "room temperature", "°C", "a,b"] {
            assert!(!SensorChannel::is_name(name), "{name}");
        }
        assert!(
            SensorChannel::is_unit("°C")
                && SensorChannel::is_unit("%")
                && !SensorChannel::is_unit("a b")
        );
    }
}
