//! The planner and its segments: they turn blocks of motion into positions over time.
//!
//! As in Grbl (gnea/grbl, planner.c and stepper.c): the newest block ends at rest; blocks join at full speed where they
//! go straight on; motion is cut into segments of a hundredth of a second, a few of which are prepared ahead and cannot be
//! changed, so that a stop begins up to 50 ms late.

use std::collections::VecDeque;

/// Axes of the board.
pub const AXES: usize = 3;
/// In mm.
pub type Coordinates = [f64; AXES];

/// Blocks that wait or are under way at most: `BLOCK_BUFFER_SIZE` 16 less the one that is always empty (planner.h).
pub const BLOCKS_MAX: usize = 15;
/// Length of a step of this emulation.
pub const STEP: f64 = 0.001;
/// Steps of a segment: `ACCELERATION_TICKS_PER_SECOND` is 100 (config.h).
const SEGMENT: usize = 10;
/// Steps made ahead: `SEGMENT_BUFFER_SIZE` 6 less the one that is always empty (stepper.h).
const AHEAD: usize = 5 * SEGMENT;
/// A shorter distance than this, in mm, is rounding.
const TINY: f64 = 1e-9;

/// A straight motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionBlock {
    pub to: Coordinates,
    /// Its direction, of length one.
    pub unit: Coordinates,
    /// Its length in mm.
    pub length: f64,
    /// Its speed in mm/s.
    pub speed: f64,
    /// Its acceleration in mm/s2.
    pub acceleration: f64,
    /// Fastest speed at which it can begin.
    entry: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    pub place: Coordinates,
    /// In mm/s.
    pub speed: f64,
}

#[derive(Clone, Debug, Default)]
pub struct Planner {
    blocks: VecDeque<MotionBlock>,
    ahead: VecDeque<PathPoint>,
    /// Where the newest segment ends.
    place: Coordinates,
    speed: f64,
    /// Of the first block.
    remaining: f64,
    /// Where the newest block ends.
    end: Coordinates,
    is_holding: bool,
}

impl Planner {
    pub fn at(place: Coordinates) -> Self {
        Self { place, end: place, ..Self::default() }
    }

    /// Where the newest block ends.
    pub const fn end(&self) -> Coordinates {
        self.end
    }

    pub fn is_full(&self) -> bool {
        self.blocks.len() >= BLOCKS_MAX
    }

    pub fn free(&self) -> usize {
        BLOCKS_MAX - self.blocks.len()
    }

    pub fn is_idle(&self) -> bool {
        self.ahead.is_empty() && (self.blocks.is_empty() || (self.is_holding && self.speed == 0.0))
    }

    /// Adds a motion unless its length is zero. `limits` holds speed and acceleration of each axis.
    pub fn push(&mut self, to: Coordinates, speed: f64, limits: &[(f64, f64); AXES]) {
        let distance: Vec<f64> = to.iter().zip(self.end).map(|(to, from)| to - from).collect();
        let length = distance.iter().map(|distance| distance * distance).sum::<f64>().sqrt();
        if length < TINY {
            return;
        }
        let mut unit = [0.0; AXES];
        let (mut most, mut acceleration) = (f64::INFINITY, f64::INFINITY);
        for axis in 0..AXES {
            unit[axis] = distance[axis] / length;
            if unit[axis].abs() > TINY {
                most = most.min(limits[axis].0 / unit[axis].abs());
                acceleration = acceleration.min(limits[axis].1 / unit[axis].abs());
            }
        }
        let speed = speed.min(most);
        // Straight on without slowing down, else from rest: this rig has one axis, so corners are reversals.
        let entry = match self.blocks.back() {
            Some(last) if dot(&last.unit, &unit) > 0.999_999 => speed.min(last.speed),
            _ => 0.0,
        };
        if self.blocks.is_empty() {
            self.remaining = length;
        }
        self.end = to;
        self.blocks.push_back(MotionBlock { to, unit, length, speed, acceleration, entry });
    }

    /// Brakes, and keeps the rest of the blocks.
    pub fn hold(&mut self) {
        self.is_holding = true;
    }

    pub fn resume(&mut self) {
        self.is_holding = false;
    }

    /// Drops all blocks and rests.
    pub fn clear(&mut self, place: Coordinates) {
        *self = Self::at(place);
    }

    /// One step of [`STEP`]: the place now, while something moves.
    pub fn advance(&mut self) -> Option<PathPoint> {
        while self.ahead.len() + SEGMENT <= AHEAD && self.make_segment() {}
        self.ahead.pop_front()
    }

    fn make_segment(&mut self) -> bool {
        let mut is_made = false;
        for _ in 0..SEGMENT {
            if self.blocks.is_empty() || (self.is_holding && self.speed == 0.0) {
                break;
            }
            self.make_step();
            is_made = true;
        }
        is_made
    }

