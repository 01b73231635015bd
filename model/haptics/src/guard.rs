//! The guard that keeps the rendered force within bounds, whatever the model asks for.

use super::{Flags, Period};
use palpate_model::units::{Newtons, Seconds};
use serde::{Deserialize, Serialize};

/// Bounds of a force guard.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuardSettings {
    /// Largest force either way.
    pub force_max: Newtons,
    /// Largest change of force, in N/ms: the impulse limit of a contact too.
    pub slew_n_per_ms: f64,
    /// The force of the start rises over this time.
    pub soft_start: Seconds,
    /// A loop that is away for longer has stalled.
    pub stall: Seconds,
    /// After a stall the force rises over this time from what the device held meanwhile; to less it goes at once.
    pub stall_ramp: Seconds,
    /// After contact the force rises over this time.
    pub contact_ramp: Seconds,
    /// The drive lets go by itself after so long without a command; `None` for one that holds the last
    /// command for ever.
    #[serde(rename = "lets_go_after")]
    pub release_after: Option<Seconds>,
}

impl Default for GuardSettings {
    /// 10 N is below what the motor may give for long. 0.5 N/ms is three times what the thesis body asks
    /// for at 100 mm/s and 30 mm. A stall of 5 ms is five ticks of 1 kHz. Ramps of a quarter of a second and more leave a
    /// hand the time to notice; that of contact is short compared with a poke.
    fn default() -> Self {
        Self {
            force_max: Newtons(10.0),
            slew_n_per_ms: 0.5,
            soft_start: Seconds(1.0),
            stall: Seconds(0.005),
            stall_ramp: Seconds(0.25),
            contact_ramp: Seconds(0.02),
            release_after: None,
        }
    }
}

impl GuardSettings {
    /// Bounds that bound nothing on this device, to show what they are for.
    pub const OPEN: Self = Self {
        force_max: Newtons(1e3),
        slew_n_per_ms: 1e3,
        soft_start: Seconds(0.0),
        stall: Seconds(1e3),
        stall_ramp: Seconds(0.0),
        contact_ramp: Seconds(0.0),
        release_after: None,
    };
}

/// A guard with its state.
///
/// Its force never differs from its last by more than the slew limit times the tick, across contacts,
/// stalls and bad numbers alike.
#[derive(Clone, Copy, Debug)]
pub struct ForceGuard {
    force_max: f64,
    change_max: f64,
    stall: u64,
    release_after: Option<u64>,
    start: Ramp,
    after_stall: Ramp,
    after_contact: Ramp,
    is_touching: bool,
    /// The force that the device held through the last stall.
    held: f64,
    last: f64,
}

/// Rises from 0 to 1 in so many ticks.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    length: u64,
    done: u64,
}

impl Ramp {
    fn new(period: Period, span: Seconds, done: bool) -> Self {
        let length = period.ticks_in(span);
        let done = if done { length } else { 0 };
        Self { length, done }
    }

