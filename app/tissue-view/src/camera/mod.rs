//! The camera of a picture: a perspective view from a sphere around its target.
//!
//! Scene: x along columns, y along rows, z up, in mm. Clip space: x right, y up, depth 0 at the near plane and 1 at the
//! far plane, as WebGPU has it (W3C, "WebGPU", section "Coordinate Systems").

mod fitted;

pub use fitted::PictureShape;

/// A position or a direction in the scene, in mm.
pub type Vec3 = [f64; 3];

/// Angle between the top and the bottom of a picture, in rad.
pub const FIELD_OF_VIEW: f64 = 0.6;
/// Distances of the near and far planes, in distances of the target. A 24-bit mantissa resolves 1e-5 of the distance
/// there, which is a micrometre at 100 mm.
const NEAR: f64 = 0.02;
const FAR: f64 = 20.0;
/// The eye stays above the surface, and off the pole, where left and right would have no meaning. In rad.
const ELEVATION: [f64; 2] = [0.08, 1.54];
/// Distance from the target, in lengths of the scene: from the furthest all of a block fits one eye of a narrow pair.
const DISTANCE: [f64; 2] = [0.15, 20.0];
/// Distance between the two eyes, in distances of the target: a thirtieth is the usual rule of stereo photography.
const EYES_APART: f64 = 1.0 / 30.0;

/// Which picture of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Eye {
    #[default]
    Single,
    Left,
    Right,
}

impl Eye {
    /// Sideways from the middle, in distances between the eyes.
    fn side(self) -> f64 {
        match self {
            Self::Single => 0.0,
            Self::Left => -0.5,
            Self::Right => 0.5,
        }
    }
}

/// A camera on a sphere around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    target: Vec3,
    /// A length of the scene in mm: the unit of distances.
    size: f64,
    /// Angle about z in rad, 0 with the eye on the side of negative y.
    azimuth: f64,
    /// Angle above the surface in rad.
    elevation: f64,
    /// The least angle above the surface in rad.
    lowest: f64,
    /// In lengths of the scene.
    distance: f64,
}

/// Where a point is in a picture of a height of two units: x right and y up from the middle, in half heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedPoint {
    pub at: [f64; 2],
    /// Along the line of sight, in mm.
    pub distance: f64,
}

#[must_use]
pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[must_use]
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[must_use]
pub(crate) fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

