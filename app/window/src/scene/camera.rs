//! The camera of a scene, and the projection of its points into a picture.
//!
//! Scene: x along columns, y along rows, z up, in mm. Picture: x to the right, y down, in points.

use eframe::egui::{Pos2, Rect, pos2};

/// Angle between the top and the bottom of a picture.
const FIELD_OF_VIEW: f64 = 0.6;
/// Nothing nearer to the eye is drawn, as a share of the distance to what is looked at.
const NEAR: f64 = 0.02;
/// The eye stays above the surface, and off the pole, where left and right would have no meaning.
const ELEVATION: [f64; 2] = [0.08, 1.54];
/// Distance from what is looked at, in lengths of the scene.
const DISTANCE: [f64; 2] = [0.3, 6.0];

/// A position or direction in the scene, in mm.
pub type Vec3 = [f64; 3];

#[must_use]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// From `from`, `length` in a direction.
#[must_use]
pub fn along(from: Vec3, direction: Vec3, length: f64) -> Vec3 {
    [0, 1, 2].map(|axis| from[axis] + length * direction[axis])
}

/// A camera on a sphere around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    target: Vec3,
    /// A length of the scene in mm: the unit of distances.
    size: f64,
    /// Angle about z, 0 with the eye on the side of negative y.
    azimuth: f64,
    /// Angle above the surface.
    elevation: f64,
    /// In lengths of the scene.
    distance: f64,
}

/// A point in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedPoint {
    pub at: Pos2,
    /// Along the line of sight, in mm.
    pub distance: f64,
}

impl Camera {
    /// Looks at the middle of a surface of these lengths in mm.
    #[must_use]
    pub fn of([wide, high]: [f64; 2]) -> Self {
        Self {
            target: [wide / 2.0, high / 2.0, 0.0],
            size: wide.max(high),
            azimuth: 0.5,
            elevation: 0.6,
            distance: 1.9,
        }
    }

    pub fn orbit(&mut self, about: f64, up: f64) {
        self.azimuth = (self.azimuth + about).rem_euclid(std::f64::consts::TAU);
        self.elevation = (self.elevation + up).clamp(ELEVATION[0], ELEVATION[1]);
    }

    /// Comes nearer by a factor above 1, goes away by one below.
    pub fn zoom(&mut self, factor: f64) {
        self.distance = (self.distance / factor).clamp(DISTANCE[0], DISTANCE[1]);
    }

    /// Unit vectors to the right, up in the picture, and away from the eye.
    fn axes(&self) -> [Vec3; 3] {
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        [
            [cos_a, sin_a, 0.0],
            [-sin_a * sin_e, cos_a * sin_e, cos_e],
            [-sin_a * cos_e, cos_a * cos_e, -sin_e],
        ]
    }

    pub fn eye(&self) -> Vec3 {
        let [_, _, away] = self.axes();
        along(self.target, away, -self.distance * self.size)
    }

    /// Unit vectors to the right and away from the eye as seen from above: what keys move along.
    pub fn ground(&self) -> [[f64; 2]; 2] {
        let (sin, cos) = self.azimuth.sin_cos();
        [[cos, sin], [-sin, cos]]
    }

