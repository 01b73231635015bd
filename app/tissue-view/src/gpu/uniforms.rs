//! The numbers of a scene as the shaders read them: `Scene` in `shaders/scene.wgsl`.

use crate::camera::{Eye, FIELD_OF_VIEW, Vec3, dot};
use crate::look::{SurfaceColours, linear};
use crate::picture::Picture;
use crate::probe::ProbeKind;
use crate::surface::SurfaceData;

/// Four numbers each.
pub(super) const ROWS: usize = 15;
pub(super) const BYTES: u64 = (ROWS * 16) as u64;

/// To the lamp and to the window: shares of right, up and away from the eye. They turn with the camera, so that relief
/// always has its light side on the left, as in drawings, and the film of water always shines.
const LAMP: Vec3 = [-0.52, 0.62, 0.30];
const WINDOW: Vec3 = [0.22, 0.62, 0.90];
/// Opacity of lines of equal depth.
const INK: f64 = 0.55;

fn row(parts: Vec3, last: f64) -> [f32; 4] {
    [parts[0], parts[1], parts[2], last].map(|part| part as f32)
}

/// Unit vector in the scene of a direction as the camera has it, with up as the scene has it.
fn turned(picture: &Picture, [to_right, up, ahead]: Vec3) -> Vec3 {
    let [right, _, away] = picture.camera.axes();
    let flat = away[0].hypot(away[1]).max(1e-9);
    let way = [
        to_right * right[0] + ahead * away[0] / flat,
        to_right * right[1] + ahead * away[1] / flat,
        up,
    ];
    let length = dot(way, way).sqrt();
    way.map(|part| part / length)
}

/// All numbers for an eye, in a picture of so many pixels.
pub(super) fn of(picture: &Picture, eye: Eye, [wide, high]: [u32; 2]) -> [[f32; 4]; ROWS] {
    let [wide, high] = [wide, high].map(f64::from);
    let size = picture.surface.size_mm();
    let look = &picture.look;
    let mut rows = [[0.0; 4]; ROWS];
    rows[..4].copy_from_slice(&picture.camera.view_projection(wide / high, eye));
    rows[4] = row(picture.camera.eye(eye), high / 2.0 / (FIELD_OF_VIEW / 2.0).tan());
    rows[5] = row(turned(picture, LAMP), 0.0);
    let is_field = matches!(*picture.surface, SurfaceData::Field(_));
    if let SurfaceData::Field(field) = &*picture.surface {
        let sides = [f64::from(field.columns), f64::from(field.rows), field.spacing_mm];
        rows[6] = row(sides, look.thickness_mm);
    }
    if let Some(probe) = &picture.probe {
        rows[7] = row(probe.centre, probe.radius);
        rows[8] = row(probe.axis, probe.length_mm(size));
        let is_glove = f64::from(u8::from(probe.kind == ProbeKind::Glove));
        rows[9] = row([probe.shaft_mm(), 1.0, is_glove], 0.0);
        if let (Some((point, normal)), false) = (probe.ground, is_field) {
            rows[6] = row(normal, dot(normal, point));
        }
    } else {
        rows[8] = [0.0, 0.0, 1.0, 1.0];
    }
    let has_values = match &*picture.surface {
        SurfaceData::Field(field) => !field.values.is_empty(),
        SurfaceData::Mesh(_) => true,
    };
    let (range, is_data, has_texture) = match look.colours {
        SurfaceColours::Tissue { has_texture } => ([0.0, 1.0], 0.0, has_texture),
        SurfaceColours::Values { range } if has_values => (range, 1.0, false),
        SurfaceColours::Values { .. } => ([0.0, 1.0], 0.0, false),
    };
    // A range without length has one colour.
    let greatest = if range[1] > range[0] { range[1] } else { range[0] + 1.0 };
    rows[10] = row([range[0], greatest, is_data], look.contour_mm.unwrap_or(0.0));
    let every = f64::from(picture.level.every.max(1));
    let texture = f64::from(u8::from(has_texture));
    rows[11] = row([every, texture, size], f64::from(u8::from(is_field)));
    rows[12] = row(linear(look.background), 1.0);
    rows[13] = row(linear(look.ink), INK);
    rows[14] = row(turned(picture, WINDOW), 0.0);
    rows
}
