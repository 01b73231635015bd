//! Measurements of the recording computer: delays, queue, disk, clocks. A replay does not compare them.

use chrono::{DateTime, Utc};
use palpate_model::Nanos;
use serde::{Deserialize, Serialize};

/// One message of the channel `/health`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HealthMessage {
    #[serde(rename = "now_ns")]
    pub now: Nanos,
    #[serde(flatten)]
    pub content: HealthContent,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum HealthContent {
    /// Each value is the worst since the last message of this kind.
    State(MachineState),
    /// Wall clock at a session time.
    Anchor {
        #[serde(rename = "why")]
        reason: AnchorReason,
        wall: DateTime<Utc>,
        /// Advance of the wall clock over the monotonic clock since the last anchor, in s.
        shift_s: f64,
    },
    /// An occurrence without influence on decisions.
    Event { text: String },
    /// A kind of a later version.
    #[serde(other)]
    Unknown,
}

/// Occasion of an anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AnchorReason {
    Start,
    /// The clocks diverged by more than 0.5 s.
    Jump,
    End,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MachineState {
    /// Delay of the runner's wake-up, in s.
    pub lateness_s: f64,
    /// Fill level of the memory for unwritten samples, 0 to 1.
    pub queue_share: f64,
    /// Duration of a synchronisation with the disk, in s; `None` if there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sync_s: Option<f64>,
    /// Free space on the disk; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_bytes: Option<u64>,
    /// Readings missing by the controller's clock.
    pub missed_readings: u64,
}

impl MachineState {
    fn worsen(&mut self, other: &Self) {
        self.lateness_s = self.lateness_s.max(other.lateness_s);
        self.queue_share = self.queue_share.max(other.queue_share);
        self.sync_s = [self.sync_s, other.sync_s].into_iter().flatten().reduce(f64::max);
        self.free_bytes = [self.free_bytes, other.free_bytes].into_iter().flatten().min();
        self.missed_readings += other.missed_readings;
    }
}

/// Worst values of a session's channel `/health`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HealthSummary {
    pub messages: u64,
    /// Worst of each value, and the sum of missed readings; `None` without measurements.
    pub worst: Option<MachineState>,
    /// Number of divergences of the wall clock from the monotonic clock.
    pub clock_jumps: u64,
    /// Largest divergence in s, with its sign.
    pub clock_jump_s: f64,
    /// The first events, with session time in s.
    pub events: Vec<(f64, String)>,
}

const EVENTS_MAX: usize = 100;

impl HealthSummary {
    pub(crate) fn take(&mut self, health: &HealthMessage) {
        self.messages += 1;
        match &health.content {
            HealthContent::State(state) => match &mut self.worst {
                Some(worst) => worst.worsen(state),
                None => self.worst = Some(*state),
            },
            HealthContent::Anchor { reason: AnchorReason::Jump, shift_s, .. } => {
                self.clock_jumps += 1;
                if shift_s.abs() > self.clock_jump_s.abs() {
                    self.clock_jump_s = *shift_s;
                }
            }
            HealthContent::Event { text } if self.events.len() < EVENTS_MAX => {
                self.events.push((health.now.seconds().0, text.clone()));
            }
            HealthContent::Anchor { .. } | HealthContent::Event { .. } | HealthContent::Unknown => {
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(now: u64, content: HealthContent) -> HealthMessage {
        HealthMessage { now: Nanos(now), content }
    }

    #[test]
    fn messages_read_back_and_later_kinds_are_ignored() {
        let state = MachineState {
            lateness_s: 0.1 + 0.2,
            queue_share: 1e-9,
            sync_s: None,
            free_bytes: Some(u64::MAX),
            missed_readings: 3,
        };
        let anchor = HealthContent::Anchor {
            reason: AnchorReason::Jump,
            wall: DateTime::from_timestamp_nanos(1_772_720_107_123_456_789),
            shift_s: -3600.5,
        };
        let event = HealthContent::Event { text: "so".into() };
        for content in [HealthContent::State(state), anchor, event] {
            let one = at(7, content);
            let text = serde_json::to_string(&one).unwrap();
            assert_eq!(serde_json::from_str::<HealthMessage>(&text).unwrap(), one, "{text}");
        }
        let later: HealthMessage =
            serde_json::from_str(r#"{"now_ns":5,"kind":"temperature","kelvin":300}"#).unwrap();
        assert_eq!(later.content, HealthContent::Unknown);
    }

    #[test]
    fn summary_has_the_worst_of_each_value() {
        let mut summary = HealthSummary::default();
        for (lateness_s, free_bytes, missed_readings) in
            [(0.1, Some(5), 1), (0.3, Some(3), 0), (0.2, None, 2)]
        {
            summary.take(&at(
                1,
                HealthContent::State(MachineState {
                    lateness_s,
                    free_bytes,
                    missed_readings,
                    ..MachineState::default()
                }),
            ));
        }
        for (why, shift_s) in
            [(AnchorReason::Start, 0.0), (AnchorReason::Jump, -2.0), (AnchorReason::Jump, 1.0)]
        {
            let wall = DateTime::UNIX_EPOCH;
            summary.take(&at(2, HealthContent::Anchor { reason: why, wall, shift_s }));
        }
        let worst = summary.worst.unwrap();
        assert_eq!(worst.lateness_s, 0.3);
        assert_eq!((worst.free_bytes, worst.missed_readings), (Some(3), 3));
        assert_eq!((summary.clock_jumps, summary.clock_jump_s), (2, -2.0));
    }
}
