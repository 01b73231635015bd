//! Damping that takes back the energy a loop has made.

use super::{Flags, PassivityObserver, Period, inertia};
use palpate_model::units::{Newtons, Seconds};
use serde::{Deserialize, Serialize};

/// Bounds of a passivity controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerSettings {
    /// Mass that moves, in kg. More damping than this over a tick would throw the device back.
    pub mass_kg: f64,
    /// Whether the damping is held below mass over tick. Without, the controller destabilises what it
    /// guards; the choice is there to show that.
    pub is_clamped: bool,
    /// Largest force of the damping.
    pub force_max: Newtons,
    /// Out of contact, what was absorbed is forgotten with this time constant: a credit from one poke
    /// must not hide what the next one makes.
    pub leak: Seconds,
    /// Whole ticks that the force is known to come late.
    pub delay_ticks: usize,
    /// After a buzz no credit is given for so long: whatever the force returns is damped.
    pub hush: Seconds,
}

impl ControllerSettings {
    /// For a device of `mass_kg` whose force comes within its tick, with damping of up to 10 N, a leak of 0.2 s (a fifth
    /// of the fastest series of pokes) and a hush of 1 s.
    #[must_use]
    pub fn of(mass_kg: f64) -> Self {
        Self {
            mass_kg,
            is_clamped: true,
            force_max: Newtons(10.0),
            leak: Seconds(0.2),
            delay_ticks: 0,
            hush: Seconds(1.0),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerTick {
    /// The force with the damping.
    pub force: Newtons,
    /// Damping added, in N s/mm.
    pub damping: f64,
    /// Energy absorbed so far, in N mm; below zero it is owed.
    pub energy: f64,
    pub flags: Flags,
}

/// Observer and controller with their state (Hannaford & Ryu 2002, impedance causality), for a device
/// that holds its force from tick to tick and counts its way.
///
/// Three things differ from the paper. Energy is that of a held force, so what the damping takes counts
/// when it has been taken. The damping is at most mass over tick, and less where it comes late: a speed that is fed back
/// `n` ticks late swings up from `2 sin(pi / (2 (2 n + 1)))` of mass over tick on, and a difference of places is a tick
/// late by itself. A move of no count has no speed that could be damped: nothing is done, and what is owed stays owed.
#[derive(Clone, Copy, Debug)]
pub struct PassivityController {
    observer: PassivityObserver,
    damping_max: f64,
    force_max: f64,
    credit_decay: f64,
    tick_s: f64,
    hush: u64,
    hush_remaining: u64,
}

impl PassivityController {
    /// At rest.
    #[must_use]
    pub fn new(settings: &ControllerSettings, period: Period) -> Self {
        let tick_s = period.seconds().0;
        let turn = std::f64::consts::FRAC_PI_2 / (2 * settings.delay_ticks + 3) as f64;
        let clamped = inertia(settings.mass_kg) / tick_s * 2.0 * turn.sin();
        Self {
            observer: PassivityObserver::with_delay(settings.delay_ticks),
            damping_max: if settings.is_clamped { clamped.max(0.0) } else { f64::MAX },
            force_max: settings.force_max.0.max(0.0),
            credit_decay: (-tick_s / settings.leak.0.max(tick_s)).exp(),
            tick_s,
            hush: period.ticks_in(settings.hush),
            hush_remaining: 0,
        }
    }

    /// Energy absorbed so far, in N mm.
    pub fn energy(&self) -> f64 {
        self.observer.energy()
    }

    /// Whether a buzz was heard not long ago.
    pub fn is_credit_withheld(&self) -> bool {
        self.hush_remaining > 0
    }

    /// The loop was heard to buzz: for the time of the hush nothing absorbed is a credit.
    pub fn report_buzz(&mut self) {
        self.hush_remaining = self.hush;
    }

    /// The device moved by so many counts of `count_mm` in `elapsed` ticks; `force` is what is to be felt.
    #[must_use]
    pub fn tick(
        &mut self,
        (counts, count_mm): (i64, f64),
        elapsed: u64,
        force: Newtons,
        is_touching: bool,
    ) -> ControllerTick {
        let moved = counts as f64 * count_mm;
        self.observer.record_move(moved);
        if self.hush_remaining > 0 {
            self.hush_remaining = self.hush_remaining.saturating_sub(elapsed.max(1));
            self.observer.scale_credit(0.0);
        } else if !is_touching {
            self.observer.scale_credit(self.credit_decay);
        }
        let energy = self.observer.energy();
        let span = self.tick_s * elapsed.max(1) as f64;
        let speed = moved / span;
        let mut flags = Flags::NONE;
        let mut damping = 0.0;
        if energy < 0.0 && counts != 0 {
            // One tick at this speed takes all that is owed.
            let whole = -energy / (self.tick_s * speed * speed);
            damping = whole.min(self.damping_max);
            flags |= Flags::PASSIVITY | Flags::DAMPING_LIMIT.when(damping < whole);
        }
        let added = (damping * speed).clamp(-self.force_max, self.force_max);
        let added = if added.is_finite() { added } else { 0.0 };
        let requested = if force.0.is_finite() { force.0 } else { 0.0 };
        let total = requested + added;
        self.observer.hold(total);
        ControllerTick { force: Newtons(total), damping, energy, flags }
    }

    /// The force that reaches the device after all, where a later bound changed it.
    pub fn set_rendered_force(&mut self, force: Newtons) {
        self.observer.hold_instead(force.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller(is_clamped: bool) -> PassivityController {
        let settings = ControllerSettings { is_clamped, ..ControllerSettings::of(0.115) };
        PassivityController::new(&settings, Period::MILLISECOND)
    }

    const COUNT: f64 = 0.015_625;

    #[test]
    fn what_is_owed_is_taken_back_at_the_speed_of_the_tick() {
        let mut one = controller(true);
        // 2 N held while the device goes back two counts: 4 counts of N are owed.
        let _ = one.tick((0, COUNT), 1, Newtons(2.0), true);
        let tick = one.tick((-2, COUNT), 1, Newtons(0.0), true);
        let speed = -2.0 * COUNT / 1e-3;
        let owed = -4.0 * COUNT;
        assert!((tick.energy - owed).abs() < 1e-15);
        // -E / (T v^2) is 0.064 N s/mm here, below m/T = 0.115.
        let damping = -owed / (1e-3 * speed * speed);
        assert!((tick.damping - damping).abs() < 1e-12 && damping < 0.115);
        assert!((tick.force.0 - damping * speed).abs() < 1e-12);
        // Going on at that speed pays it back exactly.
        let tick = one.tick((-2, COUNT), 1, Newtons(0.0), true);
        assert!(tick.energy.abs() < 1e-15 && tick.damping == 0.0);
    }

    #[test]
    fn without_a_count_nothing_is_done_and_the_debt_stays() {
        let mut one = controller(true);
        let _ = one.tick((0, COUNT), 1, Newtons(9.0), true);
        let owed = one.tick((-1, COUNT), 1, Newtons(0.0), true).energy;
        let mut tick = one.tick((0, COUNT), 1, Newtons(0.0), true);
        for _ in 0..100 {
            assert_eq!((tick.force.0, tick.damping), (0.0, 0.0));
            tick = one.tick((0, COUNT), 1, Newtons(0.0), true);
        }
        // The one count of the tick before held -m/T v for a tick, without a move it took nothing.
        assert!((tick.energy - owed).abs() < 1e-15 && owed < -0.1);
    }

    #[test]
    fn the_clamp_is_mass_over_tick() {
        let owe = |is_clamped| {
            let mut one = controller(is_clamped);
            let _ = one.tick((0, COUNT), 1, Newtons(9.0), true);
            let tick = one.tick((-1, COUNT), 1, Newtons(0.0), true);
            (tick.damping, tick.flags)
        };
        let (damping, flags) = owe(true);
        assert!((damping - 0.115e-3 / 1e-3).abs() < 1e-15);
        assert!(flags.has(Flags::DAMPING_LIMIT));
        // Unclamped it is five times that.
        let (damping, flags) = owe(false);
        assert!(damping > 0.5 && flags == Flags::PASSIVITY, "{damping}");
    }

    #[test]
    fn a_credit_fades_out_of_contact_and_a_debt_does_not() {
        let mut one = controller(true);
        let _ = one.tick((0, COUNT), 1, Newtons(1.0), true);
        let _ = one.tick((64, COUNT), 1, Newtons(0.0), true);
        let credit = one.energy();
        assert!((credit - 1.0).abs() < 1e-12);
        for _ in 0..200 {
            let _ = one.tick((0, COUNT), 1, Newtons(0.0), false);
        }
        assert!((one.energy() - (-1f64).exp()).abs() < 1e-12);
        one.report_buzz();
        let _ = one.tick((0, COUNT), 1, Newtons(1.0), true);
        assert_eq!(one.energy(), 0.0);
        let _ = one.tick((-1, COUNT), 1, Newtons(0.0), true);
        for _ in 0..1000 {
            let _ = one.tick((0, COUNT), 1, Newtons(0.0), false);
        }
        assert!((one.energy() + COUNT).abs() < 1e-12);
    }
}
