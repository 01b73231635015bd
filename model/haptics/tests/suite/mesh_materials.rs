//! Several materials on a mesh.

use super::mesh_support::{mesh, plus};
use palpate_haptics::triangles::shapes::{NODULE_MM, phantom, plate};
use palpate_haptics::triangles::{
    BlendedLaw, DentSettings, MaterialError, MaterialMap, MeshTouchLoop, MeshTouchSettings,
    Shading, TriangleMesh,
};
use palpate_haptics::{ForceLaw, LawSettings, Period};
use palpate_model::units::Depth;
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;

fn law(stiffer: f64) -> LawSettings {
    let mut body = ModifiedKelvin::THESIS;
    body.mu = body.mu.map(|mu| stiffer * mu);
    LawSettings::of(body, Period::MILLISECOND)
}

#[test]
fn materials_blend_over_a_triangle() {
    let mut soup = plate([10.0, 10.0], [1, 1]);
    soup.colours = vec![[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.2, 0.2, 0.0], [0.0, 1.0, 0.0]];
    let colours = soup.colours.clone();
    let mesh = mesh(soup);
    let map = MaterialMap::from_colours(&mesh, &colours, 2).unwrap();
    let at = |x: f64, y: f64| {
        let shares = map.at(&mesh, &mesh.nearest([x, y, 0.0], 1.0).unwrap());
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        shares[1]
    };
    assert!((at(0.0, 0.0)).abs() < 1e-12);
    assert!((at(5.0, 0.0) - 0.5).abs() < 1e-12);
    assert!((at(0.0, 10.0) - 0.5).abs() < 1e-12);
    assert!((at(5.0, 2.5) - 0.5).abs() < 1e-12);
    let refused = |colours: &[[f64; 3]], materials| {
        MaterialMap::from_colours(&mesh, colours, materials).unwrap_err()
    };
    assert_eq!(refused(&colours[1..], 2), MaterialError::Colours { given: 3, vertices: 4 });
    assert_eq!(
        refused(&colours, 1),
        MaterialError::Material { vertex: 1, material: 1, materials: 1 }
    );
    assert_eq!(refused(&[[0.0; 3]; 4], 2), MaterialError::Unpainted(0));
    assert_eq!(refused(&[[f64::NAN; 3]; 4], 2), MaterialError::Unpainted(0));
    assert_eq!(refused(&colours, 9), MaterialError::Count(9));
}

#[test]
fn a_table_names_vertices_of_the_file() {
    let mesh = mesh(plate([10.0, 10.0], [1, 1]));
    let map = MaterialMap::from_csv(&mesh, "vertex,material\n1,1\n\n2,0,1\n2,1,3\n", 2).unwrap();
    let second = |vertex| map.at_vertex(vertex)[1];
    assert_eq!([0, 1, 2, 3].map(second), [0.0, 1.0, 0.75, 0.0]);
    let refused = |text: &str| MaterialMap::from_csv(&mesh, text, 2).unwrap_err();
    assert_eq!(refused("9,0"), MaterialError::Vertex { vertex: 9, vertices: 4 });
    assert_eq!(refused("0,2"), MaterialError::Material { vertex: 0, material: 2, materials: 2 });
    for bad in ["0", "0,x", "-1,0", "0,1,-1", "0,1,nan", "0,1,1,1"] {
        assert!(matches!(refused(bad), MaterialError::Line { line: 1, .. }), "{bad}");
    }
}

/// A blend is the sum of its laws by their shares, tick by tick.
#[test]
fn a_blend_is_the_sum_of_its_laws() {
    let start = Depth(-1.0);
    let mut blend = BlendedLaw::new(&[law(1.0), law(3.0)], start).unwrap();
    let mut laws = [law(1.0), law(3.0)].map(|one| ForceLaw::new(one, start).unwrap());
    for tick in 0..500 {
        let depth = Depth(-1.0 + 0.01 * f64::from(tick));
        let share = f64::from(tick) / 500.0;
        let forces = [0, 1].map(|index: usize| laws[index].tick(depth).force.0);
        let one = blend.tick(depth, &[1.0 - share, share, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!((one.force.0 - (forces[0] + share * (forces[1] - forces[0]))).abs() < 1e-12);
    }
    assert!(BlendedLaw::new(&[], start).is_err());
    assert!(BlendedLaw::new(&[law(1.0); 9], start).is_err());
}

/// The nodule of the phantom is as much stiffer as its material, and force does not jump across its border.
#[test]
fn a_nodule_is_felt_as_stiffer() {
    let soup = phantom();
    let colours = soup.colours.clone();
    let mesh = Arc::new(mesh(soup));
    let map = MaterialMap::from_colours(&mesh, &colours, 2).unwrap();
    let settings = MeshTouchSettings {
        laws: vec![law(1.0), law(4.0)],
        friction: 0.0,
        shading: Shading::Smooth,
        dent: DentSettings::default(),
    };
    let press = |x: f64| {
        let mut touched = MeshTouchLoop::new(mesh.clone(), map.clone(), &settings).unwrap();
        let top = surface_above(&mesh, x);
        let mut force = 0.0;
        for tick in 0..8000 {
            let depth = (0.002 * f64::from(tick) - 2.0).min(2.0);
            force = touched.tick(plus(top.0, -depth, top.1)).along.0;
        }
        force
    };
    // Held until the memory of the move has faded.
    let (soft, hard) = (press(-30.0), press(NODULE_MM[0]));
    assert!((hard / soft - 4.0).abs() < 0.1, "{soft} {hard}");
    let mut last = press(8.0);
    for step in 1..40 {
        let next = press(8.0 + 0.1 * f64::from(step));
        // A border of 3 mm: a tenth of a mm changes the force by a thirtieth of the difference, and a little for the curvature.
        assert!((next - last).abs() < (hard - soft) / 15.0);
        last = next;
    }
}

fn surface_above(mesh: &TriangleMesh, x: f64) -> ([f64; 3], [f64; 3]) {
    let hit = mesh.first_hit([x, 10.0, 100.0], [x, 10.0, 0.0]).expect("the top");
    (hit.point, mesh.face_normals()[hit.face as usize])
}
