//! A simulated master that leads a slave on a rig: what the slave's cell feels comes back to it, and the force at its
//! handle is the model's.
//!
//! The model goes by the master's place, not by the slave's: a slave that follows move by move is a good part of a second
//! late, and a force that came through it would need damping of stiffness times that delay. The slave measures; of its
//! cell the master knows only whether it touches.

mod lag;

use lag::Meter;
pub use lag::{Difference, MasterLoop, Slaved, Spread};

use super::{Beat, Ticking};
use crate::{Felt, Leading};
use palpate_haptics::simulation::{Simulation, SimulationSettings, SimulationTick};
use palpate_haptics::{ContactSettings, MasterSlaveError, Period};
use palpate_model::Nanos;
use palpate_model::rig::RigDescription;
use palpate_model::signal::MovingMean;
use palpate_model::units::{Depth, Newtons};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Milliseconds averaged of the cell before it tells contact: two to three mains cycles.
const FILTER_MS: usize = 50;

/// Milliseconds without news of the slave after which the master lets go: long beside samples of any rig.
const QUIET_MS: u64 = 200;

/// Ticks after a silence that the master is led through one by one; after more it stands where it was.
const LED_MAX: u64 = 1000;

/// What leads a slave, and on what rig.
#[derive(Clone, Debug)]
pub struct SlaveSettings {
    /// The master, with the hand on it.
    pub master: SimulationSettings,
    /// The body that it renders, for the comparison with the cell.
    pub body: ModifiedKelvin,
    /// How deep the slave may go.
    pub depth_max: Depth,
    /// The rig of the slave.
    pub rig: RigDescription,
    /// Whether the rig's time is simulated: then the master ticks with its samples, and a run is the same whenever it is
    /// repeated.
    pub is_virtual: bool,
}

/// What was told to the master last, without waiting on either side.
#[derive(Debug, Default)]
struct Told {
    /// Force of the slave's cell, as bits.
    cell: AtomicU64,
    /// How often it was told.
    count: AtomicU64,
}

/// What is seen of the master.
#[derive(Clone, Copy, Debug)]
struct Seen {
    tick: SimulationTick,
    contact_changes: u64,
}

/// The master in its loop.
#[derive(Debug)]
struct Master {
    simulation: Simulation,
    told: Arc<Told>,
    heard: u64,
    quiet: u64,
    quiet_max: u64,
    seen: Seen,
}

impl Master {
    fn new(settings: &SimulationSettings, told: Arc<Told>) -> Result<Self, MasterSlaveError> {
        let mut simulation = Simulation::new(settings)?;
        let tick = simulation.tick_with(Newtons(0.0), true);
        let period: Period = settings.system.law.period;
        Ok(Self {
            simulation,
            told,
            heard: 0,
            quiet: 0,
            quiet_max: QUIET_MS * 1_000_000 / period.nanos(),
            seen: Seen { tick, contact_changes: 0 },
        })
    }
}

impl Ticking for Master {
    type View = Seen;

    fn tick(&mut self, elapsed: u64) {
        for _ in 1..elapsed.min(LED_MAX) {
            let _away = self.simulation.stalled();
        }
        let count = self.told.count.load(Ordering::Acquire);
        self.quiet = if count == self.heard { self.quiet.saturating_add(elapsed) } else { 0 };
        self.heard = count;
        let cell = Newtons(f64::from_bits(self.told.cell.load(Ordering::Relaxed)));
        let was_touching = self.seen.tick.snapshot.is_touching;
        let is_on = self.quiet <= self.quiet_max;
        self.seen.tick = self.simulation.tick_with(cell, is_on);
        let is_touching = self.seen.tick.snapshot.is_touching;
        self.seen.contact_changes += u64::from(is_touching != was_touching);
    }

    fn show(&self, view: &mut Seen) {
        *view = self.seen;
    }
}

/// The master's way through time.
#[derive(Debug)]
enum Going {
    /// With the samples, which come at times of the rig.
    WithSamples { master: Box<Master>, begun: Nanos, done: u64 },
    /// By itself, in real time.
    ByItself(Beat<Master>),
}

