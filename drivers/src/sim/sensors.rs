//! Other sensors of a simulated rig: a bath that is slowly heated, and a switch.

use super::amounts::{SimBath, SimInput};
use super::settings::SimSettings;
use palpate_model::Nanos;
use palpate_model::rig::{RigSensors, SensorReading};

/// Temperature of the bath as the rig is switched on, in °C: the room's.
const ROOM_CELSIUS: f64 = 21.0;

/// Time constant of the bath in s: a litre under a heater of some hundred watts.
const HEATING_SECS: f64 = 120.0;

/// Resolution of the thermometer: steps per degree.
const VALUES_PER_DEGREE: f64 = 20.0;

/// A sensor is reported when it has changed, and once in this time in any case.
const REPORT_EVERY: Nanos = Nanos::from_millis(1000);

/// The sensors and what was reported last, by the rig's time.
#[derive(Clone, Debug)]
pub struct Sensors {
    bath: SimBath,
    input: SimInput,
    last_reported: Vec<(Nanos, SensorReading)>,
}

impl Sensors {
    pub fn new(settings: &SimSettings) -> Self {
        Self { bath: settings.bath, input: settings.input, last_reported: Vec::new() }
    }

    pub fn described(settings: &SimSettings) -> RigSensors {
        RigSensors {
            digital_inputs: u8::from(settings.input.positive().is_some()),
            has_bath: settings.bath.positive().is_some(),
            channels: Vec::new(),
        }
    }

    /// New readings at a time since the rig was switched on.
    pub fn take(&mut self, now: Nanos) -> Vec<SensorReading> {
        let secs = now.seconds().0;
        let bath = self.bath.positive().map(|end| {
            let celsius = end - (end - ROOM_CELSIUS) * (-secs / HEATING_SECS).exp();
            let celsius = (celsius * VALUES_PER_DEGREE).round() / VALUES_PER_DEGREE;
            SensorReading::Bath { celsius }
        });
        let input = self.input.positive().map(|closes| {
            let is_high = secs >= closes;
            SensorReading::DigitalInput { number: 1, is_high }
        });
        let mut changed = Vec::new();
        for (index, reading) in bath.into_iter().chain(input).enumerate() {
            match self.last_reported.get_mut(index) {
                Some((at, last_reported))
                    if *last_reported == reading && now.since(*at) < REPORT_EVERY =>
                {
                    continue;
                }
                Some(last_reported) => *last_reported = (now, reading),
                None => self.last_reported.push((now, reading)),
            }
            changed.push(reading);
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bath_warms_up_and_switch_closes_when_asked() {
        let settings = SimSettings {
            bath: "37".parse().unwrap(),
            input: "90".parse().unwrap(),
            ..SimSettings::default()
        };
        let mut sensors = Sensors::new(&settings);
        let at = |secs: u64| Nanos::from_millis(1000 * secs);
        let high = |is_high| SensorReading::DigitalInput { number: 1, is_high };
        let bath = |celsius| SensorReading::Bath { celsius };
        assert_eq!(sensors.take(at(0)), [bath(21.0), high(false)]);
        assert_eq!(sensors.take(Nanos::from_millis(1)), []);
        // By hand: 37 - 16 / e = 31.114.
        let [SensorReading::Bath { celsius }, switch] = sensors.take(at(120))[..] else {
            panic!("both are reported")
        };
        assert!((celsius - 31.1).abs() < 1e-9, "{celsius}");
        assert_eq!(switch, high(true));
        let mut usual = Sensors::new(&SimSettings::default());
        assert_eq!(usual.take(at(5)), []);
    }
}
