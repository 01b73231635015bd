//! The energy that the rendered force has absorbed.

/// `E(n) = sum f(k-1) (x(k) - x(k-1))`: what a force held from tick to tick absorbed, exactly, from
/// positions alone (after Hannaford & Ryu, IEEE Trans. Robotics and Automation 18 (2002) 1-10, whose
/// `E = T sum f v` takes the force of the same tick; with a held force that is not the energy).
///
/// In N mm = mJ; the force counts as positive against the motion into the tissue. Where a force is known to come whole
/// ticks late, the observer takes it as late.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassivityObserver {
    energy: f64,
    carry: f64,
    /// Forces of the last ticks as a ring; the newest is at `tick`.
    forces: [f64; DELAY_MAX + 1],
    tick: usize,
    delay: usize,
}

/// Longest delay in ticks: 32 ms at 1 kHz, more than any loop that can be played.
pub const DELAY_MAX: usize = 32;

impl Default for PassivityObserver {
    fn default() -> Self {
        Self::with_delay(0)
    }
}

impl PassivityObserver {
    /// For forces that come so many ticks late, at most [`DELAY_MAX`].
    #[must_use]
    pub fn with_delay(delay_ticks: usize) -> Self {
        Self {
            energy: 0.0,
            carry: 0.0,
            forces: [0.0; DELAY_MAX + 1],
            tick: 0,
            delay: delay_ticks.min(DELAY_MAX),
        }
    }

    /// Energy absorbed so far in N mm; below zero the force has given more than it took.
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// The first half of a tick: the device moved by `moved` mm under the force held. What is not a number counts as
    /// zero.
    pub fn record_move(&mut self, moved: f64) {
        const RING: usize = DELAY_MAX + 1;
        let work = self.forces[(self.tick + RING - self.delay) % RING] * moved;
        if !work.is_finite() {
            return;
        }
        // Kahan's sum: 1e8 small numbers on a large one.
        let increment = work + self.carry;
        let energy = self.energy + increment;
        self.carry = increment - (energy - self.energy);
        self.energy = energy;
    }

    /// The second half: the force held until the next tick.
    pub fn hold(&mut self, force: f64) {
        self.tick = (self.tick + 1) % (DELAY_MAX + 1);
        self.hold_instead(force);
    }

    /// Another force than the one just held, where a later bound changed it.
    pub fn hold_instead(&mut self, force: f64) {
        self.forces[self.tick] = if force.is_finite() { force } else { 0.0 };
    }

    /// Keeps this share of what was absorbed; what is owed stays.
    pub fn scale_credit(&mut self, share: f64) {
        if self.energy > 0.0 {
            self.energy *= share;
            self.carry *= share;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(observer: &mut PassivityObserver, moved: f64, force: f64) {
        observer.record_move(moved);
        observer.hold(force);
    }

    #[test]
    fn a_held_spring_gives_half_a_stiffness_times_each_move_squared() {
        // In and out in n moves of d: each half gives away k d^2 / 2 a move.
        let (k, d, n) = (2.0, 0.25, 40);
        let mut observer = PassivityObserver::default();
        let mut x = 0.0;
        for i in 0..2 * n {
            let moved = if i < n { d } else { -d };
            x += moved;
            step(&mut observer, moved, k * x);
        }
        assert!((observer.energy() + k * d * d * f64::from(n)).abs() < 1e-12);
    }

    #[test]
    fn a_late_force_counts_when_it_comes() {
        let mut late = PassivityObserver::with_delay(2);
        let forces = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        for force in forces {
            step(&mut late, 0.5, force);
        }
        // The moves of ticks 3, 4, 5 met the forces of 0, 1, 2; those before met none.
        assert_eq!(late.energy(), 0.5 * (1.0 + 2.0 + 3.0));
    }

    #[test]
    fn many_small_moves_add_up_and_bad_ones_do_not_count() {
        let mut observer = PassivityObserver::default();
        step(&mut observer, 0.0, 1.0);
        step(&mut observer, 1e6, 1e-7);
        for _ in 0..1_000_000 {
            step(&mut observer, 1e-4, 1e-7);
        }
        // A plain sum would lose every one of them: 1e-11 added to 1e6 is below its last digit.
        assert!((observer.energy() - 1e6 - 1e-5).abs() < 2e-10);
        let before = observer.energy();
        step(&mut observer, f64::NAN, f64::INFINITY);
        step(&mut observer, 5.0, 1.0);
        assert_eq!(observer.energy(), before);
        observer.scale_credit(0.5);
        assert!((observer.energy() - 0.5 * before).abs() < 1e-9);
    }
}
