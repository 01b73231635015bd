//! The two closed enums of the engine: what it sees and what it does.

use super::record::{Record, RunOutcome};
use palpate_model::Nanos;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::{Ack, Fault, HandAction, Reading, RigCommand, SensorReading};
use palpate_model::units::Depth;
use serde::{Deserialize, Serialize};
use std::fmt;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "input", rename_all = "snake_case")]
pub enum EngineInput {
    Reading(Reading),
    Ack(Ack),
    Fault(Fault),
    Operator {
        choice: Operator,
    },
    /// A note of the operator, which changes nothing.
    Note {
        text: String,
    },
    /// The computer stood still for so long and runs again: the missing samples are not the rig's fault.
    HostLate {
        late: Nanos,
    },
    /// The live fit has a new answer. It enters only here, so a replay decides from the record.
    LiveFit(LiveEstimate),
    /// Target of a step that follows: a depth from contact, or none where the lead was not a number. It enters only
    /// here, so a replay decides from the record.
    Lead {
        depth: Option<Depth>,
    },
    Sensor {
        value: SensorReading,
    },
    Tick,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Operator {
    Start,
    Stop,
    Abort,
    /// Cut the motion at once.
    Halt,
    Retract,
    /// After a stop: end the session where the probe stands.
    Close,
    /// Pause as soon as possible without harm: motion decelerates, a hold or rest goes on until resumed.
    Pause,
    /// Pause at the checkpoint behind a step of the plan.
    PauseAfter {
        step_index: usize,
    },
    /// Go on after a pause, or cancel a pending pause.
    Resume,
    /// While paused: skip the rest of the measurement and do the plan's last retract.
    Finish,
    /// The run is unattended: a pause that cannot go on by itself ends it.
    Leave,
    /// The prompt is answered: what it asked for is done.
    Confirm,
    Decline,
    /// Go back to the weight before and read it again.
    Redo,
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Leave => "unattended",
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Abort => "abort",
            Self::Halt => "halt",
            Self::Retract => "retract",
            Self::Close => "close",
            Self::Pause => "pause",
            Self::PauseAfter { step_index } => {
                return write!(f, "pause after step {}", step_index + 1);
            }
            Self::Resume => "resume",
            Self::Finish => "finish early",
            Self::Confirm => "done",
            Self::Decline => "not done",
            Self::Redo => "weigh again",
        })
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "effect", rename_all = "snake_case")]
pub enum Effect {
    Command(RigCommand),
    /// A person has done this at the rig; a simulated rig does it now.
    ByHand(HandAction),
    Record(Record),
    Finished(RunOutcome),
}
