//! The surface contact point: it follows the device in free space and stays on the surface while the
//! device is below it (Zilles & Salisbury, "A constraint-based god-object method for haptic display",
//! IROS 1995; friction cone: Harwin & Melder, "Improved haptic rendering for multi-finger manipulation
//! using friction cone based god-objects", Eurohaptics 2002).
//!
//! Which surface: the one at rest, or one published before the tool moved it. The surface of the same
//! tick has followed the tool already; below it there is no depth, so no force.
//!
//! A height field has no other side to come out of: however fast the device, below is below. Along a
//! straight poke depth grows while the contact point holds or the surface is plane; over a curved one the
//! normal turns with a sliding point, and depth with it.

use super::heights::Heights;
use crate::{SettingError, SettingRange};

/// Projections in a tick: as many as there are constraints on a point in space.
const ROUNDS: usize = 3;
/// Projections end where the next moves less than this, in mm: far below any device's resolution.
const STILL_MM: f64 = 1e-9;
/// Halvings of a device's way through the surface: of a metre, 1e-9 mm are left.
const HALVINGS: usize = 40;
/// Most friction: beyond, a contact point practically sticks.
pub(crate) const FRICTION_MOST: f64 = 10.0;

/// A contact point and how it moves.
#[derive(Clone, Debug)]
pub struct Proxy {
    friction: f64,
    /// Where the contact point is along x and y, while it touches.
    at: Option<[f64; 2]>,
    /// Where the device was, if it was somewhere.
    last: Option<[f64; 3]>,
}

/// Whether there is a contact, and why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchState {
    /// The device is above the surface.
    Free,
    /// The contact point holds.
    Sticks,
    /// The contact point slides.
    Slides,
    /// The device is outside the mesh.
    Outside,
    /// The device's place is no number: nothing changed.
    NotANumber,
}

/// Contact of a device with the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProxyTouch {
    /// Whether, and why not.
    pub state: TouchState,
    /// The contact point in mm; without contact where the device is.
    pub point: [f64; 3],
    /// How deep the device is below the contact point along its normal, in mm; 0 without contact.
    pub depth: f64,
    /// True unit normal of the surface at the contact point.
    pub normal: [f64; 3],
    /// The way from the device to the contact point without its part along the normal, in mm.
    pub aside: [f64; 3],
}

impl ProxyTouch {
    /// Whether the device touches.
    pub fn is_contact(&self) -> bool {
        matches!(self.state, TouchState::Sticks | TouchState::Slides)
    }

    /// Force on the device where the model gives `newtons` at this depth: along the normal, and across
    /// it what friction gives, which is in proportion to how far aside the contact point is held.
    pub fn force(&self, newtons: f64) -> [f64; 3] {
        if self.depth <= 0.0 || !newtons.is_finite() {
            return [0.0; 3];
        }
        [0, 1, 2].map(|axis| newtons * (self.normal[axis] + self.aside[axis] / self.depth))
    }

    fn without(state: TouchState, point: [f64; 3]) -> Self {
        Self { state, point, depth: 0.0, normal: [0.0, 0.0, 1.0], aside: [0.0; 3] }
    }
}

impl Proxy {
    /// With a friction coefficient.
    pub fn new(friction: f64) -> Result<Self, SettingError> {
        let settings = [("friction coefficient", friction, "")];
        SettingRange::UpTo(FRICTION_MOST).check("a contact point", &settings)?;
        Ok(Self { friction, at: None, last: None })
    }

