//! Where the stylus of a scene begins, and where a device lies in it.

use super::device::HandPose;
use super::mesh::MeshSceneError;
use super::settings::{START_HEIGHT_MM, SceneSettings};
use crate::triangles::{FAR_MM, TriangleMesh};

/// Room is looked for from so far before a place, in mm, so that the triangles around it are not met: far above the roundings of 10 m.
const BEFORE_MM: f64 = 0.01;

/// Which place of a mesh is touched first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum StartPlace {
    /// Over the middle of its box, from above.
    #[default]
    Middle,
    /// The place nearest to this one, in mm.
    Near([f64; 3]),
    /// A vertex, counted from 0 in the order of the mesh's file.
    Vertex(usize),
}

/// Begin of a scene, all in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneStart {
    /// Place of the surface at rest that a path touches, and that a real device has in the middle of its reach.
    pub place: [f64; 3],
    /// Unit vector out of the tissue, along which a path comes and goes.
    pub out: [f64; 3],
    /// Where the stylus begins.
    pub at: [f64; 3],
    /// Middle of the simulated device's workspace.
    pub middle: [f64; 3],
}

const UP: [f64; 3] = [0.0, 0.0, 1.0];

impl SceneStart {
    /// Of a square of tissue.
    #[must_use]
    pub fn of_square(settings: &SceneSettings) -> Self {
        let middle = settings.middle();
        Self { place: middle, out: UP, at: settings.start(), middle }
    }

    pub(super) fn on_mesh(mesh: &TriangleMesh, place: StartPlace) -> Result<Self, MeshSceneError> {
        match place {
            StartPlace::Middle => Ok(Self::over_middle(mesh)),
            StartPlace::Near(point) => {
                let near = mesh.nearest(point, FAR_MM).ok_or(MeshSceneError::StartFar)?;
                Self::along(mesh, near.point, mesh.normal(&near))
            }
            StartPlace::Vertex(vertex) => {
                let vertices = mesh.vertex_of_file().len();
                let own = mesh.vertex_of_file().get(vertex);
                let own = *own.ok_or(MeshSceneError::StartVertex { vertex, vertices })? as usize;
                Self::along(mesh, mesh.points()[own], mesh.vertex_normals()[own])
            }
        }
    }

    /// Above the surface in the middle, or where there is none, as beside a bend, above the highest vertex.
    fn over_middle(mesh: &TriangleMesh) -> Self {
        let [low, high] = mesh.bounds();
        let middle = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
        let [x, y, _] = middle;
        let above = mesh.first_hit([x, y, high[2] + 1.0], [x, y, low[2] - 1.0]);
        let higher = |one: [f64; 3], other: &[f64; 3]| if other[2] > one[2] { *other } else { one };
        let highest = || mesh.points().iter().fold(low, higher);
        let place = above.map_or_else(highest, |hit| hit.point);
        Self { place, out: UP, at: before(place, START_HEIGHT_MM, UP), middle }
    }

    /// Before a place, if there is no other tissue.
    fn along(mesh: &TriangleMesh, place: [f64; 3], out: [f64; 3]) -> Result<Self, MeshSceneError> {
        let at = before(place, START_HEIGHT_MM, out);
        // Outwards: only on this way do closed parts show their outer side.
        if mesh.first_hit(before(place, BEFORE_MM, out), at).is_some() {
            return Err(MeshSceneError::StartBuried);
        }
        Ok(Self { place, out, at, middle: place })
    }

    /// A pose of a path over a square of tissue, over this place.
    #[must_use]
    pub fn moved(&self, pose: HandPose, square: &SceneSettings) -> HandPose {
        let usual = square.start();
        let way = [0, 1, 2].map(|axis| pose.at[axis] - usual[axis]);
        let turned = self.turned(way);
        // Where nothing is turned, a square's own path keeps its bits.
        let at = [0, 1, 2]
            .map(|axis| pose.at[axis] + (self.at[axis] - usual[axis]) + (turned[axis] - way[axis]));
        HandPose { at, turn: self.turned_stylus(pose.turn) }
    }

    /// Yaw, pitch and roll in rad of a stylus that over level tissue is held as `turn` says. Its roll about its own length is lost
    /// where the tissue is not level.
    fn turned_stylus(&self, turn: [f64; 3]) -> [f64; 3] {
        // A unit vector.
        let [_, _, up] = self.out;
        if up >= 1.0 {
            return turn;
        }
        let [x, y, z] = self.turned(stylus_axis(turn));
        [y.atan2(x), z.clamp(-1.0, 1.0).acos(), 0.0]
    }

    /// A vector by the shortest turn that brings up to `out`; where that is down, about x.
    fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.out;
        // Nearer to down than this the shortest turn is one of roundings.
        if 1.0 + c < 1e-9 {
            return [x, -y, -z];
        }
        let aside = (a * x + b * y) / (1.0 + c);
        [x - a * aside + a * z, y - b * aside + b * z, c * z - a * x - b * y]
    }
}

