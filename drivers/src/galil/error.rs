//! What a Galil controller says when it refuses a command, with what to do about it.

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
    #[must_use]
    pub const fn remedy(&self) -> &'static str {
        match self.code {
            1..=3 => {
                "this firmware does not know the command; update it or choose another controller"
            }
            4 | 50 => "check the axis letter in the rig file",
            5 => "the line is slower than the commands; check the baud rate",
            6 => "a setting of the rig file is beyond what this controller makes; lower it",
            7 | 8 | 21 | 29 => "wait until the axis rests",
            14 | 15 => "the controller's memory has failed; have it serviced",
            17 | 19 => "a program runs on the controller; halt it with HX",
            18 => "end the contour mode with ST",
            20 => "the motor is off; energise it and check the amplifier",
            22 => "a limit switch is closed; move the other way and check the switch",
            66 | 67 => "free the controller's arrays and variables (DA*[],*)",
            80 => "end the recording with RC 0",
            119 => {
                "set the axis up as a stepper: check the motor_type of the rig file and the SM jumper"
            }
            132 => "this controller has no analog inputs; read the cell with another device",
            134 | 135 => "switch the motor off first (MO)",
            136..=138 => "the controller is locked; enter its password",
            141 => "this model does not have the feature",
            _ => "",
        }
    }
}

impl fmt::Display for GalilError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = if self.words.is_empty() {
            "no reason given"
        } else {
            &self.words
        };
        write!(f, "{words}, TC {}", self.code)?;
        if !self.remedy().is_empty() {
            write!(f, "; {}", self.remedy())?;
        }
        Ok(())
    }
}
