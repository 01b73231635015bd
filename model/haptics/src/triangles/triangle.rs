//! One triangle: the point nearest to another, and where a straight way meets it.

use super::vector::{Vector, cross, dot, minus, plus};

/// Which part of a triangle a point is on. Edge `i` goes from corner `i` to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleFeature {
    Inside,
    Edge(u8),
    Corner(u8),
}

/// The point of a triangle that is nearest to `point`, and on which part of the triangle it is, by the regions that the corners and
/// edges have (Ericson, "Real-Time Collision Detection", 2005, section 5.1.5).
#[must_use]
pub fn closest_on_triangle(
    [a, b, c]: [[f64; 3]; 3],
    point: [f64; 3],
) -> ([f64; 3], TriangleFeature) {
    use TriangleFeature::{Corner, Edge, Inside};
    let (ab, ac) = (minus(b, a), minus(c, a));
    let from_a = minus(point, a);
    let (a1, a2) = (dot(ab, from_a), dot(ac, from_a));
    if a1 <= 0.0 && a2 <= 0.0 {
        return (a, Corner(0));
    }
    let from_b = minus(point, b);
    let (b1, b2) = (dot(ab, from_b), dot(ac, from_b));
    if b1 >= 0.0 && b2 <= b1 {
        return (b, Corner(1));
    }
    let from_c = minus(point, c);
    let (c1, c2) = (dot(ab, from_c), dot(ac, from_c));
    if c2 >= 0.0 && c1 <= c2 {
        return (c, Corner(2));
    }
    // Shares of the corners, but for a common factor.
    let of_c = a1 * b2 - b1 * a2;
    if of_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        return (plus(a, a1 / (a1 - b1), ab), Edge(0));
    }
    let of_b = c1 * a2 - a1 * c2;
    if of_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        return (plus(a, a2 / (a2 - c2), ac), Edge(2));
    }
    let of_a = b1 * c2 - c1 * b2;
    let (to_c, to_b) = (b2 - b1, c1 - c2);
    if of_a <= 0.0 && to_c >= 0.0 && to_b >= 0.0 {
        return (plus(b, to_c / (to_c + to_b), minus(c, b)), Edge(1));
    }
    let sum = of_a + of_b + of_c;
    (plus(plus(a, of_b / sum, ab), of_c / sum, ac), Inside)
}

/// The share of the way `along` from `from` at which it meets a triangle, from 0 to 1.
///
/// The volume that the way spans with an edge has exactly the opposite sign in the triangle on the other side of that edge, and zero
/// counts for both, so nothing slips between two triangles (Woop, Benthin & Wald, "Watertight ray/triangle intersection", J. Comput.
/// Graph. Tech. 2 (2013) 65-82, by the same thought).
pub(super) fn meets(
    corners: [Vector; 3],
    normal: Vector,
    from: Vector,
    along: Vector,
) -> Option<f64> {
    let [a, b, c] = corners.map(|corner| minus(corner, from));
    let spans = [dot(along, cross(a, b)), dot(along, cross(b, c)), dot(along, cross(c, a))];
    let is_within = spans.iter().all(|span| *span >= 0.0) || spans.iter().all(|span| *span <= 0.0);
    let speed = dot(along, normal);
    if !is_within || speed == 0.0 {
        return None;
    }
    let share = dot(a, normal) / speed;
    (0.0..=1.0).contains(&share).then_some(share)
}

/// Shares of the corners at a point of a triangle; they add up to one and none is below zero.
pub(super) fn corner_shares([a, b, c]: [Vector; 3], point: Vector) -> [f64; 3] {
    let normal = cross(minus(b, a), minus(c, a));
    let part = |from: Vector, to: Vector| {
        dot(cross(minus(from, point), minus(to, point)), normal).max(0.0)
    };
    let parts = [part(b, c), part(c, a), part(a, b)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|one| one / sum) } else { [1.0 / 3.0; 3] }
}
