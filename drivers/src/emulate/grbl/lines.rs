//! Lines: read out of the buffer one after the other, each answered by `ok` or `error:N`.

use super::gcode::{self, Motion, Parsed};
use super::homing::Homing;
use super::{FEED_MIN, Grbl, LINE_MAX, State};

impl Grbl {
    /// Takes lines while there is nothing to wait for.
    pub(super) fn read_lines(&mut self) {
        loop {
            if let Some(motion) = self.waiting.take() {
                if self.planner.is_full() {
                    self.waiting = Some(motion);
                    self.start();
                    return;
                }
                self.plan(motion);
                self.say("ok\r\n");
            }
            let is_blocked = self.is_waiting_for_reset
                || self.now < self.busy_until
                || self.homing.is_some()
                || self.is_probing
                || self.is_cancelling
                || matches!(self.state, State::Hold | State::Sleep);
            if is_blocked {
                return;
            }
            let Some(byte) = self.rx.pop_front() else {
                self.start();
                return;
            };
            self.take(byte);
        }
    }

    /// Comments and blanks go, letters become capitals (protocol.c).
    fn take(&mut self, byte: u8) {
        match byte {
            b'\r' | b'\n' => {
                // What was asked for at once is told before a line is done (protocol.c).
                self.tell_status();
                let line = std::mem::take(&mut self.line);
                let is_overlong = std::mem::take(&mut self.is_overlong);
                self.is_comment = None;
                let result = if is_overlong {
                    Err(11)
                } else {
                    self.execute(&String::from_utf8_lossy(&line))
                };
                match result {
                    Ok(true) => self.say("ok\r\n"),
                    // Its `ok` comes when it is done.
                    Ok(false) => {}
                    Err(code) => self.say(&format!("error:{code}\r\n")),
                }
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

    /// Does a line; `false` when its answer comes later.
    fn execute(&mut self, line: &str) -> Result<bool, u8> {
        if line.is_empty() {
            return Ok(true);
        }
        if let Some(command) = line.strip_prefix('$') {
            return self.system(command);
        }
        if matches!(self.state, State::Alarm | State::Jog) {
            return Err(9);
        }
        let parsed = gcode::parse(line, self.modes, false, self.planner.end(), self.offset)?;
        self.obey(parsed)
    }

    fn obey(&mut self, parsed: Parsed) -> Result<bool, u8> {
        self.modes = parsed.modes;
        if parsed.is_end {
            self.modes = gcode::Modes::default();
            self.say("[MSG:Pgm End]\r\n");
        }
        let Some(motion) = parsed.motion.filter(|_| self.state != State::Check) else {
            return Ok(true);
        };
        if motion.kind == 38 {
            if !self.planner.is_idle() {
                // It would wait until all is done; this bench has no use for that.
                return Err(8);
            }
            if self.is_probe() {
                self.alarm(4, false);
                return Ok(true);
            }
            if motion.to == self.planner.end() {
                return Err(33);
            }
            self.probed.1 = false;
            self.is_probing = true;
            self.plan(motion);
            self.state = State::Run;
            return Ok(false);
        }
        if self.eeprom.flag(20) && self.is_beyond(&motion) {
            // Grbl brakes before it tells; here it stands. The line is done with the reset.
            self.alarm(2, true);
            self.is_line_owed = true;
            return Ok(false);
        }
        self.queue(motion)
    }

    fn queue(&mut self, motion: Motion) -> Result<bool, u8> {
        if self.planner.is_full() {
            self.waiting = Some(motion);
            return Ok(false);
        }
        self.plan(motion);
        Ok(true)
    }

    fn plan(&mut self, motion: Motion) {
        // A place between two steps is the nearest step.
        let to = std::array::from_fn(|axis| {
            let scale = self.steps_per_mm(axis);
            (motion.to[axis] * scale).round() / scale
        });
        let limits = self.limits();
        let feed = if motion.kind == 0 {
            f64::INFINITY
        } else {
            motion.feed.max(FEED_MIN)
        };
        self.planner.push(to, feed / 60.0, &limits);
        if motion.is_jog && self.state == State::Idle && !self.planner.is_idle() {
            self.state = State::Jog;
        }
    }

    /// Whether a place is outside the travel, which is from 0 to `-$130` (system.c).
    fn is_beyond(&self, motion: &Motion) -> bool {
        (0..motion.to.len()).any(|axis| {
            let travel = self.eeprom.get(130 + axis as u16);
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
        let parsed = gcode::parse(words, self.modes, true, self.planner.end(), self.offset)?;
        let Some(motion) = parsed.motion else {
            return Err(16);
        };
        if self.eeprom.flag(20) && self.is_beyond(&motion) {
            return Err(15);
        }
        self.queue(motion)
    }

    fn system(&mut self, command: &str) -> Result<bool, u8> {
        if command.is_empty() {
            self.say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n");
            return Ok(true);
        }
        if let Some(rest) = command.strip_prefix('J') {
            return self.jog(rest);
        }
        let is_free = matches!(self.state, State::Idle | State::Alarm);
        match command {
            "$" if matches!(self.state, State::Run | State::Hold) => return Err(8),
            "$" => {
                let listing = self.eeprom.listing();
                self.say(&listing);
            }
            "G" => self.say_modes(),
            "C" if self.state == State::Check => {
                self.say("[MSG:Disabled]\r\nok\r\n");
                self.state = State::Idle;
                self.say_hello();
                return Ok(false);
            }
            "C" if self.state == State::Idle => {
                self.state = State::Check;
                self.say("[MSG:Enabled]\r\n");
            }
            "C" => return Err(8),
            "X" => {
                if self.state == State::Alarm {
                    self.say("[MSG:Caution: Unlocked]\r\n");
                    self.state = State::Idle;
                }
            }
            _ if !is_free => return Err(8),
            "#" => self.say_offsets(),
            "I" => self.say_build(),
            "N" => {
                for (number, line) in self.eeprom.startup.clone().iter().enumerate() {
                    self.say(&format!("$N{number}={line}\r\n"));
                }
            }
            "H" if !self.eeprom.flag(22) => return Err(5),
            "H" => {
                self.state = State::Home;
                self.homing = Some(Homing::default());
                return Ok(false);
            }
            "SLP" => {
                self.state = State::Sleep;
                self.say("ok\r\n[MSG:Sleeping]\r\n");
                return Ok(false);
            }
            "RST=$" | "RST=*" => {
                self.eeprom = super::Eeprom::factory();
                self.say("[MSG:Restoring defaults]\r\nok\r\n");
                self.say_hello();
                return Ok(false);
            }
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
        let (key, value) = command.split_once('=').ok_or(3)?;
        if let Some(number) = key.strip_prefix('N') {
            if self.state != State::Idle {
                return Err(8);
            }
            let number: usize = number.parse().map_err(|_| 2)?;
            let place = self.eeprom.startup.get_mut(number).ok_or(3)?;
            value.clone_into(place);
            return Ok(());
        }
        let number: u16 = key.parse().map_err(|_| {
            if key.starts_with(|c: char| c.is_ascii_digit()) {
                2
            } else {
                3
            }
        })?;
        let value: f64 = value.parse().map_err(|_| 2)?;
        self.eeprom.set(number, value)?;
        let here = self.machine();
        if self.planner.is_idle() {
            self.planner.clear(here);
        }
        Ok(())
    }
}
