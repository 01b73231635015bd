//! What the runner publishes: one immutable value, swapped as a whole.

use crate::base::FoundBase;
use palpate_model::Nanos;
use palpate_model::calibration::SettleProgress;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::{Phase, Reading, RigDescription, SensorValues};
use palpate_model::signal::LiveTrace;
use palpate_model::units::{Newtons, Position, Seconds};
use palpate_protocols::engine::{
    ContactPosition, DerivedValues, PauseView, Power, RunOutcome, UnloadedSignal,
};
use palpate_protocols::preview::StepPreview;
use palpate_protocols::weight_readings::WeightReading;
use palpate_sessions::edits::DataQuality;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Clone, Debug)]
pub struct RunnerSnapshot {
    /// The rig and its newest sample.
    pub rig: RigView,
    /// The run in progress or the last one; `None` before the first.
    pub run: Option<RunView>,
    /// Why the last request to run was refused, until the next request.
    pub refusal: Option<String>,
    pub sequence: u64,
}

#[derive(Clone, Debug)]
pub struct RigView {
    pub description: Arc<RigDescription>,
    pub reading: Option<Reading>,
    pub is_homed: bool,
    /// How fast it was when it was opened, in words; none on a simulated rig.
    pub link: Option<String>,
    pub link_error: Option<String>,
    /// Newest values of what it measures beside force and position.
    pub sensors: SensorValues,
}

/// The newest value of a sensor beside load cell and axis.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorFact {
    pub name: String,
    /// In `unit`; of a digital input 1 is high and 0 is low.
    pub value: f64,
    /// `1` where it has none.
    pub unit: String,
    pub is_digital: bool,
}

impl SensorFact {
    /// The value as it is read.
    #[must_use]
    pub fn words(&self) -> String {
        match (self.is_digital, self.value > 0.0, self.unit.as_str()) {
            (true, true, _) => "high".into(),
            (true, false, _) => "low".into(),
            (false, _, "1") => format!("{:.2}", self.value),
            (false, _, unit) => format!("{:.2} {unit}", self.value),
        }
    }
}

