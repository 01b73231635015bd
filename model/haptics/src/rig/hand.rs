//! A hand, for simulation: it holds the handle softly and wants to be somewhere.

use serde::{Deserialize, Serialize};

/// Mass that moves with the handle, and the spring and damper by which it is led along the intended path (Hogan's
/// equilibrium point, Journal of Neuroscience 4 (1984) 2745-2754). The numbers of the grips are assumed: of the size
/// that fingers have in one degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulatedHand {
    /// Mass in kg.
    pub mass_kg: f64,
    /// Spring to the intended path, in N/mm.
    pub stiffness: f64,
    /// Damper to the intended path, in N s/mm.
    pub damping: f64,
    pub path: HandPath,
}

/// The intended path, in mm over s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HandPath {
    /// Always at one place.
    Still {
        /// In mm.
        at: f64,
    },
    /// From one place to another at a speed, and staying there.
    RampHold {
        /// From, in mm.
        from: f64,
        /// To, in mm.
        to: f64,
        /// In mm/s, above zero.
        speed: f64,
    },
    /// To and fro.
    Sine {
        /// Middle in mm.
        middle: f64,
        /// Half of the way, in mm.
        amplitude: f64,
        /// In Hz.
        hz: f64,
    },
}

impl HandPath {
    /// Place in mm at `t` s.
    pub fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Still { at } => at,
            Self::RampHold { from, to, speed } => {
                let way = (speed * t.max(0.0)).min((to - from).abs());
                from + way.copysign(to - from)
            }
            Self::Sine { middle, amplitude, hz } => {
                middle - amplitude * (std::f64::consts::TAU * hz * t).cos()
            }
        }
    }
}

impl SimulatedHand {
    /// No hand: the handle is let go.
    pub const NONE: Self =
        Self { mass_kg: 0.0, stiffness: 0.0, damping: 0.0, path: HandPath::Still { at: 0.0 } };

    /// A firm grip.
    #[must_use]
    pub fn firm(path: HandPath) -> Self {
        Self { mass_kg: 0.2, stiffness: 0.8, damping: 0.012, path }
    }
}
