//! Where the pointer and the keys want the tool.

use super::camera::along;
use eframe::egui::Key;
use palpate_haptics::scene::SceneStart;
use palpate_haptics::triangles::{FAR_MM, TriangleMesh};
use palpate_tissue_view::{Camera, Vec3};
use std::sync::Arc;

/// How high above the surface the tool waits, in mm.
const ABOVE: f64 = 3.0;
/// How far above and below the surface at rest the tool may be sent, in mm: the stroke of the master and some air.
const HEIGHTS: [f64; 2] = [-30.0, 20.0];
/// How fast a button held presses, in mm/s: a poke of a second, slow enough to let go in time.
const PRESS_SPEED: f64 = 8.0;
/// What a key moves the tool by, in mm, along the surface and in depth.
const STEP: [f64; 2] = [1.0, 0.5];

/// How the stylus is held: yaw, pitch and roll in rad over level tissue, as the paths have it at rest.
const TURN: Vec3 = [0.0, -0.5, 0.0];
const UP: Vec3 = [0.0, 0.0, 1.0];

/// Tissue at rest that the tool is over.
#[derive(Clone, Debug)]
pub enum ToolGround {
    /// Level at height zero, of these lengths in mm.
    Square([f64; 2]),
    Mesh(Arc<TriangleMesh>),
}

impl ToolGround {
    /// Lowest and highest corner of the box around it, in mm.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        match self {
            Self::Square([wide, high]) => [[0.0; 3], [*wide, *high, 0.0]],
            Self::Mesh(mesh) => mesh.bounds(),
        }
    }
}

