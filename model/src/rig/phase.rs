//! The names of what a run is doing, as they stand in every `phase` column and on every screen.

use serde::{Deserialize, Serialize};

crate::named! {
    /// What the run was doing when a sample was taken. The session log has positions in this list: new phases go to the
    /// end, and none is ever removed.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Phase {
        /// Before the first step.
        #[default]
        Idle = "idle",
        /// Link, clock, signal and motor are checked.
        SelfTest = "self-test",
        /// The home switch is searched.
        Home = "home",
        /// The unloaded signal is averaged.
        Tare = "tare",
        /// The tissue surface is searched.
        Contact = "contact",
        /// The tissue recovers before the measurement.
        Rest = "rest",
        /// Indentation at constant speed.
        Ramp = "ramp",
        /// Constant depth while the force relaxes.
        Hold = "hold",
        /// The probe leaves the tissue.
        Retract = "retract",
        /// The axis was stopped and holds.
        Stopped = "stopped",
        /// The run has ended.
        Ended = "ended",
        /// Moved by the operator.
        Jog = "jog",
        /// Back out of the tissue at constant speed, recorded for a fit.
        Unload = "unload",
        /// Constant force while the depth creeps.
        Creep = "creep",
        /// Depth follows a sine.
        Sine = "sine",
        /// A person is asked for something.
        Prompt = "prompt",
        /// The load cell is read under a known mass.
        Weigh = "weigh",
        /// The home switch is touched again.
        CheckHome = "check-home",
        /// Paused at rest.
        Paused = "paused",
        /// Not known: the sample was imported from another program's file.
        Imported = "imported",
        /// Depth follows a lead from outside, such as the master of a master-slave system.
        Follow = "follow",
    }
}

impl Phase {
    /// The number of this phase in the session log.
    #[must_use]
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// The phase of a code, if this version knows it.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get(code as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_recorded_phases_stay() {
        let codes = Phase::ALL.map(|phase| (phase.code(), phase.name()));
        assert_eq!(
            codes,
            [
                (0, "idle"),
                (1, "self-test"),
                (2, "home"),
                (3, "tare"),
                (4, "contact"),
                (5, "rest"),
                (6, "ramp"),
                (7, "hold"),
                (8, "retract"),
                (9, "stopped"),
                (10, "ended"),
                (11, "jog"),
                (12, "unload"),
                (13, "creep"),
                (14, "sine"),
                (15, "prompt"),
                (16, "weigh"),
                (17, "check-home"),
                (18, "paused"),
                (19, "imported"),
                (20, "follow"),
            ]
        );
        assert!(Phase::ALL.iter().all(|phase| Phase::from_code(phase.code()) == Some(*phase)));
        assert_eq!(Phase::from_code(21), None);
    }
}
