//! The five-bar linkage of a planar device: two motors on a base move one point.
//!
//! Motor 1 is at the origin and motor 2 at `(base, 0)`. Each turns an inner link, whose angle counts in rad from the x axis towards
//! the y axis. Two outer links join the ends `A` and `B` of the inner ones in the end effector `P`, on the left of the way from `A`
//! to `B`. Closed forms from the two circles about `A` and `B`, as in Campion, Wang & Hayward, "The Pantograph Mk-II: a haptic
//! instrument", Proc. IEEE/RSJ IROS 2005.

use serde::{Deserialize, Serialize};

/// Sine of the angle between the outer links below which the linkage is taken for singular: there a small torque makes any force.
const SINE_MIN: f64 = 1e-6;

/// Lengths of the links in mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pantograph {
    pub inner_mm: f64,
    pub outer_mm: f64,
    /// From motor to motor.
    pub base_mm: f64,
}

/// Ends of the inner links, and the end effector.
struct Joints {
    a: [f64; 2],
    b: [f64; 2],
    p: [f64; 2],
}

impl Pantograph {
    /// Haply's 2DIY of plastic (third version): 70, 90 and 38 mm, of Haply's package `HaplyHAPI` 1.0.1 on PyPI.
    pub const TWO_DIY: Self = Self { inner_mm: 70.0, outer_mm: 90.0, base_mm: 38.0 };

    /// The end effector in mm at the motors' angles in rad; `None` where the outer links do not reach each other.
    #[must_use]
    pub fn place(&self, angles: [f64; 2]) -> Option<[f64; 2]> {
        self.joints(angles).map(|joints| joints.p)
    }

    fn joints(&self, [one, two]: [f64; 2]) -> Option<Joints> {
        let a = [self.inner_mm * one.cos(), self.inner_mm * one.sin()];
        let b = [self.base_mm + self.inner_mm * two.cos(), self.inner_mm * two.sin()];
        let way = sub(b, a);
        let half = 0.5 * way[0].hypot(way[1]);
        // Over the middle of A and B, at a right angle to their way.
        let height = (self.outer_mm * self.outer_mm - half * half).sqrt();
        let share = height / (2.0 * half);
        let p = [0.5 * (a[0] + b[0]) - share * way[1], 0.5 * (a[1] + b[1]) + share * way[0]];
        p.iter().all(|part| part.is_finite()).then_some(Joints { a, b, p })
    }

    /// The motors' angles in rad at a place in mm, the elbows outwards; `None` out of reach.
    #[must_use]
    pub fn angles(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let elbow = |x: f64| {
            let distance = x.hypot(y);
            let square = self.inner_mm * self.inner_mm - self.outer_mm * self.outer_mm;
            // The law of cosines in the triangle of motor, elbow and end effector.
            ((square + distance * distance) / (2.0 * self.inner_mm * distance)).acos()
        };
        let right = x - self.base_mm;
        let angles = [y.atan2(x) + elbow(x), y.atan2(right) - elbow(right)];
        angles.iter().all(|part| part.is_finite()).then_some(angles)
    }

    /// Way of the end effector in mm for each rad of motor 1, and of motor 2; `None` where the linkage is singular.
    #[must_use]
    pub fn jacobian(&self, angles: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let Joints { a, b, p } = self.joints(angles)?;
        let (from_a, from_b) = (sub(p, a), sub(p, b));
        let cross = from_a[0] * from_b[1] - from_a[1] * from_b[0];
        if cross.abs() < SINE_MIN * self.outer_mm * self.outer_mm {
            return None;
        }
        // An outer link keeps its length: the end effector and the elbow move equally far along it.
        let along = |angle: f64, link: [f64; 2]| {
            self.inner_mm * (angle.cos() * link[1] - angle.sin() * link[0]) / cross
        };
        let (one, two) = (along(angles[0], from_a), along(angles[1], from_b));
        Some([[one * from_b[1], -one * from_b[0]], [-two * from_a[1], two * from_a[0]]])
    }

    /// The motors' torques in N mm for a force in N on whoever holds the end effector: the transposed Jacobian.
    #[must_use]
    pub fn torques(&self, angles: [f64; 2], force: [f64; 2]) -> Option<[f64; 2]> {
        let ways = self.jacobian(angles)?;
        Some(ways.map(|[x, y]| x * force[0] + y * force[1]))
    }

    /// The force in N that torques in N mm make.
    #[must_use]
    pub fn force(&self, angles: [f64; 2], [one, two]: [f64; 2]) -> Option<[f64; 2]> {
        let [[a, b], [c, d]] = self.jacobian(angles)?;
        let determinant = a * d - b * c;
        let force = [(one * d - two * b) / determinant, (two * a - one * c) / determinant];
        force.iter().all(|part| part.is_finite()).then_some(force)
    }
}

