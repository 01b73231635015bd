//! Long paths on meshes: nothing falls through, nothing jumps, no energy comes from nowhere.

use super::mesh_support::{apart, direction, dot, length, mesh, minus, plus, uniform, within};
use super::mesh_touch::sliding;
use palpate_haptics::triangles::shapes::{ball, cuboid, plate, stomach};
use palpate_haptics::triangles::{MeshProxy, Shading};
use palpate_model::random::SplitMix;

fn proxy(friction: f64, shading: Shading) -> MeshProxy {
    MeshProxy::new(friction, shading).expect("a proxy")
}

/// A plate of 0.05 mm, poked by up to a metre in one tick: the contact is where the way goes in, the depth all that is beyond.
#[test]
fn fast_pokes_do_not_go_through_a_thin_plate() {
    let thick = 0.05;
    let mesh = mesh(cuboid([50.0, 50.0, thick]));
    let mut random = SplitMix::seeded(21);
    for _ in 0..10_000 {
        let from_above = random.below(2) == 0;
        let shading = Shading::ALL[random.below(2)];
        let mut proxy = proxy(0.0, shading);
        let above = within(&mut random, [5.0, 5.0, 0.01], [45.0, 45.0, 1.0]);
        let below = within(&mut random, [5.0, 5.0, -1000.0], [45.0, 45.0, -0.01]);
        let [z, other] =
            if from_above { [thick + above[2], below[2]] } else { [-above[2], thick - below[2]] };
        proxy.follow(&mesh, [above[0], above[1], z]);
        let contact = proxy.follow(&mesh, [below[0], below[1], other]);
        let (face, normal) = if from_above { (thick, 1.0) } else { (0.0, -1.0) };
        assert!(contact.touch.is_contact());
        assert_eq!(contact.touch.point[2], face);
        assert!((contact.touch.depth - normal * (face - other)).abs() < 1e-9);
        // Held there for as long as it is below the plate, wherever it goes.
        for _ in 0..3 {
            let next = within(&mut random, [5.0, 5.0, 0.0], [45.0, 45.0, 30.0]);
            let z = if from_above { -next[2] } else { thick + next[2] };
            let contact = proxy.follow(&mesh, [next[0], next[1], z]);
            assert!(contact.touch.is_contact() && contact.touch.point[2] == face);
        }
    }
}

/// Ten thousand random paths around and through a plate of 0.2 mm and a stomach: the point is on the surface or where the device
/// is, the device is outside whenever there is no contact, and every number is one.
#[test]
fn the_contact_point_is_never_inside() {
    let mut random = SplitMix::seeded(22);
    let plate = mesh(cuboid([20.0, 20.0, 0.2]));
    let stomach = mesh(stomach());
    let mut contacts = 0;
    for path in 0..10_000 {
        let (mesh, low, high) = if path % 2 == 0 {
            (&plate, [-5.0; 3], [25.0, 25.0, 5.0])
        } else {
            let [low, high] = stomach.bounds();
            (&stomach, low, high)
        };
        let mut proxy = proxy([0.0, 0.4][random.below(2)], Shading::ALL[random.below(2)]);
        // From outside.
        let mut device = plus(high, 1.0, [1.0, 2.0, 3.0]);
        proxy.follow(mesh, device);
        let mut way = within(&mut random, low, high);
        for _ in 0..8 {
            // Slow moves, fast ones and pokes across all of it.
            let share = [0.02, 0.2, 1.0][random.below(3)];
            device = plus(device, share, minus(way, device));
            if random.below(3) == 0 {
                way = within(&mut random, low, high);
            }
            let contact = proxy.follow(mesh, device);
            let point = contact.touch.point;
            if contact.touch.is_contact() {
                contacts += 1;
                let on = mesh.nearest(point, 1.0).expect("a point on the mesh");
                assert!(apart(on.point, point) < 1e-9, "{path}: {}", apart(on.point, point));
                assert!(contact.touch.depth >= 0.0 && contact.touch.depth.is_finite());
                assert!((length(contact.touch.normal) - 1.0).abs() < 1e-9);
            } else {
                assert_eq!(point, device);
                let nearest = mesh.nearest(device, 1000.0).expect("a point");
                assert!(mesh.is_outside(&nearest, device), "{path}");
            }
        }
    }
    assert!(contacts > 10_000, "{contacts}");
}

/// The largest change of a force in N/mm over the steps of a path, for a stiffness of 1 N/mm.
fn slope(
    path: impl Iterator<Item = [f64; 3]>,
    mesh: &palpate_haptics::triangles::TriangleMesh,
    shading: Shading,
) -> f64 {
    let mut proxy = proxy(0.0, shading);
    let mut last: Option<([f64; 3], [f64; 3])> = None;
    let mut worst = 0.0f64;
    for device in path {
        let contact = proxy.follow(mesh, device);
        let force = contact.touch.force(contact.touch.depth);
        if let Some((place, before)) = last {
            worst = worst.max(apart(force, before) / apart(device, place));
        }
        last = Some((device, force));
    }
    worst
}

