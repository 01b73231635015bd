//! An emulated Grbl 1.1h board with a slide on its X axis.
//!
//! Facts are those of the project's documents, gnea/grbl doc/markdown/{interface,commands,jogging,settings}.md, and of
//! what its sources do (protocol.c, system.c, report.c, planner.c); nothing is copied. [`Grbl`] is the board alone,
//! moved by [`super::bench::EmulatedBench`], which has the slide and the load cell.

mod block_check;
mod eeprom;
mod gcode;
mod homing;
mod lines;
mod planner;
mod real_time;
mod report;
mod start;
mod words;

pub use eeprom::Eeprom;

use super::DeviceFault;
use super::bench::{EmulatedAxis, SlideSwitches};
use gcode::{CoordinateOffsets, ModalState};
use homing::HomingCycle;
use palpate_model::Nanos;
use planner::{AXES, Coordinates, Planner};
use std::collections::VecDeque;

/// `RX_BUFFER_SIZE` (serial.h).
const RX_MAX: usize = 128;
/// Longest line: `LINE_BUFFER_SIZE` 80 less its end (protocol.h).
const LINE_MAX: usize = 79;
/// A feed is at least this, in mm/min (`MINIMUM_FEED_RATE`, config.h).
const FEED_MIN: f64 = 1.0;
/// From the reset of an Uno to the first words of its program: its boot loader waits for a new one so long.
const BOOT: Nanos = Nanos::from_millis(1_500);
/// Pause after an alarm, in which no line is read (report.c, `report_alarm_message`).
const ALARM_PAUSE: Nanos = Nanos::from_millis(500);

/// How the slide's switches are wired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HomeWiring {
    /// Home and the far limit on the X limit pin.
    #[default]
    Limit,
    /// Home on the probe pin, both limits on the X limit pin.
    Probe,
}

#[derive(Clone, Debug, PartialEq)]
pub struct EmulatedGrblSettings {
    pub eeprom: Eeprom,
    pub home: HomeWiring,
    /// Travel of the slide per step of the motor, in mm.
    pub mm_per_step: f64,
    /// The memory was never written: the first start says `error:7` and fills it.
    pub is_unused: bool,
    /// Rate of its clock. Resonators of Arduinos are right to half a percent.
    pub resonator: f64,
    /// Every jog cancel is handled just after the jog has ended, so that no line is read until a cycle start.
    pub is_suspending: bool,
}

impl Default for EmulatedGrblSettings {
    fn default() -> Self {
        Self {
            eeprom: Eeprom::slide(),
            home: HomeWiring::Limit,
            mm_per_step: 0.0025,
            is_unused: false,
            resonator: 1.0,
            is_suspending: false,
        }
    }
}

/// Machine state (doc/markdown/interface.md).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Idle,
    Run,
    Jog,
    Hold,
    /// After a safety door command.
    Door,
    Alarm,
    Home,
    Check,
    Sleep,
}

#[derive(Clone, Debug, Default)]
pub struct Grbl {
    settings: EmulatedGrblSettings,
    eeprom: Eeprom,
    state: State,
    /// After a hard or soft limit only a reset is accepted.
    is_waiting_for_reset: bool,
    is_cancelling: bool,
    /// A line that a soft limit has ended is answered with the reset.
    is_line_owed: bool,
    /// No line is read before then.
    busy_until: Nanos,
    is_resetting: bool,
    /// The boot loader runs until then.
    boots_at: Option<Nanos>,
    is_first_start: bool,
    now: Nanos,
    rx: VecDeque<u8>,
    line: Vec<u8>,
    is_comment: Option<u8>,
    is_overlong: bool,
    /// A line without its answer yet.
    waiting: Option<lines::PendingLine>,
    tx: Vec<u8>,
    planner: Planner,
    modes: ModalState,
    offsets: CoordinateOffsets,
    probe_result: (Coordinates, bool),
    is_probing: bool,
    is_probe_away: bool,
    homing: Option<HomingCycle>,
    steps: [i64; AXES],
    /// Decrease of the counter that no motion explains, in mm, not reported yet.
    shift: f64,
    speed: f64,
    switches: SlideSwitches,
    was_limit: bool,
    is_status_requested: bool,
    /// Of feed, rapids and spindle, in percent.
    overrides: [u16; 3],
    reports: report::ReportCounters,
    is_wrong: bool,
    /// Time of its own clock that has not been stepped yet, in steps.
    credit: f64,
    is_suspended: bool,
    is_hold_pressed: bool,
}

impl Grbl {
    pub fn new(settings: EmulatedGrblSettings) -> Self {
        let mut grbl = Self {
            eeprom: settings.eeprom.clone(),
            is_first_start: settings.is_unused,
            settings,
            ..Self::default()
        };
        grbl.power_up();
        grbl
    }

    fn send(&mut self, text: &str) {
        self.tx.extend_from_slice(text.as_bytes());
    }

    fn steps_per_mm(&self, axis: usize) -> f64 {
        self.eeprom.value(100 + axis as u16).max(1e-3)
    }

    /// Position in machine coordinates, in mm.
    fn machine(&self) -> Coordinates {
        std::array::from_fn(|axis| self.steps[axis] as f64 / self.steps_per_mm(axis))
    }

