//! Where the pointer and the keys want the tool, and how a stylus stands.

use super::camera::ground;
use eframe::egui::Key;
use palpate_tissue_view::{Camera, Vec3};

/// How high above the surface the tool waits, in mm.
const ABOVE: f64 = 3.0;
/// How far above and below the surface at rest the tool may be sent, in mm: the stroke of the master and some air.
const HEIGHTS: [f64; 2] = [-30.0, 20.0];
/// How fast a button held presses, in mm/s: a poke of a second, slow enough to let go in time.
const PRESS_SPEED: f64 = 8.0;
/// What a key moves the tool by, in mm, along the surface and in depth.
const STEP: [f64; 2] = [1.0, 0.5];

/// Where the tool is wanted, in mm; the surface at rest is at 0, tissue below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolTarget {
    at: Vec3,
    extent: [f64; 2],
}

impl ToolTarget {
    /// Above the middle of a surface of these lengths in mm.
    #[must_use]
    pub fn above(extent: [f64; 2]) -> Self {
        Self { at: [extent[0] / 2.0, extent[1] / 2.0, ABOVE], extent }
    }

    pub fn at(&self) -> Vec3 {
        self.at
    }

    /// Goes to a place over the surface, or as near to it as the surface reaches.
    pub fn go(&mut self, [x, y]: [f64; 2]) {
        self.at[0] = x.clamp(0.0, self.extent[0]);
        self.at[1] = y.clamp(0.0, self.extent[1]);
    }

    /// Goes up by so much, down where it is below zero.
    pub fn rise(&mut self, by: f64) {
        self.at[2] = (self.at[2] + by).clamp(HEIGHTS[0], HEIGHTS[1]);
    }

    /// Presses for so many seconds, from the surface on.
    pub fn press(&mut self, seconds: f64) {
        self.at[2] = self.at[2].min(0.0);
        self.rise(-PRESS_SPEED * seconds);
    }

    /// Lets go: up to where it waits.
    pub fn lift(&mut self) {
        self.at[2] = self.at[2].max(ABOVE);
    }

    /// What a key asks for; directions are those of the picture. False for keys that ask for nothing.
    pub fn key(&mut self, key: Key, camera: &Camera) -> bool {
        let [right, away] = ground(camera);
        let (direction, length) = match key {
            Key::ArrowRight => (right, STEP[0]),
            Key::ArrowLeft => (right, -STEP[0]),
            Key::ArrowUp => (away, STEP[0]),
            Key::ArrowDown => (away, -STEP[0]),
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
        self.go([0, 1].map(|axis| self.at[axis] + length * direction[axis]));
        true
    }
}

/// Unit vectors of a stylus turned by yaw about z, pitch about y and roll about x, in rad: from its tip up its length,
/// and to its button.
#[must_use]
pub fn stylus([yaw, pitch, roll]: Vec3) -> [Vec3; 2] {
    let (sin_y, cos_y) = yaw.sin_cos();
    let (sin_p, cos_p) = pitch.sin_cos();
    let (sin_r, cos_r) = roll.sin_cos();
    [
        [
            cos_y * sin_p * cos_r + sin_y * sin_r,
            sin_y * sin_p * cos_r - cos_y * sin_r,
            cos_p * cos_r,
        ],
        [cos_y * cos_p, sin_y * cos_p, -sin_p],
    ]
}

#[cfg(test)]
mod tests {
    use super::super::camera::Lens;
    use super::*;

    fn dot(a: Vec3, b: Vec3) -> f64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    #[test]
    fn keys_move_the_tool_as_the_picture_has_it() {
        let mut camera = Camera::of([60.0, 60.0]);
        camera.orbit(0.7, 0.0);
        let picture = eframe::egui::Rect::from_min_max([0.0, 0.0].into(), [400.0, 400.0].into());
        let lens = Lens::single(camera, picture);
        let seen = |hand: &ToolTarget| lens.see(hand.at()).unwrap().at;
        let hand = ToolTarget::above([60.0, 60.0]);
        let moved = |key| {
            let mut one = hand;
            assert!(one.key(key, &camera));
            seen(&one) - seen(&hand)
        };
        assert!(moved(Key::ArrowRight).x > 1.0 && moved(Key::ArrowLeft).x < -1.0);
        assert!(moved(Key::ArrowUp).y < -1.0 && moved(Key::ArrowDown).y > 1.0);
        assert!(moved(Key::PageUp).y < -1.0 && moved(Key::PageDown).y > 1.0);
        let mut same = hand;
        assert!(!same.key(Key::A, &camera) && same == hand);
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
    fn a_stylus_turns_about_each_axis() {
        let quarter = std::f64::consts::FRAC_PI_2;
        for (turn, up) in [
            ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([0.0, quarter, 0.0], [1.0, 0.0, 0.0]),
            ([quarter, quarter, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 0.0, quarter], [0.0, -1.0, 0.0]),
        ] {
            let [length, button] = stylus(turn);
            for (part, wanted) in length.into_iter().zip(up) {
                assert!((part - wanted).abs() < 1e-12, "{turn:?} {length:?}");
            }
            assert!(dot(length, button).abs() < 1e-12);
        }
        let [length, button] = stylus([0.3, -1.1, 2.0]);
        assert!((dot(length, length) - 1.0).abs() < 1e-12 && dot(length, button).abs() < 1e-12);
    }
}
