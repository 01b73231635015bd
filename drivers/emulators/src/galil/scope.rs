//! Values of operands and functions.

use super::GalilEmulator;
use super::analog::INPUTS;
use super::axis::PreparedMotion;
use super::expression::Scope;
use super::settings::AxisSetting;
use palpate_drivers::galil::ErrorCode;

/// The axis that a letter stands for.
pub fn axis_of(letter: char) -> Option<usize> {
    match letter {
        'A'..='H' => Some(letter as usize - 'A' as usize),
        'X' => Some(0),
        'Y' => Some(1),
        'Z' => Some(2),
        'W' => Some(3),
        _ => None,
    }
}

/// One bit for each flag, the first the lowest.
pub fn bits(flags: impl Iterator<Item = bool>) -> u8 {
    flags.enumerate().fold(0, |bits, (at, is_set)| bits | u8::from(is_set) << at)
}

pub fn truth(is_so: bool) -> f64 {
    if is_so { 1.0 } else { 0.0 }
}

impl GalilEmulator {
    /// An operand of an axis by its two letters; `None` where there is no such operand.
    pub(super) fn axis_operand(&self, word: &str, index: usize) -> Option<f64> {
        let axis = self.axes.get(index)?;
        Some(match word {
            "BG" => truth(axis.is_running()),
            "MO" => truth(!axis.is_on),
            "SH" | "RP" | "DP" => axis.reference(),
            "TD" => axis.pulses(),
            // "On a stepper axis the step-count register" (DMC-2x00 user manual, page 117).
            "DE" if axis.is_stepper() => axis.pulses(),
            "TP" | "DE" => axis.encoder_position(),
            "TE" | "TT" | "RL" | "QS" | "YR" => 0.0,
            "TV" => axis.profile.velocity,
            "TS" => f64::from(axis.switches()),
            "SC" => f64::from(axis.stop_code),
            "LF" => truth(axis.inputs.forward),
            "LR" => truth(axis.inputs.reverse),
            "HM" => truth(axis.inputs.home),
            "PA" => self.target(index),
            "PT" if self.settings.model.tracks_targets() => truth(axis.is_tracking),
            "PR" | "JG" => match axis.prepared {
                PreparedMotion::Relative(distance) if word == "PR" => distance,
                PreparedMotion::Jog(speed) if word == "JG" => speed,
                _ => 0.0,
            },
            _ => axis.settings.get(AxisSetting::from_word(word)?),
        })
    }

    /// Target of the axis.
    pub(super) fn target(&self, axis: usize) -> f64 {
        match self.axes[axis].prepared {
            PreparedMotion::Target(target) => target,
            _ => self.axes[axis].reference(),
        }
    }

    /// A number of the controller as a whole.
    pub(super) fn controller_operand(&self, word: &str) -> Option<f64> {
        Some(match word {
            "TM" => self.clock.tm(),
            "TC" => f64::from(self.error.0),
            "TB" => f64::from(self.status_byte()),
            // Inputs are pulled up and open.
            "TI" => 255.0,
            "OP" => f64::from(self.outputs),
            "RC" => truth(self.recorder.is_running()),
            "RD" => self.recorder.next as f64,
            "NO" => f64::from(self.running_threads()),
            "BN" => f64::from(self.serial_number()),
            "AB" => 1.0,
            "CM" => self.contour.free() as f64,
            "CS" => f64::from(self.contour.done),
            "DM" => self.memory.free(self.settings.model) as f64,
            "ED" => self.error_at.0 as f64,
            "PF" => self.format_numbers.0,
            "VF" => self.format_numbers.1,
            "LZ" => self.format_numbers.2,
            "CW" => 2.0 - truth(self.is_marked),
            "CA" => 0.0,
            "CO" if self.settings.model.is_40x0() => 0.0,
            "EO" => truth(self.clients[0].has_echo),
            _ => return None,
        })
    }