/// Around a ball of radius R at depth d, a force of 1 N/mm turns by `d / (R - d)` N for each mm, and changes by 1 N into the ball.
/// Steps of 5 micrometres over some hundred edges: a jump of 0.05 micrometres would be seen as a hundredth of a N/mm.
#[test]
fn force_does_not_jump_over_edges() {
    let (radius, depth) = (20.0, 4.0);
    let mesh = mesh(ball(radius, 4));
    for seed in 0..4 {
        let mut random = SplitMix::seeded(30 + seed);
        let (a, b) = (direction(&mut random), direction(&mut random));
        let across = super::mesh_support::unit(minus(b, plus([0.0; 3], dot(a, b), a)));
        let path = |count: usize| {
            (0..count).map(move |step| {
                let angle = 0.005 * step as f64 / (radius - depth);
                let out = plus(a.map(|part| angle.cos() * part), angle.sin(), across);
                let deep = (0.01 * step as f64).min(depth);
                out.map(|part| (radius - deep) * part)
            })
        };
        let smooth = slope(path(12_000), &mesh, Shading::Smooth);
        // Depth grows by 2 mm for each mm along the path at first; thereafter the slope is that of a turn.
        assert!(smooth < 2.5, "{smooth}");
        let later = slope(path(12_000).skip(1000), &mesh, Shading::Smooth);
        let turn = depth / (radius - depth);
        assert!(later < 1.0 + turn, "{later}");
        // Flat triangles do jump: the test sees it.
        let flat = slope(path(12_000), &mesh, Shading::Flat);
        assert!(flat > 10.0, "{flat}");
    }
}

#[test]
fn force_does_not_jump_along_a_stomach() {
    let mesh = mesh(stomach());
    let path = (0..1590).flat_map(|step| {
        let [from, to] = [step, step + 1].map(|step| sliding(&mesh, step + 10, 2.0));
        (0..20).map(move |part| plus(from, f64::from(part) / 20.0, minus(to, from)))
    });
    let worst = slope(path.skip(400), &mesh, Shading::Smooth);
    assert!(worst < 2.0, "{worst}");
}

/// Work of the hand on a closed path through an elastic body of 1 N/mm, in N mm, by trapezoids.
fn loop_work(
    mesh: &palpate_haptics::triangles::TriangleMesh,
    shading: Shading,
    at: impl Fn(f64) -> [f64; 3],
    steps: usize,
) -> f64 {
    let mut proxy = proxy(0.0, shading);
    let mut last: Option<([f64; 3], [f64; 3])> = None;
    let mut work = 0.0;
    for step in 0..=steps {
        let device = at(step as f64 / steps as f64);
        let contact = proxy.follow(mesh, device);
        let force = contact.touch.force(contact.touch.depth);
        if let Some((place, before)) = last {
            let mean = plus(before, 1.0, force).map(|part| 0.5 * part);
            work -= dot(mean, minus(device, place));
        }
        last = Some((device, force));
    }
    work
}

/// Into a box and out of it again along random circles. The way out may be over another side: then the hand has given energy, and
/// never has it got any. With flat shading the force has a potential, half the square of the distance; where the point goes over an
/// edge the distance falls.
#[test]
fn a_closed_path_makes_no_energy() {
    let meshes = [mesh(cuboid([20.0; 3])), mesh(ball(12.0, 3)), mesh(plate([30.0, 30.0], [5, 5]))];
    let mut random = SplitMix::seeded(40);
    let (mut lost, mut smooth_gain) = (0, 0.0f64);
    for round in 0..150 {
        let mesh = &meshes[round % 3];
        let [low, high] = mesh.bounds();
        let middle = within(&mut random, low, high);
        let out = direction(&mut random);
        let across =
            super::mesh_support::unit(super::mesh_support::cross(out, direction(&mut random)));
        let radius = uniform(&mut random, 5.0, 25.0);
        let at = |share: f64| {
            let angle = std::f64::consts::TAU * share;
            plus(
                plus(plus(middle, radius, out), -radius * angle.cos(), out),
                radius * angle.sin(),
                across,
            )
        };
        // Begun outside, so that the start has no energy.
        let start = (0..60).map(|step| f64::from(step) / 60.0).find(|share| {
            let nearest = mesh.nearest(at(*share), 1000.0).expect("a point");
            mesh.is_outside(&nearest, at(*share)) && apart(nearest.point, at(*share)) > 0.5
        });
        let Some(start) = start else { continue };
        let work = loop_work(mesh, Shading::Flat, |share| at(start + share), 20_000);
        // A trapezoid over the tick of contact or of a jump errs by a step's way (0.008 mm) times half the jump of force (25 N at
        // most); there are few of them, and where the force falls it errs to the hand's loss.
        assert!(work > -0.1, "{round}: {work}");
        lost += usize::from(work > 1.0);
        smooth_gain =
            smooth_gain.max(-loop_work(mesh, Shading::Smooth, |share| at(start + share), 4000));
    }
    assert!(lost > 5, "{lost}");
    println!("largest energy from a smooth loop: {smooth_gain} N mm");
}