    /// One tick: the device is at `device` (mm).
    pub fn follow(&mut self, surface: Heights, device: [f64; 3]) -> ProxyTouch {
        if !device.iter().all(|part| part.is_finite()) {
            let at = self.last.unwrap_or_default();
            return ProxyTouch::without(TouchState::NotANumber, at);
        }
        let [x, y, z] = device;
        let below = surface.at(x, y).map(|(height, _)| z < height);
        let last = self.last.replace(device);
        let state = match below {
            Some(true) => None,
            Some(false) => Some(TouchState::Free),
            None => Some(TouchState::Outside),
        };
        if let Some(state) = state {
            self.at = None;
            return ProxyTouch::without(state, device);
        }
        let from = self.at.unwrap_or_else(|| entry(surface, last, device));
        let (at, slides) = self.moved(surface, from, device);
        self.at = Some(at);
        touch(surface, at, device, slides).unwrap_or_else(|| {
            // Below the surface and yet not under the plane of the contact point, as behind a ridge:
            // the contact starts again above the device.
            self.at = Some([x, y]);
            touch(surface, [x, y], device, true)
                .unwrap_or(ProxyTouch::without(TouchState::Free, device))
        })
    }

    /// Where the contact point goes from `from`, and whether it slides.
    fn moved(&self, surface: Heights, from: [f64; 2], device: [f64; 3]) -> ([f64; 2], bool) {
        let goal = goal(surface, from, device);
        let (Some((start, _)), Some((end, normal))) =
            (surface_point(surface, from), surface_point(surface, goal))
        else {
            return (from, false);
        };
        let depth = dot(difference(end, device), normal).max(0.0);
        let way = difference(start, end);
        let length = dot(way, way).sqrt();
        // The contact point stays while it is within the cone of friction around the goal.
        let held = self.friction * depth;
        if length <= held {
            return (from, false);
        }
        let share = held / length;
        ([0, 1].map(|axis| goal[axis] + share * (from[axis] - goal[axis])), true)
    }
}

/// Where a device on its way down came through the surface; straight above it if that is not known.
fn entry(surface: Heights, last: Option<[f64; 3]>, device: [f64; 3]) -> [f64; 2] {
    let straight = [device[0], device[1]];
    let Some(last) = last else {
        return straight;
    };
    let way = difference(device, last);
    let along = |share: f64| [0, 1, 2].map(|axis| last[axis] + share * way[axis]);
    let is_below = |share: f64| {
        let [x, y, z] = along(share);
        surface.at(x, y).is_some_and(|(height, _)| z < height)
    };
    let (mut above, mut below) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (above + below);
        if is_below(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    let [x, y, _] = along(below);
    if surface.at(x, y).is_some() { [x, y] } else { straight }
}

/// The point of the surface that the contact would go to without friction: the device projected onto
/// the tangent plane, put on the surface, and again.
fn goal(surface: Heights, from: [f64; 2], device: [f64; 3]) -> [f64; 2] {
    let [wide, high] = surface.grid().extent();
    let mut at = from;
    for _ in 0..ROUNDS {
        let Some((point, normal)) = surface_point(surface, at) else {
            return at;
        };
        let depth = dot(difference(point, device), normal);
        let next = [
            (device[0] + depth * normal[0]).clamp(0.0, wide),
            (device[1] + depth * normal[1]).clamp(0.0, high),
        ];
        let step = (next[0] - at[0]).hypot(next[1] - at[1]);
        at = next;
        if step < STILL_MM {
            break;
        }
    }
    at
}

/// The contact at a place, if the device is under its plane.
fn touch(surface: Heights, at: [f64; 2], device: [f64; 3], slides: bool) -> Option<ProxyTouch> {
    let (point, normal) = surface_point(surface, at)?;
    let way = difference(point, device);
    let depth = dot(way, normal);
    (depth > 0.0).then(|| ProxyTouch {
        state: if slides { TouchState::Slides } else { TouchState::Sticks },
        point,
        depth,
        normal,
        aside: [0, 1, 2].map(|axis| way[axis] - depth * normal[axis]),
    })
}

fn surface_point(surface: Heights, [x, y]: [f64; 2]) -> Option<([f64; 3], [f64; 3])> {
    let (z, normal) = surface.at(x, y)?;
    Some(([x, y, z], normal))
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
