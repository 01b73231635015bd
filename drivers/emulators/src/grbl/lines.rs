//! Reads lines from the buffer one after the other and answers each with `ok` or `error:N`.

use super::gcode::{self, GcodeMotion, ParsedBlock, ProgramFlow};
use super::homing::HomingCycle;
use super::words;
use super::{FEED_MIN, Grbl, LINE_MAX, State};
use palpate_model::Nanos;

/// A line whose answer comes later.
#[derive(Clone, Debug)]
pub(super) enum PendingLine {
    /// Motions that wait for room in the planner.
    Room(Vec<GcodeMotion>),
    /// Waits for all earlier blocks.
    Rest(Box<ParsedBlock>),
    /// The position of a probe that found nothing is reported after its alarm.
    ProbeReport,
    /// A dwell, and the motions after it.
    Until(Nanos, Vec<GcodeMotion>),
}

impl Grbl {
    /// Reads lines until one has to wait.
    pub(super) fn read_lines(&mut self) {
        loop {
            let is_blocked = self.is_waiting_for_reset
                || self.is_resetting
                || self.now < self.busy_until
                || self.homing.is_some()
                || self.is_probing
                || self.is_cancelling
                || self.is_suspended
                || matches!(self.state, State::Hold | State::Door | State::Sleep);
            if is_blocked {
                return;
            }
            if let Some(pending) = self.waiting.take() {
                let result = self.continue_line(pending);
                self.answer(result);
                if self.waiting.is_some() {
                    self.start();
                    return;
                }
                continue;
            }
            let Some(byte) = self.rx.pop_front() else {
                self.start();
                return;
            };
            self.take_byte(byte);
        }
    }

    /// Comments and blanks go, letters become capitals (protocol.c).
    fn take_byte(&mut self, byte: u8) {
        match byte {
            b'\r' | b'\n' => {
                // A requested status is sent before a line is executed (protocol.c).
                self.send_status_if_requested();
                let line = std::mem::take(&mut self.line);
                let is_overlong = std::mem::take(&mut self.is_overlong);
                self.is_comment = None;
                let result = if is_overlong {
                    Err(11)
                } else {
                    self.execute(&String::from_utf8_lossy(&line))
                };
                self.answer(result);
            }
            _ if self.is_overlong => {}
            b')' if self.is_comment == Some(b'(') => self.is_comment = None,
            _ if self.is_comment.is_some() => {}
            b'(' | b';' => self.is_comment = Some(byte),
            b'/' | ..=b' ' => {}
            _ if self.line.len() >= LINE_MAX => self.is_overlong = true,
            _ => self.line.push(byte.to_ascii_uppercase()),
        }
    }

    fn answer(&mut self, result: Result<bool, u8>) {
        match result {
            Ok(true) => self.send("ok\r\n"),
            // Its `ok` comes when it is done.
            Ok(false) => {}
            Err(code) => self.send(&format!("error:{code}\r\n")),
        }
    }

    /// Executes a line; `false` when its answer comes later.
    pub(super) fn execute(&mut self, line: &str) -> Result<bool, u8> {
        if line.is_empty() {
            return Ok(true);
        }
        if let Some(command) = line.strip_prefix('$') {
            return self.system(command);
        }
        if matches!(self.state, State::Alarm | State::Jog) {
            return Err(9);
        }
        let here = self.planner.end();
        let parsed = gcode::parse(line, self.modes, false, here, &self.offsets)?;
        if parsed.waits_for_rest && !self.planner.is_idle() && self.state != State::Check {
            self.waiting = Some(PendingLine::Rest(Box::new(parsed)));
            return Ok(false);
        }
        self.apply_block(parsed)
    }

    fn continue_line(&mut self, pending: PendingLine) -> Result<bool, u8> {
        match pending {
            PendingLine::Rest(parsed) if self.planner.is_idle() => self.apply_block(*parsed),
            PendingLine::Until(until, motions) if self.now >= until => self.queue(motions),
            PendingLine::ProbeReport => {
                self.send_probe();
                Ok(true)
            }
            PendingLine::Room(motions) if !self.planner.is_full() => self.queue(motions),
            other => {
                self.waiting = Some(other);
                Ok(false)
            }
        }
    }

