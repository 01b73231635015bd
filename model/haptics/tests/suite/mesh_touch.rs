//! The contact point on meshes against planes, balls, corners and slow searches.

use super::mesh_support::{
    apart, corners, direction, distance_to, dot, hit_share, length, mesh, minus, plus, uniform,
    unit, within,
};
use palpate_haptics::surface::TouchState;
use palpate_haptics::triangles::shapes::{ball, cuboid, plate, stomach};
use palpate_haptics::triangles::{
    FAR_MM, MeshProxy, Shading, TriangleMesh, TriangleSoup, closest_on_triangle,
};
use palpate_model::random::SplitMix;

fn proxy(friction: f64, shading: Shading) -> MeshProxy {
    MeshProxy::new(friction, shading).expect("a proxy")
}

#[test]
fn the_nearest_point_of_a_triangle_is_that_of_its_plane_and_edges() {
    let mut random = SplitMix::seeded(11);
    let mut worst = 0.0f64;
    for _ in 0..20_000 {
        let mut place = || within(&mut random, [-2.0; 3], [2.0; 3]);
        let triangle = [place(), place(), place()];
        let at = place();
        let (point, _) = closest_on_triangle(triangle, at);
        // Roundings are of the size of the triangle over its height.
        let flat = length(super::mesh_support::cross(
            minus(triangle[1], triangle[0]),
            minus(triangle[2], triangle[0]),
        ));
        if flat > 1e-3 {
            worst = worst.max((apart(point, at) - distance_to(triangle, at)).abs());
        }
    }
    assert!(worst < 1e-9, "{worst}");
}

/// Every triangle, one after the other, for random places and ways around a stomach.
#[test]
fn the_tree_finds_what_a_search_of_all_triangles_finds() {
    let mesh = mesh(stomach());
    let [low, high] = mesh.bounds();
    let mut random = SplitMix::seeded(12);
    let all: Vec<_> = (0..mesh.faces().len()).map(|face| corners(&mesh, face)).collect();
    let mut hits = 0;
    for _ in 0..150 {
        let place = within(&mut random, low, high);
        let expected = all.iter().map(|one| distance_to(*one, place)).fold(f64::INFINITY, f64::min);
        let found = mesh.nearest(place, f64::INFINITY).expect("a point");
        assert!((apart(found.point, place) - expected).abs() < 1e-9);
        assert!(mesh.nearest(place, 0.999 * expected).is_none());
        let to = within(&mut random, low, high);
        let along = minus(to, place);
        // A closed surface is met from outside.
        let shares =
            all.iter().enumerate().filter(|(face, _)| dot(along, mesh.face_normals()[*face]) < 0.0);
        let least = shares
            .filter_map(|(_, one)| hit_share(*one, place, along))
            .fold(f64::INFINITY, f64::min);
        match mesh.first_hit(place, to) {
            Some(hit) => {
                hits += 1;
                assert!((hit.share - least).abs() < 1e-9, "{} {least}", hit.share);
            }
            None => assert!(least.is_infinite()),
        }
    }
    assert!(hits > 20, "{hits}");
}

#[test]
fn a_plane_gives_its_depth_and_its_normal() {
    let tilted = |point: [f64; 3]| {
        [point[0], 0.6 * point[1] - 0.8 * point[2], 0.8 * point[1] + 0.6 * point[2]]
    };
    let mut soup = plate([40.0, 40.0], [9, 7]);
    soup.points.iter_mut().for_each(|point| *point = tilted(*point));
    let mesh = mesh(soup);
    for shading in Shading::ALL {
        let mut random = SplitMix::seeded(13);
        let mut proxy = proxy(0.0, shading);
        proxy.follow(&mesh, tilted([20.0, 20.0, 5.0]));
        for _ in 0..2000 {
            let (x, y, depth) = (
                uniform(&mut random, 10.0, 30.0),
                uniform(&mut random, 10.0, 30.0),
                uniform(&mut random, -5.0, 5.0),
            );
            let contact = proxy.follow(&mesh, tilted([x, y, -depth]));
            assert!((contact.below - depth).abs() < 1e-12, "{} {depth}", contact.below);
            assert_eq!(contact.touch.is_contact(), depth > 0.0);
            if depth > 0.0 {
                assert!(apart(contact.touch.normal, tilted([0.0, 0.0, 1.0])) < 1e-12);
                assert!(apart(contact.touch.point, tilted([x, y, 0.0])) < 1e-12);
                let force = contact.touch.force(2.0);
                assert!(apart(force, tilted([0.0, 0.0, 2.0])) < 1e-12);
            }
        }
    }
}

