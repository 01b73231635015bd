//! Records of a run beside samples and commands, and its outcome.

use super::interlock::Interlock;
use super::state::Drift;
use crate::plans::BodyParameter;
use crate::plans::hold_until::percent;
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Position, Seconds, Volts};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// What is written down beside samples and commands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "record", rename_all = "snake_case")]
pub enum Record {
    PhaseStarted {
        phase: Phase,
        step_index: usize,
    },
    Homed {
        /// Counter value at which the switch closed, before it was redefined.
        edge_pulses: i64,
    },
    Tared {
        volts: Volts,
        /// Standard deviation of one sample.
        noise: Volts,
        samples: u64,
        /// How the signal drifted meanwhile; absent where the tare was too short to tell.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        drift: Option<Drift>,
    },
    /// Enough consecutive samples were above the contact criterion.
    ContactTriggered {
        /// 1 for the approach, 2 for the slow pass.
        pass: u8,
        position: Position,
        /// Signal of the triggering sample, unfiltered.
        volts: Volts,
        /// Filtered force above tare.
        force: Newtons,
        /// The samples that triggered, unfiltered and above tare, oldest first.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        raw: Vec<Newtons>,
    },
    /// The contact position was estimated.
    ContactFound {
        /// Estimate, from home.
        position: Position,
        /// Standard error in mm.
        std_error_mm: f64,
    },
    /// The base behind the specimen was found; depths count from it now.
    BaseFound {
        /// Estimate, from home.
        position: Position,
        /// Standard error in mm.
        std_error_mm: f64,
        /// Compliance of rig and base, in mm/N.
        compliance_mm_per_n: f64,
        /// From the tissue's surface to the base in mm, where the surface was found before.
        thickness_mm: Option<f64>,
        /// Its standard error in mm.
        thickness_std_error_mm: Option<f64>,
    },
    /// The live fit knows enough: the hold ends before its planned duration.
    HoldEndedEarly {
        parameter: BodyParameter,
        /// Half of its 95 % interval as a share of its value.
        relative: f64,
        /// The share that was the target.
        wanted: f64,
        held: Seconds,
    },
    /// A lead stopped coming: the axis stops where it is.
    LeadLost {
        /// Time since the last lead.
        silent: Seconds,
    },
    /// The force hardly changes any more: the hold ends before its planned duration.
    HoldSteady {
        /// Slope of the force over the window, in N/s.
        slope_n_per_s: f64,
        held: Seconds,
    },
    ForceReached {
        target: Newtons,
        /// Filtered force as the axis came to rest.
        force: Newtons,
        depth: Depth,
    },
    Prompted {
        message: String,
        /// How long the run waits.
        timeout: Seconds,
    },
    Answered {
        answer: PromptAnswer,
    },
    /// A pause was asked for, and will begin behind a step.
    PausePending {
        step_index: usize,
    },
    Paused {
        reason: String,
        /// Why it cannot go on from here; none if it can.
        no_resume: Option<String>,
    },
    Resumed,
    /// What the operator asked for cannot be done now.
    Refused {
        reason: String,
    },
    FinishedEarly,
    /// A step could not be done and the plan says what follows.
    StepFailed {
        reason: String,
        then: FailureResponse,
    },
    MonitorTripped {
        index: usize,
        value: f64,
        message: String,
    },
    MonitorPast {
        index: usize,
        value: f64,
    },
    Weighed {
        /// The mass in g, platform included.
        mass_g: f64,
        is_loading: bool,
        /// Which pass through the masses, from 1.
        repeat: u32,
        volts: Volts,
        /// Standard deviation of one sample.
        noise: Volts,
        /// Remaining slope, in V/s.
        slope_v_per_s: f64,
        /// Samples in the mean.
        samples: u64,
        /// Time until the signal had come to rest.
        waited: Seconds,
    },
    StepReported {
        text: String,
        /// In numbers, each with its unit in its name.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        values: BTreeMap<String, f64>,
    },
    Noted {
        text: String,
    },
    HomeChecked {
        /// Pulses by which it was found beyond position zero: pulses missed on the way.
        missed_pulses: i64,
    },
    /// An interlock tripped.
    InterlockTripped {
        interlock: Interlock,
        reason: String,
    },
    /// The run began to end other than by finishing its plan.
    EndingStarted {
        ending: EndingKind,
        reason: String,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PromptAnswer {
    Confirmed,
    Declined,
    TimedOut,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureResponse {
    /// Once more from where it began; counted from 1.
    Retry(u32),
    Skip,
}

palpate_model::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum EndingKind {
        Finish = "finish",
        Stop = "stop",
        /// Given up: a step failed or the operator aborted.
        Abort = "abort",
        /// Motion cut at once.
        Halt = "halt",
        /// An interlock tripped.
        Interlock = "interlock",
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunOutcome {
    pub ending: EndingKind,
    pub reason: String,
}

impl fmt::Display for Record {
    #[expect(clippy::too_many_lines, reason = "a table of sentences")]
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PhaseStarted { phase, .. } => write!(f, "{phase}"),
            Self::Homed { edge_pulses } => {
                write!(f, "home found at pulse {edge_pulses}, which is now position zero")
            }
            Self::Tared { volts, noise, drift, .. } => {
                write!(f, "tare {volts:.4}, noise {:.2} mV rms", noise.0 * 1e3)?;
                // A minute is how long people wait for a cell to settle.
                drift.map_or(Ok(()), |drift| {
                    write!(f, ", drift {:+.2} mV a minute", drift.volts_per_s * 6e4)
                })
            }
            Self::ContactTriggered { pass, position, force, .. } => {
                write!(
                    f,
                    "pass {pass}: contact detected at {position:.3} with a force of {force:.3}"
                )
            }
            Self::ContactFound { position, std_error_mm } => {
                write!(f, "contact at {:.3} ± {std_error_mm:.3} mm", position.0)
            }
            Self::BaseFound {
                position,
                std_error_mm,
                thickness_mm,
                thickness_std_error_mm,
                ..
            } => {
                write!(f, "base at {:.3} ± {std_error_mm:.3} mm", position.0)?;
                match (thickness_mm, thickness_std_error_mm) {
                    (Some(mm), Some(error)) => {
                        write!(f, "; the specimen is {mm:.3} ± {error:.3} mm thick")
                    }
                    _ => Ok(()),
                }
            }
            Self::HoldEndedEarly { parameter, relative, wanted, held } => write!(
                f,
                "the hold ended after {held:.1}, because {} is known to within {} %; the target was {} %",
                parameter.name(),
                percent(*relative),
                percent(*wanted)
            ),
            Self::LeadLost { silent } => write!(
                f,
                "the master has sent no position for {silent:.1}; the axis stops, and the step ends unless a position arrives"
            ),
            Self::HoldSteady { slope_n_per_s, held } => write!(
                f,
                "the hold ended after {held:.1}, because the force changes by only {:.4} N/min",
                60.0 * slope_n_per_s
            ),
            Self::ForceReached { target, force, depth } => {
                write!(
                    f,
                    "a force of {force:.3} was reached at a depth of {depth:.3}; the target was {target:.3}"
                )
            }
            Self::Prompted { message, timeout } => {
                write!(f, "{message} (waits at most {:.0})", *timeout)
            }
            Self::Answered { answer } => f.write_str(match answer {
                PromptAnswer::Confirmed => "done",
                PromptAnswer::Declined => "declined",
                PromptAnswer::TimedOut => "no answer in time",
            }),
            Self::PausePending { step_index } => {
                write!(f, "the run will pause after step {}", step_index + 1)
            }
            Self::Paused { reason, no_resume } => match no_resume {
                Some(cause) => {
                    write!(f, "paused: {reason}; the run cannot be resumed, because {cause}")
                }
                None => write!(f, "paused: {reason}"),
            },
            Self::Resumed => f.write_str("resumed"),
            Self::Refused { reason } => write!(f, "refused: {reason}"),
            Self::FinishedEarly => f.write_str("the rest of the measurement is skipped"),
            Self::StepFailed { reason, then } => match then {
                FailureResponse::Retry(count) => write!(f, "{reason}; retry {count} follows"),
                FailureResponse::Skip => write!(f, "{reason}; the step is skipped"),
            },
            Self::MonitorTripped { message, value, .. } => write!(f, "{message} ({value:.4})"),
            Self::MonitorPast { index, value } => {
                write!(f, "the value of monitor {} is back in range ({value:.4})", index + 1)
            }
            Self::Weighed { mass_g, is_loading, repeat, volts, .. } => {
                let way = if *is_loading { "loading" } else { "unloading" };
                write!(f, "{mass_g} g, {way}, pass {repeat}: {volts:.4}")
            }
            Self::StepReported { text, .. } => f.write_str(text),
            Self::Noted { text } => write!(f, "note: {text}"),
            Self::HomeChecked { missed_pulses } => match missed_pulses {
                0 => f.write_str("home is unchanged; no pulse was missed"),
                missed => write!(f, "home has moved by {missed} pulses"),
            },
            Self::InterlockTripped { interlock, reason } => {
                write!(f, "{interlock} interlock: {reason}")
            }
            Self::EndingStarted { ending, reason } => write!(f, "{ending}: {reason}"),
        }
    }
}
