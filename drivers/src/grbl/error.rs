//! Why a board cannot be opened; what Grbl says when it refuses a line or locks itself, with what to do about it.

use std::fmt;
use std::io;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Error)]
pub enum GrblOpenError {
    #[error("the link was lost while the board was set up ({detail}); check the cable")]
    Lost { detail: String },
    #[error(
        "no Grbl board answers; check the power, the port and the baud rate (Grbl's default is 115200)"
    )]
    Silent,
    #[error("the device is not a Grbl board: it answers '{found}'; check the port in the rig file")]
    NotGrbl { found: String },
    #[error("the board runs Grbl {version}, which cannot be driven safely; load Grbl 1.1")]
    OtherVersion { version: String },
    #[error(
        "the board is called '{found}', but the rig file expects '{expected}'; check the cables and the build_info in the rig file"
    )]
    OtherBoard {
        /// Its text of `$I=`.
        found: String,
        /// The rig file's.
        expected: String,
    },
    #[error(
        "the board is locked after its start ({reason}); check that the axis is free, then set unlock = true in the rig file, or switch the homing lock off with $22=0"
    )]
    Locked { reason: String },
    /// It is in a state in which nothing can be done.
    #[error("the board is in state {0}; reset the board and open the rig again")]
    State(String),
    /// A limit switch is closed that Grbl itself watches.
    #[error(
        "the limit pin of axis {axis} is closed, and the board locks itself again as soon as the pin opens; move the slide off the switch by hand, then open the rig again"
    )]
    OnALimit { axis: char },
    #[error(
        "the board has ${number}={found} ({meaning}), but the rig file needs {wanted}; correct the rig file, or send ${number}={wanted} from a terminal"
    )]
    SetOtherwise { number: u16, meaning: &'static str, found: f64, wanted: String },
    /// Its steps are shorter than the resolution of its reports.
    #[error(
        "the board has ${number}={found} (steps per mm), but reports positions only in thousandths of a mm, so more than 1000 steps per mm cannot be checked; set the drive to coarser microsteps"
    )]
    TooFine { number: u16, found: f64 },
    /// It is not known at which end the axis stands.
    #[error(
        "the home switch and the far limit switch share the limit pin of axis {axis}, which is closed; move the slide off the switch by hand, or set closed_is_home = true in the rig file if only the home switch can have closed the pin"
    )]
    OnASwitch { axis: char },
    #[error("the board refuses {line} ({detail})")]
    Refused { line: String, detail: String },
}

impl From<io::Error> for GrblOpenError {
    fn from(err: io::Error) -> Self {
        Self::Lost { detail: err.to_string() }
    }
}

/// `error:N` or `ALARM:N`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GrblCode {
    is_alarm: bool,
    pub code: Option<u8>,
    /// The text of firmware that sends words instead of numbers.
    pub words: String,
}

impl GrblCode {
    /// Reads what is behind `error:` or `ALARM:`.
    #[must_use]
    pub fn parse(is_alarm: bool, text: &str) -> Self {
        let code = text.trim().parse().ok();
        let words = if code.is_some() { String::new() } else { text.trim().to_owned() };
        Self { is_alarm, code, words }
    }

    /// What it means and what to do (doc/markdown/interface.md, tables of error and alarm codes).
    fn remedy(&self) -> &'static str {
        match (self.is_alarm, self.code) {
            (true, Some(1)) => {
                "a limit switch has closed, so the axis was stopped at once; move the axis off the switch by hand, then open the rig again and home the axis"
            }
            (true, Some(2)) => {
                "the target was outside the axis travel set in the board; open the rig again"
            }
            (true, Some(3)) => {
                "the board was reset in motion, so the position is lost; open the rig again and home the axis"
            }
            (true, Some(4 | 5)) => "a probe cycle has failed; check the wiring of the probe",
            (true, Some(6..=9)) => {
                "the board's own homing has failed; check the limit switch and its cable"
            }
            (true, _) | (false, Some(9)) => {
                "the board is locked; check the axis, then open the rig again"
            }
            (false, Some(1 | 2 | 11 | 16 | 22..=29)) => {
                "a line was garbled in transmission; check the cable"
            }
            (false, Some(3 | 20)) => "this firmware does not know the command; use Grbl 1.1",
            (false, Some(4)) => "a number must not be negative",
            (false, Some(5)) => "the board's homing is off; set $22=1 or let palpate home the axis",
            (false, Some(7)) => {
                "the board could not read its memory and now has the factory settings; enter your settings and open the rig again"
            }
            (false, Some(8)) => "the board is not at rest; wait until the axis is at rest",
            (false, Some(10)) => "soft limits need homing ($22=1)",
            (false, Some(12)) => {
                "the speed needs more steps per second than the board can output; lower the speed"
            }
            (false, Some(13)) => "the safety door is open; close it",
            (false, Some(15)) => {
                "the target is outside the axis travel set in the board ($130 to $132); home the axis or correct these settings"
            }
            (false, _) => "",
        }
    }
}

impl fmt::Display for GrblCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = if self.is_alarm { "ALARM" } else { "error" };
        match self.code {
            Some(code) => write!(f, "{name}:{code}")?,
            None => write!(f, "{name}: {}", self.words)?,
        }
        if !self.remedy().is_empty() {
            write!(f, ", {}", self.remedy())?;
        }
        Ok(())
    }
}
