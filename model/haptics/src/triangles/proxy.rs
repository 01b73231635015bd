//! The contact point on triangles: free above the surface, on it while the device is below.
//!
//! The point with the least distance to the device that can be reached along the surface from where the point was (Zilles & Salisbury,
//! "A constraint-based god-object method for haptic display", IROS 1995; Ruspini, Kolarov & Khatib, "The haptic display of complex
//! graphical environments", SIGGRAPH 1997). It goes from triangle to triangle, each time to the point of the triangle that is nearest,
//! and over an edge only where that brings it nearer. So two or three triangles hold it in an edge or a corner without
//! a system of equations, a point on the surface is never inside, and however thin a part is, the way to its other side
//! is around its rim. In the air the way from the last point to the device is searched for a first triangle, so nothing is jumped over.
//!
//! Flat shading is exact: the force is along the way from device to contact point, and with a force that depends on depth alone it
//! has a potential. Smooth shading moves the point on until the interpolated normal there goes through the device, so that neither point nor normal jumps where triangles meet (force shading: Morgenbesser & Srinivasan, "Force shading for haptic
//! shape perception", ASME DSC 58 (1996) 407-412).

use super::mesh::{OPEN, SurfacePoint, TriangleMesh};
use super::triangle::{TriangleFeature, closest_on_triangle};
use super::vector::{Vector, dot, is_finite, length, minus, plus, unit};
use crate::surface::{FRICTION_MOST, ProxyTouch, TouchState};
use crate::{SettingError, SettingRange};

/// Distances above the surface are known up to this, in mm: the stroke of the force law, which takes all beyond as its end.
pub const FAR_MM: f64 = 30.0;
/// Triangles crossed in a tick: at 0.5 mm each 2 m, further than a hand goes in a tick of 0.1 s. A longer way goes on in the next tick.
const MOST_STEPS: usize = 4096;
/// Surfaces that a device may leave and reach in one tick.
const ROUNDS: usize = 4;
/// Steps to the place of the interpolated normal. Five to ten are usual, up to twenty near the centre of an uneven bend.
const SHADING_STEPS: usize = 24;
/// A step that leaves less than this share of the miss is as good as its length can be; the next estimate would be of roundings.
const DONE_SHARE: f64 = 0.01;
/// Bounds of a step's length as a share of the way to the foot: a dome needs `1 / (1 - depth / radius)` of it, which is 40 at 0.975,
/// a hollow half of it or more.
const GAINS: [f64; 2] = [0.1, 40.0];
/// They end where the next is less than this, in mm, and a device that is no further from the surface is on it: far below any device's
/// resolution, and some thousand roundings of a coordinate of 1000 mm.
const STILL_MM: f64 = 1e-9;

palpate_model::named! {
    /// Which normal the force follows.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Shading {
        /// Interpolated between the triangles: edges of less than 45 degrees are not felt.
        #[default]
        Smooth = "smooth",
        /// That of the triangle: edges are felt, and no force makes energy.
        Flat = "flat",
    }
}

/// A contact point on a mesh and how it moves.
#[derive(Clone, Debug)]
pub struct MeshProxy {
    friction: f64,
    shading: Shading,
    /// Where it is on the surface, and on which side: 1 in front, -1 behind an open part.
    at: Option<(SurfacePoint, f64)>,
    last: Option<Vector>,
    /// [`MeshTouch::below`] of the last tick.
    below: f64,
}

/// Contact of a device with a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshTouch {
    /// The contact as a force law takes it.
    pub touch: ProxyTouch,
    /// Where on the mesh; the nearest point without contact, `None` further away than [`FAR_MM`].
    pub on: Option<SurfacePoint>,
    /// Depth in mm along the normal; without contact the distance to the surface below zero, -[`FAR_MM`] beyond that.
    pub below: f64,
    /// 1 in front of the surface; -1 behind an open part.
    pub side: f64,
}

