//! Boxes in boxes around triangles, halved at the middle triangle along the longest side (Ericson, "Real-Time Collision Detection",
//! 2005, chapter 6).

use super::mesh::{SurfacePoint, TriangleMesh};
use super::triangle::closest_on_triangle;
use super::vector::{Vector, dot, minus, plus};

/// Triangles in a box that has no boxes in it.
const LEAF: usize = 4;
/// Boxes that wait to be looked at: halving a million triangles to four takes 18 steps.
const WAITING: usize = 48;

#[derive(Clone, Debug)]
struct TreeBox {
    low: Vector,
    high: Vector,
    /// The first face in order where there are faces; else the second box, the first being the next.
    first: u32,
    /// Faces; none: boxes.
    faces: u32,
}

#[derive(Clone, Debug)]
pub(super) struct Tree {
    boxes: Box<[TreeBox]>,
    order: Box<[u32]>,
}

/// Where a straight way meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshHit {
    pub face: u32,
    /// Share of the way, from 0 to 1.
    pub share: f64,
    /// Place in mm.
    pub point: [f64; 3],
}

impl Tree {
    pub(super) fn new(points: &[Vector], faces: &[[u32; 3]]) -> Self {
        let corners = |face: u32| faces[face as usize].map(|vertex| points[vertex as usize]);
        let middles: Vec<Vector> = (0..faces.len() as u32)
            .map(|face| {
                let [a, b, c] = corners(face);
                plus(plus(a, 1.0, b), 1.0, c)
            })
            .collect();
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        let mut boxes = Vec::with_capacity(faces.len());
        grow(&mut boxes, &mut order, 0, &middles, &corners);
        Self { boxes: boxes.into(), order: order.into() }
    }

    pub(super) fn bounds(&self) -> [Vector; 2] {
        self.boxes.first().map_or([[0.0; 3]; 2], |root| [root.low, root.high])
    }

    pub(super) fn nearest(
        &self,
        mesh: &TriangleMesh,
        place: Vector,
        within: f64,
    ) -> Option<SurfacePoint> {
        let mut best = None;
        let mut least = within * within;
        let mut waiting = [(0u32, 0.0f64); WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (index, gap) = waiting[count];
            if gap > least {
                continue;
            }
            let one = &self.boxes[index as usize];
            if one.faces > 0 {
                for &face in &self.order[one.first as usize..(one.first + one.faces) as usize] {
                    let (point, feature) = closest_on_triangle(mesh.corners(face), place);
                    let way = minus(point, place);
                    let distance = dot(way, way);
                    if distance < least || (best.is_none() && distance <= least) {
                        least = distance;
                        best = Some(SurfacePoint { face, point, feature });
                    }
                }
                continue;
            }
            let [near, far] =
                [index + 1, one.first].map(|child| (child, self.boxes[child as usize].gap(place)));
            let (near, far) = if near.1 <= far.1 { (near, far) } else { (far, near) };
            for child in [far, near] {
                if child.1 <= least && count < WAITING {
                    waiting[count] = child;
                    count += 1;
                }
            }
        }
        best
    }

    /// The first face that a way meets; `is_skipped` leaves faces out.
    pub(super) fn first_hit(
        &self,
        mesh: &TriangleMesh,
        from: Vector,
        to: Vector,
        is_skipped: impl Fn(u32) -> bool,
    ) -> Option<MeshHit> {
        let along = minus(to, from);
        let mut best: Option<(u32, f64)> = None;
        let mut waiting = [0u32; WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let index = waiting[count];
            let one = &self.boxes[index as usize];
            let most = best.map_or(1.0, |(_, share)| share);
            if !one.is_met(from, along, most) {
                continue;
            }
            if one.faces > 0 {
                for &face in &self.order[one.first as usize..(one.first + one.faces) as usize] {
                    if let Some(share) = mesh.meets(face, from, along)
                        && best.is_none_or(|(_, least)| share < least)
                        && !is_skipped(face)
                    {
                        best = Some((face, share));
                    }
                }
                continue;
            }
            for child in [one.first, index + 1] {
                if count < WAITING {
                    waiting[count] = child;
                    count += 1;
                }
            }
        }
        best.map(|(face, share)| MeshHit { face, share, point: plus(from, share, along) })
    }
}

impl TreeBox {
    /// Square of the distance of a place.
    #[inline]
    fn gap(&self, place: Vector) -> f64 {
        let gaps = [0, 1, 2]
            .map(|axis| (self.low[axis] - place[axis]).max(place[axis] - self.high[axis]).max(0.0));
        dot(gaps, gaps)
    }

    /// Whether a way meets it before the share `most`. A box is taken a little larger: roundings must not lose a triangle that
    /// lies in a side of its box.
    #[inline]
    fn is_met(&self, from: Vector, along: Vector, most: f64) -> bool {
        let (mut enter, mut leave) = (0.0f64, most);
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - from[axis], self.high[axis] - from[axis]);
            // A thousand roundings of the largest number here.
            let slack = 1e-13 * (low.abs().max(high.abs()) + from[axis].abs());
            let (low, high) = (low - slack, high + slack);
            if along[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return false;
                }
                continue;
            }
            let (one, other) = (low / along[axis], high / along[axis]);
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        enter <= leave
    }
}

/// Adds the box of the faces of `order`, which are from `first` on in all, and the boxes in it.
fn grow(
    boxes: &mut Vec<TreeBox>,
    order: &mut [u32],
    first: u32,
    middles: &[Vector],
    corners: &impl Fn(u32) -> [Vector; 3],
) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in order.iter().flat_map(|&face| corners(face)) {
        for axis in 0..3 {
            low[axis] = low[axis].min(corner[axis]);
            high[axis] = high[axis].max(corner[axis]);
        }
    }
    let index = boxes.len();
    boxes.push(TreeBox { low, high, first, faces: order.len() as u32 });
    if order.len() <= LEAF {
        return;
    }
    let side = minus(high, low);
    let axis = (0..3).fold(0, |best, axis| if side[axis] > side[best] { axis } else { best });
    let half = order.len() / 2;
    // Faces with equal middles are in the order of their numbers, so that the tree is the same on any machine.
    order.select_nth_unstable_by(half, |&a, &b| {
        middles[a as usize][axis].total_cmp(&middles[b as usize][axis]).then(a.cmp(&b))
    });
    let (left, right) = order.split_at_mut(half);
    grow(boxes, left, first, middles, corners);
    let second = boxes.len() as u32;
    grow(boxes, right, first + half as u32, middles, corners);
    boxes[index].first = second;
    boxes[index].faces = 0;
}
