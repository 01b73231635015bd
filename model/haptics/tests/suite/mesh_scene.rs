//! A scene on a mesh against the scene on a grid, and on a stomach.

use super::mesh_support::{apart, mesh};
use palpate_haptics::scene::{
    HandLedMeshScene, HandLedScene, HandPose, MeshScene, MeshSceneError, MeshSceneSettings,
    NoForceReason, Pose, Scene, ScenePath, SceneSettings, StartPlace,
};
use palpate_haptics::triangles::shapes::{phantom, plate, stomach};
use palpate_haptics::triangles::{DentSettings, MaterialMap, Shading, TriangleMesh};
use std::sync::Arc;

fn settings(mesh: TriangleMesh) -> MeshSceneSettings {
    let scene = SceneSettings::default();
    let mesh = Arc::new(mesh);
    MeshSceneSettings {
        materials: MaterialMap::one(&mesh),
        bodies: vec![scene.body],
        shading: Shading::Smooth,
        dent: DentSettings::default(),
        start: StartPlace::Middle,
        mesh,
        scene,
    }
}

/// The square of tissue as two scenes: every number of every tick but those of nodes, on each path of the hand. Roundings grow a
/// little through the law's memory; flags and reasons are the same.
#[test]
fn a_flat_mesh_feels_like_the_grid() {
    let flat = settings(mesh(plate([60.0, 60.0], [31, 27])));
    for path in ScenePath::ALL {
        let mut led = HandLedScene::new(flat.scene).unwrap();
        let mut grid = Scene::new(flat.scene).unwrap();
        let mut other = MeshScene::new(&flat).unwrap();
        let mut contacts = 0;
        for tick in 0..(path.seconds() * 1000.0) as u64 {
            led.tick(path.at(1e-3 * tick as f64, &flat.scene));
            let pose = Pose { at: led.scene.last().device, turn: led.scene.last().turn };
            let [a, b] = [grid.render(pose, 1), other.render(pose, 1)];
            assert_eq!(
                (a.tick, a.flags, a.no_force_reason),
                (b.tick, b.flags, b.no_force_reason),
                "{path} {tick}"
            );
            assert!(apart(a.force, b.force) < 1e-9, "{path} {tick}: {:?} {:?}", a.force, b.force);
            assert!(apart(a.proxy, b.proxy) < 1e-9 && (a.depth - b.depth).abs() < 1e-9);
            assert!((a.energy - b.energy).abs() < 1e-8 && (a.speed - b.speed).abs() < 1e-6);
            contacts += usize::from(a.is_contact());
        }
        assert!(contacts > 500, "{path}: {contacts}");
    }
}

#[test]
fn a_hand_presses_a_stomach() {
    let settings = settings(mesh(stomach()));
    let start = settings.start().unwrap().at;
    let run = || {
        let mut led = HandLedMeshScene::new(&settings).unwrap();
        let mut deepest = 0.0f64;
        for tick in 0..3000 {
            let down = 0.02 * f64::from(tick.min(3000 - tick));
            let hand = HandPose { at: [start[0], start[1], start[2] - down], turn: [0.0; 3] };
            let one = led.tick(hand);
            assert!(one.force.iter().all(|part| part.is_finite()));
            if one.is_contact() {
                assert!(one.no_force_reason != NoForceReason::NoContact);
            }
            deepest = deepest.max(one.depth);
        }
        (deepest, led.scene.last(), led.scene.hash())
    };
    let (deepest, last, hash) = run();
    assert!(deepest > 2.0, "{deepest}");
    assert_eq!((deepest, last, hash), run());
    assert_eq!(last.depth, 0.0);
}

#[test]
fn a_scene_needs_a_body_for_each_material() {
    let soup = phantom();
    let colours = soup.colours.clone();
    let mut one = settings(mesh(soup));
    one.materials = MaterialMap::from_colours(&one.mesh, &colours, 2).unwrap();
    let refused = MeshScene::new(&one).unwrap_err();
    assert_eq!(refused, MeshSceneError::Bodies { materials: 2, bodies: 1 });
    one.bodies.push(one.scene.body);
    MeshScene::new(&one).unwrap();
}