impl MeshProxy {
    /// With a friction coefficient, from 0 to 10.
    pub fn new(friction: f64, shading: Shading) -> Result<Self, SettingError> {
        let settings = [("friction coefficient", friction, "")];
        SettingRange::UpTo(FRICTION_MOST).check("a contact point", &settings)?;
        Ok(Self { friction, shading, at: None, last: None, below: 0.0 })
    }

    /// One tick: the device is at `device` (mm).
    pub fn follow(&mut self, mesh: &TriangleMesh, device: [f64; 3]) -> MeshTouch {
        if !is_finite(device) {
            let at = self.last.unwrap_or_default();
            return without(TouchState::NotANumber, at, None, self.below);
        }
        let last = self.last.replace(device);
        let held = match self.at.take() {
            Some((at, side)) => self.held(mesh, at, side, device),
            None => self.reached(mesh, last, device),
        };
        let contact = match held {
            Some((goal, _, side))
                if is_level(&goal, device) && is_left(mesh, &goal, side, device) =>
            {
                self.level(goal, side, device)
            }
            Some((goal, from, side)) => self.touched(mesh, goal, from, side, device),
            None => self.free(mesh, last, device),
        };
        self.below = contact.below;
        contact
    }

    /// From a contact: where its point goes, from where, and on which side; `None` in the air.
    fn held(
        &self,
        mesh: &TriangleMesh,
        at: SurfacePoint,
        side: f64,
        device: Vector,
    ) -> Option<(SurfacePoint, SurfacePoint, f64)> {
        let (mut at, mut side) = (at, side);
        for _ in 0..ROUNDS {
            let goal = descend(mesh, at.face, device);
            if !is_left(mesh, &goal, side, device) || is_level(&goal, device) {
                return Some((goal, at, side));
            }
            let hit =
                mesh.tree.first_hit(mesh, goal.point, device, |face| touches(mesh, &goal, face))?;
            side = side_of(mesh, hit.face, minus(device, goal.point));
            at =
                SurfacePoint { face: hit.face, point: hit.point, feature: TriangleFeature::Inside };
        }
        // Between surfaces nearer than roundings: it stays where it came to.
        Some((at, at, side))
    }

    /// From the air: the surface that the device came through.
    fn reached(
        &self,
        mesh: &TriangleMesh,
        last: Option<Vector>,
        device: Vector,
    ) -> Option<(SurfacePoint, SurfacePoint, f64)> {
        let way = last.map_or(0.0, |last| length(minus(device, last)));
        // A shorter way than to the nearest surface meets none; a millionth less, since the distance is rounded.
        let clearance = (1.0 - 1e-6) * -self.below;
        if let Some(last) = last
            && way >= clearance
            && let Some(hit) = mesh.first_hit(last, device)
        {
            let side = side_of(mesh, hit.face, minus(device, last));
            let at =
                SurfacePoint { face: hit.face, point: hit.point, feature: TriangleFeature::Inside };
            return self.held(mesh, at, side, device);
        }
        None
    }

    /// Without contact, unless the device is inside: it began there, or came through a place that is one rounding wide.
    fn free(&mut self, mesh: &TriangleMesh, last: Option<Vector>, device: Vector) -> MeshTouch {
        let Some(nearest) = mesh.nearest(device, FAR_MM) else {
            return without(TouchState::Free, device, None, -FAR_MM);
        };
        if mesh.is_closed[nearest.face as usize] && !mesh.is_outside(&nearest, device) {
            return self.touched(mesh, nearest, nearest, 1.0, device);
        }
        if is_level(&nearest, device) {
            let along = last.map_or([0.0; 3], |last| minus(device, last));
            return self.level(nearest, side_of(mesh, nearest.face, along), device);
        }
        let distance = length(minus(device, nearest.point));
        without(TouchState::Free, device, Some(nearest), -distance)
    }

