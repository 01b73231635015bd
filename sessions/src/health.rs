//! How the computer kept up with a run, and how its clocks went: measurements of the machine, no part of what
//! a replay compares.

use chrono::{DateTime, Utc};
use palpate_model::Nanos;
use serde::{Deserialize, Serialize};

/// One message of the channel `/health`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Session time.
    #[serde(rename = "now_ns")]
    pub now: Nanos,
    /// What is told.
    #[serde(flatten)]
    pub told: Told,
}

/// What a message tells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Told {
    /// How the computer keeps up: each the worst since the last message of this kind.
    State(MachineState),
    /// What the wall clock showed.
    Anchor {
        /// Why it was looked at.
        why: Why,
        /// The wall clock, UTC.
        wall: DateTime<Utc>,
        /// By how much the wall clock went ahead of the monotonic one since the last anchor, in s.
        shift_s: f64,
    },
    /// Something happened that no decision was made of.
    Event {
        /// What, in words.
        text: String,
    },
    /// What a later version of the program tells.
    #[serde(other)]
    Unknown,
}

/// Why a wall clock was looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Why {
    /// The run began.
    Start,
    /// Its clocks went apart by more than half a second.
    Jump,
    /// The run ended.
    End,
}

/// How a computer keeps up with a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MachineState {
    /// How late the runner woke up, in s.
    pub lateness_s: f64,
    /// Share of the memory for unwritten samples that is in use, 0 to 1.
    pub queue_share: f64,
    /// How long a synchronisation with the disk took, in s; `None` if there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sync_s: Option<f64>,
    /// Free room on the disk; `None` if it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_bytes: Option<u64>,
    /// Readings that the controller's clock says are missing.
    pub missed_readings: u64,
}

impl MachineState {
    /// Takes the worse of each.
    fn worsen(&mut self, other: &Self) {
        self.lateness_s = self.lateness_s.max(other.lateness_s);
        self.queue_share = self.queue_share.max(other.queue_share);
        self.sync_s = match (self.sync_s, other.sync_s) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        self.free_bytes = match (self.free_bytes, other.free_bytes) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        self.missed_readings += other.missed_readings;
    }
}

/// The worst that a session's `/health` tells.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HealthSummary {
    /// Messages there are.
    pub messages: u64,
    /// The worst of each, readings missed in all; `None` where nothing was measured.
    pub worst: Option<MachineState>,
    /// How often the wall clock went apart from the monotonic one.
    pub clock_jumps: u64,
    /// The greatest such jump in s, with its sign.
    pub clock_jump_s: f64,
    /// Events, the first ones, with session time in s.
    pub events: Vec<(f64, String)>,
}

/// Events that a summary tells in full.
const EVENTS_MAX: usize = 100;

impl HealthSummary {
    pub(crate) fn take(&mut self, health: &Health) {
        self.messages += 1;
        match &health.told {
            Told::State(state) => match &mut self.worst {
                Some(worst) => worst.worsen(state),
                None => self.worst = Some(*state),
            },
            Told::Anchor { why: Why::Jump, shift_s, .. } => {
                self.clock_jumps += 1;
                if shift_s.abs() > self.clock_jump_s.abs() {
                    self.clock_jump_s = *shift_s;
                }
            }
            Told::Event { text } if self.events.len() < EVENTS_MAX => {
                self.events.push((health.now.seconds().0, text.clone()));
            }
            Told::Anchor { .. } | Told::Event { .. } | Told::Unknown => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(now: u64, told: Told) -> Health {
        Health { now: Nanos(now), told }
    }

    #[test]
    fn messages_come_back_and_later_kinds_are_passed_over() {
        let state = MachineState {
            lateness_s: 0.1 + 0.2,
            queue_share: 1e-9,
            sync_s: None,
            free_bytes: Some(u64::MAX),
            missed_readings: 3,
        };
        let anchor = Told::Anchor {
            why: Why::Jump,
            wall: DateTime::from_timestamp_nanos(1_772_720_107_123_456_789),
            shift_s: -3600.5,
        };
        let event = Told::Event { text: "so".into() };
        for told in [Told::State(state), anchor, event] {
            let one = at(7, told);
            let text = serde_json::to_string(&one).unwrap();
            assert_eq!(serde_json::from_str::<Health>(&text).unwrap(), one, "{text}");
        }
        let later: Health =
            serde_json::from_str(r#"{"now_ns":5,"kind":"temperature","kelvin":300}"#).unwrap();
        assert_eq!(later.told, Told::Unknown);
    }

    #[test]
    fn a_summary_keeps_the_worst_of_each() {
        let mut summary = HealthSummary::default();
        for (lateness_s, free_bytes, missed_readings) in
            [(0.1, Some(5), 1), (0.3, Some(3), 0), (0.2, None, 2)]
        {
            summary.take(&at(
                1,
                Told::State(MachineState {
                    lateness_s,
                    free_bytes,
                    missed_readings,
                    ..MachineState::default()
                }),
            ));
        }
        for (why, shift_s) in [(Why::Start, 0.0), (Why::Jump, -2.0), (Why::Jump, 1.0)] {
            let wall = DateTime::UNIX_EPOCH;
            summary.take(&at(2, Told::Anchor { why, wall, shift_s }));
        }
        let worst = summary.worst.unwrap();
        assert_eq!(worst.lateness_s, 0.3);
        assert_eq!((worst.free_bytes, worst.missed_readings), (Some(3), 3));
        assert_eq!((summary.clock_jumps, summary.clock_jump_s), (2, -2.0));
    }
}
