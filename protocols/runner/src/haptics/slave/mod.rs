//! A simulated master that leads a slave on a rig: it gets the force of the slave's cell, and the force at its handle is
//! the model's.
//!
//! The model goes by the master's place, not by the slave's: a slave that follows move by move is a good part of a second
//! late, and a force that came through it would need damping of stiffness times that delay. The slave measures; of its
//! cell the master knows only whether it touches.

mod lag;

use lag::SlaveMeter;
pub use lag::{ForceDifference, LagSpread, MasterLoop, SlaveReport};

use super::{LoopTask, RealTimeLoop};
use crate::{LeadSource, SlaveSample};
use palpate_haptics::simulation::{Simulation, SimulationSettings, SimulationTick};
use palpate_haptics::{ContactSettings, MasterSlaveError, Period};
use palpate_model::Nanos;
use palpate_model::rig::RigDescription;
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Milliseconds averaged before contact is detected: two to three mains cycles.
const FILTER_MS: usize = 50;

/// Milliseconds without a sample of the slave after which the master lets go: longer than the samples of any rig.
const QUIET_MS: u64 = 200;

/// Ticks of a silence that are simulated; after longer ones the master stands where it was.
const LED_MAX: u64 = 1000;

#[derive(Clone, Debug)]
pub struct SlaveSettings {
    pub master: SimulationSettings,
    /// The body that it renders, for the comparison with the cell.
    pub body: ModifiedKelvin,
    pub depth_max: Depth,
    pub rig: RigDescription,
    /// Whether the rig's time is simulated: then the master ticks with its samples, and a run is the same whenever it is
    /// repeated.
    pub is_virtual: bool,
}

/// The newest cell force on its way to the master; neither side waits.
#[derive(Debug, Default)]
struct CellMailbox {
    /// Force of the slave's cell, as bits.
    cell: AtomicU64,
    count: AtomicU64,
}

#[derive(Clone, Copy, Debug)]
struct MasterView {
    tick: SimulationTick,
    contact_changes: u64,
}

#[derive(Debug)]
struct Master {
    simulation: Simulation,
    mailbox: Arc<CellMailbox>,
    last_count: u64,
    silent_ticks: u64,
    silent_ticks_max: u64,
    seen: MasterView,
}

impl Master {
    fn new(
        settings: &SimulationSettings,
        mailbox: Arc<CellMailbox>,
    ) -> Result<Self, MasterSlaveError> {
        let mut simulation = Simulation::new(settings)?;
        let tick = simulation.tick_with(Newtons(0.0), true);
        let period: Period = settings.system.law.period;
        Ok(Self {
            simulation,
            mailbox,
            last_count: 0,
            silent_ticks: 0,
            silent_ticks_max: QUIET_MS * 1_000_000 / period.nanos(),
            seen: MasterView { tick, contact_changes: 0 },
        })
    }
}

impl LoopTask for Master {
    type View = MasterView;

    fn tick(&mut self, elapsed: u64) {
        for _ in 1..elapsed.min(LED_MAX) {
            let _away = self.simulation.tick_stalled();
        }
        let count = self.mailbox.count.load(Ordering::Acquire);
        self.silent_ticks =
            if count == self.last_count { self.silent_ticks.saturating_add(elapsed) } else { 0 };
        self.last_count = count;
        let cell = Newtons(f64::from_bits(self.mailbox.cell.load(Ordering::Relaxed)));
        let was_touching = self.seen.tick.snapshot.is_touching;
        let is_on = self.silent_ticks <= self.silent_ticks_max;
        self.seen.tick = self.simulation.tick_with(cell, is_on);
        let is_touching = self.seen.tick.snapshot.is_touching;
        self.seen.contact_changes += u64::from(is_touching != was_touching);
    }

    fn show(&self, view: &mut MasterView) {
        *view = self.seen;
    }
}

#[derive(Debug)]
enum MasterDrive {
    /// With the samples, which come at times of the rig.
    WithSamples {
        master: Box<Master>,
        begun: Nanos,
        done: u64,
    },
    RealTime(RealTimeLoop<Master>),
}

