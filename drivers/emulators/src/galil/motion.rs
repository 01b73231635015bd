//! Commands that move an axis, or set or report its position.

use super::axis::{AxisMotion, COUNTS_MAX, PreparedMotion};
use super::commands::{Argument, join_values};
use super::format::NumberFormat;
use super::program::ProgramThread;
use super::settings::{AxisSetting, STEPPER_SPEED_MAX};
use super::{Answer, GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

impl GalilEmulator {
    /// A command about axes; `None` when it is another one.
    pub(super) fn axis_command(
        &mut self,
        origin: Origin,
        word: &str,
        arguments: &str,
    ) -> Option<Result<Answer, ErrorCode>> {
        Some(match word {
            "PA" | "PR" | "JG" | "DP" | "DE" => self.position_command(word, arguments),
            "PT" => self.tracking_command(arguments),
            "BG" => self.begin(arguments),
            "ST" => self.stop(origin, arguments),
            "AB" => self.abort(arguments),
            "SH" | "MO" => self.enable(word == "SH", arguments),
            "HM" | "FE" => self.prepare_edge(word == "HM", arguments),
            // Nothing here has an index pulse.
            "FI" => Err(ErrorCode::NOT_FOR_STEPPER),
            "TP" | "RP" | "TD" | "TE" | "TV" | "TS" | "TT" | "RL" => {
                self.query_axes(word, arguments)
            }
            "SC" => self.query_axes(word, arguments),
            "CM" | "DT" | "CD" => self.contour_command(word, arguments),
            _ => return None,
        })
    }

    fn position_command(&mut self, word: &str, arguments: &str) -> Result<Answer, ErrorCode> {
        let mut values = Vec::new();
        for (axis, argument) in self.axis_arguments(arguments)? {
            let Argument::Number(value) = argument else {
                let value = self.axis_operand(word, axis).unwrap_or(0.0);
                values.push(self.position_format.write(value));
                continue;
            };
            let value = value.trunc();
            if value.abs() > COUNTS_MAX {
                return Err(ErrorCode::OUT_OF_RANGE);
            }
            let tm = self.clock.tm();
            let state = &mut self.axes[axis];
            match word {
                "DE" if !state.is_stepper() => {}
                "DE" => state.encoder = value,
                // The mode takes absolute targets only. The code of this refusal is not confirmed.
                "PR" | "JG" if state.is_tracking => return Err(ErrorCode::RUNNING),
                "PA" if state.is_tracking => state.track(value, self.polarity)?,
                "JG" if value.abs() > STEPPER_SPEED_MAX => return Err(ErrorCode::OUT_OF_RANGE),
                "JG" => state.jog(value, tm),
                // A new target needs a new begin.
                "PA" | "PR" if state.is_running() => return Err(ErrorCode::RUNNING),
                "PA" => state.prepared = PreparedMotion::Target(value),
                "PR" => state.prepared = PreparedMotion::Relative(value),
                _ => {
                    let shift = state.define(value)?;
                    self.shift_counter(axis, shift);
                }
            }
        }
        Ok(join_values(values))
    }

    /// `PT 1` switches the position tracking mode on, `PT 0` off (DMC-40x0 command reference, `PT`).
    fn tracking_command(&mut self, arguments: &str) -> Result<Answer, ErrorCode> {
        if !self.settings.model.tracks_targets() {
            return Err(ErrorCode::UNRECOGNIZED);
        }
        let mut values = Vec::new();
        for (axis, argument) in self.axis_arguments(arguments)? {
            let state = &mut self.axes[axis];
            match argument {
                Argument::Query => {
                    let is_on = if state.is_tracking { 1.0 } else { 0.0 };
                    values.push(self.position_format.write(is_on));
                }
                Argument::Number(_) if state.is_running() => return Err(ErrorCode::RUNNING),
                Argument::Number(0.0) => state.is_tracking = false,
                Argument::Number(1.0) => state.is_tracking = true,
                Argument::Number(_) => return Err(ErrorCode::OUT_OF_RANGE),
            }
        }
        Ok(join_values(values))
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
            self.axes[axis].stop(AxisSetting::Deceleration, 4);
        }
        if arguments.is_empty() && origin.client().is_some() {
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
        self.threads.fill(ProgramThread::idle());
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
            self.axes[axis].prepared = PreparedMotion::Edge { is_homing };
        }
        Ok(Answer::Done)
    }

    fn query_axes(&self, word: &str, arguments: &str) -> Result<Answer, ErrorCode> {
        let format = match word {
            "TT" => NumberFormat::decimal(10, 4),
            // Stop codes and switch bytes have three digits.
            "SC" | "TS" => NumberFormat { whole: 3, ..self.position_format },
            _ => self.position_format,
        };
        let values = self
            .axis_list(arguments)?
            .into_iter()
            .map(|axis| format.write(self.axis_operand(word, axis).unwrap_or(0.0)))
            .collect();
        Ok(join_values(values))
    }

    fn contour_command(&mut self, word: &str, arguments: &str) -> Result<Answer, ErrorCode> {
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
                    self.axes[*axis].motion = AxisMotion::Contour;
                    self.axes[*axis].stop_code = 50;
                }
                self.contour.begin(axes);
            }
            "DT" => self.contour.set_interval(self.first_number(arguments)?)?,
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
            Some((list, time)) if !is_letter => (list.trim(), Some(self.first_number(time)?)),
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
