//! The camera from which all of a box is just in the picture, whatever the shape of the picture.

use super::{Camera, DISTANCE, ELEVATION, EYES_APART, Eye, FIELD_OF_VIEW, Vec3, dot};
use crate::picture::EyeLayout;

/// Share of half a picture that stays free between a box and the edge.
const ROOM: f64 = 0.05;
/// Shapes of pictures that a box is fitted into; a thinner one is taken for these.
const ASPECT: [f64; 2] = [0.15, 20.0];

/// The shape of a picture, and whether it is one or a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureShape {
    /// Width of all of it over its height.
    pub aspect: f64,
    pub eyes: EyeLayout,
}

impl PictureShape {
    /// Of so many pixels, or of lengths in any other unit.
    #[must_use]
    pub fn new([wide, high]: [f64; 2], eyes: EyeLayout) -> Self {
        Self { aspect: wide / high, eyes }
    }

    /// Width over height of what one eye sees. A shape that is no number is taken for a square.
    fn aspect_of_eye(self) -> f64 {
        let aspect = self.aspect / self.eyes.eyes().len() as f64;
        if aspect.is_nan() { 1.0 } else { aspect.clamp(ASPECT[0], ASPECT[1]) }
    }
}

impl Camera {
    /// Looks at the middle of a box, its lowest and its highest corner in mm, and goes around it on all sides.
    #[must_use]
    pub fn around([low, high]: [Vec3; 2]) -> Self {
        let longest = [0, 1, 2].map(|axis| high[axis] - low[axis]).into_iter().fold(0.0, f64::max);
        Self {
            target: [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis])),
            lowest: -ELEVATION[1],
            ..Self::of([longest; 2])
        }
    }

    /// The same direction of view, from as near as all of a box is in the picture for each eye, and in its middle.
    #[must_use]
    pub fn fitted(self, bounds: [Vec3; 2], shape: PictureShape) -> Self {
        self.fitted_to(&corners(bounds), shape)
    }

    /// The same for points in mm, as those of a mesh, which leave the corners of their box free.
    #[must_use]
    pub fn fitted_to(self, points: &[Vec3], shape: PictureShape) -> Self {
        let axes = self.axes();
        let seen = points.iter().map(|point| axes.map(|axis| dot(*point, axis)));
        let seen = FramedPoints::new(seen.collect());
        let high = (FIELD_OF_VIEW / 2.0).tan() * (1.0 - ROOM);
        let tangents = [high * shape.aspect_of_eye(), high];
        let ahead = [0, 1].map(|across| seen.reach(across, tangents[across], shape.eyes)[0]);
        let ahead = ahead[0].min(ahead[1]);
        let place = [0, 1].map(|across| seen.middle(across, tangents[across], (ahead, shape.eyes)));
        let place = [place[0], place[1], seen.middle_ahead];
        let target = [0, 1, 2].map(|axis| {
            place[0] * axes[0][axis] + place[1] * axes[1][axis] + place[2] * axes[2][axis]
        });
        let distance = (seen.middle_ahead - ahead) / self.size;
        if !(distance.is_finite() && distance > 0.0 && target.iter().all(|part| part.is_finite())) {
            return self;
        }
        Self { target, distance: distance.clamp(DISTANCE[0], DISTANCE[1]), ..self }
    }

    /// The same view in a picture of another shape: as much further away or nearer as the box must be to fit, so that what
    /// was turned, zoomed and moved stays so.
    #[must_use]
    pub fn reshaped(self, bounds: [Vec3; 2], [before, now]: [PictureShape; 2]) -> Self {
        let [before, now] = [before, now].map(|shape| self.fitted(bounds, shape).distance);
        let distance = (self.distance * now / before).clamp(DISTANCE[0], DISTANCE[1]);
        Self { distance, ..self }
    }
}

/// The eight corners of a box.
fn corners([low, high]: [Vec3; 2]) -> [Vec3; 8] {
    std::array::from_fn(|corner| {
        [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] })
    })
}

/// Points to the right, up and ahead, in mm.
struct FramedPoints {
    points: Vec<Vec3>,
    /// Where the target is.
    middle_ahead: f64,
}

/// Halvings of the angle to the outermost point: to 2e-10 of it.
const HALVINGS: u32 = 32;

impl FramedPoints {
    fn new(points: Vec<Vec3>) -> Self {
        let [near, far] = [f64::min, f64::max].map(|pick: fn(f64, f64) -> f64| {
            points.iter().map(|point| point[2]).reduce(pick).unwrap_or(f64::NAN)
        });
        Self { points, middle_ahead: (near + far) / 2.0 }
    }

    /// How far ahead the eye may be, and how far across it is then, for a tangent of half the angle from edge to edge.
    ///
    /// A point at `r` to the right of the eye and `a` ahead is in the picture if `|r| <= a t`. That bounds the eye's place by a
    /// straight line for each point and edge. What is left is a triangle, and its tip is the furthest place ahead.
    fn reach(&self, across: usize, tangent: f64, eyes: EyeLayout) -> [f64; 2] {
        // Eyes are beside each other, not above.
        let eyes = if across == 0 { eyes.eyes() } else { &[Eye::Single] };
        let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
        for point in &self.points {
            for eye in eyes {
                let shift = eye.side() * EYES_APART * (point[2] - self.middle_ahead);
                low = low.max(point[across] + shift - tangent * point[2]);
                high = high.min(point[across] + shift + tangent * point[2]);
            }
        }
        [(high - low) / (2.0 * tangent), (high + low) / 2.0]
    }

