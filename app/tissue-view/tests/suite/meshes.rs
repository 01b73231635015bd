//! Meshes of triangles: a ball against its closed form, an organ with a dent against rays, colours of a painted phantom.
#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do")]

use super::colours::linear;
use super::off_screen;
use super::ray_caster::{Hit, HitKind, angle, corners_of, dot, picture_of};
use super::shapes::compare;
use palpate_haptics::surface::SurfaceRecovery;
use palpate_haptics::triangles::shapes::{NODULE_MM, ball, phantom};
use palpate_haptics::triangles::{Dent, DentSettings, MaterialMap, TriangleMesh};
use palpate_tissue_view::{
    Camera, ColourRamp, DetailLevel, ElasticModel, Eye, EyeLayout, Image, LEVELS, MeshData,
    MeshShape, ModelQuantity, MovedNode, OffScreen, Picture, PictureShape, Probe, ProbeKind,
    SurfaceData, SurfaceStyle,
};
use std::sync::Arc;

const SIZE: [u32; 2] = [240, 150];
const WIDE: PictureShape = PictureShape { aspect: 1.6, eyes: EyeLayout::Single };
/// Half axes of the organ in mm.
const ORGAN: [f64; 3] = [50.0, 35.0, 25.0];

fn picture(mesh: MeshData, camera: Camera) -> Picture {
    Picture {
        surface: Arc::new(SurfaceData::Mesh(mesh)),
        probe: None,
        camera,
        eyes: EyeLayout::Single,
        look: SurfaceStyle::tissue(SurfaceStyle::LIGHT),
        level: LEVELS[0],
    }
}

/// An organ of 5120 triangles.
fn organ() -> TriangleMesh {
    let mut soup = ball(1.0, 4);
    for point in &mut soup.points {
        *point = [0, 1, 2].map(|axis| ORGAN[axis] * point[axis]);
    }
    TriangleMesh::new(soup).unwrap()
}

/// The nodes that sink under a contact 6 mm deep on the top, as the loop computes them.
fn dent(mesh: &TriangleMesh) -> Vec<MovedNode> {
    let settings =
        DentSettings { slope: 0.5, recovery: SurfaceRecovery::NONE, ..DentSettings::default() };
    let mut dent = Dent::new(mesh, settings).unwrap();
    let at = mesh.nearest([8.0, -6.0, 60.0], 100.0).unwrap();
    dent.tick(mesh, Some((&at, 6.0)));
    let moved = dent.moved_vertices().iter().map(|&node| MovedNode {
        node,
        place: dent.place(mesh, node, 1.0),
        depth_mm: dent.sunk()[node as usize],
    });
    moved.collect()
}

fn shape(mesh: &TriangleMesh) -> MeshShape {
    MeshShape::new(mesh.points(), mesh.faces()).unwrap()
}