fn sub([a, b]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [a - x, b - y]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places 5 mm apart in the square of 100 mm around (19, 90) mm, where the 2DIY is used.
    fn places() -> impl Iterator<Item = [f64; 2]> {
        (0..=20).flat_map(|i| {
            (0..=20).map(move |j| [-31.0 + 5.0 * f64::from(i), 40.0 + 5.0 * f64::from(j)])
        })
    }

    const LINKAGES: [Pantograph; 2] =
        [Pantograph::TWO_DIY, Pantograph { base_mm: 0.0, ..Pantograph::TWO_DIY }];

    #[test]
    fn inverse_of_the_forward_kinematics_is_the_place() {
        for linkage in LINKAGES {
            let mut reached = 0;
            for place in places() {
                let Some(angles) = linkage.angles(place) else { continue };
                let [x, y] = linkage.place(angles).unwrap();
                // Lengths of 100 mm with sixteen digits, some roundings long.
                assert!((x - place[0]).hypot(y - place[1]) < 1e-10, "{place:?} {x} {y}");
                reached += 1;
            }
            // The whole square with the base; without it, motors on one axis do not reach one corner.
            assert!(reached == 441 || linkage.base_mm == 0.0 && reached > 400, "{reached}");
        }
    }

    #[test]
    fn virtual_work_of_motors_and_hand_is_equal() {
        // tau . dtheta = F . dx, with dx by the forward kinematics alone: a central difference of 1e-5 rad is exact to about 1e-8.
        let step = 1e-5;
        for linkage in LINKAGES {
            for place in places() {
                let Some(angles) = linkage.angles(place) else { continue };
                for (force, turn) in [([1.0, -0.5], [0.3, 0.8]), ([0.2, 2.0], [-1.0, 0.4])] {
                    let at = |way: f64| {
                        linkage
                            .place([angles[0] + way * turn[0], angles[1] + way * turn[1]])
                            .unwrap()
                    };
                    let (before, after) = (at(-step), at(step));
                    let moved = sub(after, before).map(|part| part / (2.0 * step));
                    let torques = linkage.torques(angles, force).unwrap();
                    let by_motors = torques[0] * turn[0] + torques[1] * turn[1];
                    let by_hand = force[0] * moved[0] + force[1] * moved[1];
                    assert!((by_motors - by_hand).abs() < 1e-5, "{place:?} {by_motors} {by_hand}");
                }
            }
        }
    }

    #[test]
    fn force_of_the_torques_is_the_force() {
        for place in places() {
            let angles = Pantograph::TWO_DIY.angles(place).unwrap();
            let torques = Pantograph::TWO_DIY.torques(angles, [0.7, -1.3]).unwrap();
            let [x, y] = Pantograph::TWO_DIY.force(angles, torques).unwrap();
            assert!((x - 0.7).hypot(y + 1.3) < 1e-10, "{place:?}");
        }
    }

    #[test]
    fn places_and_torques_are_those_of_haplys_package() {
        // Angles in degrees; place in m and torques in N m of 0.5 N along x and -1.25 N along y, computed by `HaplyHAPI` 1.0.1.
        let cases = [
            (
                [168.0, 12.0],
                [0.019, 0.03574204647626483],
                [0.0725601921212649, -0.08812999890794403],
            ),
            (
                [120.0, 50.0],
                [0.028016397260131096, 0.12487855748977805],
                [0.02503582247020369, -0.08506807523189366],
            ),
            (
                [135.0, 70.0],
                [-0.003927450523733559, 0.12710786637204902],
                [0.03984456897172073, -0.07026212578685681],
            ),
            (
                [100.0, 20.0],
                [0.06935376636157149, 0.10709752137187084],
                [0.0010921569763136588, -0.09409349100879276],
            ),
        ];
        for (degrees, place, torques) in cases {
            let angles = degrees.map(f64::to_radians);
            let found = Pantograph::TWO_DIY.place(angles).unwrap();
            let own = Pantograph::TWO_DIY.torques(angles, [0.5, -1.25]).unwrap();
            for axis in 0..2 {
                // Equal mathematics in another order.
                assert!((1e-3 * found[axis] - place[axis]).abs() < 1e-14, "{degrees:?} {found:?}");
                assert!((1e-3 * own[axis] - torques[axis]).abs() < 1e-14, "{degrees:?} {own:?}");
            }
        }
    }

    #[test]
    fn what_cannot_be_is_none() {
        let linkage = Pantograph::TWO_DIY;
        // Inner links away from each other: 178 mm between their ends reach, 217 mm with a longer base do not.
        assert!(linkage.place([std::f64::consts::PI, 0.0]).is_some());
        let wide = Pantograph { base_mm: 77.0, ..linkage };
        assert_eq!(wide.place([std::f64::consts::PI, 0.0]), None);
        assert_eq!(linkage.place([f64::NAN, 0.0]), None);
        for place in [[0.0, 0.0], [19.0, 200.0], [f64::INFINITY, 0.0]] {
            assert_eq!(linkage.angles(place), None, "{place:?}");
        }
        // Outer links in one line: 180 mm apart at the ends of the inner ones.
        let line = Pantograph { base_mm: 40.0, ..linkage };
        assert_eq!(line.jacobian([std::f64::consts::PI, 0.0]), None);
    }
}