    fn apply_block(&mut self, parsed: ParsedBlock) -> Result<bool, u8> {
        let (modes, before) = (parsed.modes, self.modes);
        if parsed.offsets != self.offsets || modes.system != before.system {
            self.reports.report_offset();
        }
        let accessories = |modes: &gcode::ModalState| (modes.spindle, modes.has_coolant);
        if accessories(&modes) != accessories(&before) {
            self.reports.report_overrides();
        }
        (self.modes, self.offsets) = (modes, parsed.offsets);
        match parsed.flow {
            ProgramFlow::Runs => {}
            ProgramFlow::Pauses if self.state == State::Check => {}
            ProgramFlow::Pauses => self.state = State::Hold,
            ProgramFlow::Ends => {
                self.modes = modes.after_end();
                self.reports.report_offset();
                self.send("[MSG:Pgm End]\r\n");
            }
        }
        if self.state == State::Check {
            return Ok(true);
        }
        let motions: Vec<GcodeMotion> = parsed.via.into_iter().chain(parsed.motion).collect();
        if let Some(seconds) = parsed.dwell {
            let until = self.now + Nanos((seconds * 1e9) as u64);
            self.waiting = Some(PendingLine::Until(until, motions));
            return Ok(false);
        }
        match motions[..] {
            [motion] if motion.kind > 80 => self.probe(motion),
            _ => self.queue(motions),
        }
    }

    /// `G38.2` to `G38.5` from rest (motion_control.c, `mc_probe_cycle`).
    fn probe(&mut self, motion: GcodeMotion) -> Result<bool, u8> {
        self.is_probe_away = motion.kind >= 384;
        self.probe_result.1 = false;
        if self.is_probe() != self.is_probe_away {
            self.alarm(4, false);
            return Ok(true);
        }
        self.is_probing = true;
        self.plan(motion);
        self.state = State::Run;
        Ok(false)
    }

    fn queue(&mut self, mut motions: Vec<GcodeMotion>) -> Result<bool, u8> {
        while !motions.is_empty() {
            if self.eeprom.is_set(20) && self.is_beyond(&motions[0]) {
                // Grbl brakes first; here the axis stands at once. The reset answers the line.
                self.alarm(2, true);
                self.is_line_owed = true;
                return Ok(false);
            }
            if self.planner.is_full() {
                self.waiting = Some(PendingLine::Room(motions));
                return Ok(false);
            }
            self.plan(motions.remove(0));
        }
        Ok(true)
    }

    fn plan(&mut self, motion: GcodeMotion) {
        // A position between two steps is the nearest step.
        let to = std::array::from_fn(|axis| {
            let scale = self.steps_per_mm(axis);
            (motion.to[axis] * scale).round() / scale
        });
        let limits = self.limits();
        let feed = if motion.kind == 0 { f64::INFINITY } else { motion.feed.max(FEED_MIN) };
        self.planner.push(to, feed / 60.0, &limits);
        if motion.is_jog && self.state == State::Idle && !self.planner.is_idle() {
            self.state = State::Jog;
        }
    }

    /// Whether the target is outside the travel, which is from 0 to `-$130` (system.c).
    fn is_beyond(&self, motion: &GcodeMotion) -> bool {
        (0..motion.to.len()).any(|axis| {
            let travel = self.eeprom.value(130 + axis as u16);
            motion.to[axis] > 0.0 || motion.to[axis] < -travel
        })
    }

    fn jog(&mut self, line: &str) -> Result<bool, u8> {
        if !matches!(self.state, State::Idle | State::Jog) {
            return Err(8);
        }
        let Some(words) = line.strip_prefix('=') else {
            return Err(3);
        };
        let here = self.planner.end();
        let parsed = gcode::parse(words, self.modes, true, here, &self.offsets)?;
        let motions: Vec<GcodeMotion> = parsed.motion.into_iter().collect();
        if self.eeprom.is_set(20) && motions.iter().any(|motion| self.is_beyond(motion)) {
            return Err(15);
        }
        self.queue(motions)
    }

