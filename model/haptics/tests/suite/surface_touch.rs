//! Normals and the contact point against planes and paraboloids.

use palpate_haptics::surface::{
    ContactSide, Cut, Grid, GridNode, HeightField, Heights, Proxy, ProxyTouch, Surface,
    SurfaceContact, SurfaceMethod, SurfaceRecovery, TouchState,
};
use palpate_test_support::naive_surface as naive;
use palpate_test_support::record::Noise;

fn heights(grid: &Grid, of: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let h = grid.spacing();
    let nodes =
        (0..grid.rows()).flat_map(|row| (0..grid.columns()).map(move |column| (column, row)));
    nodes.map(|(column, row)| of(column as f64 * h, row as f64 * h)).collect()
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    let way = [0, 1, 2].map(|axis| a[axis] - b[axis]);
    dot(way, way).sqrt()
}

/// Normals of all nodes, row by row.
fn normals(heights: Heights) -> Vec<[f64; 3]> {
    let [columns, rows] = [heights.grid().columns(), heights.grid().rows()].map(|n| n as u16);
    let nodes = (0..rows).flat_map(|row| (0..columns).map(move |column| GridNode { column, row }));
    nodes.map(|node| heights.normal(node)).collect()
}

#[test]
fn normals_of_a_plane_are_its_normal_everywhere() {
    let grid = Grid::new(17, 9, 0.3).unwrap();
    for (a, b) in [(0.0, 0.0), (0.4, -1.3), (-3.0, 0.01)] {
        let plane = heights(&grid, |x, y| a * x + b * y);
        let plane = Heights::new(grid, &plane).unwrap();
        let expected = unit([-a, -b, 1.0]);
        for normal in normals(plane) {
            assert!(apart(normal, expected) < 1e-12);
            assert!((dot(normal, normal).sqrt() - 1.0).abs() < 1e-12);
        }
        for (x, y) in [(0.0, 0.0), (4.8, 2.4), (1.23, 0.77), (0.3, 0.6)] {
            let (z, normal) = plane.at(x, y).unwrap();
            assert!((z - a * x - b * y).abs() < 1e-12);
            assert!(apart(normal, expected) < 1e-12);
        }
        assert!(plane.at(4.9, 0.0).is_none() && plane.at(0.0, f64::NAN).is_none());
    }
    assert!(Heights::new(grid, &[0.0]).is_err());
}

#[test]
fn normals_of_a_paraboloid_converge_with_the_square_inside_and_the_spacing_at_the_edge() {
    let errors = |n: usize| {
        let h = 2.0 / (n - 1) as f64;
        let grid = Grid::new(n, n, h).unwrap();
        let bowl = heights(&grid, |x, y| 0.4 * (x - 0.9).powi(2) + 0.3 * x * y + 0.2 * y * y);
        let normals = normals(Heights::new(grid, &bowl).unwrap());
        let mut worst = [0.0f64; 2];
        for (index, normal) in normals.into_iter().enumerate() {
            let (column, row) = (index % n, index / n);
            let [x, y] = [column, row].map(|step| step as f64 * h);
            let exact = unit([-0.8 * (x - 0.9) - 0.3 * y, -0.3 * x - 0.4 * y, 1.0]);
            let edge = column == 0 || row == 0 || column + 1 == n || row + 1 == n;
            let worst = &mut worst[usize::from(edge)];
            *worst = worst.max(apart(normal, exact));
        }
        worst
    };
    let [coarse, fine] = [errors(17), errors(65)];
    // Spacings differ by 4: errors by 16 and 4.
    let [inside, edge] = [0, 1].map(|part| coarse[part] / fine[part]);
    assert!((13.0..19.0).contains(&inside), "{inside}");
    assert!((3.4..4.6).contains(&edge), "{edge}");
}

#[test]
fn normals_of_a_rough_surface_are_those_of_the_faces_around() {
    let mut random = Noise::seeded(1);
    let grid = Grid::new(40, 27, 0.5).unwrap();
    for _ in 0..60 {
        let mut z = heights(&grid, |x, y| (x - y).sin());
        z.iter_mut().for_each(|z| *z += 0.3 * random.normal());
        let found = normals(Heights::new(grid, &z).unwrap());
        for (normal, plain) in found.into_iter().zip(naive::normals(&z, 40, 0.5)) {
            assert!(apart(normal, plain) < 1e-12);
        }
    }
}

