//! A Galil DMC controller with the simulated bench behind it: axis A is the slide with the probe, pulse-driven,
//! analog input 1 is the load cell.
//!
//! Bytes go through [`input`] into statements, those through `commands.rs` into motion, settings and answers. The
//! sample clock drives profiles, filter, tissue, recording and programs. Where a source says what the controller
//! does, the place that does it names the source; where none was found it says so.

mod analog;
mod axis;
mod client;
mod clock;
mod commands;
mod contour;
mod data_record;
mod expression;
mod format;
mod input;
mod listen;
mod memory;
mod message;
mod model;
mod motion;
mod profile;
mod program;
mod record;
mod run;
mod sample;
mod scope;
mod settings;
mod system;
mod transfer;

pub use model::{GalilModel, GalilModelError};

use super::EmulatedDevice;
use super::faults::DeviceFault;
use super::plant::{CellFault, EmulatedPlant};
use analog::Analog;
use axis::{GalilAxis, InputPolarity};
use client::GalilClient;
use clock::SampleClock;
use contour::ContourMode;
use format::NumberFormat;
use memory::ControllerMemory;
use palpate_drivers::galil::ErrorCode;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::HandAction;
use palpate_model::{Nanos, Position, Seconds};
use program::{Program, ProgramThread};
use record::ArrayRecorder;

/// Connections of a controller on a network: handles A to H.
const HANDLES: usize = 8;
/// From a reset to the first answer. Not confirmed: long enough to be noticed, short for a test.
const BOOT: Nanos = Nanos(300_000_000);

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmulatedGalilSettings {
    pub sim: SimSettings,
    pub model: GalilModel,
    /// Bits of the analog inputs' converter, 12 or 16; `None` without analog inputs.
    pub converter: Option<u32>,
    /// One serial line instead of network handles.
    pub is_serial: bool,
    /// Whether a serial line echoes after a reset (`EO 1`).
    pub has_echo: bool,
    /// By how many parts in a million the crystal is fast.
    pub clock_ppm: f64,
    pub serial_number: u32,
}

impl Default for EmulatedGalilSettings {
    fn default() -> Self {
        Self {
            sim: SimSettings::default(),
            model: GalilModel::default(),
            converter: Some(16),
            is_serial: true,
            has_echo: false,
            clock_ppm: 0.0,
            serial_number: 1820,
        }
    }
}

/// A client or a thread of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    Client(usize),
    Thread(usize),
}