    fn system(&mut self, command: &str) -> Result<bool, u8> {
        if command.is_empty() {
            self.send(
                "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n",
            );
            return Ok(true);
        }
        if let Some(rest) = command.strip_prefix('J') {
            return self.jog(rest);
        }
        let is_free = matches!(self.state, State::Idle | State::Alarm);
        let has_more = command.len() > 1;
        match command {
            _ if has_more && command.starts_with(['$', 'G', 'C', 'X']) => return Err(3),
            "$" if matches!(self.state, State::Run | State::Hold) => return Err(8),
            "$" => {
                let listing = self.eeprom.listing();
                self.send(&listing);
            }
            "G" => self.send_modes(),
            "C" if self.state == State::Check => {
                self.send("[MSG:Disabled]\r\nok\r\n");
                self.state = State::Idle;
                self.start_over();
                return Ok(false);
            }
            "C" if self.state == State::Idle => {
                self.state = State::Check;
                self.send("[MSG:Enabled]\r\n");
            }
            "C" => return Err(8),
            "X" => {
                if self.state == State::Alarm {
                    self.send("[MSG:Caution: Unlocked]\r\n");
                    self.state = State::Idle;
                }
            }
            _ if !is_free => return Err(8),
            "#" => self.send_offsets(),
            "I" => self.send_build(),
            "N" => {
                for (number, line) in self.eeprom.startup.clone().iter().enumerate() {
                    self.send(&format!("$N{number}={line}\r\n"));
                }
            }
            _ if command.starts_with('H') && !self.eeprom.is_set(22) => return Err(5),
            "H" => {
                self.state = State::Home;
                self.homing = Some(HomingCycle::default());
                return Ok(false);
            }
            "SLP" => {
                self.state = State::Sleep;
                self.send("ok\r\n[MSG:Sleeping]\r\n");
                return Ok(false);
            }
            "RST=$" | "RST=#" | "RST=*" => {
                let factory = super::Eeprom::factory();
                if command != "RST=#" {
                    self.eeprom.copy_numbers_from(&factory);
                }
                if command != "RST=$" {
                    self.offsets = gcode::CoordinateOffsets::default();
                }
                if command == "RST=*" {
                    self.eeprom = factory;
                }
                self.send("[MSG:Restoring defaults]\r\nok\r\n");
                self.start_over();
                return Ok(false);
            }
            _ if command.starts_with(['#', 'H', 'S', 'R']) => return Err(3),
            _ if command.starts_with('I') && !command.starts_with("I=") => return Err(3),
            _ => return self.store(command).map(|()| true),
        }
        Ok(true)
    }

    /// `$n=value`, `$Nn=line`, `$I=text`.
    fn store(&mut self, command: &str) -> Result<(), u8> {
        if let Some(text) = command.strip_prefix("I=") {
            text.clone_into(&mut self.eeprom.build_info);
            return Ok(());
        }
        let line = command.strip_prefix('N');
        let (key, rest) = words::number(line.unwrap_or(command)).ok_or(2)?;
        let value = rest.strip_prefix('=').ok_or(3)?;
        if line.is_some() {
            if self.state != State::Idle {
                return Err(8);
            }
            // Only what can be done is kept, and so it is done.
            if !value.is_empty() {
                self.execute(value)?;
            }
            let stored = self.eeprom.startup.get_mut(key as usize).ok_or(3)?;
            value.clone_into(stored);
            return Ok(());
        }
        let (value, rest) = words::number(value).ok_or(2)?;
        if !rest.is_empty() || key > 255.0 {
            return Err(3);
        }
        let number = key as u16;
        self.eeprom.set(number, value)?;
        let here = self.machine();
        if self.planner.is_idle() {
            self.planner.clear(here);
        }
        Ok(())
    }
}
