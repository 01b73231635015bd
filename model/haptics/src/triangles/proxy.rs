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
/// Steps to the place of the interpolated normal. Each leaves a share of depth over radius of the last, or less.
const SHADING_STEPS: usize = 24;
/// They end where the next is less than this, in mm: far below any device's resolution.
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
            Some((goal, from, side)) => self.touched(mesh, goal, from, side, device),
            None => self.free(mesh, device),
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
            if !is_left(mesh, &goal, side, device) {
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
    fn free(&mut self, mesh: &TriangleMesh, device: Vector) -> MeshTouch {
        let Some(nearest) = mesh.nearest(device, FAR_MM) else {
            return without(TouchState::Free, device, None, -FAR_MM);
        };
        if mesh.is_closed[nearest.face as usize] && !mesh.is_outside(&nearest, device) {
            return self.touched(mesh, nearest, nearest, 1.0, device);
        }
        let distance = length(minus(device, nearest.point));
        without(TouchState::Free, device, Some(nearest), -distance)
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

/// From which side a way comes to a face.
fn side_of(mesh: &TriangleMesh, face: u32, along: Vector) -> f64 {
    if dot(along, mesh.face_normals[face as usize]) < 0.0 { 1.0 } else { -1.0 }
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
    let mut at = from;
    let (normal, mut off) = miss(&at);
    let mut best = (at, normal, length(off));
    let mut gain = 1.0;
    for _ in 0..SHADING_STEPS {
        if best.2 <= STILL_MM {
            break;
        }
        let next = descend(mesh, at.face, plus(at.point, gain, off));
        let (next_normal, next_off) = miss(&next);
        let change = minus(off, next_off);
        let along = dot(off, change);
        // A step that takes most of the way off is kept: over edges the next estimate would be of two triangles.
        if dot(next_off, next_off) > 0.25 * dot(off, off) {
            gain = if along > 0.0 {
                (gain * dot(off, off) / along).clamp(0.1, 4.0)
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
    let depth = length(minus(from.point, device));
    let is_near = length(minus(best.0.point, from.point)) <= depth;
    let is_under = dot(minus(best.0.point, device), best.1) > 0.0;
    if is_near && is_under {
        return (best.0, best.1);
    }
    (from, miss(&from).0)
}