impl RigView {
    /// What its sensors reported last, in the order of the rig's description; a sensor that has reported nothing is left out.
    #[must_use]
    pub fn sensor_facts(&self) -> Vec<SensorFact> {
        let known = &self.description.sensors;
        let mut facts = Vec::new();
        for number in 1..=known.digital_inputs {
            facts.extend(self.sensors.is_high(number).map(|is_high| SensorFact {
                name: format!("input {number}"),
                value: f64::from(u8::from(is_high)),
                unit: "1".into(),
                is_digital: true,
            }));
        }
        let is_digital = false;
        facts.extend(self.sensors.bath_celsius().map(|value| SensorFact {
            name: "bath".into(),
            value,
            unit: "°C".into(),
            is_digital,
        }));
        for (number, channel) in (1..=u8::MAX).zip(&known.channels) {
            let (name, unit) = (channel.name.clone(), channel.unit.clone());
            let value = self.sensors.channel(number);
            facts.extend(value.map(|value| SensorFact { name, value, unit, is_digital }));
        }
        facts
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// Largest delay of session time.
    pub worst: Seconds,
    /// Delay that was too long to catch up.
    pub given_up: Seconds,
}

#[derive(Clone, Debug)]
pub struct RunView {
    pub plan_name: String,
    /// CRC-32 of the text that the plan was written out from; none for a plan made by the program.
    pub plan_crc32: Option<String>,
    pub folder: PathBuf,
    pub phase: Phase,
    pub power: Power,
    pub steps: Arc<Vec<StepPreview>>,
    pub step_index: usize,
    /// Session time of the newest input.
    pub now: Nanos,
    pub time_left: Seconds,
    /// Share done, 0 to 1.
    pub fraction: f64,
    pub derived: DerivedValues,
    pub tare: Option<UnloadedSignal>,
    pub contact: Option<ContactPosition>,
    /// The base behind it and the thickness between, once found.
    pub base: FoundBase,
    /// Highest force so far.
    pub force_peak: Option<Newtons>,
    pub live: Option<LiveEstimate>,
    pub trace: Arc<LiveTrace>,
    /// Times at which phases began, in seconds of session time.
    pub phases: Arc<Vec<(f64, Phase)>>,
    pub samples: u64,
    /// Session time through which everything is on disk.
    pub saved_through: Nanos,
    /// `None` at full pace.
    pub lateness: Option<Lateness>,
    pub is_motion_possible: bool,
    pub pause: PauseView,
    pub prompt: Option<PromptView>,
    /// Index and name of the next step behind which a pause spoils nothing.
    pub next_checkpoint: Option<(usize, String)>,
    /// Repeat of the measurement, from 1; 0 where nothing is measured.
    pub cycle: u32,
    /// Cycles of the plan; 0 or 1 without a series.
    pub cycles: u32,
    /// Session time in s at which each repeat began, with its number.
    pub cycle_starts: Arc<Vec<(f64, u32)>>,
    /// Every reading under a known mass that the plan has.
    pub planned_weights: Arc<Vec<PlannedWeight>>,
    pub weight_readings: Arc<Vec<WeightReading>>,
    /// How far the signal under the mass on the cell has come to rest; `None` where nothing is weighed.
    pub settling: Option<SettleProgress>,
    /// Whether the last weight can be read again now, or why not.
    pub can_redo: Result<(), String>,
    /// Force over machine position (as its depth) of the last search for the surface.
    pub approach: Arc<LiveTrace>,
    pub contact_triggers: Arc<Vec<ContactTrigger>>,
    /// Set while the run waits for retract or close after a stop.
    pub holding: Option<RunOutcome>,
    pub can_retract: Result<(), String>,
    /// How it ended, once it has and the log is closed.
    pub outcome: Option<RunOutcome>,
    /// Data quality with its reason, once the run has ended.
    pub data_quality: Option<(DataQuality, String)>,
    pub log_error: Option<String>,
    /// Why the data quality could not be written beside the log.
    pub data_quality_error: Option<String>,
    /// What happened, newest last; the oldest lines fall out past [`RunView::EVENTS_MAX`].
    pub events: Arc<Vec<LogLine>>,
}

impl RunView {
    /// Lines of the event log on the screen. The session log has all.
    pub const EVENTS_MAX: usize = 500;
}

/// A reading under a known mass as the plan has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedWeight {
    pub step_index: usize,
    /// The mass in g, platform included.
    pub mass_g: f64,
    pub is_loading: bool,
    /// Which pass through the masses, from 1.
    pub repeat: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactTrigger {
    /// 1 for the approach, 2 for the slow pass.
    pub pass: u8,
    /// Where, from home.
    pub position: Position,
    /// The filtered force above tare there.
    pub force: Newtons,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PromptView {
    pub message: String,
    /// How long the run still waits.
    pub time_left: Seconds,
}

#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// When, in session time.
    pub at: Nanos,
    pub text: String,
    pub is_alarm: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_drivers::Rig;
    use palpate_drivers::sim::{SimRig, SimSettings};
    use palpate_model::rig::{SensorChannel, SensorReading};

    #[test]
    fn what_sensors_reported_last_has_names_and_units() {
        let mut about = SimRig::new(SimSettings::default()).description().clone();
        let channel =
            |name: &str, unit: &str| SensorChannel { name: name.into(), unit: unit.into() };
        about.sensors.digital_inputs = 2;
        about.sensors.has_bath = true;
        about.sensors.channels =
            vec![channel("room.temperature", "°C"), channel("silent", "%"), channel("frame", "1")];
        let mut sensors = SensorValues::default();
        for reading in [
            SensorReading::DigitalInput { number: 2, is_high: true },
            SensorReading::Bath { celsius: 36.5 },
            SensorReading::Channel { number: 1, value: 21.304, age: Nanos::ZERO },
            SensorReading::Channel { number: 3, value: 12.0, age: Nanos::ZERO },
        ] {
            sensors.update(&reading);
        }
        let rig = RigView {
            description: Arc::new(about),
            reading: None,
            is_homed: false,
            link: None,
            link_error: None,
            sensors,
        };
        let words: Vec<(String, String)> =
            rig.sensor_facts().into_iter().map(|one| (one.name.clone(), one.words())).collect();
        let expected = [
            ("input 2", "high"),
            ("bath", "36.50 °C"),
            ("room.temperature", "21.30 °C"),
            ("frame", "12.00"),
        ];
        assert_eq!(words, expected.map(|(name, words)| (name.to_owned(), words.to_owned())));
    }
}