/// From `from`, `length` in a direction.
#[must_use]
pub(crate) fn along(from: Vec3, direction: Vec3, length: f64) -> Vec3 {
    [0, 1, 2].map(|axis| from[axis] + length * direction[axis])
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
            lowest: ELEVATION[0],
            distance: 1.9,
        }
    }

    /// Looks at another point of the scene, in mm.
    #[must_use]
    pub fn looking_at(mut self, target: Vec3) -> Self {
        self.target = target;
        self
    }

    /// Turns about the target by angles in rad.
    pub fn orbit(&mut self, about: f64, up: f64) {
        self.azimuth = (self.azimuth + about).rem_euclid(std::f64::consts::TAU);
        self.elevation = (self.elevation + up).clamp(self.lowest, ELEVATION[1]);
    }

    /// Comes nearer by a factor above 1, goes away by one below.
    pub fn zoom(&mut self, factor: f64) {
        self.distance = (self.distance / factor).clamp(DISTANCE[0], DISTANCE[1]);
    }

    /// Moves the target so that it goes right and up in the picture by these shares of half its height.
    pub fn pan(&mut self, right: f64, up: f64) {
        let unit = self.distance_mm() * (FIELD_OF_VIEW / 2.0).tan();
        let [to_right, to_top, _] = self.axes();
        self.target = along(along(self.target, to_right, -right * unit), to_top, -up * unit);
    }

    /// Unit vectors to the right, up in the picture, and away from the eye.
    #[must_use]
    pub fn axes(&self) -> [Vec3; 3] {
        let (sin_a, cos_a) = self.azimuth.sin_cos();
        let (sin_e, cos_e) = self.elevation.sin_cos();
        [
            [cos_a, sin_a, 0.0],
            [-sin_a * sin_e, cos_a * sin_e, cos_e],
            [-sin_a * cos_e, cos_a * cos_e, -sin_e],
        ]
    }

    /// From the eye to the target, in mm.
    #[must_use]
    pub fn distance_mm(&self) -> f64 {
        self.distance * self.size
    }

    /// Position of an eye in mm.
    #[must_use]
    pub fn eye(&self, eye: Eye) -> Vec3 {
        let [right, _, away] = self.axes();
        let middle = along(self.target, away, -self.distance_mm());
        along(middle, right, eye.side() * EYES_APART * self.distance_mm())
    }

    /// Where an eye sees a point; `None` for one nearer than the near plane.
    #[must_use]
    pub fn see(&self, point: Vec3, eye: Eye) -> Option<ProjectedPoint> {
        let from = along(point, self.eye(eye), -1.0);
        let [right, up, distance] = self.axes().map(|axis| dot(from, axis));
        if distance.is_nan() || distance <= NEAR * self.distance_mm() {
            return None;
        }
        let scale = 1.0 / (FIELD_OF_VIEW / 2.0).tan();
        // Both eyes see what is as far as the target at the same place.
        let shift = eye.side() * EYES_APART;
        Some(ProjectedPoint {
            at: [scale * (right / distance + shift), scale * up / distance],
            distance,
        })
    }

    /// Direction, of no particular length, that an eye sees at a place of the picture in half heights from its middle.
    #[must_use]
    pub fn ray(&self, [x, y]: [f64; 2], eye: Eye) -> Vec3 {
        let tangent = (FIELD_OF_VIEW / 2.0).tan();
        let [right, up, away] = self.axes();
        let shift = eye.side() * EYES_APART;
        along(along(away, right, x * tangent - shift), up, y * tangent)
    }

    /// The matrix from scene to clip space, in columns, for a picture `aspect` times as wide as high.
    #[must_use]
    pub fn view_projection(&self, aspect: f64, eye: Eye) -> [[f32; 4]; 4] {
        let scale = 1.0 / (FIELD_OF_VIEW / 2.0).tan();
        let [near, far] = [NEAR, FAR].map(|share| share * self.distance_mm());
        let depth = far / (far - near);
        let [right, up, away] = self.axes();
        let shift = eye.side() * EYES_APART;
        let row_x = [0, 1, 2].map(|axis| scale / aspect * (right[axis] + shift * away[axis]));
        let row_y = up.map(|part| scale * part);
        let row_z = away.map(|part| depth * part);
        let from = self.eye(eye);
        let mut columns = [[0.0; 4]; 4];
        for axis in 0..3 {
            columns[axis] =
                [row_x[axis], row_y[axis], row_z[axis], away[axis]].map(|part| part as f32);
        }
        columns[3] = [
            -dot(row_x, from),
            -dot(row_y, from),
            -dot(row_z, from) - depth * near,
            -dot(away, from),
        ]
        .map(|part| part as f32);
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clip coordinates of a point over their last.
    fn project(matrix: [[f32; 4]; 4], point: Vec3) -> [f64; 4] {
        let mut clip = [0.0; 4];
        for row in 0..4 {
            clip[row] = f64::from(matrix[3][row])
                + (0..3).map(|axis| f64::from(matrix[axis][row]) * point[axis]).sum::<f64>();
        }
        [clip[0] / clip[3], clip[1] / clip[3], clip[2] / clip[3], clip[3]]
    }

    #[test]
    fn matrix_and_projection_agree_for_both_eyes() {
        let mut camera = Camera::of([60.0, 40.0]);
        camera.orbit(1.2, -0.2);
        camera.pan(0.2, -0.1);
        for eye in [Eye::Single, Eye::Left, Eye::Right] {
            let matrix = camera.view_projection(1.6, eye);
            for point in [[3.0, 4.0, -2.0], [40.0, 30.0, 5.0], [60.0, 0.0, 0.0]] {
                let seen = camera.see(point, eye).unwrap();
                let [x, y, depth, w] = project(matrix, point);
                // The matrix is of single precision: 1e-7 of terms of about 10.
                assert!((x * 1.6 - seen.at[0]).abs() < 1e-5 && (y - seen.at[1]).abs() < 1e-5);
                assert!((w - seen.distance).abs() < 1e-4 * seen.distance);
                assert!((0.0..1.0).contains(&depth));
            }
        }
    }

    #[test]
    fn a_ray_meets_the_point_that_is_seen_there() {
        let mut camera = Camera::of([60.0, 60.0]);
        camera.zoom(1.3);
        for eye in [Eye::Single, Eye::Left, Eye::Right] {
            let point = [21.0, 33.0, -4.0];
            let seen = camera.see(point, eye).unwrap();
            let met = along(camera.eye(eye), camera.ray(seen.at, eye), seen.distance);
            for axis in 0..3 {
                assert!((met[axis] - point[axis]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn the_eyes_agree_at_the_target_and_nearer_points_move_apart() {
        let camera = Camera::of([60.0, 60.0]);
        let at = |point, eye| camera.see(point, eye).unwrap().at[0];
        let target = [30.0, 30.0, 0.0];
        assert!((at(target, Eye::Left) - at(target, Eye::Right)).abs() < 1e-12);
        let near = along(target, camera.axes()[2], -20.0);
        assert!(at(near, Eye::Left) > at(near, Eye::Right));
    }

    #[test]
    fn what_is_panned_moves_as_the_hand_does() {
        let mut camera = Camera::of([60.0, 60.0]);
        camera.pan(0.25, 0.1);
        let seen = camera.see([30.0, 30.0, 0.0], Eye::Single).unwrap();
        assert!((seen.at[0] - 0.25).abs() < 1e-9 && (seen.at[1] - 0.1).abs() < 1e-9);
    }

    #[test]
    fn the_eye_stays_above_the_surface_and_within_its_distances() {
        let mut camera = Camera::of([60.0, 60.0]);
        for (up, factor) in [(-9.0, 1e9), (9.0, 1e-9)] {
            camera.orbit(1.0, up);
            camera.zoom(factor);
            assert!(camera.eye(Eye::Single)[2] > 0.0);
            assert!((ELEVATION[0]..=ELEVATION[1]).contains(&camera.elevation));
            assert!((DISTANCE[0]..=DISTANCE[1]).contains(&camera.distance));
        }
    }
}
