//! Bytes that are never queued (doc/markdown/commands.md, realtime commands).

use super::{Grbl, State};

impl Grbl {
    /// A byte that is never queued; `false` for all others.
    pub(super) fn real_time(&mut self, byte: u8) -> bool {
        match byte {
            0x18 if self.is_resetting => {}
            b'?' => self.is_status_requested = self.homing.is_none() && !self.is_waiting_for_reset,
            0x18 => self.reset(),
            _ if self.is_waiting_for_reset => return matches!(byte, b'!' | b'~' | 0x80..),
            // A hold of a jog ends it (doc/markdown/jogging.md).
            0x85 | b'!' if self.state == State::Jog => {
                self.is_cancelling = true;
                self.planner.hold();
            }
            b'!' if self.state == State::Run || self.state == State::Idle => {
                self.state = State::Hold;
                self.planner.hold();
            }
            0x84 if matches!(self.state, State::Run | State::Idle | State::Hold | State::Jog) => {
                self.send("[MSG:Check Door]\r\n");
                self.is_cancelling = self.state == State::Jog;
                self.state = State::Door;
                self.planner.hold();
            }
            b'~' if matches!(self.state, State::Hold | State::Door) && self.planner.is_idle() => {
                self.planner.resume();
                self.state = State::Idle;
                self.start();
            }
            b'~' if self.state == State::Idle => self.is_suspended = false,
            0x90..=0x9d => self.change_override(byte),
            0xa0 if matches!(self.state, State::Idle | State::Run | State::Hold) => {
                self.modes.has_coolant = !self.modes.has_coolant;
                self.reports.report_overrides();
            }
            b'!' | b'~' | 0x80.. => {}
            _ => return false,
        }
        true
    }

    /// Feed, rapids, spindle (doc/markdown/commands.md, overrides); only reported.
    fn change_override(&mut self, byte: u8) {
        let [feed, rapid, spindle] = &mut self.overrides;
        let (value, what) = match byte {
            0x90..=0x94 => (feed, byte - 0x90),
            0x99.. => (spindle, byte - 0x99),
            0x95..=0x97 => {
                *rapid = [100, 50, 25][usize::from(byte - 0x95)];
                return self.reports.report_overrides();
            }
            _ => return,
        };
        let changed = match what {
            0 => 100,
            1 => *value + 10,
            2 => value.saturating_sub(10),
            3 => *value + 1,
            _ => value.saturating_sub(1),
        };
        *value = changed.clamp(10, 200);
        self.reports.report_overrides();
    }
}
