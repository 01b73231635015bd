//! Triangles become a mesh, or are refused.

use super::mesh_support::{apart, dot, mesh, minus, uniform};
use palpate_haptics::triangles::shapes::{STOMACH_FACES, ball, cuboid, phantom, plate, stomach};
use palpate_haptics::triangles::{MOST_FACES, TriangleMesh, TriangleMeshError, TriangleSoup};
use palpate_model::random::SplitMix;

fn refused(soup: TriangleSoup) -> TriangleMeshError {
    TriangleMesh::new(soup).expect_err("no mesh")
}

fn triangle() -> TriangleSoup {
    let points = vec![[0.0; 3], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
    TriangleSoup { points, faces: vec![[0, 1, 2]], colours: Vec::new() }
}

#[test]
fn what_is_no_mesh_is_refused() {
    use TriangleMeshError as Error;
    assert_eq!(refused(TriangleSoup::default()), Error::Empty);
    let many = TriangleSoup { faces: vec![[0, 1, 2]; MOST_FACES + 1], ..triangle() };
    assert_eq!(refused(many), Error::TooManyFaces { faces: MOST_FACES + 1, most: MOST_FACES });
    for bad in [f64::NAN, f64::INFINITY] {
        let mut soup = triangle();
        soup.points[1][2] = bad;
        assert_eq!(refused(soup), Error::NotANumber { vertex: 1 });
    }
    let beyond = TriangleSoup { faces: vec![[0, 1, 2], [0, 3, 1]], ..triangle() };
    assert_eq!(refused(beyond), Error::Index { face: 1, vertex: 3, vertices: 3 });
    let flat =
        TriangleSoup { points: vec![[0.0; 3], [10.0, 0.0, 0.0], [5.0, 0.0, 0.0]], ..triangle() };
    assert!(matches!(refused(flat), Error::NoArea { face: 0, .. }));
    let twice = TriangleSoup { faces: vec![[0, 1, 2], [0, 1, 1]], ..triangle() };
    assert!(matches!(refused(twice), Error::NoArea { face: 1, .. }));
    let mut fins = triangle();
    fins.points.extend([[5.0, -10.0, 0.0], [5.0, 0.0, 10.0]]);
    fins.faces.extend([[1, 0, 3], [0, 1, 4]]);
    assert_eq!(refused(fins), Error::ThirdFace { face: 2, at: [5.0, 0.0, 0.0] });
    let colours = TriangleSoup { colours: vec![[1.0; 3]], ..triangle() };
    assert_eq!(refused(colours), Error::Colours { given: 1, vertices: 3 });
    let scaled = |factor: f64| {
        let mut soup = triangle();
        soup.points.iter_mut().flatten().for_each(|part| *part *= factor);
        soup
    };
    assert!(matches!(refused(scaled(1e4)), Error::TooLarge { size_mm, .. } if size_mm == 1e5));
    assert!(matches!(refused(scaled(0.05)), Error::TooSmall { size_mm, .. } if size_mm == 0.5));
}

#[test]
fn a_moebius_strip_has_no_outer_side() {
    let count = 12u32;
    let mut soup = TriangleSoup::default();
    for step in 0..count {
        let turn = std::f64::consts::TAU * f64::from(step) / f64::from(count);
        for side in [-5.0, 5.0] {
            let out = 30.0 + side * (0.5 * turn).cos();
            soup.points.push([out * turn.cos(), out * turn.sin(), side * (0.5 * turn).sin()]);
        }
    }
    for step in 0..count {
        let [a, b] = [2 * step, 2 * step + 1];
        let [c, d] = if step + 1 < count { [a + 2, b + 2] } else { [1, 0] };
        soup.faces.extend([[a, b, c], [b, d, c]]);
    }
    assert!(matches!(refused(soup), TriangleMeshError::NoSides { .. }));
}

/// A cuboid as STL has it, every corner three times and some triangles the wrong way round.
#[test]
fn loose_triangles_are_welded_and_turned_outwards() {
    let mut random = SplitMix::seeded(7);
    let whole = cuboid([30.0, 20.0, 10.0]);
    for inside_out in [false, true] {
        let mut soup = TriangleSoup::default();
        let mut wrong = 0;
        for face in &whole.faces {
            let first = soup.points.len() as u32;
            // A hundred-millionth of the size apart, as by roundings of single precision.
            soup.points.extend(face.map(|vertex| {
                whole.points[vertex as usize].map(|part| part + uniform(&mut random, -1e-7, 1e-7))
            }));
            let is_wrong = random.below(2) == 0 || inside_out;
            wrong += usize::from(is_wrong);
            let [a, b] = if is_wrong { [2, 1] } else { [1, 2] };
            soup.faces.push([first, first + a, first + b]);
        }
        let mesh = mesh(soup);
        assert_eq!(mesh.points().len(), 8);
        assert_eq!((mesh.open_edges(), mesh.parts(), mesh.turned()), (0, 1, wrong));
        let middle = [15.0, 10.0, 5.0];
        for (face, normal) in mesh.faces().iter().zip(mesh.face_normals()) {
            let out = minus(mesh.points()[face[0] as usize], middle);
            assert!(dot(out, *normal) > 0.0);
        }
        // Corners of a cube: equal angles make the diagonal.
        for (point, normal) in mesh.points().iter().zip(mesh.vertex_normals()) {
            let expected = minus(*point, middle).map(|part| part.signum() / 3.0f64.sqrt());
            assert!(apart(*normal, expected) < 1e-6, "{normal:?} {expected:?}");
        }
    }
}

#[test]
fn open_edges_are_counted_and_left_open() {
    let open = mesh(plate([10.0, 10.0], [4, 3]));
    assert_eq!((open.open_edges(), open.parts()), (14, 1));
    let mut cup = cuboid([10.0; 3]);
    cup.faces.truncate(11);
    let cup = mesh(cup);
    assert_eq!((cup.open_edges(), cup.faces().len()), (3, 11));
    // Most triangles as they were.
    let mut bent = plate([10.0, 10.0], [4, 4]);
    bent.faces.iter_mut().take(5).for_each(|face| face.swap(0, 1));
    let bent = mesh(bent);
    assert_eq!(bent.turned(), 5);
    assert!(bent.face_normals().iter().all(|normal| normal[2] > 0.99));
}

#[test]
fn two_parts_are_each_turned_outwards() {
    let mut soup = ball(10.0, 1);
    let other = ball(5.0, 1);
    let first = soup.points.len() as u32;
    soup.points.extend(other.points.iter().map(|point| [point[0] + 30.0, point[1], point[2]]));
    soup.faces.extend(other.faces.iter().map(|[a, b, c]| [a + first, c + first, b + first]));
    let mesh = mesh(soup);
    assert_eq!(mesh.parts(), 2);
    for (face, normal) in mesh.faces().iter().zip(mesh.face_normals()) {
        let point = mesh.points()[face[0] as usize];
        let middle = if point[0] > 15.0 { [30.0, 0.0, 0.0] } else { [0.0; 3] };
        assert!(dot(minus(point, middle), *normal) > 0.0);
    }
}

#[test]
fn the_examples_are_closed_surfaces_of_the_size_that_they_say() {
    let stomach = mesh(stomach());
    assert_eq!(stomach.faces().len(), STOMACH_FACES);
    assert_eq!((stomach.open_edges(), stomach.parts(), stomach.turned()), (0, 1, 0));
    let [low, high] = stomach.bounds();
    let long = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    assert!((180.0..260.0).contains(&long), "{long}");
    let soup = phantom();
    assert!(soup.colours.iter().any(|colour| colour[1] == 1.0));
    let phantom = mesh(soup);
    assert_eq!((phantom.faces().len(), phantom.open_edges(), phantom.turned()), (20_480, 0, 0));
    // Smooth: no edge of more than a few degrees but at the stomach's two poles.
    let sharp = stomach.vertex_normals().iter().zip(stomach.points()).filter(|(normal, point)| {
        let nearest = stomach.nearest(**point, 1.0).expect("on it");
        dot(stomach.face_normals()[nearest.face as usize], **normal) < 0.99
    });
    assert!(sharp.count() < 400);
}
