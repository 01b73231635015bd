//! The simulated device with a hand that another thread moves, and the newest points of its motion.

use super::{LoopTask, SimulatedMasterSlave};
use palpate_haptics::simulation::{SimulationSettings, SimulationTick};
use palpate_haptics::{Flags, MasterSlaveError, Period};
use palpate_model::units::{MmPerS, Seconds};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Points in one view: a reader four times a second misses none.
pub const TRAIL: usize = 64;

/// Time between two points: 250 Hz resolves every limit cycle of a hand on a handle, which is below 100 Hz.
const APART: Seconds = Seconds(0.004);

/// Target position of the hand, shared between threads; the loop never waits.
#[derive(Clone, Debug)]
pub struct HandTarget(Arc<AtomicU64>);

impl HandTarget {
    fn at(place_mm: f64) -> Self {
        Self(Arc::new(AtomicU64::new(place_mm.to_bits())))
    }

    /// In mm, from the next tick on; a value that is not finite is ignored.
    pub fn set(&self, place_mm: f64) {
        if place_mm.is_finite() {
            self.0.store(place_mm.to_bits(), Ordering::Relaxed);
        }
    }

    /// In mm.
    pub fn position(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrailPoint {
    pub t: f64,
    /// Depth of the slave in mm.
    pub depth: f64,
    /// Force of the model in N.
    pub model: f64,
    /// Force commanded in N.
    pub force: f64,
    /// Torque commanded in N mm.
    pub torque: f64,
    /// All flags since the point before.
    pub flags: Flags,
}

#[derive(Clone, Debug)]
pub struct GuidedDeviceView {
    /// The newest tick.
    pub last: SimulationTick,
    count: u64,
    /// The last of them; the one with number n at n modulo [`TRAIL`].
    trail: [TrailPoint; TRAIL],
}

impl GuidedDeviceView {
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Points after the first `known`, as far as they are still there, in order.
    pub fn since(&self, known: u64) -> impl Iterator<Item = &TrailPoint> {
        let first = known.max(self.count.saturating_sub(TRAIL as u64));
        (first..self.count).map(|number| &self.trail[(number % TRAIL as u64) as usize])
    }
}

/// The simulated master-slave system with a hand that goes where its [`HandTarget`] says.
#[derive(Clone, Debug)]
pub struct GuidedDevice {
    device: SimulatedMasterSlave,
    lead: HandTarget,
    place: f64,
    speed: MmPerS,
    apart: u64,
    ticks: u64,
    flags: Flags,
    live: GuidedDeviceView,
}

impl GuidedDevice {
    /// At its start, the hand at rest where its path begins; it moves at `speed` above zero.
    pub fn new(settings: &SimulationSettings, speed: MmPerS) -> Result<Self, MasterSlaveError> {
        let place = settings.plant.hand.path.at(0.0);
        let mut device = SimulatedMasterSlave::new(settings)?;
        device.lead(place, speed);
        let period: Period = settings.system.law.period;
        let live = GuidedDeviceView {
            last: *device.last(),
            count: 0,
            trail: [TrailPoint::default(); TRAIL],
        };
        Ok(Self {
            device,
            lead: HandTarget::at(place),
            place,
            speed,
            apart: period.ticks_in(APART).max(1),
            ticks: 0,
            flags: Flags::NONE,
            live,
        })
    }

    /// Where the hand was led in the last tick, in mm.
    pub fn place(&self) -> f64 {
        self.place
    }

    pub fn hand_target(&self) -> HandTarget {
        self.lead.clone()
    }

    pub fn view(&self) -> &GuidedDeviceView {
        &self.live
    }
}

impl LoopTask for GuidedDevice {
    type View = GuidedDeviceView;

    fn tick(&mut self, elapsed: u64) {
        let place = self.lead.position();
        if place != self.place {
            self.place = place;
            self.device.lead(place, self.speed);
        }
        self.device.tick(elapsed);
        let last = *self.device.last();
        self.flags |= last.output.flags;
        self.live.last = last;
        self.ticks += 1;
        if self.ticks >= self.apart {
            self.ticks = 0;
            let seen = &last.snapshot;
            self.live.trail[(self.live.count % TRAIL as u64) as usize] = TrailPoint {
                t: last.t.0,
                depth: seen.depth.0,
                model: seen.model.0,
                force: seen.force.0,
                torque: seen.torque,
                flags: std::mem::take(&mut self.flags),
            };
            self.live.count += 1;
        }
    }

    fn show(&self, view: &mut GuidedDeviceView) {
        view.clone_from(&self.live);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_haptics::rig::{HandPath, SimulatedHand};
    use palpate_model::viscoelastic::ModifiedKelvin;

    fn led() -> GuidedDevice {
        let hand = SimulatedHand::firm(HandPath::Still { at: 0.0 });
        let settings = SimulationSettings::of(ModifiedKelvin::THESIS, Period::MILLISECOND, hand);
        GuidedDevice::new(&settings, MmPerS(50.0)).unwrap()
    }

    #[test]
    fn the_hand_goes_where_it_is_led_at_its_speed_and_back() {
        let mut led = led();
        let lead = led.hand_target();
        let run = |led: &mut GuidedDevice, ticks: u64| (0..ticks).for_each(|_| led.tick(1));
        run(&mut led, 500);
        assert_eq!(led.view().last.snapshot.force.0, 0.0);
        lead.set(20.0);
        // 20 mm at 50 mm/s take 0.4 s; by a quarter of it the hand has not even led it half the way.
        run(&mut led, 100);
        assert!(led.view().last.x < 10.0, "{}", led.view().last.x);
        run(&mut led, 2_900);
        let pressed = led.view().last;
        assert!(pressed.x > 8.0 && pressed.x < 20.0, "{}", pressed.x);
        assert!(pressed.snapshot.force.0 > 0.5);
        // Turned on the way, without a jump.
        lead.set(-2.0);
        run(&mut led, 50);
        lead.set(f64::NAN);
        let before = led.view().last.x;
        run(&mut led, 1);
        assert!((led.view().last.x - before).abs() < 0.2);
        run(&mut led, 3_000);
        assert!(led.view().last.x < 0.5, "{}", led.view().last.x);
        assert_eq!(led.view().last.snapshot.force.0, 0.0);
    }

    #[test]
    fn a_trail_looked_at_often_enough_has_every_point_once() {
        let mut led = led();
        led.hand_target().set(20.0);
        let (mut known, mut times) = (0, Vec::new());
        for tick in 1..=2_000_u64 {
            led.tick(1);
            if tick % 250 == 0 {
                times.extend(led.view().since(known).map(|point| point.t));
                known = led.view().count();
            }
        }
        assert_eq!(times.len(), 500);
        let apart = |pair: &[f64]| (pair[1] - pair[0] - APART.0).abs() < 1e-9;
        assert!(times.windows(2).all(apart));
        // Looked at late, the last ones are there.
        let late: Vec<f64> = led.view().since(0).map(|point| point.t).collect();
        assert_eq!(late, times[times.len() - TRAIL..]);
    }
}
