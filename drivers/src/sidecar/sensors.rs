//! Values of a sidecar's sensors, on their way to the rig's owner.

use super::description::{SensorKind, SidecarDescription};
use crate::wire::lock;
use palpate_model::Nanos;
use palpate_model::rig::SensorReading;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// A value is reported when it has changed, and once in this time in any case.
const REPORT_EVERY: Nanos = Nanos::from_millis(1_000);
/// A sensor is reported at most so often, 200 times a second; every value is in the raw bytes.
const REPORT_MIN: Nanos = Nanos::from_millis(5);
/// Values that may wait to be taken: ten seconds of one that changes as often as it may.
const WAITING_MAX: usize = 2_048;

/// Values that wait to be taken, shared with the rig.
pub type SharedValues = Arc<Mutex<VecDeque<SensorReading>>>;

#[derive(Clone, Copy, Debug)]
struct SensorState {
    kind: Option<SensorKind>,
    channel: u8,
    /// Number of the digital input.
    input: u8,
    reported: Option<(Nanos, f64)>,
}

/// The sensors of one sidecar, numbered among those of the rig.
#[derive(Debug)]
pub struct SensorReports {
    sensors: Vec<SensorState>,
    values: SharedValues,
}

impl SensorReports {
    /// Channels and digital inputs are numbered behind so many of other devices.
    #[must_use]
    pub fn new(
        description: &SidecarDescription,
        (channels, inputs): (u8, u8),
        values: SharedValues,
    ) -> Self {
        let mut input = inputs;
        let mut states = Vec::new();
        // At most 16 sensors each, checked when it was connected.
        for (channel, sensor) in (channels + 1..).zip(&description.sensors) {
            input += u8::from(sensor.kind == Some(SensorKind::Input));
            states.push(SensorState { kind: sensor.kind, channel, input, reported: None });
        }
        Self { sensors: states, values }
    }

    /// Takes the values of a sample that is `age` old.
    pub fn take(&mut self, now: Nanos, age: Nanos, values: &[Option<f64>]) {
        for (sensor, value) in self.sensors.iter_mut().zip(values) {
            let Some(value) = value.filter(|value| value.is_finite()) else {
                continue;
            };
            if let Some((at, last)) = sensor.reported {
                let least =
                    if last.to_bits() == value.to_bits() { REPORT_EVERY } else { REPORT_MIN };
                if now.since(at) < least {
                    continue;
                }
            }
            sensor.reported = Some((now, value));
            let mut waiting = lock(&self.values);
            waiting.push_back(SensorReading::Channel { number: sensor.channel, value, age });
            waiting.extend(match sensor.kind {
                Some(SensorKind::Input) => Some(SensorReading::DigitalInput {
                    number: sensor.input,
                    is_high: value >= 0.5,
                }),
                Some(SensorKind::Bath) => Some(SensorReading::Bath { celsius: value }),
                None => None,
            });
            while waiting.len() > WAITING_MAX {
                waiting.pop_front();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn description() -> SidecarDescription {
        let text = r#"{"ok":1,"sidecar":1,"name":"a","boot":1,"tick_ns":1000,"rate":100,"sensors":[
            {"name":"bath","unit":"C","kind":"bath"},{"name":"one","unit":"1","kind":"input"},
            {"name":"plain","unit":"%"},{"name":"two","unit":"1","kind":"input"}]}"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn values_are_numbered_behind_those_of_others_and_repeated_seldom() {
        let values = SharedValues::default();
        let mut reports = SensorReports::new(&description(), (3, 2), Arc::clone(&values));
        let (ms, age) = (Nanos::from_millis, Nanos(7));
        let all = [Some(36.5), Some(1.0), Some(f64::NAN), Some(0.0)];
        reports.take(ms(10), age, &all);
        let channel = |number, value| SensorReading::Channel { number, value, age };
        let input = |number, is_high| SensorReading::DigitalInput { number, is_high };
        let expected = [
            channel(4, 36.5),
            SensorReading::Bath { celsius: 36.5 },
            channel(5, 1.0),
            input(3, true),
            channel(7, 0.0),
            input(4, false),
        ];
        assert_eq!(lock(&values).drain(..).collect::<Vec<_>>(), expected);
        // Unchanged; changed too soon; changed; unchanged for a second.
        reports.take(ms(500), age, &all);
        reports.take(ms(12), age, &[Some(36.6)]);
        assert!(lock(&values).is_empty());
        reports.take(ms(515), age, &[Some(36.6)]);
        reports.take(ms(1_600), age, &[Some(36.6), None]);
        assert_eq!(lock(&values).len(), 4);
    }
}
