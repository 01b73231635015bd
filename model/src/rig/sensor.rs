//! What a rig reports apart from load cell and axis: digital inputs and the temperature of the bath that the specimen lies in.

use serde::{Deserialize, Serialize};

/// Most digital inputs of a rig.
pub const DIGITAL_INPUTS_MAX: usize = 8;

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
}

impl SensorReading {
    /// Whether it is a value that can be: of an input that can be, and a number.
    pub fn is_possible(&self) -> bool {
        match self {
            Self::DigitalInput { number, .. } => {
                (1..=DIGITAL_INPUTS_MAX).contains(&usize::from(*number))
            }
            Self::Bath { celsius } => celsius.is_finite(),
        }
    }
}

/// Which sensors a rig has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSensors {
    /// Digital inputs, numbered from 1.
    pub digital_inputs: u8,
    /// Whether it reports the temperature of a bath.
    pub has_bath: bool,
}

/// The newest value of each sensor; none before the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorValues {
    digital_inputs: [Option<bool>; DIGITAL_INPUTS_MAX],
    bath_celsius: Option<f64>,
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
        }
    }

    /// Whether a digital input, numbered from 1, is high.
    pub fn is_high(&self, number: u8) -> Option<bool> {
        let index = usize::from(number).checked_sub(1)?;
        *self.digital_inputs.get(index)?
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
    }
}
