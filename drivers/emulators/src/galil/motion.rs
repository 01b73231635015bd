//! Commands that move, define or tell the place of an axis.

use super::axis::{COUNTS_MAX, Motion, Prepared};
use super::commands::{Argument, listed};
use super::format::Format;
use super::program::Thread;
use super::settings::{STEPPER_SPEED_MAX, Setting};
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

impl GalilEmulator {
    /// A command about axes; `None` when it is another one.
    pub(super) fn move_word(
        &mut self,
        origin: Origin,
        word: &str,
        arguments: &str,
    ) -> Option<Result<Answer, ErrorCode>> {
        Some(match word {
            "PA" | "PR" | "JG" | "DP" | "DE" => self.place_word(word, arguments),
            "BG" => self.begin(arguments),
            "ST" => self.stop(origin, arguments),
            "AB" => self.abort(arguments),
            "SH" | "MO" => self.enable(word == "SH", arguments),
            "HM" | "FE" => self.prepare_edge(word == "HM", arguments),
            // Nothing here has an index pulse.
            "FI" => Err(ErrorCode::NOT_FOR_STEPPER),
            "TP" | "RP" | "TD" | "TE" | "TV" | "TS" | "TT" | "RL" => self.tell(word, arguments),
            "SC" => self.tell(word, arguments),
            "CM" | "DT" | "CD" => self.contour_word(word, arguments),
            _ => return None,
        })
    }

    fn place_word(&mut self, word: &str, arguments: &str) -> Result<Answer, ErrorCode> {
        let mut told = Vec::new();
        for (axis, argument) in self.axis_arguments(arguments)? {
            let Argument::Number(value) = argument else {
                let word = [word.as_bytes()[0], word.as_bytes()[1]];
                let value = self.told(word, axis).unwrap_or(0.0);
                told.push(self.position_format.write(value));
                continue;
            };
            let value = value.trunc();
            if value.abs() > COUNTS_MAX {
                return Err(ErrorCode::OUT_OF_RANGE);
            }
            let tm = self.clock.tm();
            let state = &mut self.axes[axis];
            match word {
                "JG" if value.abs() > STEPPER_SPEED_MAX => return Err(ErrorCode::OUT_OF_RANGE),
                "JG" => state.jog(value, tm),
                "DE" if !state.is_stepper() => {}
                "DE" => state.encoder = value,
                // A new target needs a new begin.
                "PA" | "PR" if state.is_running() => return Err(ErrorCode::RUNNING),
                "PA" => state.prepared = Prepared::Target(value),
                "PR" => state.prepared = Prepared::Relative(value),
                _ => {
                    let shift = state.define(value)?;
                    self.shift(axis, shift);
                }
            }
        }
        Ok(listed(told))
    }

    fn begin(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        for axis in self.axis_list(arguments)? {
            if self.contour.axes.contains(&axis) {
                return Err(ErrorCode::CONTOURING);
            }
            self.axes[axis].begin(self.polarity)?;
        }
        Ok(Answer::Done)
    }

    /// Sent by a host without axes it stops programs too (DMC-40x0 command reference, `ST`).
    fn stop(&mut self, origin: Origin, arguments: &str) -> Result<Answer, ErrorCode> {
        let axes = self.axis_list(arguments)?;
        for axis in axes {
            self.axes[axis].stop(Setting::Deceleration, 4);
        }
        if arguments.is_empty() && matches!(origin, Origin::Client(_)) {
            self.halt_threads();
        }
        Ok(Answer::Done)
    }

    /// `AB` and `AB 0` abort motion and programs, `AB 1` motion alone (DMC-40x0 command reference, `AB`).
    fn abort(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        let numbers = self.numbers(arguments)?;
        let is_motion_only = match numbers.as_slice() {
            [] | [Some(0.0)] => false,
            [Some(1.0)] => true,
            _ => return Err(ErrorCode::OUT_OF_RANGE),
        };
        for axis in &mut self.axes {
            axis.abort(7);
        }
        if !is_motion_only {
            self.halt_threads();
        }
        Ok(Answer::Done)
    }

    pub(super) fn halt_threads(&mut self) {
        self.threads.fill(Thread::idle());
    }

    fn enable(&mut self, is_on: bool, arguments: &str) -> Result<Answer, ErrorCode> {
        for axis in self.axis_list(arguments)? {
            if !is_on {
                self.axes[axis].abort(7);
            }
            self.axes[axis].is_on = is_on;
        }
        Ok(Answer::Done)
    }

    fn prepare_edge(&mut self, is_homing: bool, arguments: &str) -> Result<Answer, ErrorCode> {
        for axis in self.axis_list(arguments)? {
            if self.axes[axis].is_running() {
                return Err(ErrorCode::RUNNING);
            }
            self.axes[axis].prepared = Prepared::Edge { is_homing };
        }
        Ok(Answer::Done)
    }

    fn tell(&self, word: &str, arguments: &str) -> Result<Answer, ErrorCode> {
        let letters = [word.as_bytes()[0], word.as_bytes()[1]];
        let format = match word {
            "TT" => Format::decimal(10, 4),
            // Stop codes and switch bytes have three digits.
            "SC" | "TS" => Format { whole: 3, ..self.position_format },
            _ => self.position_format,
        };
        let told = self
            .axis_list(arguments)?
            .into_iter()
            .map(|axis| format.write(self.told(letters, axis).unwrap_or(0.0)))
            .collect();
        Ok(listed(told))
    }

    fn contour_word(&mut self, word: &str, arguments: &str) -> Result<Answer, ErrorCode> {
        match word {
            "CM" if arguments == "?" => {
                let free = self.contour.free() as f64;
                return Ok(Answer::Text(self.position_format.write(free)));
            }
            "CM" => {
                let axes = self.axis_list(arguments)?;
                for axis in &axes {
                    if !self.axes[*axis].is_on {
                        return Err(ErrorCode::MOTOR_OFF);
                    }
                    if self.axes[*axis].is_running() {
                        return Err(ErrorCode::RUNNING);
                    }
                }
                for axis in &axes {
                    self.axes[*axis].motion = Motion::Contour;
                    self.axes[*axis].stop_code = 50;
                }
                self.contour.begin(axes);
            }
            "DT" => match self.numbers(arguments)?.as_slice() {
                [Some(n)] => self.contour.set_interval(*n)?,
                _ => return Err(ErrorCode::FEW_FIELDS),
            },
            _ => self.contour_data(arguments)?,
        }
        Ok(Answer::Done)
    }

    /// `CD 1,2=n`, `CDA=1`.
    fn contour_data(&mut self, arguments: &str) -> Result<(), ErrorCode> {
        if !self.contour.is_on() {
            return Err(ErrorCode::NOT_RUNNING);
        }
        let is_letter = arguments.starts_with(|c: char| c.is_ascii_uppercase());
        let (list, time) = match arguments.split_once('=') {
            Some((list, time)) if !is_letter => {
                let time = self.numbers(time)?.first().copied().flatten();
                (list.trim(), Some(time.ok_or(ErrorCode::FEW_FIELDS)?))
            }
            _ => (arguments, None),
        };
        let mut increments = vec![0.0; self.contour.axes.len()];
        for (axis, argument) in self.axis_arguments(list)? {
            let Argument::Number(value) = argument else {
                return Err(ErrorCode::QUESTION_MARK);
            };
            match self.contour.axes.iter().position(|one| *one == axis) {
                Some(at) => increments[at] = value.trunc(),
                None if value == 0.0 => {}
                None => return Err(ErrorCode::NOT_RUNNING),
            }
        }
        self.contour.push(increments, time)
    }
}
