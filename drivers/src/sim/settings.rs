//! What makes one simulated rig differ from another; with these values it can be rebuilt.

use super::amounts::{
    SimBath, SimCompliance, SimInput, SimNoise, SimRate, SimStiffness, SimThickness,
};
use super::preconditioning::SimPreconditioning;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// How much of a laboratory the simulated load cell shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SimProfile {
    /// The thesis's nonlinear cell with noise, drift and a 16-bit converter.
    #[default]
    Lab,
    /// A straight cell without drift or converter, and white noise: 0.02 N rms unless set otherwise.
    Ideal,
}

/// The controller's sample clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SimClock {
    /// 1000 us per tick.
    #[default]
    Nominal,
    /// 976 us per tick: what a Galil controller makes of its nominal millisecond (`TM 1000`).
    Galil,
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

/// How much softer the simulated tissue is where it has been deeper: the largest share of its elastic force
/// that is lost, in whole percent, 0 to 90.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SimSoftening(u8);

/// Largest percentage: tissue that loses more would not come back by itself.
const SOFTENING_MAX: u8 = 90;

impl SimSoftening {
    /// So many percent; `None` above 90.
    #[must_use]
    pub fn percent(percent: u8) -> Option<Self> {
        (percent <= SOFTENING_MAX).then_some(Self(percent))
    }

    /// The share, 0 to 0.9.
    #[must_use]
    pub fn share(self) -> f64 {
        f64::from(self.0) / 100.0
    }
}

/// Everything that determines a simulated rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SimSettings {
    /// How real the load cell is.
    pub profile: SimProfile,
    /// Seed of every random number the rig uses.
    pub seed: u64,
    /// The controller's sample clock.
    pub clock: SimClock,
    /// Samples a second.
    pub rate: SimRate,
    /// What the tissue loses by having been deeper.
    pub softening: SimSoftening,
    /// White noise of the ideal load cell.
    pub noise: SimNoise,
    /// How stiff the tissue is.
    pub stiffness: SimStiffness,
    /// How far behind the surface a stiff base stands.
    pub thickness: SimThickness,
    /// How far the rig itself gives way.
    pub compliance: SimCompliance,
    /// How far loading moves the tissue's surface.
    pub preconditioning: SimPreconditioning,
    /// What its bath is heated to.
    pub bath: SimBath,
    /// When its digital input goes high.
    pub input: SimInput,
}

/// A setting of the simulated rig cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("the simulated rig's {setting} cannot be '{value}'; give {choices}")]
pub struct SimSettingError {
    /// Which setting.
    pub setting: &'static str,
    /// What was given.
    pub value: String,
    /// What is accepted.
    pub choices: &'static str,
}

impl SimSettingError {
    pub(super) fn new(setting: &'static str, value: &str, choices: &'static str) -> Self {
        Self {
            setting,
            value: value.to_owned(),
            choices,
        }
    }
}

impl SimSettings {
    /// True length of one tick in nanoseconds.
    #[must_use]
    pub fn tick_nanos(&self) -> u64 {
        self.clock.tick_nanos() / self.rate.per_usual_tick()
    }

    /// The settings as a rig's description carries them: `profile`, `seed`, `clock` and, where they
    /// are not the usual ones, `rate` (samples a second), `softening` and `preconditioning` (percent), `noise`
    /// (mN), `stiffness` (percent), `thickness` (mm), `compliance` (um/N), `bath` (°C)
    /// and `input` (s).
    #[must_use]
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("profile".to_owned(), self.profile.to_string()),
            ("seed".to_owned(), self.seed.to_string()),
            ("clock".to_owned(), self.clock.to_string()),
        ]);
        let unusual = [
            unusual("rate", self.rate),
            unusual("softening", self.softening),
            unusual("noise", self.noise),
            unusual("stiffness", self.stiffness),
            unusual("thickness", self.thickness),
            unusual("compliance", self.compliance),
            unusual("preconditioning", self.preconditioning),
            unusual("bath", self.bath),
            unusual("input", self.input),
        ];
        map.extend(unusual.into_iter().flatten());
        map
    }

    /// The inverse of [`SimSettings::to_map`]; other values are ignored.
    pub fn from_map(map: &BTreeMap<String, String>) -> Result<Self, SimSettingError> {
        let text = |name: &str| map.get(name).map_or("", String::as_str);
        let seed = text("seed");
        Ok(Self {
            profile: text("profile").parse()?,
            seed: seed
                .parse()
                .map_err(|_| SimSettingError::new("seed", seed, "a whole number from 0"))?,
            clock: text("clock").parse()?,
            rate: usual_or(map, "rate")?,
            softening: usual_or(map, "softening")?,
            noise: usual_or(map, "noise")?,
            stiffness: usual_or(map, "stiffness")?,
            thickness: usual_or(map, "thickness")?,
            compliance: usual_or(map, "compliance")?,
            preconditioning: usual_or(map, "preconditioning")?,
            bath: usual_or(map, "bath")?,
            input: usual_or(map, "input")?,
        })
    }
}

