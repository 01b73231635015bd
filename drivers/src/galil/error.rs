//! Reasons why a Galil controller refuses a command, and what to do about them.

use super::codes::ErrorCode;
use std::fmt;

/// The answer to `TC1`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GalilError {
    /// Number of `TC`.
    pub code: u16,
    /// The controller's own words.
    pub words: String,
}

impl GalilError {
    /// What to do about it (DMC-40x0 command reference, `TC`); empty where only the controller's own words help.
    pub fn remedy(&self) -> &'static str {
        use ErrorCode as E;
        let Ok(code) = u8::try_from(self.code) else {
            return "";
        };
        match ErrorCode(code) {
            E::UNRECOGNIZED | E::PROGRAM_ONLY | E::NOT_IN_PROGRAM => {
                "this firmware does not know the command; update it or choose another controller"
            }
            E::OPERAND | E::FEW_FIELDS => "check the axis letter in the rig file",
            E::BUFFER_FULL => "the line is slower than the commands; check the baud rate",
            E::OUT_OF_RANGE => {
                "a setting of the rig file is beyond what this controller makes; lower it"
            }
            E::RUNNING | E::NOT_RUNNING | E::BEGIN_RUNNING | ErrorCode(29) => {
                "wait until the axis rests"
            }
            ErrorCode(14 | 15) => "the controller's memory has failed; have it serviced",
            E::PROGRAM_RUNNING | E::STRAND_BUSY => {
                "a program runs on the controller; halt it with HX"
            }
            E::CONTOURING => "end the contour mode with ST",
            E::MOTOR_OFF => "the motor is off; energise it and check the amplifier",
            E::LIMIT_SWITCH => "a limit switch is closed; move the other way and check the switch",
            E::ARRAY_SPACE | E::TOO_MANY_NAMES => {
                "free the controller's arrays and variables (DA*[],*)"
            }
            E::RECORDING => "end the recording with RC 0",
            E::NOT_FOR_STEPPER => {
                "set the axis up as a stepper: check the motor_type of the rig file and the SM jumper"
            }
            E::NO_ANALOG => {
                "this controller has no analog inputs; read the cell with another device"
            }
            ErrorCode(134 | 135) => "switch the motor off first (MO)",
            ErrorCode(136..=138) => "the controller is locked; enter its password",
            E::NOT_SUPPORTED => "this model does not have the feature",
            _ => "",
        }
    }
}

impl fmt::Display for GalilError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = if self.words.is_empty() { "no reason given" } else { &self.words };
        write!(f, "{words}, TC {}", self.code)?;
        if !self.remedy().is_empty() {
            write!(f, "; {}", self.remedy())?;
        }
        Ok(())
    }
}
