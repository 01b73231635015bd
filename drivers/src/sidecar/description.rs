//! What a sidecar says of itself, and whether that can be.

use super::protocol::VERSION;
use crate::board_clock::BoardClock;
use palpate_model::Nanos;
use palpate_model::rig::{AdcDescription, RigSensors, SensorChannel};
use serde::Deserialize;

/// The answer to `hello`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct SidecarDescription {
    /// The version that it speaks.
    pub sidecar: u64,
    pub name: String,
    pub serial: Option<String>,
    /// Differs after every start.
    pub boot: u64,
    /// Length of one count of its clock.
    pub tick_ns: u64,
    /// Samples per second.
    pub rate: f64,
    /// Without a line for so long the axis brakes by itself.
    pub silence_ms: Option<f64>,
    #[serde(default)]
    pub crc: bool,
    #[serde(default)]
    pub binary: bool,
    pub axis: Option<SidecarAxis>,
    pub cell: Option<SidecarCell>,
    #[serde(default)]
    pub sensors: Vec<SidecarSensor>,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct SidecarAxis {
    pub mm_per_pulse: f64,
    pub travel_mm: f64,
    /// In mm/s.
    pub speed_max: f64,
    /// In mm/s².
    pub acceleration: f64,
    /// By how long reported positions may be behind or before commanded ones.
    #[serde(default)]
    pub lag_ms: f64,
    /// Whether it makes sines.
    #[serde(default)]
    pub sine: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct SidecarCell {
    pub counts_min: i32,
    pub counts_max: i32,
    pub volts_per_count: f64,
    /// Standard deviation at rest, in V.
    pub noise_v: f64,
    /// Age of a value when it is sent.
    #[serde(default)]
    pub delay_ms: f64,
    /// Where it is calibrated itself.
    pub newtons_per_volt: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct SidecarSensor {
    pub name: String,
    pub unit: String,
    pub kind: Option<SensorKind>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SensorKind {
    /// A digital input.
    Input,
    /// The bath of the specimen.
    Bath,
}

/// Most sensors of one sidecar.
pub const SENSORS_MAX: usize = 16;
const NAME_MAX: usize = 32;

/// Whether a sidecar or one of its sensors can be called so.
pub(super) fn is_name(name: &str) -> bool {
    name.len() <= NAME_MAX && SensorChannel::is_name(name)
}

fn within(key: &str, value: f64, least: f64, most: f64) -> Result<(), String> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(format!("its {key} is {value}, which is not between {least} and {most}"))
}

impl SidecarDescription {
    /// Why it cannot be, in words.
    pub fn check(&self) -> Result<(), String> {
        if self.sidecar != VERSION {
            let found = self.sidecar;
            return Err(format!(
                "it speaks version {found} of the sidecar protocol, but this palpate speaks version {VERSION}"
            ));
        }
        if !is_name(&self.name) || self.serial.as_deref().is_some_and(|serial| !is_name(serial)) {
            return Err(
                "its name and serial must have 1 to 32 letters, digits, '-', '_' or '.'".into()
            );
        }
        within("tick_ns", self.tick_ns as f64, 1.0, 1e9)?;
        within("rate", self.rate, 0.1, 20_000.0)?;
        let is_fine = 1e9 / self.rate >= self.tick_ns as f64 * (1.0 - 1e-9);
        if !is_fine {
            return Err("its rate is faster than its clock; give a shorter tick_ns".into());
        }
        if self.period() > BoardClock::step_max(self.tick_ns) {
            return Err(
                "its clock makes half a turn between two samples; give a longer tick_ns".into()
            );
        }
        if let Some(axis) = &self.axis {
            axis.check()?;
            let silence = self.silence_ms.ok_or("it has an axis but no silence_ms")?;
            within("silence_ms", silence, 20.0, 1_000.0)?;
        }
        if let Some(cell) = &self.cell {
            cell.check()?;
        }
        self.check_sensors()
    }

    fn check_sensors(&self) -> Result<(), String> {
        if self.sensors.len() > SENSORS_MAX {
            return Err(format!("it has more than {SENSORS_MAX} sensors"));
        }
        for (index, sensor) in self.sensors.iter().enumerate() {
            let name = &sensor.name;
            if !is_name(name) || !SensorChannel::is_unit(&sensor.unit) {
                return Err(format!(
                    "its sensor {} has a name or a unit with other than the allowed characters",
                    index + 1
                ));
            }
            if self.sensors[..index].iter().any(|other| other.name == *name) {
                return Err(format!("two of its sensors are called {name}"));
            }
        }
        Ok(())
    }

    /// Name and serial number, for the operator and the log.
    #[must_use]
    pub fn identity(&self) -> String {
        let serial = self.serial.as_ref().map(|serial| format!(", no. {serial}"));
        format!("sidecar {}{}", self.name, serial.unwrap_or_default())
    }

    pub fn silence(&self) -> Nanos {
        Nanos((self.silence_ms.unwrap_or(1_000.0) * 1e6) as u64)
    }

    /// Time between two samples.
    pub fn period(&self) -> Nanos {
        Nanos((1e9 / self.rate) as u64)
    }

    /// Its sensors as channels; `prefix` comes before their names.
    #[must_use]
    pub fn rig_sensors(&self, prefix: &str) -> RigSensors {
        let of = |kind| self.sensors.iter().filter(move |sensor| sensor.kind == Some(kind)).count();
        let channel = |sensor: &SidecarSensor| SensorChannel {
            name: format!("{prefix}{}", sensor.name),
            unit: sensor.unit.clone(),
        };
        RigSensors {
            // At most as many as it has sensors, 16.
            digital_inputs: of(SensorKind::Input) as u8,
            has_bath: of(SensorKind::Bath) > 0,
            channels: self.sensors.iter().map(channel).collect(),
        }
    }
}

impl SidecarAxis {
    fn check(&self) -> Result<(), String> {
        within("mm_per_pulse", self.mm_per_pulse, 1e-6, 1.0)?;
        within("travel_mm", self.travel_mm, 1.0, 10_000.0)?;
        within("speed_max", self.speed_max, 1e-3, 1_000.0)?;
        within("acceleration", self.acceleration, 1e-3, 1e6)?;
        // More would hide a lost step of a tenth of a millimetre at any speed that is used in tissue.
        within("lag_ms", self.lag_ms, 0.0, 100.0)
    }
}

impl SidecarCell {
    fn check(&self) -> Result<(), String> {
        if self.counts_min >= self.counts_max {
            return Err("its counts_min is not below its counts_max".into());
        }
        within("volts_per_count", self.volts_per_count, 1e-12, 1e3)?;
        within("noise_v", self.noise_v, 0.0, 1e3)?;
        within("delay_ms", self.delay_ms, 0.0, 1_000.0)?;
        self.newtons_per_volt
            .map_or(Ok(()), |newtons| within("newtons_per_volt", newtons, 1e-9, 1e9))
    }

    pub fn adc(&self) -> AdcDescription {
        AdcDescription {
            counts_min: self.counts_min,
            counts_max: self.counts_max,
            volts_per_count: self.volts_per_count,
        }
    }

    pub fn delay(&self) -> Nanos {
        Nanos((self.delay_ms * 1e6) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The description of the page, and with one text of it replaced.
    fn with(from: &str, to: &str) -> Result<(), String> {
        let page = include_str!("../../../docs/sidecar-protocol.md");
        let (_, rest) = page.split_once("```json\n").unwrap();
        let (text, _) = rest.split_once("```").unwrap();
        assert!(text.contains(from), "{from}");
        let read = serde_json::from_str::<SidecarDescription>(&text.replace(from, to));
        read.map_err(|err| err.to_string())?.check()
    }

    #[test]
    fn the_description_of_the_page_is_read_and_impossible_ones_are_refused() {
        assert_eq!(with("31", "31"), Ok(()));
        for (from, to) in [
            ("\"sidecar\": 1", "\"sidecar\": 2"),
            ("\"my-stage\"", "\"my stage\""),
            ("\"A7\"", "\"\""),
            ("1000", "0"),
            ("500", "0"),
            ("500", "1e9"),
            // A clock of a nanosecond makes half a turn within 2.1 s.
            ("\"tick_ns\": 1000, \"rate\": 500", "\"tick_ns\": 1, \"rate\": 0.4"),
            ("\"silence_ms\": 200,", ""),
            ("200", "5"),
            ("0.0025", "0"),
            ("60", "1e9"),
            ("10,", "-1,"),
            ("\"lag_ms\": 2", "\"lag_ms\": 500"),
            ("-8388608", "8388608"),
            ("5.96e-7", "0"),
            ("\"trigger\"", "\"temperature\""),
            ("\"input\"", "\"output\""),
            ("\"1\"", "\"a b\""),
        ] {
            assert!(with(from, to).is_err(), "{from} -> {to}");
        }
    }
}
