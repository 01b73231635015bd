//! Normals, depths and sizes in pixels against the reference.
#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests fail and print as tests do"
)]

use super::off_screen;
use super::ray_caster::{Hit, HitKind, Reference, angle};
use palpate_tissue_view::{
    Camera, DetailLevel, Eye, EyeLayout, FIELD_OF_VIEW, FieldData, Image, LEVELS, MeshData,
    Picture, Probe, ProbeKind, SurfaceData, SurfaceStyle,
};
use std::sync::Arc;

const SIDE: usize = 61;
const SPACING: f64 = 1.0;
const SIZE: [u32; 2] = [240, 150];
/// A finger that stands in the dent, its tip below the surface at rest.
const FINGER: ([f64; 3], f64) = ([30.0, 30.0, -0.2], 5.5);

/// A dent with a steep wall and waves on it, so that normals point everywhere.
fn reference(finger: Option<([f64; 3], f64)>) -> Reference {
    let heights = (0..SIDE * SIDE).map(|index| {
        let [x, y] = [index % SIDE, index / SIDE].map(|step| step as f64 * SPACING - 30.0);
        let r = x.hypot(y);
        -5.5 / (1.0 + (r / 8.0).powi(6)) + 0.25 * (0.7 * x).sin() * (0.5 * y).cos()
    });
    Reference { side: SIDE, spacing: SPACING, heights: heights.collect(), finger }
}

fn picture(reference: &Reference, eyes: EyeLayout) -> Picture {
    let field = FieldData::new(SIDE, SPACING, &reference.heights).unwrap();
    let mut camera = Camera::of(field.extent()).looking_at([30.0, 30.0, 0.0]);
    camera.orbit(0.3, -0.1);
    camera.zoom(1.5);
    Picture {
        surface: Arc::new(SurfaceData::Field(field)),
        probe: reference
            .finger
            .map(|(centre, radius)| Probe::new(centre, radius).unwrap().of_kind(ProbeKind::Glove)),
        camera,
        eyes,
        look: SurfaceStyle::tissue(SurfaceStyle::LIGHT),
        level: LEVELS[0],
    }
}

/// What a pixel of the picture has: its kind, normal and distance.
fn drawn_hit([x, y, z, distance]: [f32; 4]) -> Option<Hit> {
    let kind = if distance < 0.0 { HitKind::Probe } else { HitKind::Tissue };
    let normal = [x, y, z].map(f64::from);
    (distance != 0.0).then_some(Hit { kind, normal, distance: f64::from(distance.abs()) })
}

/// The pixels beside one, itself left out, those outside the picture too.
fn neighbours(index: usize, [wide, high]: [u32; 2]) -> Vec<usize> {
    let [wide, high] = [wide as usize, high as usize];
    let (column, row) = (index % wide, index / wide);
    let columns = column.saturating_sub(1)..=(column + 1).min(wide - 1);
    let rows = row.saturating_sub(1)..=(row + 1).min(high - 1);
    let all = rows.flat_map(|row| columns.clone().map(move |column| row * wide + column));
    all.filter(|other| *other != index).collect()
}

/// A jump of the distance to a neighbouring pixel beyond this, in mm, is an edge of what is seen: a slope that is seen at 5
/// degrees makes steps of 3 mm with these pixels of a quarter of a millimetre.
const JUMP_MM: f64 = 3.0;

/// The largest change of normal in degrees and of distance in mm to a neighbouring pixel; `None` at a silhouette, and where nothing
/// is.
fn change(wanted: &[Option<Hit>], index: usize, size: [u32; 2]) -> Option<[f64; 2]> {
    let here = wanted[index]?;
    let mut largest = [0.0_f64; 2];
    for other in neighbours(index, size) {
        let there = wanted[other].filter(|there| there.kind == here.kind)?;
        let jump = (there.distance - here.distance).abs();
        if jump > JUMP_MM {
            return None;
        }
        largest = [largest[0].max(angle(here.normal, there.normal)), largest[1].max(jump)];
    }
    Some(largest)
}