    /// This camera for a picture of a place and size, with what all its points share worked out.
    pub fn lens(&self, picture: Rect) -> Lens {
        let half = f64::from(picture.height()) / 2.0;
        Lens {
            eye: self.eye(),
            axes: self.axes(),
            centre: picture.center(),
            scale: half / (FIELD_OF_VIEW / 2.0).tan(),
            near: NEAR * self.distance * self.size,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Lens {
    eye: Vec3,
    axes: [Vec3; 3],
    centre: Pos2,
    scale: f64,
    near: f64,
}

impl Lens {
    /// Where a point is seen; `None` for one beside or behind the eye.
    pub fn see(&self, point: Vec3) -> Option<ProjectedPoint> {
        let from = along(point, self.eye, -1.0);
        let [right, up, distance] = self.axes.map(|axis| dot(from, axis));
        if distance.is_nan() || distance <= self.near {
            return None;
        }
        let at = pos2(
            self.centre.x + (self.scale * right / distance) as f32,
            self.centre.y - (self.scale * up / distance) as f32,
        );
        Some(ProjectedPoint { at, distance })
    }

    /// How many points of the picture a millimetre across the line of sight takes at a distance in mm.
    pub fn points_per_mm(&self, distance: f64) -> f64 {
        self.scale / distance
    }

    /// The place at height `z` that is seen at a point of the picture; `None` above the horizon.
    pub fn pick(&self, at: Pos2, z: f64) -> Option<[f64; 2]> {
        let right = f64::from(at.x - self.centre.x) / self.scale;
        let up = f64::from(self.centre.y - at.y) / self.scale;
        let [axis_right, axis_up, axis_away] = self.axes;
        let ray = along(along(axis_away, axis_right, right), axis_up, up);
        let length = (z - self.eye[2]) / ray[2];
        let place = along(self.eye, ray, length);
        (length > 0.0 && length.is_finite()).then_some([place[0], place[1]])
    }

    pub fn eye(&self) -> Vec3 {
        self.eye
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::vec2;

    fn picture() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(400.0, 300.0))
    }

    #[test]
    fn what_is_looked_at_is_in_the_middle_and_directions_are_as_they_are_seen() {
        let mut camera = Camera::of([60.0, 40.0]);
        for (about, up) in [(0.0, 0.0), (1.0, 0.3), (3.0, -0.9), (-2.0, 5.0)] {
            camera.orbit(about, up);
            let lens = camera.lens(picture());
            let seen = lens.see([30.0, 20.0, 0.0]).unwrap();
            assert!(seen.at.distance(picture().center()) < 1e-3);
            assert!((seen.distance - 1.9 * 60.0).abs() < 1e-9);
            let above = lens.see([30.0, 20.0, 1.0]).unwrap().at;
            assert!(above.y < seen.at.y && (above.x - seen.at.x).abs() < 1e-3);
            let [right, away] = camera.ground();
            let beside = lens.see([30.0 + right[0], 20.0 + right[1], 0.0]).unwrap();
            assert!(beside.at.x > seen.at.x && (beside.distance - seen.distance).abs() < 1e-9);
            let behind = lens.see([30.0 + away[0], 20.0 + away[1], 0.0]).unwrap();
            assert!(behind.distance > seen.distance && behind.at.y < seen.at.y);
        }
    }

    #[test]
    fn a_known_camera_sees_known_points() {
        // From straight in front at an elevation of 45 degrees, 100 mm away, a millimetre across is
        // scale / 100 points.
        let camera = Camera {
            target: [0.0; 3],
            size: 50.0,
            azimuth: 0.0,
            elevation: std::f64::consts::FRAC_PI_4,
            distance: 2.0,
        };
        let half = 100.0 * std::f64::consts::FRAC_1_SQRT_2;
        for (part, wanted) in camera.eye().into_iter().zip([0.0, -half, half]) {
            assert!((part - wanted).abs() < 1e-9, "{part} {wanted}");
        }
        let lens = camera.lens(picture());
        let scale = 150.0 / 0.3_f64.tan();
        let seen = lens.see([7.0, 0.0, 0.0]).unwrap();
        assert!((f64::from(seen.at.x - 210.0) - scale * 0.07).abs() < 1e-3);
        assert!((seen.at.y - 170.0).abs() < 1e-3);
        // Twice as far away, half as large.
        let seen = lens.see([7.0, half, -half]).unwrap();
        assert!((seen.distance - 200.0).abs() < 1e-9);
        assert!((f64::from(seen.at.x - 210.0) - scale * 0.035).abs() < 1e-3);
        assert!((lens.points_per_mm(200.0) - scale / 200.0).abs() < 1e-9);
        assert_eq!(lens.see(camera.eye()), None);
        assert_eq!(lens.see([0.0, -half - 10.0, half + 10.0]), None);
        assert_eq!(lens.see([f64::NAN, 0.0, 0.0]), None);
    }

    #[test]
    fn a_picked_place_is_seen_where_it_was_picked() {
        let mut camera = Camera::of([60.0, 60.0]);
        camera.orbit(2.0, -0.2);
        camera.zoom(1.4);
        let lens = camera.lens(picture());
        for (at, z) in
            [(pos2(100.0, 200.0), 0.0), (pos2(300.0, 150.0), -4.0), (pos2(210.0, 300.0), 2.0)]
        {
            let [x, y] = lens.pick(at, z).unwrap();
            assert!(lens.see([x, y, z]).unwrap().at.distance(at) < 1e-2);
        }
        camera.orbit(0.0, -3.0);
        // Just above the surface the upper part of the picture is sky.
        assert_eq!(camera.lens(picture()).pick(pos2(210.0, 25.0), 0.0), None);
    }

    #[test]
    fn the_eye_stays_above_the_surface_and_within_its_distances() {
        let mut camera = Camera::of([60.0, 60.0]);
        for (up, factor) in [(-9.0, 1e9), (9.0, 1e-9)] {
            camera.orbit(1.0, up);
            camera.zoom(factor);
            assert!(camera.eye()[2] > 0.0);
            assert!((ELEVATION[0]..=ELEVATION[1]).contains(&camera.elevation));
            assert!((DISTANCE[0]..=DISTANCE[1]).contains(&camera.distance));
        }
    }
}
