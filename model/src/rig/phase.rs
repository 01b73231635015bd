//! The names of what a run is doing, as they stand in every `phase` column and on every screen.

use serde::{Deserialize, Serialize};
use std::fmt;

macro_rules! phases {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        /// What the run was doing when a sample was taken.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Phase {
            #[default]
            $($(#[$doc])* $name),*
        }

        impl Phase {
            /// Every phase, in the order of its code.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The number that stands for this phase in the session log; never reused.
            #[must_use]
            pub const fn code(self) -> u32 { match self { $(Self::$name => $code),* } }

            /// The phase of a code, if this version knows it.
            #[must_use]
            pub const fn from_code(code: u32) -> Option<Self> {
                match code { $($code => Some(Self::$name),)* _ => None }
            }

            /// The canonical name.
            #[must_use]
            pub const fn name(self) -> &'static str { match self { $(Self::$name => $text),* } }
        }
    };
}

phases! {
    /// Before the first step.
    Idle = 0, "idle";
    /// Link, clock, signal and motor are checked.
    SelfTest = 1, "self-test";
    /// The home switch is searched.
    Home = 2, "home";
    /// The unloaded signal is averaged.
    Tare = 3, "tare";
    /// The tissue surface is searched.
    Contact = 4, "contact";
    /// The tissue recovers before the measurement.
    Rest = 5, "rest";
    /// Indentation at constant speed.
    Ramp = 6, "ramp";
    /// Constant depth while the force relaxes.
    Hold = 7, "hold";
    /// The probe leaves the tissue.
    Retract = 8, "retract";
    /// The axis was stopped and holds.
    Stopped = 9, "stopped";
    /// The run has ended.
    Ended = 10, "ended";
    /// Moved by the operator.
    Jog = 11, "jog";
    /// Back out of the tissue at constant speed, recorded for a fit.
    Unload = 12, "unload";
    /// Constant force while the depth creeps.
    Creep = 13, "creep";
    /// Depth follows a sine.
    Sine = 14, "sine";
    /// A person is asked for something.
    Prompt = 15, "prompt";
    /// The load cell is read under a known mass.
    Weigh = 16, "weigh";
    /// The home switch is touched again.
    CheckHome = 17, "check-home";
    /// Paused at rest.
    Paused = 18, "paused";
    /// Not known: the sample was imported from another program's file.
    Imported = 19, "imported";
    /// Depth follows a lead from outside, such as the master of a master-slave system.
    Follow = 20, "follow";
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