    /// On the surface itself there is no depth and no contact, but the side is known: of a way that begins on an open part, its hit
    /// does not say from where it comes.
    fn level(&mut self, at: SurfacePoint, side: f64, device: Vector) -> MeshTouch {
        self.at = Some((at, side));
        let distance = length(minus(device, at.point));
        MeshTouch { side, ..without(TouchState::Free, device, Some(at), -distance) }
    }

    fn touched(
        &mut self,
        mesh: &TriangleMesh,
        goal: SurfacePoint,
        from: SurfacePoint,
        side: f64,
        device: Vector,
    ) -> MeshTouch {
        let (goal, normal) = match self.shading {
            Shading::Smooth => shaded(mesh, goal, side, device),
            Shading::Flat => (goal, flat_normal(mesh, &goal, side, device)),
        };
        let depth = dot(minus(goal.point, device), normal).max(0.0);
        let way = minus(from.point, goal.point);
        let across = plus(way, -dot(way, normal), normal);
        let (far, held) = (length(way), self.friction * depth);
        let is_still = far <= held;
        let (at, share) = if is_still {
            (from, 1.0)
        } else if held > 0.0 {
            let share = held / far;
            (descend(mesh, goal.face, plus(goal.point, share, way)), share)
        } else {
            (goal, 0.0)
        };
        self.at = Some((at, side));
        MeshTouch {
            touch: ProxyTouch {
                state: if is_still && self.friction > 0.0 {
                    TouchState::Sticks
                } else {
                    TouchState::Slides
                },
                point: at.point,
                depth,
                normal,
                aside: across.map(|part| share * part),
            },
            on: Some(at),
            below: depth,
            side,
        }
    }
}

fn without(state: TouchState, point: Vector, on: Option<SurfacePoint>, below: f64) -> MeshTouch {
    let touch = ProxyTouch { state, point, depth: 0.0, normal: [0.0, 0.0, 1.0], aside: [0.0; 3] };
    MeshTouch { touch, on, below, side: 1.0 }
}

/// The point with the least distance to `target` that a path from a triangle reaches on which the distance only falls.
fn descend(mesh: &TriangleMesh, face: u32, target: Vector) -> SurfacePoint {
    let on = |face: u32| {
        let (point, feature) = closest_on_triangle(mesh.corners(face), target);
        let way = minus(point, target);
        (SurfacePoint { face, point, feature }, dot(way, way))
    };
    let (mut at, mut least) = on(face);
    for _ in 0..MOST_STEPS {
        let mut best = (at, least);
        let mut look = |face: u32| {
            let one = on(face);
            if one.1 < best.1 {
                best = one;
            }
        };
        match at.feature {
            TriangleFeature::Inside => return at,
            TriangleFeature::Edge(edge) => {
                let other = mesh.neighbours[at.face as usize][usize::from(edge)];
                if other != OPEN {
                    look(other);
                }
            }
            TriangleFeature::Corner(corner) => {
                let vertex = mesh.faces[at.face as usize][usize::from(corner)];
                mesh.faces_around(vertex).iter().copied().for_each(look);
            }
        }
        if best.1 >= least {
            return at;
        }
        (at, least) = best;
    }
    at
}

/// Whether the device is on the free side of a point of the surface, or beyond its rim.
fn is_left(mesh: &TriangleMesh, at: &SurfacePoint, side: f64, device: Vector) -> bool {
    if side * dot(minus(device, at.point), mesh.normal_for_sign(at)) >= 0.0 {
        return true;
    }
    // The nearest point is on the rim only where the device is beyond it.
    match at.feature {
        TriangleFeature::Inside => false,
        TriangleFeature::Edge(edge) => mesh.neighbours[at.face as usize][usize::from(edge)] == OPEN,
        TriangleFeature::Corner(corner) => {
            mesh.is_at_open_edge[mesh.faces[at.face as usize][usize::from(corner)] as usize]
        }
    }
}

/// Whether the device is on the surface, as far as roundings let it be known.
fn is_level(at: &SurfacePoint, device: Vector) -> bool {
    length(minus(device, at.point)) <= STILL_MM
}