    fn limits(&self) -> [(f64, f64); AXES] {
        std::array::from_fn(|axis| {
            let axis = axis as u16;
            (self.eeprom.value(110 + axis) / 60.0, self.eeprom.value(120 + axis))
        })
    }

    fn is_limit(&self) -> bool {
        let SlideSwitches { is_home, is_forward, is_reverse } = self.switches;
        match self.settings.home {
            HomeWiring::Limit => is_home || is_reverse || is_forward,
            HomeWiring::Probe => is_reverse || is_forward,
        }
    }

    /// The button at the hold pin acts like `!` when it goes down.
    pub fn press_hold(&mut self, is_pressed: bool) {
        if is_pressed && !std::mem::replace(&mut self.is_hold_pressed, is_pressed) {
            self.real_time(b'!');
        }
        self.is_hold_pressed = is_pressed;
    }

    fn is_probe(&self) -> bool {
        self.settings.home == HomeWiring::Probe && self.switches.is_home
    }

    fn is_moving(&self) -> bool {
        matches!(self.state, State::Run | State::Jog | State::Home)
            || (matches!(self.state, State::Hold | State::Door) && !self.planner.is_idle())
    }

    fn has_line_under_way(&self) -> bool {
        self.waiting.is_some() || self.homing.is_some() || self.is_probing
    }

    fn send_status_if_requested(&mut self) {
        if self.now >= self.busy_until && std::mem::take(&mut self.is_status_requested) {
            self.send_status();
        }
    }

    /// Blocks that wait begin (`protocol_auto_cycle_start`).
    fn start(&mut self) {
        if self.state == State::Idle && !self.planner.is_idle() {
            self.state = State::Run;
        }
    }

    /// Advances the axis by a millisecond.
    fn step(&mut self) {
        if let Some(homing) = self.homing.take() {
            self.home(homing);
        } else if let Some(point) = self.planner.advance() {
            for axis in 0..AXES {
                self.steps[axis] = (point.place[axis] * self.steps_per_mm(axis)).round() as i64;
            }
            self.speed = point.speed;
            if self.is_probing && self.is_probe() != self.is_probe_away {
                self.probe_result = (self.machine(), true);
                self.planner.hold();
            }
        }
        if self.homing.is_none() && self.planner.is_idle() {
            self.speed = 0.0;
            match self.state {
                State::Jog | State::Run if self.is_cancelling || self.is_probing => {
                    self.state = State::Idle;
                    self.is_suspended = self.is_cancelling && self.settings.is_suspending;
                    self.finish_cancelled_motion();
                }
                // A jog does not go on behind a door.
                State::Door if self.is_cancelling => self.finish_cancelled_motion(),
                State::Jog | State::Run => self.state = State::Idle,
                _ => {}
            }
        }
        let is_limit = self.is_limit();
        // Opening is a change as well (limits.c, the pin's interrupt).
        let has_changed = is_limit != std::mem::replace(&mut self.was_limit, is_limit);
        if has_changed
            && self.eeprom.is_set(21)
            && self.homing.is_none()
            && self.state != State::Alarm
        {
            self.alarm(1, true);
        }
    }

    /// Ends a cancelled jog or a probing.
    fn finish_cancelled_motion(&mut self) {
        self.planner.clear(self.machine());
        self.is_cancelling = false;
        if !std::mem::take(&mut self.is_probing) {
            return;
        }
        let is_error = !self.probe_result.1 && matches!(self.modes.motion, 382 | 384);
        if !self.probe_result.1 && !is_error {
            self.probe_result.0 = self.machine();
        }
        if is_error {
            self.alarm(5, false);
        }
        self.waiting = Some(lines::PendingLine::ProbeReport);
    }
}

impl EmulatedAxis for Grbl {
    fn receive(&mut self, now: Nanos, bytes: &[u8]) {
        self.now = now;
        if self.boots_at.is_some() {
            // The boot loader takes them for itself.
            return;
        }
        for byte in bytes {
            if self.real_time(*byte) {
                continue;
            }
            if self.rx.len() >= RX_MAX {
                // A board that waits for nothing reads faster than bytes arrive.
                self.read_lines();
            }
            if self.rx.len() < RX_MAX {
                self.rx.push_back(*byte);
            }
        }
        self.read_lines();
    }

    fn advance(&mut self, now: Nanos, switches: SlideSwitches) {
        self.now = now;
        self.switches = switches;
        if let Some(at) = self.boots_at {
            if now < at {
                return;
            }
            self.boots_at = None;
            self.power_up();
        }
        self.credit += self.settings.resonator;
        while self.credit >= 1.0 - 1e-9 {
            self.credit -= 1.0;
            self.step();
        }
        self.finish_reset();
        self.read_lines();
        self.send_status_if_requested();
    }

    fn counter_mm(&self) -> f64 {
        self.steps[0] as f64 * self.settings.mm_per_step
    }

    fn transmit(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.tx)
    }

    fn take_counter_shift(&mut self) -> f64 {
        std::mem::take(&mut self.shift)
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        match fault {
            DeviceFault::Reset if is_on => {
                self.shift += self.counter_mm();
                self.tx.clear();
                self.planner.clear([0.0; AXES]);
                self.steps = [0; AXES];
                self.state = State::Idle;
                self.boots_at = Some(now + BOOT);
            }
            DeviceFault::WrongDevice => self.is_wrong = is_on,
            _ => {}
        }
    }
}
