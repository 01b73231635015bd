//! The rack on its slide, with the motor's rotor and whoever holds it, as one moving mass.

use super::hand::SimulatedHand;
use crate::inertia;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pinion {
    pub teeth: u32,
    /// Module in mm: pitch diameter per tooth.
    pub module_mm: f64,
}

impl Default for Pinion {
    /// The source's: 20 teeth of module 1, pitch diameter 20 mm.
    fn default() -> Self {
        Self { teeth: 20, module_mm: 1.0 }
    }
}

impl Pinion {
    /// Pitch radius in mm.
    pub fn radius_mm(&self) -> f64 {
        0.5 * f64::from(self.teeth) * self.module_mm
    }

    /// Way of the rack per revolution, in mm.
    pub fn mm_per_rev(&self) -> f64 {
        std::f64::consts::TAU * self.radius_mm()
    }
}

/// The moving mass and where it is.
///
/// Each step takes the mean of the speeds at its ends for every force, so that the energies of a step add up
/// exactly, at any length (the midpoint rule: Hairer, Lubich & Wanner, Geometric Numerical Integration, section
/// II.1). Friction is Coulomb's as an impulse: it takes the speed towards zero and never beyond, so that what
/// rests, rests until the force is above it (Moreau's sweeping process; no velocity band as in Karnopp's model is
/// needed).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rack {
    mass: f64,
    damping: f64,
    sliding: f64,
    sticking: f64,
    /// Place in mm.
    pub x: f64,
    /// Speed in mm/s.
    pub v: f64,
    pub energies: RackEnergies,
}

/// What acts on the rack over a step, apart from its own damping and friction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RackForces {
    /// Force of the motor in N, positive into the tissue.
    pub motor: f64,
    /// Intended place of the hand in the middle of the step, in mm, and its speed in mm/s.
    pub hand: [f64; 2],
}

/// Energies in N mm since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RackEnergies {
    /// Put in by the motor.
    pub motor: f64,
    /// Put in by the hand, through its spring and damper.
    pub hand: f64,
    /// Taken by the device's damping.
    pub damping: f64,
    /// Taken by its friction.
    pub friction: f64,
}

impl Rack {
    /// At rest at `x` mm: mass in kg, damping in N s/mm, friction sliding and at rest in N.
    #[must_use]
    pub fn new(mass_kg: f64, damping: f64, [sliding, sticking]: [f64; 2], x: f64) -> Self {
        Self {
            mass: inertia(mass_kg),
            damping,
            sliding,
            sticking: sticking.max(sliding),
            x,
            v: 0.0,
            energies: RackEnergies::default(),
        }
    }

    /// Energy of its motion, in N mm.
    pub fn kinetic(&self) -> f64 {
        0.5 * self.mass * self.v * self.v
    }

    /// Moves for `dt` s with a hand on it; the hand's own mass is part of the rack's. Returns the hand's force, in N.
    pub fn step(&mut self, forces: &RackForces, hand: &SimulatedHand, dt: f64) -> f64 {
        let [place, speed] = forces.hand;
        let v0 = self.v;
        // m (v1 - v0) / dt = motor + k (place - x - dt v / 2) + c (speed - v) - b v - friction, v = (v0 + v1) / 2.
        let drag = 0.5 * (0.5 * hand.stiffness * dt + hand.damping + self.damping);
        let inert = self.mass / dt;
        let pushed = forces.motor + hand.stiffness * (place - self.x) + hand.damping * speed;
        let free = inert * v0 + pushed - drag * v0;
        let holds = if v0 == 0.0 { self.sticking } else { self.sliding };
        let friction = if free.abs() <= holds { free } else { self.sliding.copysign(free) };
        let v1 = (free - friction) / (inert + drag);
        let mean = 0.5 * (v0 + v1);
        let moved = mean * dt;
        let pull = hand.stiffness * (place - self.x - 0.5 * moved) + hand.damping * (speed - mean);
        self.x += moved;
        self.v = v1;
        self.energies.motor += forces.motor * moved;
        self.energies.hand += pull * moved;
        self.energies.damping += self.damping * mean * moved;
        self.energies.friction += friction * moved;
        pull
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::HandPath;

    #[test]
    fn a_free_swing_keeps_its_energy_and_period() {
        let hand = SimulatedHand {
            mass_kg: 0.0,
            stiffness: 0.5,
            damping: 0.0,
            path: HandPath::Still { at: 0.0 },
        };
        let mut rack = Rack::new(0.115, 0.0, [0.0; 2], 3.0);
        // 9.95 Hz; in steps of 20 us.
        let omega = (0.5 / inertia(0.115)).sqrt();
        let steps = (10.0 * std::f64::consts::TAU / omega / 2e-5).round() as u32;
        for _ in 0..steps {
            rack.step(&RackForces::default(), &hand, 2e-5);
        }
        assert!((rack.x - 3.0).abs() < 1e-3, "{rack:?}");
        // Of the 2.25 N mm in the spring all is there.
        assert!((0.25 * rack.x * rack.x + rack.kinetic() - 2.25).abs() < 1e-11);
        let RackEnergies { motor, hand, damping, friction } = rack.energies;
        let residual = motor + hand - damping - friction - rack.kinetic();
        assert!(residual.abs() < 1e-11, "{residual:e}");
    }

    #[test]
    fn friction_holds_what_is_below_it_and_stops_what_slides() {
        let mut rack = Rack::new(0.1, 0.0, [0.8, 1.2], 0.0);
        let push = |motor: f64| RackForces { motor, hand: [0.0; 2] };
        for _ in 0..1000 {
            rack.step(&push(1.19), &SimulatedHand::NONE, 1e-4);
        }
        assert_eq!((rack.x, rack.v), (0.0, 0.0));
        rack.step(&push(1.21), &SimulatedHand::NONE, 1e-4);
        assert!(rack.v > 0.0);
        // Sliding at 100 mm/s it stops after v^2 m / (2 f) = 0.625 mm.
        let mut rack = Rack::new(0.1, 0.0, [0.8, 1.2], 0.0);
        rack.v = 100.0;
        for _ in 0..1000 {
            rack.step(&push(0.0), &SimulatedHand::NONE, 1e-4);
        }
        assert_eq!(rack.v, 0.0);
        assert!((rack.x - 0.625).abs() < 0.005, "{rack:?}");
        // All of the motion went into friction, none was made.
        assert!((rack.energies.friction - 0.5).abs() < 1e-12);
    }
}
