//! The probe: a tip of its true radius on a shaft, as triangles.

use crate::camera::{Vec3, along, dot};
use thiserror::Error;

/// Triangles around the axis: the polygon is within 0.0006 of the radius of its circle, less than a tenth of a pixel for
/// a tip of 150 pixels.
const AROUND: u32 = 96;
/// Rings of the tip from its lowest point to the shaft.
const RINGS: u32 = 48;
/// Length of the shaft that is drawn, in lengths of the scene.
const SHAFT: f64 = 0.9;
/// Radius of the shaft of a steel probe in radii of its tip, and of the handle above it, and where that begins.
const SHAFT_SHARE: f64 = 0.5;
const HANDLE_SHARE: f64 = 0.86;
const HANDLE_AT: f64 = 0.42;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProbeKind {
    /// A polished ball on a shaft.
    #[default]
    Steel,
    /// A finger in a glove: as thick as its tip.
    Glove,
}

/// A probe that cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ProbeError {
    #[error("a tip radius of {0} mm cannot be drawn: it is positive and finite")]
    Radius(f64),
    #[error("the position of the probe is not finite")]
    Place,
    #[error("the direction of the shaft has no length")]
    Axis,
    #[error("the normal of the tissue below the probe has no length")]
    Ground,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    pub(crate) centre: Vec3,
    pub(crate) radius: f64,
    pub(crate) axis: Vec3,
    pub(crate) kind: ProbeKind,
    /// A point of the tissue near the tip and the unit normal there; `None` where the picture knows it by itself or there is none.
    pub(crate) ground: Option<(Vec3, Vec3)>,
}

impl Probe {
    /// A probe whose tip is a sphere of `radius_mm` around `centre`, upright, of steel.
    pub fn new(centre: Vec3, radius_mm: f64) -> Result<Self, ProbeError> {
        if !(radius_mm.is_finite() && radius_mm > 0.0) {
            return Err(ProbeError::Radius(radius_mm));
        }
        if centre.iter().any(|part| !part.is_finite()) {
            return Err(ProbeError::Place);
        }
        let axis = [0.0, 0.0, 1.0];
        Ok(Self { centre, radius: radius_mm, axis, kind: ProbeKind::Steel, ground: None })
    }

    /// The same whose lowest point along the axis is at `tip`, in mm.
    pub fn with_tip_at(mut self, tip: Vec3) -> Result<Self, ProbeError> {
        if tip.iter().any(|part| !part.is_finite()) {
            return Err(ProbeError::Place);
        }
        self.centre = along(tip, self.axis, self.radius);
        Ok(self)
    }

    /// The same with a direction from the tip up the shaft, of any length.
    pub fn with_axis(mut self, axis: Vec3) -> Result<Self, ProbeError> {
        let length = dot(axis, axis).sqrt();
        if !(length.is_finite() && length > 0.0) {
            return Err(ProbeError::Axis);
        }
        self.axis = axis.map(|part| part / length);
        Ok(self)
    }

    /// The same above a mesh that is at `point`, in mm, with a normal of any length: what a polished tip mirrors.
    /// Over a field of heights it changes nothing.
    pub fn above(mut self, point: Vec3, normal: Vec3) -> Result<Self, ProbeError> {
        let length = dot(normal, normal).sqrt();
        if !(length.is_finite() && length > 0.0) {
            return Err(ProbeError::Ground);
        }
        if point.iter().any(|part| !part.is_finite()) {
            return Err(ProbeError::Place);
        }
        self.ground = Some((point, normal.map(|part| part / length)));
        Ok(self)
    }

    #[must_use]
    pub fn of_kind(mut self, kind: ProbeKind) -> Self {
        self.kind = kind;
        self
    }

    /// Radius of the shaft in mm.
    pub(crate) fn shaft_mm(&self) -> f64 {
        match self.kind {
            ProbeKind::Steel => SHAFT_SHARE * self.radius,
            ProbeKind::Glove => self.radius,
        }
    }

    /// Length of the shaft from the centre of the tip in mm, in a scene of this size.
    pub(crate) fn length_mm(&self, scene_mm: f64) -> f64 {
        (SHAFT * scene_mm).max(4.0 * self.radius)
    }

