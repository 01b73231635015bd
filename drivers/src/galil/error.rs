//! Reasons why a Galil controller refuses a command, and what to do about them.

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
                "this firmware does not know the command; update the firmware or use another controller"
            }
            E::OPERAND | E::FEW_FIELDS => "check the axis letter in the rig file",
            E::BUFFER_FULL => "the link is too slow for the commands; check the baud rate",
            E::OUT_OF_RANGE => {
                "a setting in the rig file is beyond the range of this controller; lower the setting"
            }
            E::RUNNING | E::NOT_RUNNING | E::BEGIN_RUNNING | ErrorCode(29) => {
                "wait until the axis is at rest"
            }
            ErrorCode(14 | 15) => {
                "the controller's memory has failed; have the controller serviced"
            }
            E::PROGRAM_RUNNING | E::STRAND_BUSY => {
                "a program is running on the controller; stop it with HX"
            }
            E::CONTOURING => "end the contour mode with ST",
            E::MOTOR_OFF => "the motor is off; energise it and check the amplifier",
            E::LIMIT_SWITCH => {
                "a limit switch is closed; move the axis the other way and check the switch"
            }
            E::ARRAY_SPACE | E::TOO_MANY_NAMES => {
                "delete the arrays and variables on the controller with its command DA *[],*"
            }
            E::RECORDING => "send the command RC 0 to end the recording",
            E::NOT_FOR_STEPPER => {
                "this command is for servo axes, and palpate drives stepper axes only; report this error with the log"
            }
            E::NO_ANALOG => {
                "this controller has no analog inputs; read the load cell with another device"
            }
            ErrorCode(134 | 135) => "switch the motor off first (MO)",
            ErrorCode(136..=138) => "the controller is locked; enter its password",
            E::NOT_SUPPORTED => "this model does not have the feature; use another model",
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

/// A number of `TC`: Galil DMC-40x0 command reference, `TC`; the wording of the texts follows the table in ESRF BLISS
/// 2.4.0, `controllers/motors/galil`, which was read from hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorCode(pub u8);

macro_rules! codes {
    ($($name:ident = $number:literal, $text:literal;)*) => {
        impl ErrorCode {
            $(
                #[doc = $text]
                pub const $name: Self = Self($number);
            )*

            /// What `TC1` says after the number; empty for numbers that have no name here.
            #[must_use]
            pub fn text(self) -> &'static str {
                match self.0 {
                    $($number => $text,)*
                    _ => "",
                }
            }
        }
    };
}

codes! {
    UNRECOGNIZED = 1, "Unrecognized command";
    PROGRAM_ONLY = 2, "Command only valid from program";
    NOT_IN_PROGRAM = 3, "Command not valid in program";
    OPERAND = 4, "Operand error";
    BUFFER_FULL = 5, "Input buffer full";
    OUT_OF_RANGE = 6, "Number out of range";
    RUNNING = 7, "Command not valid while running";
    NOT_RUNNING = 8, "Command not valid when not running";
    VARIABLE = 9, "Variable error";
    NO_LABEL = 10, "Empty program line or undefined label";
    BAD_LABEL = 11, "Invalid label or line number";
    SUBROUTINES = 12, "Subroutine more than 16 deep";
    PROGRAM_RUNNING = 17, "ED, BN and DL commands not valid while program running";
    CONTOURING = 18, "Command not valid when contouring";
    STRAND_BUSY = 19, "Application strand already executing";
    MOTOR_OFF = 20, "Begin not valid with motor off";
    BEGIN_RUNNING = 21, "Begin not valid while running";
    LIMIT_SWITCH = 22, "Begin not possible due to Limit Switch";
    SEGMENTS_FULL = 32, "Segment buffer full";
    NO_TIME = 39, "No time specified";
    CONTOUR_RANGE = 41, "Contouring record range error";
    FEW_FIELDS = 50, "Not enough fields";
    QUESTION_MARK = 51, "Question mark not valid";
    QUOTE = 52, "Missing \" or string too long";
    BRACES = 53, "Error in {}";
    BRACKETS = 55, "Missing [ or []";
    ARRAY_INDEX = 56, "Array index invalid or out of range";
    BAD_FUNCTION = 57, "Bad function or array";
    BAD_RESPONSE = 58, "Bad command response (i.e._GNX)";
    PARENTHESES = 59, "Mismatched parentheses";
    DOWNLOAD = 60, "Download error - line too long or too many lines";
    DUPLICATE_LABEL = 61, "Duplicate or bad label";
    NO_ENDIF = 63, "IF statement without ENDIF";
    ARRAY_SPACE = 66, "Array space full";
    TOO_MANY_NAMES = 67, "Too many arrays or variables";
    RECORDING = 80, "Record mode already running";
    NO_SOURCE = 81, "No array or source specified";
    NO_ARRAY = 82, "Undefined Array";
    NOT_A_NUMBER = 83, "Not a valid number";
    TOO_MANY_ELEMENTS = 84, "Too many elements";
    NOT_FOR_STEPPER = 119, "Not valid for axis configured as stepper";
    CLOSED_HANDLE = 126, "Can not use closed Ethernet handle";
    NO_ANALOG = 132, "Analog inputs not present";
    NOT_SUPPORTED = 141, "Feature not supported";
}
