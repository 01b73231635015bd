//! Where points of a scene are in a picture on the screen, and what is under the pointer.
//!
//! Scene: x along columns, y along rows, z up, in mm. Screen: x to the right, y down, in points.

use eframe::egui::{Pos2, Rect, pos2};
use palpate_tissue_view::{Camera, Eye, FIELD_OF_VIEW, Vec3};

/// From `from`, `length` in a direction.
#[must_use]
pub fn along(from: Vec3, direction: Vec3, length: f64) -> Vec3 {
    [0, 1, 2].map(|axis| from[axis] + length * direction[axis])
}

/// A point on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPoint {
    pub at: Pos2,
    /// Along the line of sight, in mm.
    pub distance: f64,
}

/// What one eye sees of a scene, and where on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    pub camera: Camera,
    pub eye: Eye,
    pub rect: Rect,
}

impl Lens {
    /// Of the only picture.
    #[must_use]
    pub fn single(camera: Camera, rect: Rect) -> Self {
        Self { camera, eye: Eye::Single, rect }
    }

    /// One for each eye: the left picture and the right one, each half as wide.
    #[must_use]
    pub fn pair(camera: Camera, rect: Rect) -> [Self; 2] {
        let (left, right) = rect.split_left_right_at_fraction(0.5);
        [(Eye::Left, left), (Eye::Right, right)].map(|(eye, rect)| Self { camera, eye, rect })
    }

    /// Points of the screen in a unit of the picture: half its height.
    fn unit(&self) -> f64 {
        f64::from(self.rect.height()) / 2.0
    }

    /// Where a point is seen; `None` for one beside or behind the eye.
    #[must_use]
    pub fn see(&self, point: Vec3) -> Option<SeenPoint> {
        let seen = self.camera.see(point, self.eye)?;
        let [right, up] = seen.at.map(|part| (self.unit() * part) as f32);
        let centre = self.rect.center();
        Some(SeenPoint { at: pos2(centre.x + right, centre.y - up), distance: seen.distance })
    }

    /// How many points of the screen a millimetre across the line of sight takes at a distance in mm.
    #[must_use]
    pub fn points_per_mm(&self, distance: f64) -> f64 {
        self.unit() / (FIELD_OF_VIEW / 2.0).tan() / distance
    }

    /// The eye, and the direction, of no particular length, that it sees at a point of the screen.
    #[must_use]
    pub fn ray(&self, at: Pos2) -> [Vec3; 2] {
        let from = at - self.rect.center();
        let place = [from.x, -from.y].map(|part| f64::from(part) / self.unit());
        [self.camera.eye(self.eye), self.camera.ray(place, self.eye)]
    }

    /// The place at height `z` that is seen at a point of the screen; `None` above the horizon.
    #[must_use]
    pub fn pick(&self, at: Pos2, z: f64) -> Option<[f64; 2]> {
        let [eye, ray] = self.ray(at);
        let length = (z - eye[2]) / ray[2];
        let [x, y, _] = along(eye, ray, length);
        (length > 0.0 && length.is_finite()).then_some([x, y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::vec2;

    /// Unit vectors to the right and away from the eye as seen from above.
    fn ground(camera: &Camera) -> [[f64; 2]; 2] {
        let [[x, y, _], ..] = camera.axes();
        [[x, y], [-y, x]]
    }

    fn picture() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(400.0, 300.0))
    }

    #[test]
    fn what_is_looked_at_is_in_the_middle_and_directions_are_as_they_are_seen() {
        let mut camera = Camera::of([60.0, 40.0]);
        for (about, up) in [(0.0, 0.0), (1.0, 0.3), (3.0, -0.9), (-2.0, 5.0)] {
            camera.orbit(about, up);
            let lens = Lens::single(camera, picture());
            let seen = lens.see([30.0, 20.0, 0.0]).unwrap();
            // Points of single precision.
            assert!(seen.at.distance(picture().center()) < 1e-3);
            let above = lens.see([30.0, 20.0, 1.0]).unwrap().at;
            assert!(above.y < seen.at.y && (above.x - seen.at.x).abs() < 1e-3);
            let [right, away] = ground(&camera);
            let beside = lens.see([30.0 + right[0], 20.0 + right[1], 0.0]).unwrap();
            assert!(beside.at.x > seen.at.x && (beside.distance - seen.distance).abs() < 1e-9);
            let behind = lens.see([30.0 + away[0], 20.0 + away[1], 0.0]).unwrap();
            assert!(behind.distance > seen.distance && behind.at.y < seen.at.y);
        }
    }

    #[test]
    fn a_millimetre_takes_as_many_points_as_it_is_said_to() {
        let camera = Camera::of([60.0, 40.0]);
        let lens = Lens::single(camera, picture());
        let [right, _] = ground(&camera);
        let middle = lens.see([30.0, 20.0, 0.0]).unwrap();
        let beside = lens.see([30.0 + right[0], 20.0 + right[1], 0.0]).unwrap();
        let points = f64::from(beside.at.x - middle.at.x);
        // Points of single precision.
        assert!((points - lens.points_per_mm(middle.distance)).abs() < 1e-3);
    }

    #[test]
    fn a_picked_place_is_seen_where_it_was_picked_by_each_eye() {
        let mut camera = Camera::of([60.0, 60.0]);
        camera.orbit(2.0, -0.2);
        camera.zoom(1.4);
        let [left, right] = Lens::pair(camera, picture());
        assert!(left.rect.right() <= right.rect.left());
        for lens in [Lens::single(camera, picture()), left, right] {
            for (share, z) in [([0.2, 0.6], 0.0), ([0.7, 0.4], -4.0), ([0.5, 0.9], 2.0)] {
                let [right, down] = share;
                let at = lens.rect.min + vec2(right, down) * lens.rect.size();
                let [x, y] = lens.pick(at, z).unwrap();
                assert!(lens.see([x, y, z]).unwrap().at.distance(at) < 1e-2);
            }
        }
        camera.orbit(0.0, -3.0);
        // Just above the surface the upper part of the picture is sky.
        assert_eq!(Lens::single(camera, picture()).pick(pos2(210.0, 25.0), 0.0), None);
    }
}