/// A setting with its name, unless it is the usual one: rigs are described as they always were.
fn unusual<T: Default + PartialEq + fmt::Display>(
    name: &str,
    value: T,
) -> Option<(String, String)> {
    (value != T::default()).then(|| (name.to_owned(), value.to_string()))
}

/// A setting by its name, the usual one where it is not given.
fn usual_or<T: Default + FromStr<Err = SimSettingError>>(
    map: &BTreeMap<String, String>,
    name: &str,
) -> Result<T, SimSettingError> {
    map.get(name).map_or(Ok(T::default()), |text| text.parse())
}

impl fmt::Display for SimProfile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Lab => "lab",
            Self::Ideal => "ideal",
        })
    }
}

impl FromStr for SimProfile {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "lab" => Ok(Self::Lab),
            "ideal" => Ok(Self::Ideal),
            _ => Err(SimSettingError::new("profile", text, "'lab' or 'ideal'")),
        }
    }
}

impl fmt::Display for SimSoftening {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for SimSoftening {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let percent = text.parse().ok().and_then(Self::percent);
        percent.ok_or_else(|| SimSettingError::new("softening", text, "0 to 90 (whole percent)"))
    }
}

impl fmt::Display for SimClock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nominal => "nominal",
            Self::Galil => "galil",
        })
    }
}

impl FromStr for SimClock {
    type Err = SimSettingError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "nominal" => Ok(Self::Nominal),
            "galil" => Ok(Self::Galil),
            _ => Err(SimSettingError::new("clock", text, "'nominal' or 'galil'")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_their_map() {
        for profile in [SimProfile::Lab, SimProfile::Ideal] {
            for clock in [SimClock::Nominal, SimClock::Galil] {
                for percent in [0, 40] {
                    let settings = SimSettings {
                        profile,
                        seed: u64::MAX - 3,
                        clock,
                        softening: SimSoftening::percent(percent).unwrap(),
                        preconditioning: SimPreconditioning::percent(percent / 4).unwrap(),
                        ..SimSettings::default()
                    };
                    let map = settings.to_map();
                    assert_eq!(SimSettings::from_map(&map), Ok(settings));
                    // Rigs whose tissue does not soften are described as they always were.
                    assert_eq!(map.contains_key("softening"), percent > 0);
                    assert_eq!(map.contains_key("preconditioning"), percent > 0);
                }
            }
        }
    }

    #[test]
    fn amounts_survive_their_map_and_usual_ones_are_not_in_it() {
        let settings = SimSettings {
            rate: "20000".parse().unwrap(),
            noise: "5".parse().unwrap(),
            stiffness: "200".parse().unwrap(),
            thickness: "12.5".parse().unwrap(),
            compliance: "40".parse().unwrap(),
            bath: "37".parse().unwrap(),
            input: "30".parse().unwrap(),
            ..SimSettings::default()
        };
        let map = settings.to_map();
        assert_eq!(SimSettings::from_map(&map), Ok(settings));
        assert_eq!(
            (map["noise"].as_str(), map["thickness"].as_str()),
            ("5", "12.5")
        );
        assert_eq!(
            (settings.tick_nanos(), map["rate"].as_str()),
            (50_000, "20000")
        );
        assert_eq!(SimSettings::default().to_map().len(), 3);
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
        let mut map = SimSettings::default().to_map();
        map.insert("seed".to_owned(), "-1".to_owned());
        assert_eq!(SimSettings::from_map(&map).unwrap_err().setting, "seed");
        map.remove("seed");
        assert_eq!(SimSettings::from_map(&map).unwrap_err().value, "");
    }
}