fn before(place: [f64; 3], height: f64, out: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| place[axis] + height * out[axis])
}

/// Unit vector from the tip of a stylus up its length, turned by yaw about z, pitch about y and roll about x, in rad.
#[must_use]
pub fn stylus_axis([yaw, pitch, roll]: [f64; 3]) -> [f64; 3] {
    let (sin_y, cos_y) = yaw.sin_cos();
    let (sin_p, cos_p) = pitch.sin_cos();
    let (sin_r, cos_r) = roll.sin_cos();
    [cos_y * sin_p * cos_r + sin_y * sin_r, sin_y * sin_p * cos_r - cos_y * sin_r, cos_p * cos_r]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ScenePath;
    use crate::triangles::shapes::ball;

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3).map(|axis| a[axis] * b[axis]).sum()
    }

    #[test]
    fn a_path_on_a_ball_is_the_one_over_a_square_turned() {
        let square = SceneSettings::default();
        let mesh = TriangleMesh::new(ball(40.0, 3)).unwrap();
        for vertex in 0..mesh.points().len() {
            let start = SceneStart::on_mesh(&mesh, StartPlace::Vertex(vertex)).unwrap();
            let place = start.place;
            for path in ScenePath::ALL {
                for t in [0.0, 0.7, 1.5] {
                    let usual = path.at(t, &square);
                    let moved = start.moved(usual, &square);
                    let [held, wanted] =
                        [stylus_axis(moved.turn), start.turned(stylus_axis(usual.turn))];
                    // Near a pole the arc cosine loses half of the digits.
                    assert!(
                        (0..3).all(|axis| (held[axis] - wanted[axis]).abs() < 1e-7),
                        "{vertex}"
                    );
                    let way = [0, 1, 2].map(|axis| moved.at[axis] - place[axis]);
                    let [x, y, _] = square.middle();
                    let aside = [usual.at[0] - x, usual.at[1] - y, usual.at[2]];
                    // Some roundings of 40 mm.
                    assert!((dot(way, start.out) - usual.at[2]).abs() < 1e-11, "{vertex}");
                    assert!((dot(way, way) - dot(aside, aside)).abs() < 1e-9, "{vertex}");
                }
            }
        }
        let start = SceneStart::of_square(&square);
        let usual = ScenePath::Drag.at(1.234, &square);
        assert_eq!(start.moved(usual, &square), usual);
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
            let axis = stylus_axis(turn);
            assert!(axis.into_iter().zip(up).all(|(part, wanted)| (part - wanted).abs() < 1e-12));
        }
        let axis = stylus_axis([0.3, -1.1, 2.0]);
        assert!((dot(axis, axis) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_turn_has_no_jump_near_down() {
        let start = |out| SceneStart { place: [0.0; 3], out, at: [0.0; 3], middle: [0.0; 3] };
        assert_eq!(start([0.0, 0.0, -1.0]).turned([1.0, 2.0, 3.0]), [1.0, -2.0, -3.0]);
        // Down by a thousandth of rad, about x as well.
        let (sin, cos) = 1e-3_f64.sin_cos();
        let turned = start([0.0, sin, -cos]).turned([1.0, 2.0, 3.0]);
        let expected = [1.0, -2.0 * cos + 3.0 * sin, -3.0 * cos - 2.0 * sin];
        for (part, expected) in turned.into_iter().zip(expected) {
            // The small difference 1 - cos has lost seven digits.
            assert!((part - expected).abs() < 1e-8, "{turned:?}");
        }
    }

    #[test]
    fn a_place_without_room_before_it_is_refused() {
        // Two balls whose surfaces are 5 mm apart.
        let mut soup = ball(20.0, 3);
        let count = soup.points.len() as u32;
        let moved: Vec<_> = soup.points.iter().map(|[x, y, z]| [x + 45.0, *y, *z]).collect();
        soup.points.extend(moved);
        let faces: Vec<_> = soup.faces.iter().map(|face| face.map(|one| one + count)).collect();
        soup.faces.extend(faces);
        let mesh = TriangleMesh::new(soup).unwrap();
        let at = |place| SceneStart::on_mesh(&mesh, place);
        assert_eq!(at(StartPlace::Near([20.0, 0.0, 0.0])), Err(MeshSceneError::StartBuried));
        let free = at(StartPlace::Near([-22.0, 0.0, 0.0])).unwrap();
        assert!((free.place[0] + 20.0).abs() < 0.2 && free.at[0] < -29.5, "{free:?}");
        assert_eq!(free.middle, free.place);
        assert_eq!(at(StartPlace::Near([0.0, 90.0, 0.0])), Err(MeshSceneError::StartFar));
        let vertices = 2 * count as usize;
        let beyond = at(StartPlace::Vertex(vertices));
        assert_eq!(beyond, Err(MeshSceneError::StartVertex { vertex: vertices, vertices }));
    }
}
