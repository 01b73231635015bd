//! Why a Galil controller refuses a command: the numbers and texts of `TC`.
//!
//! Galil DMC-40x0 command reference, `TC`; the wording of the texts follows the table in ESRF BLISS 2.4.0,
//! `controllers/motors/galil`, which was read from hardware.

/// A number of `TC`.
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
