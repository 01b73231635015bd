//! The two closed enums of the engine: what it sees and what it does.

use super::record::{Outcome, Record};
use palpate_model::Nanos;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::{Ack, Fault, HandAction, Reading, RigCommand, SensorReading};
use palpate_model::units::Depth;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Everything the engine can see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "input", rename_all = "snake_case")]
pub enum Input {
    /// One sample.
    Reading(Reading),
    /// The rig accepted a command.
    Ack(Ack),
    /// Something outside the plan went wrong.
    Fault(Fault),
    /// The operator asked for something.
    Operator {
        /// What.
        choice: Operator,
    },
    /// Somebody at the rig writes something down; nothing follows from it.
    Note {
        /// What, in their words.
        text: String,
    },
    /// The computer itself stood still so long, all its programs, and goes on: silence in it is not the rig's.
    HostLate {
        /// How long.
        late: Nanos,
    },
    /// The live fit has a new answer. It enters only here, so a replay decides from the record.
    LiveFit(LiveEstimate),
    /// Where a step that follows is to go now: a depth from contact, or none where what leads gave no number. It
    /// enters only here, so a replay decides from the record.
    Lead {
        /// The depth.
        depth: Option<Depth>,
    },
    /// What a sensor beside load cell and axis says.
    Sensor {
        /// The value.
        value: SensorReading,
    },
    /// No sample arrived for a while; time passed.
    Tick,
}

/// What an operator can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Operator {
    /// Begin the plan.
    Start,
    /// Decelerate, hold, keep the data.
    Stop,
    /// As stop, and mark the run failed.
    Abort,
    /// Cut the motion at once.
    Halt,
    /// After a stop: leave the tissue.
    Retract,
    /// After a stop: end the session where the probe stands.
    Close,
    /// Pause as soon as it is sound: motion decelerates, a hold or rest goes on until resumed.
    Pause,
    /// Pause at the checkpoint behind a step of the plan.
    PauseAfter {
        /// Index of the step.
        step_index: usize,
    },
    /// Go on after a pause, or forget a pause that was asked for.
    Resume,
    /// While paused: leave out what is left to measure and do the plan's last retract.
    Finish,
    /// Nobody watches: a pause that cannot go on by itself ends the run.
    Leave,
    /// The prompt is answered: what it asked for is done.
    Confirm,
    /// The prompt is answered: it will not be done.
    Decline,
    /// Go back to the weight before and read it again.
    Redo,
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Leave => "nobody is there",
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

/// Everything the engine can do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "effect", rename_all = "snake_case")]
pub enum Effect {
    /// Tell the rig something.
    Command(RigCommand),
    /// A person has done this at the rig; a simulated rig does it now.
    ByHand(HandAction),
    /// Write something down.
    Record(Record),
    /// The run has ended.
    Finished(Outcome),
}