impl Origin {
    fn client(self) -> Option<usize> {
        match self {
            Self::Client(channel) => Some(channel),
            Self::Thread(_) => None,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Answer {
    /// `:`.
    Done,
    /// A text, its line end, `:`.
    Text(String),
    /// Text without a line end, then `:` (`MG` with `{N}`).
    Open(String),
    /// Bytes, then `:`.
    Bytes(Vec<u8>),
    Silent,
}

/// The emulated controller.
#[derive(Clone, Debug)]
pub struct GalilEmulator {
    settings: EmulatedGalilSettings,
    plant: EmulatedPlant,
    clock: SampleClock,
    axes: Vec<GalilAxis>,
    polarity: InputPolarity,
    /// The rest of `CN`.
    other_inputs: [f64; 3],
    memory: ControllerMemory,
    recorder: ArrayRecorder,
    contour: ContourMode,
    analog: Option<Analog>,
    program: Program,
    /// The program that `BP` keeps over a reset.
    burned: Option<Program>,
    threads: Vec<ProgramThread>,
    clients: Vec<GalilClient>,
    /// `TC`, and thread and line of the last error of a program.
    error: ErrorCode,
    error_at: (usize, usize),
    position_format: NumberFormat,
    variable_format: NumberFormat,
    /// `PF`, `VF`, `LZ` as they were set.
    format_numbers: (f64, f64, f64),
    /// `CW 1`: unsolicited characters have their top bit set.
    is_marked: bool,
    /// `CF`: where unsolicited text goes.
    unsolicited_to: Option<usize>,
    outputs: u16,
    /// `DR`: samples between records, and to whom.
    pushed: Option<(u64, usize)>,
    /// No answer before then.
    boots_until: Option<Nanos>,
    now: Nanos,
    /// Another controller is on the wire.
    is_wrong: bool,
}

impl GalilEmulator {
    /// A controller just switched on at time zero.
    pub fn new(settings: EmulatedGalilSettings) -> Self {
        let plant = EmulatedPlant::new(
            &settings.sim,
            SampleClock::new(Nanos::ZERO, settings.clock_ppm).period(),
        );
        let channels = if settings.is_serial { 1 } else { HANDLES };
        let mut emulator =
            Self::start(settings, plant, None, vec![GalilClient::default(); channels], Nanos::ZERO);
        if settings.is_serial {
            emulator.clients[0] = GalilClient::connected(settings.has_echo);
        }
        emulator
    }

    /// The state after power-up or a reset, with what survives one. The slide is at zero counts.
    fn start(
        settings: EmulatedGalilSettings,
        plant: EmulatedPlant,
        burned: Option<Program>,
        clients: Vec<GalilClient>,
        now: Nanos,
    ) -> Self {
        let program = burned.clone().unwrap_or_default();
        let mut threads = vec![ProgramThread::idle(); settings.model.threads()];
        if let Some(line) = program.find("AUTO") {
            threads[0].start(line, 0);
        }
        Self {
            settings,
            plant,
            clock: SampleClock::new(now, settings.clock_ppm),
            axes: (0..settings.model.axes()).map(|axis| GalilAxis::new(axis == 0)).collect(),
            polarity: InputPolarity { limit: -1.0, home: -1.0 },
            other_inputs: [-1.0, 0.0, 0.0],
            memory: ControllerMemory::default(),
            recorder: ArrayRecorder::default(),
            contour: ContourMode::default(),
            analog: settings.converter.map(Analog::new),
            program,
            burned,
            threads,
            clients,
            error: ErrorCode(0),
            error_at: (0, 0),
            position_format: NumberFormat::decimal(10, 0),
            variable_format: NumberFormat::decimal(10, 4),
            format_numbers: (10.0, 10.4, 1.0),
            is_marked: false,
            unsolicited_to: settings.is_serial.then_some(0),
            outputs: 0,
            pushed: None,
            boots_until: None,
            now,
            is_wrong: false,
        }
    }

    /// `RS`, and a reset by fault: connections on a network are dropped.
    fn reset(&mut self) {
        // The slide stays where it stands.
        let counts = self.axes[0].filtered;
        self.plant.shift_counter(counts * palpate_drivers::sim::MM_PER_PULSE);
        let (burned, clients) = (self.burned.take(), std::mem::take(&mut self.clients));
        *self = Self {
            is_wrong: self.is_wrong,
            ..Self::start(self.settings, self.plant.clone(), burned, clients, self.now)
        };
        for client in &mut self.clients {
            if self.settings.is_serial {
                *client = GalilClient::connected(self.settings.has_echo);
            } else if client.is_open {
                *client = GalilClient::dropped();
            }
        }
        self.boots_until = Some(self.now + BOOT);
    }

    /// True length of a sample.
    pub fn period(&self) -> Seconds {
        self.clock.period()
    }

    pub fn plant(&self) -> &EmulatedPlant {
        &self.plant
    }

    /// Whether an axis, counted from 0, is moving, for tests.
    pub fn is_running(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(GalilAxis::is_running)
    }

    /// True position of the slide from home, whatever the counter says, for tests.
    pub fn slide(&self) -> Position {
        self.plant.axis()
    }
}

impl EmulatedDevice for GalilEmulator {
    fn channels(&self) -> usize {
        self.clients.len()
    }

    fn connect(&mut self, now: Nanos, channel: usize) {
        self.advance(now);
        if !self.settings.is_serial
            && let Some(client) = self.clients.get_mut(channel)
        {
            // Echo is for terminals on a serial line.
            *client = GalilClient::connected(false);
        }
    }

    fn disconnect(&mut self, now: Nanos, channel: usize) {
        self.advance(now);
        if !self.settings.is_serial
            && let Some(client) = self.clients.get_mut(channel)
        {
            *client = GalilClient::default();
            self.pushed = self.pushed.filter(|(_, to)| *to != channel);
            if self.unsolicited_to == Some(channel) {
                self.unsolicited_to = None;
            }
            if let Some(line) = self.program.find("TCPERR") {
                self.threads[0].call_automatic(line);
            }
        }
    }

    fn receive(&mut self, now: Nanos, channel: usize, bytes: &[u8]) {
        self.advance(now);
        if channel < self.clients.len() {
            for byte in bytes {
                self.receive_byte(channel, *byte);
            }
        }
    }

    fn advance(&mut self, now: Nanos) {
        self.run_samples_until(now);
    }

    fn transmit(&mut self, channel: usize) -> Vec<u8> {
        self.clients.get_mut(channel).map(GalilClient::take_out).unwrap_or_default()
    }

    fn take_hang_up(&mut self, channel: usize) -> bool {
        self.clients.get_mut(channel).is_some_and(|client| std::mem::take(&mut client.is_hung_up))
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        self.advance(now);
        match fault {
            DeviceFault::Reset if is_on => self.reset(),
            DeviceFault::Reset => {}
            DeviceFault::Stuck => self.plant.set_cell_fault(is_on.then_some(CellFault::Stuck)),
            DeviceFault::Saturated => {
                self.plant.set_cell_fault(is_on.then_some(CellFault::Saturated))
            }
            DeviceFault::WrongDevice => self.is_wrong = is_on,
        }
    }

    fn apply_hand_action(&mut self, now: Nanos, action: HandAction) {
        self.advance(now);
        self.plant.apply_hand_action(action);
    }
}