/// Leads a slave and keeps account of it. Its hand begins its way with the first sample of the step that follows.
#[derive(Debug)]
pub struct SlaveLeader {
    settings: SlaveSettings,
    told: Arc<Told>,
    filter: MovingMean,
    going: Option<Going>,
    /// The master's tick that was seen last; a master that stands still leads nobody.
    last_tick: u64,
    failure: Option<String>,
    meter: Meter,
}

impl SlaveLeader {
    /// At the start, nothing led.
    pub fn new(settings: SlaveSettings) -> Result<Self, MasterSlaveError> {
        // What makes no master is told before anything moves.
        let told = Arc::<Told>::default();
        Master::new(&settings.master, Arc::clone(&told))?;
        let filtered = settings.rig.means_in(FILTER_MS);
        Ok(Self {
            filter: MovingMean::new(filtered * settings.rig.samples_per_ms() as usize),
            meter: Meter::new(&settings),
            told,
            going: None,
            last_tick: 0,
            failure: None,
            settings,
        })
    }

    /// Why there is no master, if it could not begin.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// What came of it; none if nothing was led.
    pub fn slaved(&self) -> Option<Slaved> {
        let mut slaved = self.meter.slaved()?;
        if let Some(Going::ByItself(beat)) = &self.going {
            slaved.master_loop =
                Some(MasterLoop { priority: beat.granted().to_string(), kept: beat.kept() });
        }
        Some(slaved)
    }

    /// Contact must stand above the noise of this cell, averaged as it is.
    fn begin(&mut self, felt: &Felt) -> Result<Going, String> {
        let samples = self.settings.rig.means_in(FILTER_MS) as f64
            * f64::from(self.settings.rig.samples_per_ms());
        let above = ContactSettings::above_noise(Newtons(felt.sigma.0 / samples.sqrt()));
        let mut master = self.settings.master;
        let contact = &mut master.system.contact;
        contact.on = Newtons(contact.on.0.max(above.on.0));
        contact.off = Newtons(contact.off.0.max(above.off.0));
        let period = master.system.law.period;
        let made = Master::new(&master, Arc::clone(&self.told)).map_err(|err| err.to_string())?;
        if self.settings.is_virtual {
            return Ok(Going::WithSamples { master: Box::new(made), begun: felt.at, done: 0 });
        }
        let first = made.seen;
        let beat = Beat::start(made, period, first).map_err(|err| err.to_string())?;
        Ok(Going::ByItself(beat))
    }

    /// The master as it is at the time of a sample.
    fn see(&mut self, felt: &Felt) -> Option<Seen> {
        if self.going.is_none() && self.failure.is_none() {
            match self.begin(felt) {
                Ok(going) => self.going = Some(going),
                Err(reason) => self.failure = Some(reason),
            }
        }
        match self.going.as_mut()? {
            Going::WithSamples { master, begun, done } => {
                let period = self.settings.master.system.law.period;
                let due = felt.at.since(*begun).0 / period.nanos();
                // Ticks of a silence that is longer are left out, as in a loop that was away.
                for _ in 0..due.saturating_sub(*done).min(LED_MAX) {
                    master.tick(1);
                }
                *done = due;
                Some(master.seen)
            }
            Going::ByItself(beat) => Some(*beat.seen()),
        }
    }
}

impl Leading for SlaveLeader {
    fn lead(&mut self, felt: &Felt) -> Option<f64> {
        let cell = self.filter.push(felt.force.0);
        self.told.cell.store(cell.to_bits(), Ordering::Relaxed);
        self.told.count.fetch_add(1, Ordering::Release);
        let seen = self.see(felt)?;
        let master = &seen.tick.snapshot;
        self.meter.push(felt, master.depth, master.force, seen.contact_changes);
        let is_new = master.tick != self.last_tick;
        self.last_tick = master.tick;
        is_new.then_some(master.depth.0)
    }
}
