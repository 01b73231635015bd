//! The simulated rig: a slider, a load cell and a specimen to plan, train and demonstrate on.
//!
//! It takes the same commands and reports the same readings as a rig on wires, in simulated time:
//! the controller samples once per tick, commands reach it half a millisecond after they are sent
//! and act at the next tick, reports reach the host 1.0 to 1.5 ms after their tick. Nothing
//! is simulated beyond the event that is handed out, so an answer to that event acts when it
//! would on wires. Equal settings and equal commands at equal events give equal events, bit for bit.

mod amounts;
mod bench;
mod clock;
mod load_cell;
mod own_cell;
mod preconditioning;
mod random;
mod sensors;
mod settings;
mod slider;
mod tissue;
mod truth;

pub use amounts::{
    SimBath, SimCompliance, SimInput, SimNoise, SimPreconditioning, SimRate, SimSoftening,
    SimStiffness, SimThickness,
};
pub use bench::SimBench;
pub use load_cell::{LoadCell, calibration, counts_from_volts, volts_from_counts};
pub use random::{Random, RandomStream};
pub use settings::{SimCell, SimClock, SimProfile, SimSettingError, SimSettings};
pub use slider::SWITCH_MARGIN_MM;
pub use truth::{RigWithTruth, TruthListener};

use crate::rig::{Rig, RigEvent, RigEventBody};
use clock::{COMMAND_LATENCY, REPORT_LATENCY, ReportLink, TickClock};
use palpate_model::calibration::{Calibration, CalibrationCurve};
use palpate_model::rig::{HandAction, Reading, RigCommand, RigDescription, SensorReading};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{MmPerS, MmPerS2, Nanos, Newtons, Position, Seconds};
use sensors::Sensors;
use slider::{ACCELERATION_QUANTUM, Slider};
use std::collections::VecDeque;

/// Travel of one pulse of the thesis's slide (EZ limo EZS3-15), in mm.
pub const MM_PER_PULSE: f64 = 0.015;
pub const TRAVEL: Position = Position(150.0);
/// 2 counts/s, the resolution of `SP` at a nominal millisecond in Galil's DMC command reference.
const SPEED_QUANTUM: MmPerS = MmPerS(2.0 * MM_PER_PULSE);
/// Faster than any published indentation of soft tissue with such a slide.
const SPEED_MAX: MmPerS = MmPerS(20.0);
/// Four acceleration quanta: the thesis's 0.75 mm/s is reached within 13 ms and 5 um.
const ACCELERATION: MmPerS2 = MmPerS2(4.0 * ACCELERATION_QUANTUM.0);
/// Commands on their way; a controller's input buffer holds no more.
const COMMANDS_MAX: usize = 64;
/// Changes whenever equal settings no longer give equal events.
const SIMULATOR_VERSION: u32 = 1;

/// True values of a simulated rig, for demonstrations and tests. No decision of a run may
/// use it: a rig on wires has no such thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimTruth {
    /// Tick the other values belong to.
    pub tick: u64,
    /// Tip of the probe, in mm from the edge of the home switch: where the rig gives way, not where the
    /// axis is.
    pub position: Position,
    /// Tissue surface, in mm from the edge of the home switch, which loading may move; that of the base without
    /// a specimen.
    pub surface: Position,
    /// Front of the stiff base behind the tissue, in mm from the edge of the home switch.
    pub base: Position,
    /// Where the pulse counter reads zero, in mm from the edge of the home switch.
    pub counter_zero: Position,
    /// Parameters of the specimen mounted last.
    pub body: ModifiedKelvin,
    pub force: Newtons,
}

impl SimTruth {
    /// The probe's position on the scale of the pulse counter, as a host sees it.
    pub fn position_counted(&self) -> Position {
        Position(self.position.distance_from(self.counter_zero))
    }

    /// The surface's position on the scale of the pulse counter, as a host sees it.
    pub fn surface_counted(&self) -> Position {
        Position(self.surface.distance_from(self.counter_zero))
    }
}

#[derive(Clone, Debug)]
pub struct SimRig {
    description: RigDescription,
    settings: SimSettings,
    tick: Seconds,
    clock: TickClock,
    link: ReportLink,
    slider: Slider,
    bench: SimBench,
    load_cell: LoadCell,
    sensors: Sensors,
    newest_tick: u64,
    /// Force on the probe at that tick.
    force: Newtons,
    /// Time of the newest event handed out: the host's present.
    now: Nanos,
    /// Commands under way, with their arrival at the controller.
    commands: VecDeque<(Nanos, RigCommand)>,
    /// A command found the controller's buffer full.
    is_overrun: bool,
    /// Reports of the newest tick that have not been handed out.
    reports: VecDeque<RigEvent>,
}

impl SimRig {
    /// A rig just powered up, called `sim`.
    #[must_use]
    pub fn new(settings: SimSettings) -> Self {
        Self::named("sim", settings)
    }

