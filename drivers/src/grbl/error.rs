//! Why a board cannot be opened; what Grbl says when it refuses a line or locks itself, with what to do about it.

use std::fmt;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Error)]
pub enum GrblOpenError {
    #[error("the link was lost while the board was set up ({detail}); check the cable")]
    Lost {
        detail: String,
    },
    #[error("nothing answers like Grbl; check power, port and baud rate (115200 is Grbl's)")]
    Silent,
    #[error("what answers is not Grbl ({found}); check the port in the rig file")]
    NotGrbl {
        found: String,
    },
    #[error("the board runs Grbl {version}, which cannot be driven safely; load Grbl 1.1")]
    OtherVersion {
        version: String,
    },
    #[error(
        "the board calls itself '{found}' where the rig file has '{expected}'; check the cables, or the build_info of the rig file"
    )]
    OtherBoard {
        /// Its text of `$I=`.
        found: String,
        /// The rig file's.
        expected: String,
    },
    #[error(
        "the board is locked after its start ({reason}); look whether the axis is free, then let palpate unlock it with unlock = true in the rig file, or switch its homing lock off with $22=0"
    )]
    Locked {
        reason: String,
    },
    /// It is in a state in which nothing can be done.
    #[error("the board is in state {0}; reset it and open the rig again")]
    State(String),
    /// A limit switch is closed that Grbl itself watches.
    #[error(
        "the limit pin of axis {axis} is closed, and the board would lock itself again as soon as it opens; move the slide off the switch by hand, then open the rig again"
    )]
    OnALimit {
        axis: char,
    },
    #[error(
        "the board has ${number}={found} ({meaning}) where the rig file needs {wanted}; correct the rig file, or send ${number}={wanted} from a terminal"
    )]
    SetOtherwise {
        number: u16,
        meaning: &'static str,
        found: f64,
        wanted: String,
    },
    /// Its steps are shorter than what it tells.
    #[error(
        "the board has ${number}={found} (steps a mm), but tells places in thousandths of a mm only, so that more than 1000 cannot be checked; set the drive to coarser microsteps"
    )]
    TooFine {
        number: u16,
        found: f64,
    },
    /// Nobody knows at which end it stands.
    #[error(
        "the limit pin of axis {axis} is closed, and home and the far limit look alike on it; move the slide off the switch by hand, or say closed_is_home = true in the rig file if nothing but home can have closed it"
    )]
    OnASwitch {
        axis: char,
    },
    #[error("the board refuses {line} ({detail})")]
    Refused {
        line: String,
        detail: String,
    },
}

/// `error:N`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    pub code: Option<u8>,
    pub words: String,
}

/// `ALARM:N`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alarm {
    pub code: Option<u8>,
    pub words: String,
}

fn split(text: &str) -> (Option<u8>, String) {
    let text = text.trim();
    match text.parse() {
        Ok(code) => (Some(code), String::new()),
        Err(_) => (None, text.to_owned()),
    }
}

impl Refusal {
    /// Reads what is behind `error:`.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let (code, words) = split(text);
        Self { code, words }
    }

    /// What it means and what to do (doc/markdown/interface.md, table of error codes).
    fn meaning(&self) -> &'static str {
        match self.code {
            Some(1 | 2 | 23..=29) => "a line was garbled on its way; check the cable",
            Some(3 | 20) => "this firmware does not know the command; use Grbl 1.1",
            Some(4) => "a number must not be negative",
            Some(5) => "its homing is off; set $22=1 or let palpate look for home",
            Some(7) => {
                "its memory could not be read and holds the factory settings now; set them again and open the rig"
            }
            Some(8) => "it is not at rest; wait",
            Some(9) => "it is locked; look at the axis, then open the rig again",
            Some(10) => "soft limits need homing ($22=1)",
            Some(11) => "a line was too long; bytes were lost, check the cable",
            Some(12) => "so many steps a second it does not make; lower the speed",
            Some(13) => "the safety door is open; close it",
            Some(15) => {
                "the target is outside the travel that it knows ($130 to $132); home it or correct the travel"
            }
            Some(16) => "the jog was garbled on its way; check the cable",
            Some(22) => "the speed was lost on its way; check the cable",
            _ => "",
        }
    }
}

impl Alarm {
    /// Reads what is behind `ALARM:`.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let (code, words) = split(text);
        Self { code, words }
    }

    /// What it means and what to do (doc/markdown/interface.md, table of alarm codes).
    fn meaning(&self) -> &'static str {
        match self.code {
            Some(1) => {
                "a limit switch has closed and the axis was stopped at once; free it by hand, then open the rig again and home it"
            }
            Some(2) => "a target was outside the travel that it knows; open the rig again",
            Some(3) => {
                "it was reset in motion and its position is lost; open the rig again and home it"
            }
            Some(4 | 5) => "a search for the probe has failed; check the probe's wiring",
            Some(6..=9) => "its own homing has failed; check the limit switch and its cable",
            _ => "it is locked; look at the axis, then open the rig again",
        }
    }
}

fn write(
    f: &mut fmt::Formatter<'_>,
    name: &str,
    code: Option<u8>,
    words: &str,
    meaning: &str,
) -> fmt::Result {
    match code {
        Some(code) => write!(f, "{name}:{code}")?,
        None => write!(f, "{name}: {words}")?,
    }
    if !meaning.is_empty() {
        write!(f, ", {meaning}")?;
    }
    Ok(())
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, "error", self.code, &self.words, self.meaning())
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, "ALARM", self.code, &self.words, self.meaning())
    }
}