/// Where the tool is wanted.
#[derive(Clone, Debug)]
pub struct ToolTarget {
    /// The place on the tissue at rest that it is over, in mm, and the unit vector out of the tissue there.
    foot: Vec3,
    out: Vec3,
    /// Above that place in mm, below zero in the tissue.
    height: f64,
    ground: ToolGround,
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl ToolTarget {
    /// Above the middle of level tissue of these lengths in mm.
    #[must_use]
    pub fn above([wide, high]: [f64; 2]) -> Self {
        let foot = [wide / 2.0, high / 2.0, 0.0];
        Self { foot, out: UP, height: ABOVE, ground: ToolGround::Square([wide, high]) }
    }

    /// Above where a scene on a mesh begins.
    #[must_use]
    pub fn over(mesh: Arc<TriangleMesh>, start: SceneStart) -> Self {
        let SceneStart { place, out, .. } = start;
        Self { foot: place, out, height: ABOVE, ground: ToolGround::Mesh(mesh) }
    }

    pub fn ground(&self) -> &ToolGround {
        &self.ground
    }

    /// In mm.
    pub fn at(&self) -> Vec3 {
        along(self.foot, self.out, self.height)
    }

    /// Yaw, pitch and roll of the stylus in rad: over level tissue as the paths have it, elsewhere along the way out.
    pub fn turn(&self) -> Vec3 {
        match self.ground {
            ToolGround::Square(_) => TURN,
            ToolGround::Mesh(_) => {
                let [x, y, z] = self.out;
                [y.atan2(x), z.clamp(-1.0, 1.0).acos(), 0.0]
            }
        }
    }

    /// Goes over the place that an eye sees in a direction, if it sees the tissue; beside a square to the nearest place.
    pub fn go_to_seen(&mut self, [eye, direction]: [Vec3; 2]) {
        match &self.ground {
            ToolGround::Square(_) => {
                let length = -eye[2] / direction[2];
                if length > 0.0 && length.is_finite() {
                    self.go(along(eye, direction, length));
                }
            }
            ToolGround::Mesh(mesh) => {
                let [low, high] = mesh.bounds();
                let reach = [0, 1, 2]
                    .map(|axis| (low[axis] - eye[axis]).abs().max((high[axis] - eye[axis]).abs()));
                let far =
                    along(eye, direction, (dot(reach, reach) / dot(direction, direction)).sqrt());
                if let Some(hit) = mesh.first_hit(eye, far) {
                    self.go(hit.point);
                }
            }
        }
    }

    /// Goes over the place of the tissue that is nearest.
    fn go(&mut self, place: Vec3) {
        match &self.ground {
            ToolGround::Square([wide, high]) => {
                self.foot = [place[0].clamp(0.0, *wide), place[1].clamp(0.0, *high), 0.0];
            }
            ToolGround::Mesh(mesh) => {
                if let Some(near) = mesh.nearest(place, FAR_MM) {
                    self.foot = near.point;
                    self.out = mesh.normal(&near);
                }
            }
        }
    }

    /// Goes up by so much, down where it is below zero.
    pub fn rise(&mut self, by: f64) {
        self.height = (self.height + by).clamp(HEIGHTS[0], HEIGHTS[1]);
    }

    /// Presses for so many seconds, from the surface on.
    pub fn press(&mut self, seconds: f64) {
        self.height = self.height.min(0.0);
        self.rise(-PRESS_SPEED * seconds);
    }

    /// Lets go: up to where it waits.
    pub fn lift(&mut self) {
        self.height = self.height.max(ABOVE);
    }

    /// What a key asks for; directions are those of the picture. False for keys that ask for nothing.
    pub fn key(&mut self, key: Key, camera: &Camera) -> bool {
        let [right, up, _] = camera.axes();
        let (direction, length) = match key {
            Key::ArrowRight => (right, STEP[0]),
            Key::ArrowLeft => (right, -STEP[0]),
            Key::ArrowUp => (up, STEP[0]),
            Key::ArrowDown => (up, -STEP[0]),
            Key::PageDown => {
                self.rise(-STEP[1]);
                return true;
            }
            Key::PageUp => {
                self.rise(STEP[1]);
                return true;
            }
            _ => return false,
        };
        // As it is seen along the tissue, where that is not looked at along that direction.
        let flat = along(direction, self.out, -dot(direction, self.out));
        let long = dot(flat, flat).sqrt();
        if long > 1e-6 {
            self.go(along(self.foot, flat, length / long));
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::Lens;
    use super::*;
    use palpate_haptics::scene::stylus_axis;
    use palpate_haptics::triangles::shapes;

    #[test]
    fn keys_move_the_tool_as_the_picture_has_it() {
        let mut camera = Camera::of([60.0, 60.0]);
        camera.orbit(0.7, 0.0);
        let picture = eframe::egui::Rect::from_min_max([0.0, 0.0].into(), [400.0, 400.0].into());
        let lens = Lens::single(camera, picture);
        let seen = |hand: &ToolTarget| lens.see(hand.at()).unwrap().at;
        let hand = ToolTarget::above([60.0, 60.0]);
        let moved = |key| {
            let mut one = hand.clone();
            assert!(one.key(key, &camera));
            seen(&one) - seen(&hand)
        };
        assert!(moved(Key::ArrowRight).x > 1.0 && moved(Key::ArrowLeft).x < -1.0);
        assert!(moved(Key::ArrowUp).y < -1.0 && moved(Key::ArrowDown).y > 1.0);
        assert!(moved(Key::PageUp).y < -1.0 && moved(Key::PageDown).y > 1.0);
        let mut same = hand.clone();
        assert!(!same.key(Key::A, &camera) && same.at() == hand.at());
    }

    #[test]
    fn the_tool_stays_over_the_surface_and_within_its_stroke() {
        let camera = Camera::of([60.0, 40.0]);
        let mut hand = ToolTarget::above([60.0, 40.0]);
        for key in [Key::ArrowRight, Key::ArrowUp, Key::PageDown] {
            for _ in 0..200 {
                hand.key(key, &camera);
            }
        }
        assert!((0.0..=60.0).contains(&hand.at()[0]) && (0.0..=40.0).contains(&hand.at()[1]));
        assert_eq!(hand.at()[2], HEIGHTS[0]);
        hand.lift();
        assert_eq!(hand.at()[2], ABOVE);
        hand.press(0.25);
        assert!((hand.at()[2] + 2.0).abs() < 1e-12);
        hand.press(1e9);
        assert_eq!(hand.at()[2], HEIGHTS[0]);
    }

    #[test]
    fn on_a_mesh_the_tool_goes_where_it_is_seen_and_presses_along_the_way_out() {
        let mesh = Arc::new(TriangleMesh::new(shapes::ball(20.0, 4)).unwrap());
        let camera = Camera::around(mesh.bounds());
        let start = SceneStart { place: [0.0, 0.0, 20.0], out: UP, at: UP, middle: UP };
        let mut hand = ToolTarget::over(mesh, start);
        let picture = eframe::egui::Rect::from_min_max([0.0, 0.0].into(), [400.0, 400.0].into());
        let lens = Lens::single(camera, picture);
        for at in [[200.0, 200.0], [150.0, 230.0], [240.0, 170.0]] {
            hand.go_to_seen(lens.ray(at.into()));
            let seen = lens.see(hand.foot).unwrap().at;
            // Points of single precision, and the nearest point of the mesh is the place itself.
            assert!(seen.distance(at.into()) < 0.05, "{seen:?}");
            // The ball's own normal is along its radius, within the angle between triangles of a 64th of a turn.
            let radius = dot(hand.foot, hand.foot).sqrt();
            assert!(dot(hand.out, hand.foot) / radius > 0.995);
            assert!(dot(stylus_axis(hand.turn()), hand.out) > 1.0 - 1e-9);
        }
        let before = hand.at();
        hand.go_to_seen(lens.ray([2.0, 2.0].into()));
        assert_eq!(hand.at(), before, "beside the ball nothing is seen");
        hand.press(0.5);
        assert!((hand.height + 4.0).abs() < 1e-12 && dot(hand.at(), hand.at()) < 17.0 * 17.0);
        for key in [Key::ArrowRight, Key::ArrowUp] {
            for _ in 0..40 {
                hand.key(key, &camera);
            }
        }
        let radius = dot(hand.foot, hand.foot).sqrt();
        assert!((19.5..=20.0 + 1e-9).contains(&radius), "{radius}");
    }
}