/// Compares a picture with the reference; prints the mean and the 99 % error of its normals.
///
/// A vertex is placed to a sixteenth of a pixel at worst (Vulkan, subPixelPrecisionBits: at least 4), so what a pixel shows may be what the
/// reference sees a sixteenth of a pixel beside: the tolerance is a sixteenth of the change to the next pixel. To that
/// come roundings of single precision: 0.001 degrees are 150 of them for a normal; 1e-5 of a distance are 80.
pub fn compare(wanted: &[Option<Hit>], image: &Image<[f32; 4]>, name: &str) {
    assert_eq!(wanted.len(), image.pixels.len());
    let (mut errors, mut above, mut kinds) = (Vec::new(), 0, 0);
    for (index, pixel) in image.pixels.iter().enumerate() {
        let Some([turn, jump]) = change(wanted, index, image.size) else { continue };
        let (Some(wanted), Some(drawn)) = (wanted[index], drawn_hit(*pixel)) else {
            panic!("{name}: nothing is drawn at pixel {index}");
        };
        kinds += usize::from(wanted.kind != drawn.kind);
        let error = angle(wanted.normal, drawn.normal);
        let far = (wanted.distance - drawn.distance).abs();
        let is_above = error > turn / 16.0 + 1e-3 || far > jump / 16.0 + 1e-5 * wanted.distance;
        above += usize::from(is_above);
        errors.push(error);
    }
    errors.sort_by(f64::total_cmp);
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let late = errors[errors.len() * 99 / 100];
    println!(
        "{name}: {} pixels, mean {mean:.5}, 99 % {late:.5} degrees, {above} above",
        errors.len()
    );
    assert!(errors.len() > wanted.len() / 4, "{name}: {} pixels", errors.len());
    assert_eq!(kinds, 0, "{name}: tissue and probe are exchanged");
    // A facet of the probe's polygon is up to 0.0005 of the radius inside, which moves its edges.
    assert!(above * 100 <= errors.len(), "{name}: {above} of {}", errors.len());
}

#[test]
fn normals_and_distances_are_those_of_the_heights() {
    let Some(mut off_screen) = off_screen() else { return };
    let reference = reference(None);
    let picture = picture(&reference, EyeLayout::Single);
    let image = off_screen.normals(&picture, SIZE).unwrap();
    compare(&reference.picture(&picture.camera, Eye::Single, SIZE), &image, "field");
}

#[test]
fn a_mesh_of_the_same_triangles_gives_the_same_picture() {
    let Some(mut off_screen) = off_screen() else { return };
    let reference = reference(None);
    let mut picture = picture(&reference, EyeLayout::Single);
    let field = off_screen.normals(&picture, SIZE).unwrap();
    let place = |index: usize| {
        let [x, y] = [index % SIDE, index / SIDE].map(|step| step as f64 * SPACING);
        [x, y, reference.heights[index]]
    };
    let places: Vec<[f64; 3]> = (0..SIDE * SIDE).map(place).collect();
    let normals = vec![[0.0, 0.0, 1.0]; places.len()];
    let cells = (0..SIDE - 1).flat_map(|row| (0..SIDE - 1).map(move |column| row * SIDE + column));
    let indices = cells.flat_map(|first| {
        let [a, b, c, d] = [first, first + 1, first + SIDE + 1, first + SIDE];
        [a, b, c, a, c, d].map(|index| index as u32)
    });
    let mesh = MeshData::new(&places, &normals, indices.collect()).unwrap();
    picture.surface = Arc::new(SurfaceData::Mesh(mesh));
    let mesh = off_screen.normals(&picture, SIZE).unwrap();
    for (field, mesh) in field.pixels.iter().zip(&mesh.pixels) {
        // The matrix is the same, the places differ by roundings of single precision.
        assert!((field[3] - mesh[3]).abs() <= 1e-4 * field[3].abs(), "{field:?} {mesh:?}");
        assert!(mesh[3] == 0.0 || mesh[2] == 1.0, "{mesh:?}");
    }
}

#[test]
fn the_probe_is_behind_the_near_rim_of_its_dent_and_before_the_far_one() {
    let Some(mut off_screen) = off_screen() else { return };
    let reference = reference(Some(FINGER));
    let mut picture = picture(&reference, EyeLayout::Single);
    // So low that the near rim is in front of the tip.
    picture.camera.orbit(0.0, -0.3);
    let wanted = reference.picture(&picture.camera, Eye::Single, SIZE);
    let bare = Reference { side: 2, spacing: 60.0, heights: vec![-100.0; 4], finger: Some(FINGER) };
    let alone = bare.picture(&picture.camera, Eye::Single, SIZE);
    let probe = |hits: &[Option<Hit>]| {
        hits.iter().flatten().filter(|hit| hit.kind == HitKind::Probe).count()
    };
    // The rim hides a part of the tip, or the test would be none.
    assert!(probe(&wanted) + 100 < probe(&alone), "{} {}", probe(&wanted), probe(&alone));
    let image = off_screen.normals(&picture, SIZE).unwrap();
    compare(&wanted, &image, "finger in a dent");
    // Where the sides of the block are drawn nothing else changes.
    let mut thick = picture.clone();
    thick.look.thickness_mm = 8.0;
    let sides = off_screen.normals(&thick, SIZE).unwrap();
    for ((wanted, with), without) in wanted.iter().zip(&sides.pixels).zip(&image.pixels) {
        assert!(wanted.is_none() || drawn_hit(*without).is_none() || with == without);
    }
}