    /// How far across the eye is if points are to be as far from both edges, from a place this far ahead: the tip of the
    /// triangle whose tangent has it there.
    fn middle(&self, across: usize, tangent: f64, (ahead, eyes): (f64, EyeLayout)) -> f64 {
        let [mut narrow, mut wide] = [0.0, tangent];
        for _ in 0..HALVINGS {
            let half = (narrow + wide) / 2.0;
            if self.reach(across, half, eyes)[0] < ahead { narrow = half } else { wide = half }
        }
        self.reach(across, wide, eyes)[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: [Vec3; 2] = [[0.0, 0.0, -7.2], [60.0, 60.0, 0.0]];
    const ORGAN: [Vec3; 2] = [[-40.0, -45.0, -95.0], [180.0, 50.0, 110.0]];

    /// Left, right, lower and upper end of what the eyes see of points, in halves of the picture.
    fn ends(camera: &Camera, points: &[Vec3], shape: PictureShape) -> [[f64; 2]; 2] {
        let aspect = shape.aspect / shape.eyes.eyes().len() as f64;
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for &eye in shape.eyes.eyes() {
            for point in points {
                let [x, y] = camera.see(*point, eye).unwrap().at;
                for (end, at) in ends.iter_mut().zip([x / aspect, y]) {
                    *end = [end[0].min(at), end[1].max(at)];
                }
            }
        }
        ends
    }

    #[test]
    fn all_of_a_box_is_in_a_picture_of_any_shape_and_fills_it_one_way() {
        for bounds in [BLOCK, ORGAN] {
            for turn in 0..12 {
                let mut camera = Camera::around(bounds);
                camera.orbit(0.55 * f64::from(turn), 0.2 * f64::from(turn) - 1.2);
                for step in 0..=27 {
                    for eyes in [EyeLayout::Single, EyeLayout::SideBySide] {
                        let shape = PictureShape { aspect: 0.3 + 0.1 * f64::from(step), eyes };
                        let [x, y] = ends(&camera.fitted(bounds, shape), &corners(bounds), shape);
                        // Halvings end at 2e-10 of an angle.
                        let edge = 1.0 - ROOM + 1e-8;
                        assert!(x[1] <= edge && y[1] <= edge, "{shape:?}: {x:?} {y:?}");
                        assert!(x[1].max(y[1]) > edge - 2e-8, "{shape:?}: could be nearer");
                        assert!((x[0] + x[1]).abs() < 1e-8 && (y[0] + y[1]).abs() < 1e-8);
                    }
                }
            }
        }
    }

    #[test]
    fn points_that_leave_the_corners_of_their_box_free_are_seen_from_nearer() {
        let shape = PictureShape { aspect: 1.6, eyes: EyeLayout::SideBySide };
        let middles: Vec<Vec3> = (0..6)
            .map(|side: usize| {
                let mut place = [0, 1, 2].map(|axis| (ORGAN[0][axis] + ORGAN[1][axis]) / 2.0);
                place[side / 2] = ORGAN[side % 2][side / 2];
                place
            })
            .collect();
        let camera = Camera::around(ORGAN).fitted_to(&middles, shape);
        assert!(camera.distance_mm() < 0.8 * camera.fitted(ORGAN, shape).distance_mm());
        let [x, y] = ends(&camera, &middles, shape);
        assert!(x[1].max(y[1]) < 1.0 && (x[0] + x[1]).abs() + (y[0] + y[1]).abs() < 1e-8);
        assert_eq!(camera.fitted_to(&[], shape), camera);
    }

    #[test]
    fn another_shape_keeps_what_was_zoomed_and_comes_back() {
        let [wide, narrow] =
            [1.6, 0.4].map(|aspect| PictureShape { aspect, eyes: EyeLayout::Single });
        let fitted = Camera::around(BLOCK).fitted(BLOCK, wide);
        let mut zoomed = fitted;
        zoomed.zoom(2.0);
        let there = zoomed.reshaped(BLOCK, [wide, narrow]);
        assert!(
            (2.0 * there.distance_mm() / fitted.fitted(BLOCK, narrow).distance_mm() - 1.0).abs()
                < 1e-9
        );
        let back = there.reshaped(BLOCK, [narrow, wide]);
        assert!((back.distance_mm() / zoomed.distance_mm() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn no_number_leaves_the_camera_where_it_is() {
        let camera = Camera::of([60.0; 2]);
        let shape = PictureShape::new([0.0, 0.0], EyeLayout::Single);
        assert_eq!(camera.fitted([[f64::NAN; 3]; 2], shape), camera);
        assert!(camera.fitted(BLOCK, shape).distance_mm().is_finite());
    }

    #[test]
    fn an_organ_is_seen_from_below_too_and_a_block_is_not() {
        let mut organ = Camera::around(ORGAN);
        organ.orbit(0.0, -9.0);
        assert!(organ.eye(Eye::Single)[2] < ORGAN[0][2]);
        let mut block = Camera::of([60.0; 2]);
        block.orbit(0.0, -9.0);
        assert!(block.eye(Eye::Single)[2] > 0.0);
    }
}
