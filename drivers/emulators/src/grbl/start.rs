//! Start, alarm and reset of the board.

use super::gcode::ModalState;
use super::planner::AXES;
use super::{ALARM_PAUSE, Grbl, State, report};

impl Grbl {
    /// After power-up or a reset by the converter, which clears the position (main.c).
    pub(super) fn power_up(&mut self) {
        self.steps = [0; AXES];
        self.state = if self.eeprom.is_set(22) { State::Alarm } else { State::Idle };
        self.start_over();
    }

    /// After every reset: the position stays, lines and blocks are dropped.
    pub(super) fn start_over(&mut self) {
        self.is_resetting = false;
        self.busy_until = self.now;
        self.rx.clear();
        self.line.clear();
        (self.is_comment, self.is_overlong) = (None, false);
        self.waiting = None;
        self.modes = ModalState::default();
        self.offsets.shift = [0.0; AXES];
        self.offsets.tool = 0.0;
        self.probe_result = ([0.0; AXES], false);
        self.homing = None;
        self.is_probing = false;
        self.is_cancelling = false;
        self.is_waiting_for_reset = false;
        self.is_status_requested = false;
        self.speed = 0.0;
        self.reports = report::ReportCounters::default();
        self.overrides = [100; 3];
        self.planner.clear(self.machine());
        let is_first = std::mem::take(&mut self.is_first_start);
        if is_first {
            // Observed with 1.1h on an emulated ATmega328P: unused memory is reported, then listed.
            self.send("error:7\r\n");
            let listing = self.eeprom.listing();
            self.send(&listing);
        }
        let version = if self.is_wrong { "0.9j" } else { "1.1h" };
        self.send(&format!("\r\nGrbl {version} ['$' for help]\r\n"));
        if self.eeprom.is_set(21) && self.is_limit() {
            self.send("[MSG:Check Limits]\r\n");
            self.state = State::Alarm;
        }
        self.was_limit = self.is_limit();
        if matches!(self.state, State::Alarm | State::Sleep) {
            self.send("[MSG:'$H'|'$X' to unlock]\r\n");
            self.state = State::Alarm;
        } else {
            self.state = State::Idle;
            if is_first {
                self.send(">:error:7\r\n>:error:7\r\n");
            }
            for line in self.eeprom.startup.clone() {
                if !line.is_empty() {
                    let result = self.execute(&line);
                    let result_text =
                        result.map_or_else(|code| format!("error:{code}"), |_| "ok".to_owned());
                    self.send(&format!(">{line}:{result_text}\r\n"));
                }
            }
        }
    }

    /// Raises an alarm; the axis stands still at once.
    pub(super) fn alarm(&mut self, code: u8, is_critical: bool) {
        self.send(&format!("ALARM:{code}\r\n"));
        self.busy_until = self.now + ALARM_PAUSE;
        self.is_line_owed |= is_critical && self.has_line_under_way();
        self.planner.clear(self.machine());
        self.waiting = None;
        self.homing = None;
        self.is_probing = false;
        self.is_cancelling = false;
        self.speed = 0.0;
        self.state = State::Alarm;
        if is_critical {
            self.send("[MSG:Reset to continue]\r\n");
            self.is_waiting_for_reset = true;
        }
    }

    /// Ctrl-X (motion_control.c, `mc_reset`).
    pub(super) fn reset(&mut self) {
        // A line that is being done ends with its `ok` all the same (protocol.c, `protocol_main_loop`).
        self.is_line_owed |= self.has_line_under_way();
        if self.homing.is_some() {
            self.alarm(6, false);
        } else if self.is_moving() {
            self.alarm(3, false);
        }
        self.is_resetting = true;
        self.is_suspended = false;
        self.finish_reset();
    }

    /// Sends the welcome once the alarm has had its pause.
    pub(super) fn finish_reset(&mut self) {
        if self.is_resetting && self.now >= self.busy_until {
            if std::mem::take(&mut self.is_line_owed) {
                self.send("ok\r\n");
            }
            self.start_over();
        }
    }
}
