//! Paths of a hand, for scenes without one.

use super::device::HandPose;
use super::settings::SceneSettings;
use std::f64::consts::{PI, TAU};
use std::str::FromStr;

palpate_model::named! {
    /// A path of the hand, from the scene's start and back to it.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum ScenePath {
        /// Down to 8 mm and up again, once.
        Poke = "poke",
        /// To 5 mm and held there.
        Press = "press",
        /// To 4 mm, a third of the side along x, and up.
        Drag = "drag",
        /// Down to 3 mm and up again, four times in two seconds, at four places.
        Taps = "taps",
    }
}

/// From the start to the surface and from the surface to the start, in s.
const WAY_S: f64 = 0.5;

impl ScenePath {
    /// Duration in s.
    #[must_use]
    pub fn seconds(self) -> f64 {
        2.0 * WAY_S + self.contact_s()
    }

    /// Time at the surface or below it, in s.
    fn contact_s(self) -> f64 {
        match self {
            Self::Poke | Self::Taps => 2.0,
            Self::Press => 4.0,
            Self::Drag => 3.0,
        }
    }

    /// Intended pose at `t_s` s; before and after, the scene's start.
    #[must_use]
    pub fn at(self, t_s: f64, settings: &SceneSettings) -> HandPose {
        let [x, y, high] = settings.start();
        let whole = self.contact_s();
        let t = t_s - WAY_S;
        let passed = t.clamp(0.0, whole);
        let share = passed / whole;
        // Down from the start and up to it without a jerk.
        let away = if t < 0.0 { -t } else { t - whole }.clamp(0.0, WAY_S) / WAY_S;
        let above = high * eased(away);
        // In and out again in a quarter of a second.
        let edge = (passed.min(whole - passed) / 0.25).min(1.0);
        let (depth, aside, lean) = match self {
            Self::Poke => (8.0 * (PI * share).sin().powi(2), 0.0, 0.0),
            Self::Press => (5.0 * eased(edge), 0.0, 0.0),
            Self::Drag => {
                let along = (eased(share) - 0.5) * settings.side_mm / 3.0;
                // It comes from the middle and goes back to it above the surface.
                let back = along * (1.0 - eased(away));
                (4.0 * eased(edge), back, 0.3 * (TAU * share).sin())
            }
            Self::Taps => {
                let place = (4.0 * share).min(3.999).floor() - 1.5;
                let lift = (PI * 4.0 * share).sin().powi(2);
                // Between taps the hand is 2 mm above the surface and moves on.
                (
                    5.0 * lift - 2.0 * eased(1.0 - away),
                    place * settings.side_mm / 10.0 * (1.0 - eased(away)),
                    0.0,
                )
            }
        };
        HandPose { at: [x + aside, y, above - depth], turn: [0.0, -0.5 + lean, lean] }
    }
}

/// From 0 to 1 with level ends.
fn eased(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

impl FromStr for ScenePath {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|path| path.name() == name);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("'{name}' is not the name of a path; choose one of {names}")
        })
    }
}
