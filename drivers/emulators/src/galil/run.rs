//! Runs the threads of the application program at each sample.

use super::expression::evaluate;
use super::program::{ProgramThread, ThreadWait};
use super::{GalilEmulator, Origin};
use palpate_drivers::galil::ErrorCode;

/// `WT n` is in ms of which 1024 are a second, as samples at TM 1000 are; `WT n,1` in samples
/// (DMC-40x0 command reference, `WT`).
fn samples_of(ms: f64, tm: f64) -> f64 {
    ms * 1000.0 / tm
}

impl GalilEmulator {
    /// Runs every thread for as long as a sample lasts.
    pub(super) fn run_threads(&mut self) {
        for index in 0..self.threads.len() {
            for _ in 0..self.settings.model.statements_per_sample() {
                if !self.threads[index].is_running || !self.has_wait_ended(index) {
                    break;
                }
                self.step(index);
            }
        }
    }

    fn has_wait_ended(&mut self, index: usize) -> bool {
        let is_over = match &self.threads[index].wait {
            ThreadWait::None => true,
            ThreadWait::Until(sample) => self.clock.count() >= *sample,
            ThreadWait::Rest(axes) => axes.iter().all(|axis| !self.axes[*axis].is_running()),
            ThreadWait::Pulses(axes) => axes.iter().all(|axis| {
                let axis = &self.axes[*axis];
                !axis.is_running() && axis.filtered == axis.profile.place
            }),
            ThreadWait::Contour => !self.contour.is_behind(),
            // Inputs are open, which is high.
            ThreadWait::Input(_, is_high) => *is_high,
        };
        if is_over {
            self.threads[index].wait = ThreadWait::None;
        }
        is_over
    }

    fn step(&mut self, index: usize) {
        let from = self.threads[index].at;
        let Some((text, next)) = self.program.fetch(from) else {
            self.threads[index].is_running = false;
            return;
        };
        let (text, line) = (text.to_owned(), next.0);
        self.threads[index].at = next;
        if let Err(code) = self.run_statement(index, &text) {
            self.fail(index, line, &text, code);
        }
    }

    /// An error ends its thread; `#CMDERR` runs in thread 0 if the program has one, else the line is sent
    /// (gclib.h: `?55 i=var`).
    fn fail(&mut self, index: usize, line: usize, text: &str, code: ErrorCode) {
        self.error = code;
        self.error_at = (line, index);
        let was_automatic = self.threads[index].automatic.is_some();
        self.threads[index] = ProgramThread::idle();
        match self.program.find("CMDERR") {
            Some(routine) if !was_automatic => {
                if self.threads[0].is_running {
                    self.threads[0].call_automatic(routine);
                } else {
                    let now = self.clock.count();
                    self.threads[0].start(routine, now);
                    self.threads[0].automatic = Some(0);
                }
            }
            _ => self.send_unsolicited(&format!("?{line} {text}\r\n")),
        }
    }

    fn run_statement(&mut self, index: usize, text: &str) -> Result<(), ErrorCode> {
        if text.starts_with('#') {
            return Ok(());
        }
        let (word, arguments) = text.split_at_checked(2).unwrap_or((text, ""));
        let arguments = arguments.trim();
        match word {
            "IF" => {
                if !self.is_true(arguments)? {
                    let at = self.threads[index].at;
                    self.threads[index].at = self.program.skip(at, true)?;
                }
            }
            // Reached after the branch that was taken.
            "EL" if text.starts_with("ELSE") => {
                let at = self.threads[index].at;
                self.threads[index].at = self.program.skip(at, false)?;
            }
            "EN" if text.starts_with("ENDIF") => {}
            "EN" | "RE" => self.threads[index].return_from_call(),
            "JP" | "JS" => self.jump(index, word == "JS", arguments)?,
            "ZS" => self.threads[index].clear_stack(),
            "WT" => {
                let length = self.first_number(arguments)?;
                let is_samples = self.numbers(arguments)?.get(1) == Some(&Some(1.0));
                self.wait_samples(index, length, is_samples, self.clock.count())?;
            }
            "AT" => {
                let number = self.first_number(arguments)?;
                if number == 0.0 {
                    self.threads[index].since = self.clock.count();
                } else {
                    let since = self.threads[index].since;
                    self.wait_samples(index, number.abs(), false, since)?;
                    if number < 0.0
                        && let ThreadWait::Until(until) = self.threads[index].wait
                    {
                        self.threads[index].since = until;
                    }
                }
            }
            "AM" => self.threads[index].wait = ThreadWait::Rest(self.axis_list(arguments)?),
            "MC" => self.threads[index].wait = ThreadWait::Pulses(self.axis_list(arguments)?),
            "WC" => self.threads[index].wait = ThreadWait::Contour,
            "AI" => {
                let number = evaluate(arguments, self)?;
                if !(1.0..=16.0).contains(&number.abs()) {
                    return Err(ErrorCode::OUT_OF_RANGE);
                }
                let input = number.abs() as usize;
                self.threads[index].wait = ThreadWait::Input(input, number > 0.0);
            }
            "DL" | "QD" | "QR" | "BN" | "BP" | "BV" => return Err(ErrorCode::NOT_IN_PROGRAM),
            _ => {
                let answer = self.execute(Origin::Thread(index), text)?;
                self.send_program_output(answer);
            }
        }
        Ok(())
    }

    fn wait_samples(
        &mut self,
        index: usize,
        length: f64,
        is_samples: bool,
        since: u64,
    ) -> Result<(), ErrorCode> {
        if length < 0.0 {
            return Err(ErrorCode::OUT_OF_RANGE);
        }
        let samples = if is_samples { length } else { samples_of(length, self.clock.tm()) };
        // A cast saturates; 2^31 samples are 24 days.
        self.threads[index].wait = ThreadWait::Until(since + samples.ceil() as u64);
        Ok(())
    }

    fn is_true(&self, condition: &str) -> Result<bool, ErrorCode> {
        evaluate(condition, self).map(|value| value != 0.0)
    }

    /// `JP #LABEL,condition`.
    fn jump(&mut self, index: usize, is_call: bool, arguments: &str) -> Result<(), ErrorCode> {
        let (place, condition) = match arguments.split_once(',') {
            Some((place, condition)) => (place.trim(), Some(condition.trim())),
            None => (arguments, None),
        };
        let line = match place.strip_prefix('#') {
            Some(label) => self.program.find(label).ok_or(ErrorCode::NO_LABEL)?,
            None => {
                let line = evaluate(place, self)?.max(0.0) as usize;
                if line >= self.program.lines.len() {
                    return Err(ErrorCode::BAD_LABEL);
                }
                line
            }
        };
        if let Some(condition) = condition
            && !self.is_true(condition)?
        {
            return Ok(());
        }
        if is_call {
            self.threads[index].call(line)
        } else {
            self.threads[index].at = (line, 0);
            Ok(())
        }
    }
}