/// Radial, with the depth below the sphere: chords of length `edge` are up to `edge^2 / 8 R` below it, and that is how far the
/// triangle's middle is, `edge^2 / 6 R` (a third of its height twice). Interpolated normals err by the change of sagitta over a triangle.
#[test]
fn a_ball_gives_the_depth_and_the_normal_of_a_sphere() {
    let radius = 25.0;
    for (times, edge) in [(3, 4.0), (4, 2.0), (5, 1.0)] {
        let mesh = mesh(ball(radius, times));
        let mut random = SplitMix::seeded(14);
        let sagitta = edge * edge / (6.0 * radius) * 1.3;
        let (mut off, mut turned) = (0.0f64, 0.0f64);
        for _ in 0..500 {
            let out = direction(&mut random);
            let depth = uniform(&mut random, 0.5, 6.0);
            let mut proxy = proxy(0.0, Shading::Smooth);
            assert!(!proxy.follow(&mesh, out.map(|part| (radius + 3.0) * part)).touch.is_contact());
            let contact = proxy.follow(&mesh, out.map(|part| (radius - depth) * part));
            off = off.max((contact.touch.depth - depth).abs());
            turned = turned.max(apart(contact.touch.normal, out));
        }
        println!("{times}: depth {off} normal {turned}");
        assert!(off < sagitta, "{times}: {off} {sagitta}");
        // Flat triangles turn by edge / radius; interpolated ones by a share of its square.
        assert!(turned < (edge / radius).powi(2), "{times}: {turned}");
    }
}

#[test]
fn flat_shading_has_the_force_along_the_way_to_the_nearest_point() {
    let mesh = mesh(ball(20.0, 3));
    let mut random = SplitMix::seeded(15);
    for _ in 0..300 {
        let out = direction(&mut random);
        let mut proxy = proxy(0.0, Shading::Flat);
        proxy.follow(&mesh, out.map(|part| 25.0 * part));
        let place = out.map(|part| uniform(&mut random, 18.0, 19.5) * part);
        let contact = proxy.follow(&mesh, place);
        let way = minus(contact.touch.point, place);
        assert!(apart(unit(way), contact.touch.normal) < 1e-9);
        assert!((length(way) - contact.touch.depth).abs() < 1e-12);
    }
}

/// In a box without a lid, from inside: one plane, two and three hold the contact point.
#[test]
fn floor_edge_and_corner_hold_with_one_two_and_three_planes() {
    let mut soup = cuboid([20.0; 3]);
    let top = |face: &[u32; 3]| face.iter().all(|vertex| vertex & 4 == 4);
    soup.faces.retain(|face| !top(face));
    soup.faces.iter_mut().for_each(|face| face.swap(1, 2));
    let mesh = mesh(soup);
    assert_eq!(mesh.open_edges(), 4);
    for shading in Shading::ALL {
        let mut proxy = proxy(0.0, shading);
        let mut touch = |place| {
            let contact = proxy.follow(&mesh, place);
            (contact.touch.point, contact.touch.depth, contact.touch.normal)
        };
        touch([10.0, 10.0, 5.0]);
        assert_eq!(touch([10.0, 12.0, -2.0]), ([10.0, 12.0, 0.0], 2.0, [0.0, 0.0, 1.0]));
        let (point, depth, normal) = touch([10.0, 23.0, -4.0]);
        assert_eq!(point, [10.0, 20.0, 0.0]);
        if shading == Shading::Flat {
            assert!((depth - 5.0).abs() < 1e-12 && apart(normal, [0.0, -0.6, 0.8]) < 1e-12);
        }
        let (point, ..) = touch([-1.0, 22.0, -2.0]);
        assert_eq!(point, [0.0, 20.0, 0.0]);
        if shading == Shading::Flat {
            let (_, depth, normal) = touch([-1.0, 22.0, -2.0]);
            assert!((depth - 3.0).abs() < 1e-12);
            assert!(apart(normal, [1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0]) < 1e-12);
        }
        // Back to the floor and out.
        let (point, depth, _) = touch([10.0, 10.0, -1.0]);
        assert_eq!((point, depth), ([10.0, 10.0, 0.0], 1.0));
        assert_eq!(touch([10.0, 10.0, 1.0]).1, 0.0);
    }
}