#[test]
fn each_eye_sees_its_own_picture() {
    let Some(mut off_screen) = off_screen() else { return };
    let reference = reference(Some(FINGER));
    let picture = picture(&reference, EyeLayout::SideBySide);
    let [wide, high] = [SIZE[0] / 2, SIZE[1] / 2];
    let image = off_screen.normals(&picture, [2 * wide, high]).unwrap();
    for (eye, first) in [(Eye::Left, 0), (Eye::Right, wide as usize)] {
        let rows = image.pixels.chunks_exact(2 * wide as usize);
        let half = rows.flat_map(|row| row[first..first + wide as usize].to_vec());
        let half = Image { size: [wide, high], pixels: half.collect() };
        let wanted = reference.picture(&picture.camera, eye, half.size);
        compare(&wanted, &half, &format!("{eye:?} eye"));
    }
}

#[test]
fn the_tip_is_as_large_as_its_radius_is_from_there() {
    let Some(mut off_screen) = off_screen() else { return };
    let size = [480_u32, 300];
    // The surface is far below; half of the tip is free of the shaft.
    let field = FieldData::new(2, 60.0, &[-200.0; 4]).unwrap();
    for radius in [1.5, 6.0, 12.0] {
        let centre = [30.0, 30.0, 20.0];
        let mut camera = Camera::of([60.0; 2]).looking_at(centre);
        camera.orbit(0.4, -9.0);
        let picture = Picture {
            surface: Arc::new(SurfaceData::Field(field.clone())),
            probe: Some(Probe::new(centre, radius).unwrap()),
            camera,
            eyes: EyeLayout::Single,
            look: SurfaceStyle::tissue(SurfaceStyle::DARK),
            level: LEVELS[0],
        };
        let image = off_screen.normals(&picture, size).unwrap();
        let lower = &image.pixels[image.pixels.len() / 2..];
        let area = lower.iter().filter(|pixel| pixel[3] < 0.0).count() as f64;
        let measured = (2.0 * area / std::f64::consts::PI).sqrt();
        // The cone around a sphere touches it at a right angle.
        let distance = camera.distance_mm();
        let tangent = radius / (distance * distance - radius * radius).sqrt();
        let wanted = f64::from(size[1]) / 2.0 / (FIELD_OF_VIEW / 2.0).tan() * tangent;
        println!("radius {radius} mm: {measured:.3} pixels, projected {wanted:.3}");
        // Counting pixels of a disc errs by less than a third of a pixel of its radius; the polygon of 96 sides by 0.0006.
        assert!((measured - wanted).abs() < 0.33, "{measured} {wanted}");
    }
}

#[test]
fn thinned_nodes_stay_where_they_are() {
    let Some(mut off_screen) = off_screen() else { return };
    let reference = reference(None);
    let mut picture = picture(&reference, EyeLayout::Single);
    picture.level = DetailLevel { every: 3, ..LEVELS[1] };
    let image = off_screen.normals(&picture, SIZE).unwrap();
    // Every third node of 61 is a mesh of 21 that has the same corners; its normals are still those of the full heights.
    let nodes = (0..SIDE * SIDE)
        .filter(|index| (index % SIDE).is_multiple_of(3) && (index / SIDE).is_multiple_of(3));
    let heights = nodes.map(|index| reference.heights[index]).collect();
    let thin = Reference { side: 21, spacing: 3.0, heights, finger: None };
    let wanted = thin.picture(&picture.camera, Eye::Single, SIZE);
    let mut far = 0;
    for (index, pixel) in image.pixels.iter().enumerate() {
        let Some([_, jump]) = change(&wanted, index, SIZE) else { continue };
        let (Some(wanted), Some(drawn)) = (wanted[index], drawn_hit(*pixel)) else {
            panic!("nothing is drawn at pixel {index}");
        };
        let error = (wanted.distance - drawn.distance).abs();
        far += usize::from(error > jump / 16.0 + 1e-5 * wanted.distance);
    }
    assert!(far * 100 <= wanted.len(), "{far}");
}
