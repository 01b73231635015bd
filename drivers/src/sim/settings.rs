//! The settings that make a simulated rig; with them it can be rebuilt.

use super::amounts::{
    SimBath, SimCompliance, SimInput, SimNoise, SimPreconditioning, SimRate, SimSoftening,
    SimStiffness, SimThickness,
};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::collections::BTreeMap;
use std::str::FromStr;
use thiserror::Error;

palpate_model::named! {
    /// Realism of the simulated load cell.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum SimProfile {
        /// The thesis's nonlinear cell with noise, drift and a 16-bit converter.
        #[default]
        Lab = "lab",
        /// A straight cell without drift or converter, and white noise: 0.02 N rms unless set otherwise.
        Ideal = "ideal",
    }
}

palpate_model::named! {
    /// The controller's sample clock.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum SimClock {
        /// 1000 us per tick.
        #[default]
        Nominal = "nominal",
        /// 976 us per tick: what a Galil controller makes of its nominal millisecond (`TM 1000`).
        Galil = "galil",
    }
}

palpate_model::named! {
    /// The load cell that a simulated rig has.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum SimCell {
        /// Exactly the curve that the profile's calibration document holds.
        #[default]
        Document = "document",
        /// A cell drawn by the seed: its curve differs from the document's, it has hysteresis, and the weights that a
        /// person puts on it differ from what is engraved on them.
        Own = "own",
    }
}

impl SimClock {
    /// True length of one tick in nanoseconds, at the usual rate.
    #[must_use]
    pub const fn tick_nanos(self) -> u64 {
        match self {
            Self::Nominal => 1_000_000,
            Self::Galil => 976_000,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimSettings {
    pub profile: SimProfile,
    pub cell: SimCell,
    pub seed: u64,
    /// Repeat of the run on the same specimen, with noise and drift of its own; 0 for the first run.
    pub repeat: u64,
    /// The controller's sample clock.
    pub clock: SimClock,
    pub rate: SimRate,
    pub softening: SimSoftening,
    pub noise: SimNoise,
    pub stiffness: SimStiffness,
    /// Distance of the stiff base from the surface.
    pub thickness: SimThickness,
    pub compliance: SimCompliance,
    /// Recession of the tissue's surface by loading.
    pub preconditioning: SimPreconditioning,
    pub bath: SimBath,
    pub input: SimInput,
    /// Tissue of all specimens, instead of one drawn by the seed.
    pub body: Option<ModifiedKelvin>,
}

/// A setting of the simulated rig cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the simulated rig's {setting} cannot be '{value}'; give {choices}")]
pub struct SimSettingError {
    pub setting: &'static str,
    pub value: String,
    pub choices: &'static str,
}

impl SimSettingError {
    pub(super) fn new(setting: &'static str, value: &str, choices: &'static str) -> Self {
        Self { setting, value: value.to_owned(), choices }
    }
}

impl SimSettings {
    /// True length of one tick in nanoseconds.
    pub fn tick_nanos(&self) -> u64 {
        self.clock.tick_nanos() / self.rate.per_usual_tick()
    }

    /// The settings as a rig's description carries them: `profile`, `seed`, `clock` and, where they
    /// are not the usual ones, `repeat`, `cell`, `rate` (samples a second), `softening` and `preconditioning` (percent), `noise`
    /// (mN), `stiffness` (percent), `thickness` (mm), `compliance` (um/N), `bath` (°C), `input` (s), and the parameters of
    /// the tissue.
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("profile".to_owned(), self.profile.to_string()),
            ("seed".to_owned(), self.seed.to_string()),
            ("clock".to_owned(), self.clock.to_string()),
        ]);
        let usual = Self::default();
        let amounts = [
            ("repeat", self.repeat.to_string(), usual.repeat.to_string()),
            ("cell", self.cell.to_string(), usual.cell.to_string()),
            ("rate", self.rate.to_string(), usual.rate.to_string()),
            ("softening", self.softening.to_string(), usual.softening.to_string()),
            ("noise", self.noise.to_string(), usual.noise.to_string()),
            ("stiffness", self.stiffness.to_string(), usual.stiffness.to_string()),
            ("thickness", self.thickness.to_string(), usual.thickness.to_string()),
            ("compliance", self.compliance.to_string(), usual.compliance.to_string()),
            (
                "preconditioning",
                self.preconditioning.to_string(),
                usual.preconditioning.to_string(),
            ),
            ("bath", self.bath.to_string(), usual.bath.to_string()),
            ("input", self.input.to_string(), usual.input.to_string()),
        ];
        // Usual values are left out: rigs are described as they always were.
        let unusual = amounts.into_iter().filter(|(_, value, usual)| value != usual);
        map.extend(unusual.map(|(name, value, _)| (name.to_owned(), value)));
        let body = self.body.iter().flat_map(ModifiedKelvin::named);
        map.extend(body.map(|(name, value)| (name.to_owned(), value.to_string())));
        map
    }
}

