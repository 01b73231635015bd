//! Colours: those of data keep their hue, and the window shows what was drawn.

use super::off_screen;
use palpate_tissue_view::{
    Camera, ColourRamp, EyeLayout, FieldData, LEVELS, Picture, Probe, SurfaceData, SurfaceStyle,
};
use std::sync::Arc;

const SIZE: [u32; 2] = [160, 100];

fn picture(field: FieldData, look: SurfaceStyle) -> Picture {
    Picture {
        camera: Camera::of(field.extent()),
        surface: Arc::new(SurfaceData::Field(field)),
        probe: None,
        eyes: EyeLayout::Single,
        look,
        level: LEVELS[0],
    }
}

pub fn linear(value: u8) -> f64 {
    let share = f64::from(value) / 255.0;
    if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn a_value_has_the_hue_of_its_legend() {
    let Some(mut off_screen) = off_screen() else { return };
    let ramp = ColourRamp::new(&[[200, 60, 30], [30, 200, 90], [60, 90, 220]]);
    for (value, share) in [(2.0, 0.0), (3.0, 0.25), (4.0, 0.5), (6.0, 1.0), (9.0, 1.0)] {
        let field = FieldData::new(5, 10.0, &[0.0; 25]).unwrap();
        let field = field.with_values(vec![value; 25]).unwrap();
        let look = SurfaceStyle {
            ramp: ramp.clone(),
            ..SurfaceStyle::values([2.0, 6.0], SurfaceStyle::LIGHT)
        };
        let image = off_screen.colours(&picture(field, look), SIZE).unwrap();
        let middle = image.pixels[(SIZE[1] / 2 * SIZE[0] + SIZE[0] / 2) as usize];
        let wanted = ramp.at(share);
        let [red, green, blue] =
            [0, 1, 2].map(|channel| linear(middle[channel]) / linear(wanted[channel]));
        // Light and shade change all three alike; eight bits resolve a dark channel to 6 %.
        assert!(
            (red / green - 1.0).abs() < 0.06 && (blue / green - 1.0).abs() < 0.06,
            "{middle:?} {wanted:?}"
        );
        assert!((0.3..=1.0).contains(&green), "{green}");
    }
}

#[test]
fn the_window_shows_the_bytes_that_were_drawn() {
    let Some(mut off_screen) = off_screen() else { return };
    let heights: Vec<f64> = (0..31 * 31).map(|index| f64::from(index % 31 % 7) * 0.1).collect();
    let field = FieldData::new(31, 2.0, &heights).unwrap();
    let mut picture = picture(field, SurfaceStyle::tissue(SurfaceStyle::LIGHT));
    picture.probe = Some(Probe::new([30.0, 30.0, 5.0], 5.0).unwrap());
    let screen = off_screen.screen(SIZE);
    for level in LEVELS {
        picture.level = level;
        let drawn = off_screen.colours(&picture, SIZE).unwrap();
        let shown = off_screen.window(&picture, &screen).unwrap();
        assert_eq!(shown.size, SIZE);
        let [light, dark] = [u8::max, u8::min].map(|pick: fn(u8, u8) -> u8| {
            shown.pixels.iter().map(|pixel| pixel[1]).reduce(pick).unwrap()
        });
        assert!(light - dark > 60, "{level}: {dark} to {light}");
        if level.divisor > 1 {
            assert_eq!(drawn.size, SIZE.map(|side| side.div_ceil(level.divisor)));
            continue;
        }
        for (drawn, shown) in drawn.pixels.iter().zip(&shown.pixels) {
            // A rounding to eight bits each way.
            assert!((0..4).all(|at| drawn[at].abs_diff(shown[at]) <= 1), "{drawn:?} {shown:?}");
        }
    }
}

#[test]
fn the_background_is_the_panel() {
    let Some(mut off_screen) = off_screen() else { return };
    for background in [SurfaceStyle::LIGHT, SurfaceStyle::DARK] {
        let field = FieldData::new(3, 20.0, &[0.0; 9]).unwrap();
        let image =
            off_screen.colours(&picture(field, SurfaceStyle::tissue(background)), SIZE).unwrap();
        let [red, green, blue] = background;
        assert_eq!(image.pixels[0], [red, green, blue, 255]);
    }
}

#[test]
fn lines_of_equal_depth_are_where_the_depth_is() {
    let Some(mut off_screen) = off_screen() else { return };
    // A plane that goes down along x: 6 mm over 60, with a line every 2 mm.
    let heights: Vec<f64> = (0..61 * 61).map(|index| -0.1 * f64::from(index % 61)).collect();
    let field = FieldData::new(61, 1.0, &heights).unwrap().with_rest(&[0.0; 61 * 61]).unwrap();
    let mut look = SurfaceStyle::values([0.0, 1.0], SurfaceStyle::LIGHT);
    look.ink = [0, 0, 0];
    let field = field.with_values(vec![1.0; 61 * 61]).unwrap();
    let mut picture = picture(field, look);
    let bare = off_screen.colours(&picture, [640, 400]).unwrap();
    picture.look.contour_mm = Some(2.0);
    let lined = off_screen.colours(&picture, [640, 400]).unwrap();
    let pairs = bare.pixels.iter().zip(&lined.pixels);
    let darker = pairs.filter(|(bare, lined)| bare[1] > lined[1].saturating_add(25)).count();
    // Lines at 2 and 4 mm, and half of one at 6: each about 250 pixels long and two wide.
    assert!((600..2500).contains(&darker), "{darker}");
}
