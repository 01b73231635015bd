//! The homing cycle of the X axis (gnea/grbl, limits.c): seek, pull off, locate, pull off.

use super::planner::STEP;
use super::{Grbl, State};

/// Searches go so many times further than the travel, and than the pull-off (doc/markdown/interface.md, ALARM:9).
const SEARCH: f64 = 1.5;
const LOCATE: f64 = 5.0;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    #[default]
    Seek,
    PullOff,
    Locate,
    Leave,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct HomingCycle {
    phase: Phase,
    /// In mm since the phase began.
    distance: f64,
    /// In mm, whole steps of it done.
    from: Option<f64>,
    speed: f64,
}

impl Grbl {
    pub(super) fn home(&mut self, mut homing: HomingCycle) {
        let is_negative = self.eeprom.value(23) as u32 & 1 != 0;
        let towards = if is_negative { -1.0 } else { 1.0 };
        let pull_off = self.eeprom.value(27);
        let (side, rate, most) = match homing.phase {
            Phase::Seek => (towards, self.eeprom.value(25), SEARCH * self.eeprom.value(130)),
            Phase::PullOff | Phase::Leave => (-towards, self.eeprom.value(25), pull_off),
            Phase::Locate => (towards, self.eeprom.value(24), LOCATE * pull_off),
        };
        let from = *homing.from.get_or_insert(self.steps[0] as f64 / self.steps_per_mm(0));
        let is_closed = self.is_limit();
        let is_search = matches!(homing.phase, Phase::Seek | Phase::Locate);
        if is_search && is_closed {
            return self.start_phase(if homing.phase == Phase::Seek {
                Phase::PullOff
            } else {
                Phase::Leave
            });
        }
        if homing.distance >= most {
            match homing.phase {
                Phase::Seek | Phase::Locate => return self.fail(9),
                _ if is_closed => return self.fail(8),
                Phase::PullOff => return self.start_phase(Phase::Locate),
                Phase::Leave => return self.finish_homing(is_negative, pull_off),
            }
        }
        homing.speed = (homing.speed + self.eeprom.value(120) * STEP).min(rate / 60.0);
        homing.distance = (homing.distance + homing.speed * STEP).min(most);
        self.steps[0] = ((from + side * homing.distance) * self.steps_per_mm(0)).round() as i64;
        self.speed = homing.speed;
        self.homing = Some(homing);
    }

    fn start_phase(&mut self, phase: Phase) {
        self.homing = Some(HomingCycle { phase, ..HomingCycle::default() });
    }

    fn fail(&mut self, code: u8) {
        self.alarm(code, false);
        self.is_line_owed = true;
        self.is_resetting = true;
    }

    /// Machine zero is at the end of the travel that has the greater coordinate (limits.c).
    fn finish_homing(&mut self, is_negative: bool, pull_off: f64) {
        let mm = if is_negative { pull_off - self.eeprom.value(130) } else { -pull_off };
        let steps = (mm * self.steps_per_mm(0)).round() as i64;
        self.shift += (self.steps[0] - steps) as f64 * self.settings.mm_per_step;
        self.steps[0] = steps;
        self.planner.clear(self.machine());
        self.speed = 0.0;
        self.state = State::Idle;
        self.send("ok\r\n");
    }
}