    /// The fastest speed at the end of the next step from which every block ahead can be done, the last ending at rest:
    /// the root `w` of `(v + w) dt / 2 + (w^2 - c^2) / (2 a) = distance` for each speed `c` at the end of a block.
    fn fastest(&self, block: &MotionBlock) -> f64 {
        let (v, a) = (self.speed, block.acceleration);
        let half = 0.5 * a * STEP;
        let reach = |distance: f64, c: f64| {
            let room = half * half + c * c + 2.0 * a * (distance - 0.5 * v * STEP);
            room.max(half * half).sqrt() - half
        };
        let mut distance = self.remaining;
        let mut fastest = f64::INFINITY;
        for next in self.blocks.iter().skip(1) {
            fastest = fastest.min(reach(distance, next.entry));
            distance += next.length;
        }
        fastest.min(reach(distance, 0.0))
    }

    fn make_step(&mut self) {
        let Some(block) = self.blocks.front().copied() else {
            return;
        };
        let (v, change) = (self.speed, block.acceleration * STEP);
        let w = if self.is_holding {
            (v - change).max(0.0)
        } else {
            let nominal = block.speed.max(v - change);
            (v + change).min(nominal).min(self.fastest(&block))
        };
        let mut distance = 0.5 * (v + w) * STEP;
        self.speed = w;
        while let Some(block) = self.blocks.front().copied() {
            let is_last = self.blocks.len() == 1;
            if distance < self.remaining - TINY {
                self.remaining -= distance;
                for axis in 0..AXES {
                    self.place[axis] = block.to[axis] - block.unit[axis] * self.remaining;
                }
                break;
            }
            distance -= self.remaining;
            self.place = block.to;
            self.blocks.pop_front();
            self.remaining = self.blocks.front().map_or(0.0, |next| next.length);
            if is_last {
                self.speed = 0.0;
            }
        }
        self.ahead.push_back(PathPoint { place: self.place, speed: self.speed });
    }
}

fn dot(one: &Coordinates, other: &Coordinates) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::rig::MotionProfile;
    use palpate_model::{MmPerS, MmPerS2, Position, Seconds};

    const LIMITS: [(f64, f64); AXES] = [(25.0, 50.0); AXES];

    fn run(planner: &mut Planner) -> Vec<PathPoint> {
        std::iter::from_fn(|| planner.advance()).collect()
    }

    #[test]
    fn one_block_or_many_give_the_same_trapezoid() {
        for pieces in [1, 2, 7, 15] {
            let mut planner = Planner::default();
            for piece in 1..=pieces {
                let to = 30.0 * f64::from(piece) / f64::from(pieces);
                planner.push([to, 0.0, 0.0], 9.0, &LIMITS);
            }
            let exact =
                MotionProfile::to_rest(Position(0.0), Position(30.0), MmPerS(9.0), MmPerS2(50.0));
            let points = run(&mut planner);
            for (at, point) in points.iter().enumerate() {
                let place = exact.position(Seconds((at + 1) as f64 * STEP)).0;
                // A corner of the trapezoid within a step costs that step's change of speed.
                assert!((point.place[0] - place).abs() < 1e-3, "{pieces}, {at}: {point:?} {place}");
            }
            assert_eq!(points.last().unwrap().place[0], 30.0);
            assert!(planner.is_idle() && planner.free() == BLOCKS_MAX);
        }
    }

    #[test]
    fn late_block_costs_speed() {
        let mut planner = Planner::default();
        planner.push([3.0, 0.0, 0.0], 9.0, &LIMITS);
        // Braking takes 0.81 mm.
        for _ in 0..330 {
            planner.advance();
        }
        planner.push([6.0, 0.0, 0.0], 9.0, &LIMITS);
        let slowest =
            (0..60).filter_map(|_| planner.advance()).fold(9.0, |slow: f64, p| slow.min(p.speed));
        assert!((2.0..8.5).contains(&slowest), "{slowest}");
        assert_eq!(run(&mut planner).last().unwrap().place[0], 6.0);
    }

    #[test]
    fn hold_brakes_after_the_prepared_segments() {
        let mut planner = Planner::default();
        planner.push([-100.0, 0.0, 0.0], 9.0, &LIMITS);
        for _ in 0..1000 {
            planner.advance();
        }
        let before = planner.advance().unwrap().place[0];
        planner.hold();
        let end = run(&mut planner).last().unwrap().place[0];
        let distance = before - end;
        // 81 / 100 mm of braking, and 40 to 50 ms before it.
        assert!((0.81 + 0.36..0.81 + 0.46).contains(&distance), "{distance}");
        assert!(planner.is_idle());
        planner.resume();
        assert_eq!(run(&mut planner).last().unwrap().place[0], -100.0);
    }
}