/// Leads a slave and measures its lag. The hand starts with the first sample of the step that follows.
#[derive(Debug)]
pub struct SlaveLeader {
    settings: SlaveSettings,
    mailbox: Arc<CellMailbox>,
    filter: MovingMean,
    drive: Option<MasterDrive>,
    /// The master's newest tick; a master that stands still gives no lead.
    last_tick: u64,
    failure: Option<String>,
    meter: SlaveMeter,
}

impl SlaveLeader {
    pub fn new(settings: SlaveSettings) -> Result<Self, MasterSlaveError> {
        // Settings that make no master fail before anything moves.
        let mailbox = Arc::<CellMailbox>::default();
        Master::new(&settings.master, Arc::clone(&mailbox))?;
        let filtered = settings.rig.means_in(FILTER_MS);
        Ok(Self {
            filter: MovingMean::new(filtered * settings.rig.samples_per_ms() as usize),
            meter: SlaveMeter::new(&settings),
            mailbox,
            drive: None,
            last_tick: 0,
            failure: None,
            settings,
        })
    }

    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// What came of it; none if nothing was led.
    pub fn report(&self) -> Option<SlaveReport> {
        let mut report = self.meter.report()?;
        if let Some(MasterDrive::RealTime(beat)) = &self.drive {
            report.master_loop = Some(MasterLoop {
                priority: beat.granted_priority().to_string(),
                timing: beat.timing(),
            });
        }
        Some(report)
    }

    /// Contact must stand above the noise of this cell, averaged as it is.
    fn begin(&mut self, sample: &SlaveSample) -> Result<MasterDrive, String> {
        let samples = self.settings.rig.means_in(FILTER_MS) as f64
            * f64::from(self.settings.rig.samples_per_ms());
        let above = ContactSettings::above_noise(Newtons(sample.sigma.0 / samples.sqrt()));
        let mut master = self.settings.master;
        let contact = &mut master.system.contact;
        contact.on = Newtons(contact.on.0.max(above.on.0));
        contact.off = Newtons(contact.off.0.max(above.off.0));
        let period = master.system.law.period;
        let made =
            Master::new(&master, Arc::clone(&self.mailbox)).map_err(|err| err.to_string())?;
        if self.settings.is_virtual {
            return Ok(MasterDrive::WithSamples {
                master: Box::new(made),
                begun: sample.at,
                done: 0,
            });
        }
        let first = made.seen;
        let beat = RealTimeLoop::start(made, period, first).map_err(|err| err.to_string())?;
        Ok(MasterDrive::RealTime(beat))
    }

    fn see(&mut self, sample: &SlaveSample) -> Option<MasterView> {
        if self.drive.is_none() && self.failure.is_none() {
            match self.begin(sample) {
                Ok(drive) => self.drive = Some(drive),
                Err(reason) => self.failure = Some(reason),
            }
        }
        match self.drive.as_mut()? {
            MasterDrive::WithSamples { master, begun, done } => {
                let period = self.settings.master.system.law.period;
                let due = sample.at.since(*begun).0 / period.nanos();
                // Ticks of a longer silence are skipped, as in a late loop.
                for _ in 0..due.saturating_sub(*done).min(LED_MAX) {
                    master.tick(1);
                }
                *done = due;
                Some(master.seen)
            }
            MasterDrive::RealTime(beat) => Some(*beat.view()),
        }
    }
}

impl LeadSource for SlaveLeader {
    fn lead(&mut self, sample: &SlaveSample) -> Option<f64> {
        let cell = self.filter.push(sample.force.0);
        self.mailbox.cell.store(cell.to_bits(), Ordering::Relaxed);
        self.mailbox.count.fetch_add(1, Ordering::Release);
        let seen = self.see(sample)?;
        let master = &seen.tick.snapshot;
        self.meter.push(sample, master.depth, master.force, seen.contact_changes);
        let is_new = master.tick != self.last_tick;
        self.last_tick = master.tick;
        is_new.then_some(master.depth.0)
    }
}