    /// The gain of the next tick, and whether it still rises.
    fn tick(&mut self) -> (f64, bool) {
        self.done = (self.done + 1).min(self.length);
        (self.done as f64 / self.length as f64, self.done < self.length)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuardTick {
    pub force: Newtons,
    pub flags: Flags,
}

impl ForceGuard {
    /// At the start, with no force.
    #[must_use]
    pub fn new(settings: &GuardSettings, period: Period) -> Self {
        // A bound that is no number lets nothing through.
        let bound = |value: f64| if value >= 0.0 { value } else { 0.0 };
        Self {
            force_max: bound(settings.force_max.0),
            change_max: bound(settings.slew_n_per_ms) * period.millis(),
            stall: period.ticks_in(settings.stall),
            release_after: settings.release_after.map(|span| period.ticks_in(span)),
            start: Ramp::new(period, settings.soft_start, false),
            after_stall: Ramp::new(period, settings.stall_ramp, true),
            after_contact: Ramp::new(period, settings.contact_ramp, false),
            is_touching: false,
            held: 0.0,
            last: 0.0,
        }
    }

    /// The force now at the device: what the next one is measured against.
    pub fn force(&self) -> Newtons {
        Newtons(self.last)
    }

    /// Force is requested again: it rises as after the start.
    pub fn restart(&mut self) {
        self.start.done = 0;
    }

    /// Bounds `force`, `elapsed` ticks after the last call: one, unless the loop was away.
    #[must_use]
    pub fn tick(&mut self, force: Newtons, is_touching: bool, elapsed: u64) -> GuardTick {
        if self.release_after.is_some_and(|ticks| elapsed > ticks) {
            self.last = 0.0;
        }
        if elapsed > self.stall {
            self.after_stall.done = 0;
            self.held = self.last;
        }
        if is_touching && !self.is_touching {
            self.after_contact.done = 0;
        }
        self.is_touching = is_touching;
        let (start, starts) = self.start.tick();
        let (stall, stalls) = self.after_stall.tick();
        let (contact, contacts) = self.after_contact.tick();
        let mut flags = Flags::SOFT_START.when(starts)
            | Flags::STALL.when(stalls)
            | Flags::CONTACT_RAMP.when(contacts && is_touching)
            | Flags::NO_CONTACT.when(!is_touching)
            | Flags::NO_FORCE.when(force.0.is_nan());
        let requested = if is_touching && !force.0.is_nan() { force.0 } else { 0.0 };
        let bounded = requested.clamp(-self.force_max, self.force_max);
        flags |= Flags::FORCE_MAX.when(bounded != requested);
        let risen = bounded * start.min(contact);
        // A device that held its force goes on from there: a loop that is late again and again would else never reach it.
        let known = risen.clamp(self.held.min(0.0), self.held.max(0.0));
        let target = known + (risen - known) * stall;
        let reached = target.clamp(self.last - self.change_max, self.last + self.change_max);
        flags |= Flags::SLEW.when(reached != target);
        self.last = reached;
        GuardTick { force: Newtons(reached), flags }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    const PERIOD: Period = Period::MILLISECOND;

    #[test]
    fn no_step_is_above_the_limit_whatever_comes() {
        let mut guard = ForceGuard::new(&GuardSettings::default(), PERIOD);
        let mut random = SplitMix::seeded(3);
        let wild = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, -0.0];
        let mut last = 0.0;
        for i in 0..200_000 {
            let force =
                if i % 11 == 0 { wild[random.below(wild.len())] } else { 20.0 * random.normal() };
            let elapsed = [0, 1, 1, 1, 1, 1, 1, 30, u64::MAX][random.below(9)];
            let one = guard.tick(Newtons(force), random.below(3) > 0, elapsed);
            // The product of the limit and a tick, to rounding of 10 N.
            assert!((one.force.0 - last).abs() <= 0.5 + 1e-14, "{i}");
            assert!(one.force.0.abs() <= 10.0);
            last = one.force.0;
        }
    }

    #[test]
    fn each_ramp_rises_over_its_time_and_says_so() {
        let settings = GuardSettings {
            soft_start: Seconds(0.1),
            contact_ramp: Seconds(0.05),
            ..GuardSettings::default()
        };
        let mut guard = ForceGuard::new(&settings, PERIOD);
        let mut run = |ticks: u32, force: f64, touching: bool, elapsed: u64| {
            let mut out = guard.tick(Newtons(force), touching, elapsed);
            for _ in 1..ticks {
                out = guard.tick(Newtons(force), touching, 1);
            }
            out
        };
        let one = run(50, 2.0, true, 1);
        assert!((one.force.0 - 1.0).abs() < 1e-12 && one.flags == Flags::SOFT_START);
        assert_eq!(run(50, 2.0, true, 1).force, Newtons(2.0));
        // Away from contact it falls at the limit, back in contact it rises over the ramp.
        let one = run(2, 2.0, false, 1);
        assert!((one.force.0 - 1.0).abs() < 1e-12 && one.flags.has(Flags::NO_CONTACT));
        run(2, 2.0, false, 1);
        let one = run(25, 2.0, true, 1);
        assert!((one.force.0 - 1.0).abs() < 1e-12 && one.flags.has(Flags::CONTACT_RAMP));
        run(25, 2.0, true, 1);
        // A stall of 5 ms is none; after one of 6 ms the force rises from what was held: 2 N.
        assert_eq!(run(1, 4.0, true, 5).flags, Flags::SLEW);
        run(3, 2.0, true, 1);
        let one = run(1, 4.0, true, 6);
        assert!((one.force.0 - 2.008).abs() < 1e-12 && one.flags == Flags::STALL);
        assert!((run(124, 4.0, true, 1).force.0 - 3.0).abs() < 1e-12);
        assert_eq!(run(125, 4.0, true, 1).force, Newtons(4.0));
        // To less, and across zero, it goes at the limit of its change.
        let one = run(1, 3.7, true, 6);
        assert!((one.force.0 - 3.7).abs() < 1e-12 && one.flags == Flags::STALL);
        let one = run(8, -2.0, true, 1);
        assert!((one.force.0 - 0.0).abs() < 0.3, "{one:?}");
        // Ten of the 250 ticks of the ramp are done.
        let one = run(1, -2.0, true, 1);
        assert!((one.force.0 + 2.0 * 10.0 / 250.0).abs() < 1e-12, "{one:?}");
    }

    #[test]
    fn a_loop_that_is_late_again_and_again_reaches_the_force_all_the_same() {
        let mut guard = ForceGuard::new(&GuardSettings::default(), PERIOD);
        let mut last = 0.0;
        // A stall of 19 ms every 60 ms, which is a quarter of the ramp.
        for tick in 0..6000 {
            let elapsed = if tick % 60 == 0 { 19 } else { 1 };
            let one = guard.tick(Newtons(3.0), true, elapsed).force.0;
            assert!(one >= last, "{tick}: {last} {one}");
            last = one;
        }
        assert!(last > 2.9, "{last}");
    }

    #[test]
    fn a_drive_that_lets_go_is_met_at_zero() {
        let settings = GuardSettings {
            release_after: Some(Seconds(0.02)),
            soft_start: Seconds(0.0),
            ..GuardSettings::default()
        };
        let mut guard = ForceGuard::new(&settings, PERIOD);
        for _ in 0..100 {
            let _ = guard.tick(Newtons(4.0), true, 1);
        }
        assert_eq!(guard.force(), Newtons(4.0));
        let one = guard.tick(Newtons(4.0), true, 100);
        // A 250th of 4 N.
        assert!((one.force.0 - 0.016).abs() < 1e-12, "{one:?}");
    }
}