/// A plane tilted by a slope along x, and a proxy on it.
fn tilted(slope: f64) -> (Grid, Vec<f64>) {
    let grid = Grid::new(101, 101, 1.0).expect("a grid");
    let plane = heights(&grid, |x, _| slope * (x - 50.0));
    (grid, plane)
}

#[test]
fn without_friction_the_contact_point_is_the_nearest_of_the_plane() {
    let mut random = Noise::seeded(2);
    for slope in [0.0, 0.3, -1.7] {
        let (grid, plane) = tilted(slope);
        let plane = Heights::new(grid, &plane).unwrap();
        let mut proxy = Proxy::new(0.0).unwrap();
        let normal = unit([-slope, 0.0, 1.0]);
        for _ in 0..200 {
            let [x, y] = [0, 1].map(|_| 30.0 + 40.0 * random.uniform());
            let device = [x, y, slope * (x - 50.0) + 5.0 * random.normal()];
            let touch = proxy.follow(plane, device);
            let depth = -dot([x - 50.0, y, device[2]], normal);
            assert_eq!(touch.is_contact(), depth > 0.0);
            if depth > 0.0 {
                assert!((touch.depth - depth).abs() < 1e-9);
                let nearest = [0, 1, 2].map(|axis| device[axis] + depth * normal[axis]);
                assert!(apart(touch.point, nearest) < 1e-9);
                assert!(apart(touch.force(2.0), normal.map(|x| 2.0 * x)) < 1e-8);
            } else {
                assert_eq!((touch.point, touch.depth), (device, 0.0));
                assert_eq!(touch.force(2.0), [0.0; 3]);
            }
        }
    }
}

#[test]
fn friction_holds_up_to_its_cone_and_then_follows_at_its_edge() {
    let (grid, plane) = tilted(0.0);
    let plane = Heights::new(grid, &plane).unwrap();
    let mut proxy = Proxy::new(0.5).unwrap();
    proxy.follow(plane, [20.0, 50.0, 1.0]);
    // Straight down to 2 mm: friction holds 1 mm aside.
    assert_eq!(proxy.follow(plane, [20.0, 50.0, -2.0]).state, TouchState::Sticks);
    for tick in 0..300 {
        let aside = 0.01 * f64::from(tick);
        let touch = proxy.follow(plane, [20.0 + aside, 50.0, -2.0]);
        let behind = aside.min(1.0);
        assert!((20.0 + aside - touch.point[0] - behind).abs() < 1e-9);
        assert!((touch.depth - 2.0).abs() < 1e-12);
        let force = touch.force(3.0);
        assert!((force[0] + 3.0 * behind / 2.0).abs() < 1e-9 && (force[2] - 3.0).abs() < 1e-12);
        // Exactly at the edge either is right.
        if (aside - 1.0).abs() > 1e-6 {
            let slides = touch.state == TouchState::Slides;
            assert_eq!(slides, aside > 1.0, "{aside}");
        }
    }
}

#[test]
fn on_a_slope_a_contact_slips_where_the_slope_is_more_than_the_friction() {
    for slope in [0.1, 0.49, 0.51, 2.0] {
        let (grid, plane) = tilted(slope);
        let plane = Heights::new(grid, &plane).unwrap();
        let mut proxy = Proxy::new(0.5).unwrap();
        proxy.follow(plane, [50.0, 50.0, 0.5]);
        let touch = proxy.follow(plane, [50.0, 50.0, -3.0]);
        let sticks = touch.state == TouchState::Sticks;
        assert_eq!(sticks, slope < 0.5, "{slope}");
    }
}

/// A wavy surface and random paths over and into it.
fn wander(friction: f64, mut see: impl FnMut(&ProxyTouch, [f64; 3])) {
    let grid = Grid::new(61, 61, 0.5).expect("a grid");
    let waves = heights(&grid, |x, y| (0.5 * x).sin() + (0.4 * y).cos());
    let waves = Heights::new(grid, &waves).expect("heights");
    let mut random = Noise::seeded(3);
    let mut proxy = Proxy::new(friction).expect("a proxy");
    let mut device = [15.0, 15.0, 3.0];
    for tick in 0..20_000 {
        let z = -4.0 * (0.01 * f64::from(tick)).sin();
        device[0] = (device[0] + 0.05 * random.normal()).clamp(0.0, 30.0);
        device[1] = (device[1] + 0.05 * random.normal()).clamp(0.0, 30.0);
        device[2] = z;
        let touch = proxy.follow(waves, device);
        let below = waves.at(device[0], device[1]).is_some_and(|(height, _)| height > z);
        assert_eq!(touch.is_contact(), below);
        see(&touch, device);
    }
}