#[test]
fn normals_of_a_ball_are_its_radii() {
    let Some(mut off_screen) = off_screen() else { return };
    const RADIUS: f64 = 30.0;
    let mesh = TriangleMesh::new(ball(RADIUS, 5)).unwrap();
    let data = shape(&mesh).at_rest();
    let camera = Camera::around([[-RADIUS; 3], [RADIUS; 3]]).fitted(mesh.bounds(), WIDE);
    let image = off_screen.normals(&picture(data, camera), SIZE).unwrap();
    let half = SIZE.map(|side| f64::from(side) / 2.0);
    let eye = camera.eye(Eye::Single);
    let mut errors = Vec::new();
    for (index, [x, y, z, distance]) in image.pixels.iter().enumerate() {
        if *distance == 0.0 {
            continue;
        }
        let at = [index as u32 % SIZE[0], index as u32 / SIZE[0]].map(|part| f64::from(part) + 0.5);
        let way =
            camera.ray([(at[0] - half[0]) / half[1], (half[1] - at[1]) / half[1]], Eye::Single);
        // Where the ray meets the sphere itself; none is at its silhouette.
        let (square, middle) = (dot(way, way), dot(eye, way));
        let inside = middle * middle - square * (dot(eye, eye) - RADIUS * RADIUS);
        if inside < 0.1 * square * RADIUS * RADIUS {
            continue;
        }
        let out = (-middle - inside.sqrt()) / square;
        let radius = [0, 1, 2].map(|axis| eye[axis] + out * way[axis]);
        errors.push(angle(radius, [x, y, z].map(|part| f64::from(*part))));
    }
    errors.sort_by(f64::total_cmp);
    let [mean, late] =
        [errors.iter().sum::<f64>() / errors.len() as f64, errors[errors.len() * 99 / 100]];
    println!("ball: {} pixels, mean {mean:.5}, 99 % {late:.5} degrees", errors.len());
    assert!(errors.len() > 5000, "{}", errors.len());
    // A triangle spans 1.2 degrees around its middle, which is 0.006 mm inside the sphere: seen at up to 72 degrees that
    // moves the place by 0.018 mm, which are 0.035 degrees. Interpolation between normals errs by a tenth of that.
    assert!(late < 0.04, "{late}");
}

#[test]
fn an_organ_with_a_dent_and_a_finger_in_it_is_what_rays_see() {
    let Some(mut off_screen) = off_screen() else { return };
    let mesh = organ();
    let moved = dent(&mesh);
    assert!(moved.len() > 20, "{}", moved.len());
    let mut places = mesh.points().to_vec();
    for node in &moved {
        places[node.node as usize] = node.place;
    }
    let data = shape(&mesh).displaced(moved).unwrap();
    let finger = ([8.0, -6.0, 23.5], 4.0);
    let mut camera = Camera::around(mesh.bounds()).fitted(mesh.bounds(), WIDE);
    camera.zoom(1.4);
    let mut picture = picture(data, camera);
    let probe = Probe::new(finger.0, finger.1).unwrap();
    picture.probe = Some(probe.of_kind(ProbeKind::Glove));
    let image = off_screen.normals(&picture, SIZE).unwrap();
    let corners = corners_of(&places, mesh.faces());
    let wanted = picture_of(&corners, Some(finger), &camera, (Eye::Single, SIZE));
    let seen = |kind| wanted.iter().flatten().filter(|hit: &&Hit| hit.kind == kind).count();
    assert!(seen(HitKind::Probe) > 300 && seen(HitKind::Tissue) > 5000);
    compare(&wanted, &image, "organ with a dent and a finger");
}

#[test]
fn only_what_moved_is_uploaded_and_the_picture_is_that_of_all() {
    let (Some(mut one), Some(mut other)) = (off_screen(), off_screen()) else { return };
    let mesh = organ();
    let shape = shape(&mesh);
    let camera = Camera::around(mesh.bounds()).fitted(mesh.bounds(), WIDE);
    let draw = |off_screen: &mut OffScreen, data: MeshData| {
        off_screen.normals(&picture(data, camera), SIZE).unwrap()
    };
    let rest = draw(&mut one, shape.at_rest());
    let after = draw(&mut one, shape.displaced(dent(&mesh)).unwrap());
    assert_ne!(rest, after);
    assert_eq!(after, draw(&mut other, shape.displaced(dent(&mesh)).unwrap()));
    assert_eq!(rest, draw(&mut one, shape.at_rest()));
    // Another mesh of as many nodes.
    let turned = MeshShape::new(mesh.points(), &mesh.faces()[1..]).unwrap();
    assert_eq!(draw(&mut one, turned.at_rest()), draw(&mut other, turned.at_rest()));
}