impl FromStr for SimProfile {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|profile| profile.name() == text);
        found.ok_or_else(|| SimSettingError::new("profile", text, "'lab' or 'ideal'"))
    }
}

impl FromStr for SimCell {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|cell| cell.name() == text);
        found.ok_or_else(|| SimSettingError::new("cell", text, "'document' or 'own'"))
    }
}

impl FromStr for SimClock {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|clock| clock.name() == text);
        found.ok_or_else(|| SimSettingError::new("clock", text, "'nominal' or 'galil'"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rigs are described as they always were: what is usual is not in the map.
    #[test]
    fn map_has_every_setting_that_is_not_usual() {
        let usual = SimSettings::default().to_map();
        let usual: Vec<_> =
            usual.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        assert_eq!(usual, [("clock", "nominal"), ("profile", "lab"), ("seed", "0")]);
        let settings = SimSettings {
            profile: "ideal".parse().unwrap(),
            cell: "own".parse().unwrap(),
            seed: u64::MAX - 3,
            repeat: 2,
            clock: "galil".parse().unwrap(),
            rate: "20000".parse().unwrap(),
            softening: "40".parse().unwrap(),
            noise: "5".parse().unwrap(),
            stiffness: "200".parse().unwrap(),
            thickness: "12.5".parse().unwrap(),
            compliance: "41".parse().unwrap(),
            preconditioning: "10".parse().unwrap(),
            bath: "37".parse().unwrap(),
            input: "30".parse().unwrap(),
            body: Some(ModifiedKelvin::THESIS),
        };
        let map = settings.to_map();
        let map: Vec<_> = map.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        let all = [
            ("bath", "37"),
            ("cell", "own"),
            ("clock", "galil"),
            ("compliance", "41"),
            ("input", "30"),
            ("mu1", "0.05333"),
            ("mu2", "-0.0086"),
            ("mu3", "0.0004345"),
            ("noise", "5"),
            ("preconditioning", "10"),
            ("profile", "ideal"),
            ("rate", "20000"),
            ("repeat", "2"),
            ("seed", "18446744073709551612"),
            ("softening", "40"),
            ("stiffness", "200"),
            ("tau_eps", "1.023"),
            ("tau_sig", "0.06"),
            ("thickness", "12.5"),
        ];
        assert_eq!(map, all);
        assert_eq!(settings.tick_nanos(), 48_800);
    }

    #[test]
    fn a_wrong_word_is_named_with_the_right_ones() {
        let err = "Lab".parse::<SimProfile>().unwrap_err();
        assert_eq!(
            err.to_string(),
            "the simulated rig's profile cannot be 'Lab'; give 'lab' or 'ideal'"
        );
        let err = "91".parse::<SimSoftening>().unwrap_err();
        assert!(err.choices.contains("0 to 90"), "{err}");
        let err = "31".parse::<SimPreconditioning>().unwrap_err();
        assert_eq!((err.setting, err.value.as_str()), ("preconditioning", "31"));
    }
}
