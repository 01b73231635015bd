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
    ///
    /// A corner at `r` to the right of the eye and `a` ahead is in the picture if `|r| <= a t`, where `t` is the tangent of
    /// half the angle from edge to edge. That bounds the eye's place by a straight line for each corner and edge: what is
    /// left is a triangle in each direction, and the nearest place is the tip of the smaller one.
    #[must_use]
    pub fn fitted(self, bounds: [Vec3; 2], shape: PictureShape) -> Self {
        let axes = self.axes();
        let [right, up, away] = axes;
        let tangent = (FIELD_OF_VIEW / 2.0).tan() * (1.0 - ROOM);
        let middle_ahead =
            dot([0, 1, 2].map(|axis| (bounds[0][axis] + bounds[1][axis]) / 2.0), away);
        let corners = (0..8).map(|corner: usize| {
            let place = [0, 1, 2].map(|axis| bounds[corner >> axis & 1][axis]);
            axes.map(|axis| dot(place, axis))
        });
        // How far ahead the eye may be, and where across, for a tangent and shifts of the eyes.
        let reach = |across: usize, tangent: f64, eyes: &[Eye]| {
            let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
            for corner in corners.clone() {
                for eye in eyes {
                    let shift = eye.side() * EYES_APART * (corner[2] - middle_ahead);
                    low = low.max(corner[across] + shift - tangent * corner[2]);
                    high = high.min(corner[across] + shift + tangent * corner[2]);
                }
            }
            [(high - low) / (2.0 * tangent), (high + low) / 2.0]
        };
        let [ahead_x, to_right] = reach(0, tangent * shape.aspect_of_eye(), shape.eyes.eyes());
        let [ahead_y, to_top] = reach(1, tangent, &[Eye::Single]);
        let target = [0, 1, 2]
            .map(|axis| to_right * right[axis] + to_top * up[axis] + middle_ahead * away[axis]);
        let distance = (middle_ahead - ahead_x.min(ahead_y)) / self.size;
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

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: [Vec3; 2] = [[0.0, 0.0, -7.2], [60.0, 60.0, 0.0]];
    const ORGAN: [Vec3; 2] = [[-40.0, -45.0, -95.0], [180.0, 50.0, 110.0]];

    fn corners([low, high]: [Vec3; 2]) -> impl Iterator<Item = Vec3> {
        (0..8).map(move |corner: usize| {
            [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] })
        })
    }

    /// Furthest corner from the middle of its eye's picture to the right and up, in halves of the picture.
    fn furthest(camera: &Camera, bounds: [Vec3; 2], shape: PictureShape) -> [f64; 2] {
        let aspect = shape.aspect / shape.eyes.eyes().len() as f64;
        let mut furthest = [0.0_f64; 2];
        for &eye in shape.eyes.eyes() {
            for corner in corners(bounds) {
                let [x, y] = camera.see(corner, eye).unwrap().at;
                furthest = [furthest[0].max(x.abs() / aspect), furthest[1].max(y.abs())];
            }
        }
        furthest
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
                        let [x, y] = furthest(&camera.fitted(bounds, shape), bounds, shape);
                        // The free room is exact; 1e-9 for rounding.
                        let edge = 1.0 - ROOM + 1e-9;
                        assert!(x <= edge && y <= edge, "{shape:?}: {x} {y}");
                        assert!(x.max(y) > edge - 2e-9, "{shape:?}: {x} {y} could be nearer");
                    }
                }
            }
        }
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