    /// Places and unit normals around z, the centre of the tip at the origin, and the triangles between them.
    pub(crate) fn triangles(&self, scene_mm: f64) -> (Vec<[f32; 6]>, Vec<u32>) {
        let profile = self.profile(self.length_mm(scene_mm));
        let mut nodes = Vec::with_capacity(profile.len() * (AROUND + 1) as usize);
        for [radius, height, outward, upward] in &profile {
            for step in 0..=AROUND {
                let angle = std::f64::consts::TAU * f64::from(step) / f64::from(AROUND);
                let (sin, cos) = angle.sin_cos();
                let node =
                    [radius * cos, radius * sin, *height, outward * cos, outward * sin, *upward];
                nodes.push(node.map(|number| number as f32));
            }
        }
        let mut indices = Vec::new();
        for ring in 0..profile.len() as u32 - 1 {
            for step in 0..AROUND {
                let first = ring * (AROUND + 1) + step;
                let above = first + AROUND + 1;
                indices.extend([first, first + 1, above + 1, first, above + 1, above]);
            }
        }
        (nodes, indices)
    }

    /// From the lowest point up: radius, height, and the normal outward and upward.
    fn profile(&self, length: f64) -> Vec<[f64; 4]> {
        let (tip, shaft) = (self.radius, self.shaft_mm());
        // Where the sphere is as wide as the shaft, from its lowest point.
        let end = std::f64::consts::PI - (shaft / tip).min(1.0).asin();
        let mut profile: Vec<[f64; 4]> = (0..=RINGS)
            .map(|ring| {
                let (sin, cos) = (end * f64::from(ring) / f64::from(RINGS)).sin_cos();
                [tip * sin, -tip * cos, sin, -cos]
            })
            .collect();
        let neck = -tip * end.cos();
        let mut tube = |radius: f64, [low, high]: [f64; 2]| {
            profile.extend([[radius, low, 1.0, 0.0], [radius, high, 1.0, 0.0]]);
        };
        match self.kind {
            ProbeKind::Glove => tube(shaft, [neck, length]),
            ProbeKind::Steel => {
                let (handle, start) = (HANDLE_SHARE * tip, HANDLE_AT * length);
                tube(shaft, [neck, start]);
                let slant = handle - shaft;
                let normal = std::f64::consts::FRAC_1_SQRT_2;
                profile.extend([
                    [shaft, start, normal, -normal],
                    [handle, start + slant, normal, -normal],
                    [handle, start + slant, 1.0, 0.0],
                    [handle, length, 1.0, 0.0],
                ]);
            }
        }
        let top = profile[profile.len() - 1][0];
        profile.extend([[top, length, 0.0, 1.0], [0.0, length, 0.0, 1.0]]);
        profile
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tip_has_its_true_radius_and_its_normals_point_outward() {
        let probe = Probe::new([0.0; 3], 2.5).unwrap();
        let (nodes, indices) = probe.triangles(60.0);
        let tip = (RINGS * (AROUND + 1)) as usize;
        for node in &nodes[..tip] {
            let [x, y, z, u, v, w] = node.map(f64::from);
            // Rounding to single precision.
            assert!(((x * x + y * y + z * z).sqrt() - 2.5).abs() < 1e-6);
            assert!((x * u + y * v + z * w - 2.5).abs() < 1e-6);
        }
        assert!(indices.iter().all(|&index| (index as usize) < nodes.len()));
    }

    #[test]
    fn a_tip_stands_where_it_touches() {
        let probe = Probe::new([0.0; 3], 2.0).unwrap().with_axis([0.0, 3.0, 4.0]).unwrap();
        let probe = probe.with_tip_at([1.0, 1.0, 1.0]).unwrap();
        for (part, wanted) in probe.centre.into_iter().zip([1.0, 2.2, 2.6]) {
            assert!((part - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn no_number_is_refused() {
        assert!(matches!(Probe::new([0.0; 3], f64::NAN), Err(ProbeError::Radius(_))));
        assert_eq!(Probe::new([f64::NAN; 3], 1.0), Err(ProbeError::Place));
        let probe = Probe::new([0.0; 3], 1.0).unwrap();
        assert_eq!(probe.with_axis([0.0; 3]), Err(ProbeError::Axis));
        assert_eq!(probe.above([0.0; 3], [0.0; 3]), Err(ProbeError::Ground));
        assert_eq!(probe.above([f64::NAN; 3], [0.0, 0.0, 1.0]), Err(ProbeError::Place));
        assert_eq!(probe.with_tip_at([f64::INFINITY; 3]), Err(ProbeError::Place));
    }
}