#[test]
fn a_thinned_organ_stays_where_it_is() {
    let Some(mut off_screen) = off_screen() else { return };
    let mesh = organ();
    let data = shape(&mesh).displaced(dent(&mesh)).unwrap();
    let camera = Camera::around(mesh.bounds()).fitted(mesh.bounds(), WIDE);
    let mut picture = picture(data, camera);
    let full = off_screen.normals(&picture, SIZE).unwrap();
    let count =
        |image: &Image<[f32; 4]>| image.pixels.iter().filter(|pixel| pixel[3] > 0.0).count();
    // Back and forth: what was left out comes back.
    for every in [2, 3, 4, 1] {
        picture.level = DetailLevel { every, ..LEVELS[1] };
        let image = off_screen.normals(&picture, SIZE).unwrap();
        let pairs = image.pixels.iter().zip(&full.pixels);
        let both = pairs.filter(|(one, other)| one[3] > 0.0 && other[3] > 0.0);
        let mut off: Vec<f32> = both.map(|(one, other)| (one[3] - other[3]).abs()).collect();
        off.sort_by(f32::total_cmp);
        let median = off[off.len() / 2];
        println!("every {every}: {} of {} pixels, {median:.3} mm off", count(&image), count(&full));
        if every == 1 {
            assert_eq!(image, full);
        } else {
            assert_ne!(image, full);
        }
        // Edges are 3.6 mm, so a cell is up to 14 mm wide: a chord of that is 1 mm inside where the radius is 25 mm.
        assert!(median < 1.0 && count(&image) * 10 > count(&full) * 9);
    }
}

#[test]
fn a_nodule_at_rest_stands_out_by_its_stiffness() {
    let Some(mut off_screen) = off_screen() else { return };
    let soup = phantom();
    let colours = soup.colours.clone();
    let mesh = TriangleMesh::new(soup).unwrap();
    let map = MaterialMap::from_colours(&mesh, &colours, 2).unwrap();
    let materials = [[0.05, 0.0, 0.0], [0.25, 0.0, 0.0]].map(|mu| ElasticModel { mu });
    let vertices = 0..mesh.points().len() as u32;
    let models: Vec<ElasticModel> =
        vertices.map(|vertex| ElasticModel::blended(&materials, &map.at_vertex(vertex))).collect();
    let data = shape(&mesh).at_rest();
    let data = data.with_model_as_values(ModelQuantity::Stiffness, &models).unwrap();
    let camera = Camera::around(mesh.bounds()).fitted(mesh.bounds(), WIDE);
    let mut picture = picture(data, camera);
    let mut range = ModelQuantity::Stiffness.first_range();
    range.take(picture.surface.value_range().unwrap());
    assert_eq!(range.range(), [0.0, 0.5]);
    picture.look = SurfaceStyle::values(range.range(), SurfaceStyle::LIGHT);
    // Red alone is 0, green alone is 0.5 N/mm.
    picture.look.ramp = ColourRamp::new(&[[255, 0, 0], [0, 255, 0]]);
    let image = off_screen.colours(&picture, SIZE).unwrap();
    let on_top = mesh.nearest([NODULE_MM[0], NODULE_MM[1], 40.0], 100.0).unwrap().point;
    let beside = mesh.nearest([-20.0, -5.0, 40.0], 100.0).unwrap().point;
    for (place, share) in [(on_top, 0.5), (beside, 0.1)] {
        let [x, y] = camera.see(place, Eye::Single).unwrap().at;
        let half = SIZE.map(|side| f64::from(side) / 2.0);
        let [column, row] =
            [half[0] + x * half[1], half[1] - y * half[1]].map(|part| part as usize);
        let [red, green, _, _] = image.pixels[row * SIZE[0] as usize + column];
        let wanted = [1.0 - share, share].map(|part: f64| linear((part * 255.0).round() as u8));
        let [drawn, wanted] = [linear(green) / linear(red), wanted[1] / wanted[0]];
        // Eight bits of a dark channel of about 20 resolve it to 10 % of its light.
        assert!((drawn / wanted - 1.0).abs() < 0.15, "{share}: {red} {green}");
    }
}