#[test]
fn one_triangle_is_touched_from_both_sides_and_left_over_its_rim() {
    let points = vec![[0.0; 3], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
    let mesh = mesh(TriangleSoup { points, faces: vec![[0, 1, 2]], colours: Vec::new() });
    for (side, shading) in [
        (1.0, Shading::Flat),
        (-1.0, Shading::Flat),
        (1.0, Shading::Smooth),
        (-1.0, Shading::Smooth),
    ] {
        let mut proxy = proxy(0.0, shading);
        let mut touch = |x: f64, y: f64, z: f64| proxy.follow(&mesh, [x, y, side * z]);
        assert_eq!(touch(2.0, 3.0, 1.0).touch.state, TouchState::Free);
        let contact = touch(2.0, 3.0, -4.0);
        assert_eq!((contact.touch.point, contact.touch.depth), ([2.0, 3.0, 0.0], 4.0));
        assert_eq!((contact.touch.normal, contact.side), ([0.0, 0.0, side], side));
        // Along below it, beyond its rim, and back: it is behind the triangle now and above nothing.
        assert!(touch(2.0, 0.1, -4.0).touch.is_contact());
        assert!(!touch(2.0, -0.1, -4.0).touch.is_contact());
        let behind = touch(2.0, 3.0, -4.0);
        assert_eq!((behind.touch.state, behind.below), (TouchState::Free, -4.0));
        // Through from the other side.
        let other = touch(2.0, 3.0, 1.0);
        assert_eq!((other.touch.normal, other.touch.depth), ([0.0, 0.0, -side], 1.0));
    }
}

#[test]
fn a_device_that_begins_inside_is_pushed_out_the_nearest_way() {
    let mesh = mesh(cuboid([20.0, 30.0, 40.0]));
    let contact = proxy(0.0, Shading::Flat).follow(&mesh, [3.0, 15.0, 20.0]);
    assert_eq!((contact.touch.point, contact.touch.depth), ([0.0, 15.0, 20.0], 3.0));
    assert_eq!(contact.touch.normal, [-1.0, 0.0, 0.0]);
}

#[test]
fn places_that_are_none_change_nothing_and_far_ones_are_far() {
    let mesh = mesh(ball(20.0, 3));
    let mut proxy = proxy(0.3, Shading::Smooth);
    let far = proxy.follow(&mesh, [0.0, 0.0, 500.0]);
    assert_eq!((far.touch.state, far.below, far.on), (TouchState::Free, -FAR_MM, None));
    proxy.follow(&mesh, [0.0, 0.0, 21.0]);
    let first = proxy.follow(&mesh, [0.0, 0.0, 18.0]);
    for bad in [f64::NAN, f64::INFINITY] {
        let contact = proxy.follow(&mesh, [0.0, bad, 18.0]);
        assert_eq!(contact.touch.state, TouchState::NotANumber);
        assert!(contact.below.is_finite());
    }
    let again = proxy.follow(&mesh, [0.0, 0.0, 18.0]);
    assert!((again.touch.depth - first.touch.depth).abs() < 1e-9);
    for far in [f64::MAX, -f64::MAX, 1e300] {
        let contact = proxy.follow(&mesh, [far, -far, far]);
        assert!(contact.touch.depth.is_finite() || !contact.touch.is_contact());
    }
}

/// On a plate the point stays while the device is within `friction * depth` aside, and then trails it by that.
#[test]
fn friction_holds_within_its_cone() {
    let mesh = mesh(plate([100.0, 100.0], [23, 31]));
    let mut proxy = proxy(0.5, Shading::Smooth);
    proxy.follow(&mesh, [40.0, 50.0, 1.0]);
    let first = proxy.follow(&mesh, [40.0, 50.0, -4.0]);
    assert!(first.touch.is_contact());
    for step in 1..=40 {
        let aside = 0.2 * f64::from(step);
        let contact = proxy.follow(&mesh, [40.0 + aside, 50.0, -4.0]);
        let trail = aside.min(2.0);
        assert!((40.0 + aside - contact.touch.point[0] - trail).abs() < 1e-9, "{step}");
        let expected = if aside > 2.0 + 1e-9 { TouchState::Slides } else { TouchState::Sticks };
        // At the cone's edge itself rounding decides.
        assert!(contact.touch.state == expected || (aside - 2.0).abs() < 1e-9);
        let force = contact.touch.force(8.0);
        assert!(apart(force, [-8.0 * trail / 4.0, 0.0, 8.0]) < 1e-9, "{force:?}");
    }
}

/// The mesh and the device moved together: the same contact, moved. Roundings of coordinates of up to 1000 mm, some thousand times.
#[test]
fn a_rigid_motion_moves_the_contact_with_it() {
    let turn = |point: [f64; 3]| {
        let (sin, cos) = 0.7f64.sin_cos();
        let [x, y, z] =
            [cos * point[0] - sin * point[1], sin * point[0] + cos * point[1], point[2]];
        let (sin, cos) = (-1.9f64).sin_cos();
        [x, cos * y - sin * z, sin * y + cos * z]
    };
    let moved = |point: [f64; 3]| plus(turn(point), 1.0, [300.0, -700.0, 150.0]);
    let here = mesh(stomach());
    let mut soup = stomach();
    soup.points.iter_mut().for_each(|point| *point = moved(*point));
    let there = mesh(soup);
    for shading in Shading::ALL {
        let mut one = proxy(0.3, shading);
        let mut other = proxy(0.3, shading);
        for step in 0..1500 {
            // Aside of vertices: exactly below one, roundings choose the triangle.
            let device = plus(sliding(&here, step, 2.5), 1.0, [0.031, 0.017, 0.023]);
            let [a, b] = [one.follow(&here, device), other.follow(&there, moved(device))];
            assert_eq!(a.touch.is_contact(), b.touch.is_contact(), "{step}");
            assert!(
                apart(moved(a.touch.point), b.touch.point) < 1e-6,
                "{step}: {}",
                apart(moved(a.touch.point), b.touch.point)
            );
            assert!(
                (a.below - b.below).abs() < 1e-7,
                "{step}: {} {} {:?} {:?}",
                a.below,
                b.below,
                a.on,
                b.on
            );
            if a.touch.is_contact() {
                assert!(apart(turn(a.touch.normal), b.touch.normal) < 1e-6);
            }
        }
    }
}

/// A device that follows a stomach's surface at a depth, slowly from vertex to vertex of a ring.
pub fn sliding(mesh: &TriangleMesh, step: usize, depth: f64) -> [f64; 3] {
    let first = 1 + 160 * 80;
    let share = (step % 10) as f64 / 10.0;
    let at = |index: usize| {
        let vertex = first + index % 160;
        plus(mesh.points()[vertex], -depth, mesh.vertex_normals()[vertex])
    };
    let start = at(0);
    if step < 10 {
        return plus(start, (1.0 - share) * (depth + 2.0), mesh.vertex_normals()[first]);
    }
    plus(at(step / 10 - 1), share, minus(at(step / 10), at(step / 10 - 1)))
}