    /// An operand with a number behind its letters.
    fn numbered_operand(&self, word: &str, number: usize) -> Result<f64, ErrorCode> {
        let thread = || self.threads.get(number).ok_or(ErrorCode::OUT_OF_RANGE);
        match word {
            "XQ" => {
                thread().map(|thread| if thread.is_running { thread.at.0 as f64 } else { -1.0 })
            }
            "HX" => thread().map(|thread| truth(thread.is_running)),
            "ED" if number == 1 => Ok(self.error_at.1 as f64),
            "AQ" => {
                let analog = self.analog.as_ref().ok_or(ErrorCode::NO_ANALOG)?;
                number
                    .checked_sub(1)
                    .and_then(|input| analog.range(input))
                    .ok_or(ErrorCode::OUT_OF_RANGE)
            }
            "DQ" => Ok(2.0),
            "CN" => {
                let all = [self.polarity.limit, self.polarity.home];
                all.iter()
                    .chain(&self.other_inputs)
                    .nth(number)
                    .copied()
                    .ok_or(ErrorCode::OUT_OF_RANGE)
            }
            _ => self.controller_operand(word).ok_or(ErrorCode::BAD_RESPONSE),
        }
    }

    /// Threads that run, one bit each.
    pub(super) fn running_threads(&self) -> u8 {
        bits(self.threads.iter().map(|thread| thread.is_running))
    }

    /// The byte of `TB`.
    pub(super) fn status_byte(&self) -> u8 {
        u8::from(self.running_threads() != 0) << 7
            | u8::from(self.contour.is_on()) << 5
            | u8::from(self.threads.iter().any(|thread| thread.automatic.is_some())) << 4
            | u8::from(self.clients[0].has_echo)
    }

    /// Another controller has another number.
    pub(super) fn serial_number(&self) -> u32 {
        self.settings.serial_number.wrapping_add(u32::from(self.is_wrong))
    }

    /// Volts of an analog input, counted from 1.
    fn analog_volts(&self, number: f64) -> Result<f64, ErrorCode> {
        let analog = self.analog.as_ref().ok_or(ErrorCode::NO_ANALOG)?;
        if !(1.0..=INPUTS as f64).contains(&number) {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let input = number as usize - 1;
        Ok(analog.volts(input, self.input_volts(input)))
    }
}

impl Scope for GalilEmulator {
    fn variable(&self, name: &str) -> Option<f64> {
        if name == "TIME" {
            // Numbers have 31 bits before the point.
            return Some((self.clock.count() % (1 << 31)) as f64);
        }
        self.memory.variable(name)
    }

    fn element(&self, name: &str, index: f64) -> Result<f64, ErrorCode> {
        self.memory.element(name, index)
    }

    fn operand(&self, name: &str) -> Result<f64, ErrorCode> {
        let (word, rest) = name.split_at_checked(2).ok_or(ErrorCode::BAD_RESPONSE)?;
        if let Ok(number) = rest.parse() {
            return self.numbered_operand(word, number);
        }
        let mut letters = rest.chars();
        match (letters.next(), letters.next()) {
            (None, _) => self
                .controller_operand(word)
                .or_else(|| self.axis_operand(word, 0))
                .ok_or(ErrorCode::BAD_RESPONSE),
            // The coordinate systems never run.
            (Some('S' | 'T'), None) if word == "BG" => Ok(0.0),
            (Some(letter), None) => axis_of(letter)
                .and_then(|axis| self.axis_operand(word, axis))
                .ok_or(ErrorCode::BAD_RESPONSE),
            _ => Err(ErrorCode::BAD_RESPONSE),
        }
    }

    fn function(&self, name: &str, argument: f64) -> Result<f64, ErrorCode> {
        let degrees = argument.to_radians();
        Ok(match name {
            "AN" => return self.analog_volts(argument),
            "IN" if (1.0..=16.0).contains(&argument) => 1.0,
            "OUT" if (1.0..=16.0).contains(&argument) => {
                truth(self.outputs >> (argument as u32 - 1) & 1 == 1)
            }
            "IN" | "OUT" => return Err(ErrorCode::OUT_OF_RANGE),
            "ABS" => argument.abs(),
            "INT" => argument.trunc(),
            "FRAC" => argument.fract(),
            "RND" => argument.round(),
            "SQR" if argument >= 0.0 => argument.sqrt(),
            "SQR" => return Err(ErrorCode::OUT_OF_RANGE),
            "SIN" => degrees.sin(),
            "COS" => degrees.cos(),
            "TAN" => degrees.tan(),
            "ATAN" => argument.atan().to_degrees(),
            "ASIN" => argument.clamp(-1.0, 1.0).asin().to_degrees(),
            "ACOS" => argument.clamp(-1.0, 1.0).acos().to_degrees(),
            "COM" => !(argument as i32) as f64,
            _ => return Err(ErrorCode::BAD_FUNCTION),
        })
    }
}
