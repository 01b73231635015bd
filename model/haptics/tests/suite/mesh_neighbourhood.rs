//! Distances along a mesh and dents, against planes and spheres; nothing allocates.

use super::mesh_support::{apart, dot, mesh, plus, uniform, unit};
use super::mesh_touch::sliding;
use palpate_haptics::surface::SurfaceRecovery;
use palpate_haptics::triangles::shapes::{ball, plate, stomach};
use palpate_haptics::triangles::{
    Dent, DentSettings, GeodesicDistance, MaterialMap, MeshTouchLoop, MeshTouchSettings, Shading,
    TriangleMesh,
};
use palpate_haptics::{LawSettings, Period};
use palpate_model::Seconds;
use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;

/// A plate with its inner vertices moved at random.
fn rough_plate(seed: u64) -> TriangleMesh {
    let mut soup = plate([40.0, 40.0], [40, 40]);
    let mut random = SplitMix::seeded(seed);
    for [x, y, _] in &mut soup.points {
        if *x > 0.5 && *x < 39.5 && *y > 0.5 && *y < 39.5 {
            *x += uniform(&mut random, -0.2, 0.2);
            *y += uniform(&mut random, -0.2, 0.2);
        }
    }
    mesh(soup)
}

/// Exact on a plane, whatever its triangles. Where a source is near the line of an edge its height is the root of a difference of
/// roundings, 1e-8 of the distance, over and over; and just within the reach a vertex beyond is missing. A ten-thousandth of a mm is less
/// than a hundredth of a device's step.
#[test]
fn distances_on_a_plane_are_straight() {
    for seed in 0..5 {
        let mesh = rough_plate(50 + seed);
        let mut distances = GeodesicDistance::new(&mesh);
        let mut random = SplitMix::seeded(60 + seed);
        for _ in 0..20 {
            let place = [uniform(&mut random, 1.0, 39.0), uniform(&mut random, 1.0, 39.0), 0.0];
            let from = mesh.nearest(place, 1.0).expect("on the plate");
            let reach = uniform(&mut random, 1.0, 20.0);
            distances.search(&mesh, &from, reach);
            let found: Vec<_> = distances.found().collect();
            for (vertex, distance) in &found {
                let straight = apart(mesh.points()[*vertex as usize], place);
                assert!((distance - straight).abs() < 1e-4, "{distance} {straight}");
            }
            let inside = mesh.points().iter().filter(|point| apart(**point, place) <= reach - 1e-4);
            assert!(inside.count() <= found.len());
        }
    }
}

/// Against arcs on a sphere of 20 mm up to 30 mm: the error falls with the edge.
#[test]
fn distances_on_a_ball_are_arcs() {
    let radius = 20.0;
    let mut errors = Vec::new();
    for times in [3, 4, 5] {
        let mesh = mesh(ball(radius, times));
        let mut distances = GeodesicDistance::new(&mesh);
        let (mut worst, mut low, mut high) = (0.0f64, 0.0f64, 0.0f64);
        let mut random = SplitMix::seeded(70);
        for _ in 0..30 {
            let from = mesh.nearest(
                super::mesh_support::direction(&mut random).map(|part| radius * part),
                5.0,
            );
            let from = from.expect("on the ball");
            distances.search(&mesh, &from, 30.0);
            for (vertex, distance) in distances.found() {
                let cosine = dot(unit(mesh.points()[vertex as usize]), unit(from.point));
                let arc = radius * cosine.clamp(-1.0, 1.0).acos();
                worst = worst.max((distance - arc).abs());
                if arc > 2.0 {
                    low = low.min(distance / arc - 1.0);
                    high = high.max(distance / arc - 1.0);
                }
            }
        }
        println!("{times}: worst {worst} mm, relative {low} to {high}");
        errors.push(worst);
    }
    assert!(errors[0] < 0.6 && errors[1] < 0.3 && errors[2] < 0.15, "{errors:?}");
}