    /// A rig just powered up, with a name of its own.
    #[must_use]
    pub fn named(name: &str, settings: SimSettings) -> Self {
        let description = describe(name, &settings);
        let tick = description.tick();
        let mut machine = Random::of_repeat(settings.seed, settings.repeat, RandomStream::Machine);
        let slider = Slider::new(&description, &mut machine);
        let bench = SimBench::new(&settings, slider.counter_zero());
        // The controller was switched on up to a minute and a half before the host looked.
        let tick_count = machine.between(1.0, 1e5) as u64;
        Self {
            tick,
            clock: TickClock::new(tick_count, description.tick_nanos),
            link: ReportLink::new(settings.seed, settings.repeat),
            load_cell: LoadCell::new(&settings, tick),
            sensors: Sensors::new(&settings),
            slider,
            bench,
            newest_tick: tick_count,
            force: Newtons(0.0),
            description,
            settings,
            now: Nanos::ZERO,
            commands: VecDeque::new(),
            is_overrun: false,
            reports: VecDeque::new(),
        }
    }

    /// What the laboratory's calibration of this rig's load cell says.
    pub fn calibration(&self) -> Calibration {
        calibration(self.settings.profile)
    }

    /// The true values at the tick of the newest event; see [`SimTruth`].
    pub fn truth(&self) -> SimTruth {
        SimTruth {
            tick: self.newest_tick,
            position: self.bench.probe(),
            surface: self.bench.surface(),
            base: self.bench.base(),
            counter_zero: self.slider.counter_zero(),
            body: self.bench.body(),
            force: self.force,
        }
    }

    /// Volts of newtons of its load cell as they truly are.
    pub fn true_curve(&self) -> &CalibrationCurve {
        self.load_cell.true_curve()
    }

    /// One tick of the controller: commands that have arrived, motion, tissue, sample.
    fn simulate_tick(&mut self) {
        let (tick, at) = self.clock.advance();
        self.slider.begin_tick(tick);
        if std::mem::take(&mut self.is_overrun) {
            let detail = format!(
                "the input buffer is full; send fewer than {COMMANDS_MAX} commands at once"
            );
            self.report(at, RigEventBody::refusal(detail));
        }
        while let Some(&(arrival, command)) = self.commands.front() {
            if arrival > at {
                break;
            }
            self.commands.pop_front();
            let answer = match self.slider.execute(tick, command) {
                Ok(ack) => RigEventBody::Ack(ack),
                Err(fault) => RigEventBody::Fault(fault),
            };
            self.report(at, answer);
        }
        let axis = self.slider.end_tick(tick);
        let forces = self.bench.advance(axis.position, self.tick);
        let (counts, volts) = self.load_cell.read(forces.on_cell);
        (self.newest_tick, self.force) = (tick, forces.on_probe);
        let reading =
            Reading { tick, counts, volts, pulses: axis.pulses, status: axis.status, age: None };
        self.report(at, RigEventBody::Reading(reading));
    }

    fn report(&mut self, sent: Nanos, body: RigEventBody) {
        let at = self.link.arrival(sent);
        self.reports.push_back(RigEvent::new(at, body));
    }
}

impl Rig for SimRig {
    fn description(&self) -> &RigDescription {
        &self.description
    }

    fn send(&mut self, command: RigCommand) {
        if self.commands.len() >= COMMANDS_MAX {
            self.is_overrun = true;
        } else {
            self.commands.push_back((self.now + COMMAND_LATENCY, command));
        }
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        // A tick is simulated only when all its predecessors have been handed out and it can be
        // seen by `until`. A command sent after it arrives half a millisecond after the newest event
        // and so after the tick, which lies at least one millisecond before that event.
        if self.reports.is_empty() && self.clock.next_at() + REPORT_LATENCY <= until {
            self.simulate_tick();
        }
        if self.reports.front()?.at > until {
            return None;
        }
        let event = self.reports.pop_front()?;
        self.now = event.at;
        Some(event)
    }

    fn is_virtual(&self) -> bool {
        true
    }

    fn take_sensors(&mut self) -> Vec<SensorReading> {
        self.sensors.take(self.now)
    }

    /// Acts at the next tick.
    fn apply_hand_action(&mut self, action: HandAction) {
        self.bench.apply_hand_action(action);
    }
}

fn describe(name: &str, settings: &SimSettings) -> RigDescription {
    RigDescription {
        name: name.to_owned(),
        identity: format!(
            "Simulated slider, load cell and specimen, {} profile, simulator {SIMULATOR_VERSION}",
            settings.profile
        ),
        settings: settings.to_map(),
        mm_per_pulse: MM_PER_PULSE,
        travel: TRAVEL,
        tick_nanos: settings.tick_nanos(),
        speed_quantum: SPEED_QUANTUM,
        speed_max: SPEED_MAX,
        acceleration: ACCELERATION,
        adc: load_cell::adc(settings.profile),
        noise_expected: load_cell::noise_expected(settings),
        pulse_lag: palpate_model::units::Seconds(0.0),
        cell_delay: Seconds(0.0),
        ticks_per_sample: 1.0,
        unseen_max: RigDescription::UNSEEN_USUAL,
        takes_targets: false,
        sensors: Sensors::described(settings),
    }
}
