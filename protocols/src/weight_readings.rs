//! Readings of a load cell under known masses; a repeated reading replaces the earlier one.

use crate::engine::Record;
use palpate_model::calibration::{Direction, SeriesStep};
use palpate_model::rig::Phase;
use palpate_model::units::Volts;

#[derive(Clone, Debug, PartialEq)]
pub struct WeightReading {
    pub step_index: usize,
    pub direction: Direction,
    /// Which pass through the masses, from 1.
    pub repeat: u32,
    pub step: SeriesStep,
}

impl WeightReading {
    /// The mass in g, platform included.
    pub fn mass_g(&self) -> f64 {
        self.step.mass_g
    }

    /// The mean signal.
    pub fn volts(&self) -> Volts {
        self.step.volts
    }
}

#[derive(Clone, Debug, Default)]
pub struct WeightReadings {
    all: Vec<WeightReading>,
    step_index: usize,
}

impl WeightReadings {
    pub fn of<'a>(records: impl IntoIterator<Item = &'a Record>) -> Self {
        let mut readings = Self::default();
        records.into_iter().for_each(|one| readings.record(one));
        readings
    }

    pub fn record(&mut self, record: &Record) {
        match record {
            // A run that went back repeats the readings from there on.
            Record::PhaseStarted { phase: Phase::Prompt | Phase::Weigh, step_index } => {
                self.step_index = *step_index;
                self.all.retain(|one| one.step_index < *step_index);
            }
            Record::Weighed {
                mass_g,
                is_loading,
                repeat,
                volts,
                noise,
                slope_v_per_s,
                samples,
                waited,
            } => self.all.push(WeightReading {
                step_index: self.step_index,
                direction: match is_loading {
                    true => Direction::Loading,
                    false => Direction::Unloading,
                },
                repeat: *repeat,
                step: SeriesStep {
                    mass_g: *mass_g,
                    weights: Vec::new(),
                    volts: *volts,
                    noise: Some(*noise),
                    samples: Some(*samples),
                    slope_v_per_s: Some(*slope_v_per_s),
                    waited_s: Some(waited.0),
                },
            }),
            _ => {}
        }
    }

    pub fn all(&self) -> &[WeightReading] {
        &self.all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::Seconds;

    fn reading(step_index: usize, mass_g: f64, volts: f64) -> [Record; 2] {
        [
            Record::PhaseStarted { phase: Phase::Weigh, step_index },
            Record::Weighed {
                mass_g,
                is_loading: true,
                repeat: 1,
                volts: Volts(volts),
                noise: Volts(1e-3),
                slope_v_per_s: 0.0,
                samples: 2000,
                waited: Seconds(2.0),
            },
        ]
    }

    #[test]
    fn repeated_weighing_replaces_readings_from_that_step_on() {
        let mut records = Vec::new();
        for (step, mass, volts) in [(1, 0.0, 1.28), (3, 140.0, 1.4), (5, 240.0, 9.0)] {
            records.extend(reading(step, mass, volts));
        }
        // Back to the second weight; the third has to be laid on again too.
        records.extend(reading(3, 140.0, 1.5));
        let so_far = WeightReadings::of(&records);
        let found: Vec<f64> = so_far.all().iter().map(|one| one.volts().0).collect();
        assert_eq!(found, [1.28, 1.5]);
        records.extend(reading(5, 240.0, 1.6));
        let all = WeightReadings::of(&records);
        let found: Vec<(f64, f64)> =
            all.all().iter().map(|one| (one.mass_g(), one.volts().0)).collect();
        assert_eq!(found, [(0.0, 1.28), (140.0, 1.5), (240.0, 1.6)]);
        // The end of the run is none of its steps.
        records.push(Record::PhaseStarted { phase: Phase::Stopped, step_index: 5 });
        assert_eq!(WeightReadings::of(&records).all().len(), 3);
    }
}