#[test]
fn a_dent_is_as_deep_as_the_contact_less_the_slope_times_the_distance() {
    let mesh = rough_plate(80);
    let settings = DentSettings { slope: 0.5, reach_mm: 30.0, ..DentSettings::default() };
    let mut dent = Dent::new(&mesh, settings).unwrap();
    let place = [20.3, 19.1, 0.0];
    let at = mesh.nearest(place, 1.0).unwrap();
    let report = dent.tick(&mesh, Some((&at, 4.0)));
    assert!(!report.is_cut && report.moved > 150);
    for (vertex, point) in mesh.points().iter().enumerate() {
        let expected = (4.0 - 0.5 * apart(*point, place)).max(0.0);
        assert!((dent.sunk()[vertex] - expected).abs() < 1e-6);
        let now = dent.place(&mesh, vertex as u32, 1.0);
        assert!(apart(now, plus(*point, -expected, [0.0, 0.0, 1.0])) < 1e-6);
    }
    // Elastic: at rest at once.
    assert_eq!(dent.tick(&mesh, None), palpate_haptics::triangles::DentTick::default());
    assert!(dent.sunk().iter().all(|sunk| *sunk == 0.0));
    // With a time constant each is at exp(-t / tau) of it, and no steeper than before.
    let recovery = SurfaceRecovery::new(Seconds(0.1), Seconds(0.001)).unwrap();
    let mut slow = Dent::new(&mesh, DentSettings { recovery, ..settings }).unwrap();
    slow.tick(&mesh, Some((&at, 4.0)));
    let first = slow.sunk().to_vec();
    for tick in 1..=100 {
        slow.tick(&mesh, None);
        let share = (-0.01 * f64::from(tick)).exp();
        // A nanometre is how far beyond rest a vertex aims.
        assert!(
            first.iter().zip(slow.sunk()).all(|(first, now)| (first * share - now).abs() < 2e-6)
        );
    }
    for _ in 0..2000 {
        slow.tick(&mesh, None);
    }
    assert!(slow.moved_vertices().is_empty());
    // A reach that is shorter than the dent cuts it and says so.
    let mut short = Dent::new(&mesh, DentSettings { reach_mm: 2.0, ..settings }).unwrap();
    let report = short.tick(&mesh, Some((&at, 4.0)));
    assert!(report.is_cut && report.moved < 25);
    assert!(Dent::new(&mesh, DentSettings { slope: 0.0, ..settings }).is_err());
    assert!(Dent::new(&mesh, DentSettings { reach_mm: f64::NAN, ..settings }).is_err());
}

#[test]
fn a_tick_on_a_mesh_allocates_nothing() {
    let mesh = Arc::new(mesh(stomach()));
    let law = LawSettings::of(ModifiedKelvin::THESIS, Period::MILLISECOND);
    let recovery = SurfaceRecovery::new(Seconds(0.5), Seconds(0.001)).unwrap();
    let settings = MeshTouchSettings {
        laws: vec![law; 2],
        friction: 0.2,
        shading: Shading::Smooth,
        dent: DentSettings { recovery, ..DentSettings::default() },
    };
    let mut touched = MeshTouchLoop::new(mesh.clone(), MaterialMap::one(&mesh), &settings).unwrap();
    let path: Vec<_> = (0..1500).map(|step| sliding(&mesh, step, 3.0)).collect();
    let mut contacts = 0;
    let counted = allocation_counter::measure(|| {
        for device in &path {
            contacts += usize::from(touched.tick(*device).contact.touch.is_contact());
        }
    });
    assert_eq!(counted.count_total, 0);
    assert!(contacts > 1000, "{contacts}");
    // And the same bits again.
    let again = |mut touched: MeshTouchLoop| {
        path.iter().map(|device| touched.tick(*device)).collect::<Vec<_>>()
    };
    let fresh = || MeshTouchLoop::new(mesh.clone(), MaterialMap::one(&mesh), &settings).unwrap();
    assert_eq!(again(fresh()), again(fresh()));
}