/// Whether a face has the part of the surface that a point is on; a way from there meets it nowhere else.
fn touches(mesh: &TriangleMesh, at: &SurfacePoint, face: u32) -> bool {
    let corners = mesh.faces[at.face as usize];
    let other = mesh.faces[face as usize];
    match at.feature {
        TriangleFeature::Inside => face == at.face,
        TriangleFeature::Edge(edge) => {
            let edge = usize::from(edge);
            other.contains(&corners[edge]) && other.contains(&corners[(edge + 1) % 3])
        }
        TriangleFeature::Corner(corner) => other.contains(&corners[usize::from(corner)]),
    }
}

/// From which side a way comes to a face; one along the face counts as from the front.
fn side_of(mesh: &TriangleMesh, face: u32, along: Vector) -> f64 {
    if dot(along, mesh.face_normals[face as usize]) > 0.0 { -1.0 } else { 1.0 }
}

/// From the device to the contact point; the normal of the surface where they are one.
fn flat_normal(mesh: &TriangleMesh, at: &SurfacePoint, side: f64, device: Vector) -> Vector {
    if at.feature == TriangleFeature::Inside {
        return mesh.face_normals[at.face as usize].map(|part| side * part);
    }
    let way = minus(at.point, device);
    let normal = mesh.normal_for_sign(at);
    let normal =
        unit(normal).unwrap_or(mesh.face_normals[at.face as usize]).map(|part| side * part);
    // Below a nanometre the direction is one of roundings.
    if length(way) > STILL_MM { unit(way).unwrap_or(normal) } else { normal }
}

/// The point near `from` whose interpolated normal goes through the device, and that normal.
///
/// Steps go to the foot of the device on the plane of the normal; how far is from the steps before (Barzilai & Borwein, "Two-point step
/// size gradient methods", IMA J. Numer. Anal. 8 (1988) 141-148), since a hollow needs less than the whole step and a dome more.
fn shaded(
    mesh: &TriangleMesh,
    from: SurfacePoint,
    side: f64,
    device: Vector,
) -> (SurfacePoint, Vector) {
    let miss = |at: &SurfacePoint| {
        let normal = mesh.shaded_normal(at.face, at.point).map(|part| side * part);
        let way = minus(device, at.point);
        (normal, plus(way, -dot(way, normal), normal))
    };
    // The place is no further from the nearest point than the device is. So no step walks further, and a place in the middle of a bend,
    // to which no normal leads, costs a walk around it and not one over the whole mesh.
    let depth = length(minus(from.point, device));
    let mut at = from;
    let (normal, mut off) = miss(&at);
    let mut best = (at, normal, length(off));
    let mut gain = 1.0;
    for _ in 0..SHADING_STEPS {
        if best.2 <= STILL_MM {
            break;
        }
        let next = descend(mesh, at.face, within(plus(at.point, gain, off), from.point, depth));
        let (next_normal, next_off) = miss(&next);
        let along = dot(off, minus(off, next_off));
        let (was, is) = (dot(off, off), dot(next_off, next_off));
        if is > DONE_SHARE * DONE_SHARE * was {
            let [least, most] = GAINS;
            gain = if along > 0.0 {
                (gain * was / along).clamp(least, most)
            } else {
                0.5 * gain.min(1.0)
            };
        }
        (at, off) = (next, next_off);
        if length(off) < best.2 {
            best = (at, next_normal, length(off));
        }
    }
    // It may not be led away over a fold, nor to where the device is above the plane.
    let is_near = length(minus(best.0.point, from.point)) <= depth;
    let is_under = dot(minus(best.0.point, device), best.1) > 0.0;
    if is_near && is_under {
        return (best.0, best.1);
    }
    (from, miss(&from).0)
}

/// The point itself, or the one on the way to it that is `reach` from `middle`.
fn within(point: Vector, middle: Vector, reach: f64) -> Vector {
    let way = minus(point, middle);
    let far = length(way);
    if far > reach { plus(middle, reach / far, way) } else { point }
}