#[test]
fn the_contact_point_is_on_the_surface_within_its_cone() {
    let mut contacts = 0;
    wander(0.3, |touch, device| {
        if touch.is_contact() {
            contacts += 1;
            assert!(touch.depth > 0.0);
            assert!(dot(touch.aside, touch.normal).abs() < 1e-9);
            let way = [0, 1, 2].map(|axis| touch.point[axis] - device[axis]);
            let parts = [0, 1, 2].map(|a| touch.depth * touch.normal[a] + touch.aside[a]);
            assert!(apart(way, parts) < 1e-12);
        }
    });
    assert!(contacts > 5000);
}

#[test]
fn a_fast_straight_poke_does_not_pop_through() {
    let grid = Grid::new(61, 61, 0.5).unwrap();
    let waves = heights(&grid, |x, y| (0.5 * x).sin() + (0.4 * y).cos());
    let waves = Heights::new(grid, &waves).unwrap();
    let slope = heights(&grid, |x, _| 0.4 * (x - 15.0));
    let slope = Heights::new(grid, &slope).unwrap();
    for step in [0.1, 3.0, 1000.0] {
        let poke = |surface: Heights, friction, is_monotone: bool| {
            let mut proxy = Proxy::new(friction).unwrap();
            let mut last = 0.0;
            for tick in 0..200 {
                let z = 4.0 - step * f64::from(tick);
                let touch = proxy.follow(surface, [14.3, 15.1, z]);
                assert_eq!(touch.is_contact(), z < surface.at(14.3, 15.1).unwrap().0);
                assert!(touch.depth >= last || !is_monotone);
                assert!(touch.depth.is_finite());
                last = touch.depth;
            }
            assert!(last > 0.0);
        };
        poke(slope, 0.0, true);
        poke(slope, 0.2, true);
        // Held where it came in, so that its normal stays; sliding over waves the normal turns.
        poke(waves, 10.0, true);
        poke(waves, 0.2, false);
    }
    // A slanting way enters where it crosses the surface.
    let flat = [0.0; 61 * 61];
    let flat = Heights::new(grid, &flat).unwrap();
    let mut proxy = Proxy::new(10.0).unwrap();
    proxy.follow(flat, [10.0, 15.0, 3.0]);
    let touch = proxy.follow(flat, [14.0, 15.0, -1.0]);
    assert!((touch.point[0] - 13.0).abs() < 1e-6, "{:?}", touch.point);
}

#[test]
fn places_that_are_none_give_no_contact_and_say_why() {
    let (grid, plane) = tilted(0.0);
    let plane = Heights::new(grid, &plane).unwrap();
    let mut proxy = Proxy::new(0.5).unwrap();
    let free = proxy.follow(plane, [1.0, 1.0, 1.0]);
    assert_eq!(free.state, TouchState::Free);
    for device in [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, f64::NAN]] {
        let touch = proxy.follow(plane, device);
        assert_eq!((touch.state, touch.point), (TouchState::NotANumber, [1.0; 3]));
        assert_eq!(touch.force(1.0), [0.0; 3]);
    }
    let outside = proxy.follow(plane, [-1.0, 1.0, -1.0]);
    assert_eq!(outside.state, TouchState::Outside);
    let deep = proxy.follow(plane, [1.0, 1.0, -f64::MAX]);
    assert!(deep.point.iter().chain(&deep.normal).all(|part| part.is_finite()));
    assert!(deep.depth.is_finite() && deep.force(1.0).iter().all(|part| part.is_finite()));
    for friction in [-0.1, f64::NAN, 11.0] {
        assert!(Proxy::new(friction).is_err());
    }
}

#[test]
fn depth_is_of_the_rest_surface_for_the_one_that_followed_the_tool_has_none() {
    let grid = Grid::new(51, 51, 0.5).unwrap();
    let field = HeightField::new(grid, vec![0.0; 51 * 51], 0.1).unwrap();
    let mut surface =
        Surface::new(field, SurfaceMethod::Envelope, SurfaceRecovery::ELASTIC, Cut::NONE);
    let device = [12.5, 12.5, -2.0];
    let tool = SurfaceContact { x: 12.5, y: 12.5, z: -2.0, side: ContactSide::Push };
    surface.tick(&[tool]);
    let depth = |surface| Proxy::new(0.0).unwrap().follow(surface, device).depth;
    assert!((depth(surface.field().at_rest()) - 2.0).abs() < 1e-12);
    assert_eq!(depth(surface.field().current()), 0.0);
}
