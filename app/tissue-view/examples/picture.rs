//! A picture of a dent under a probe: `cargo run -p palpate-tissue-view --example picture -- OUT.png`.
//!
//! Further words: `depth` for colours of depth with lines, `dark` for a dark panel, `glove` for a finger, `stereo` for two
//! eyes, `hertz` for the closed form of an elastic half space in place of the haptic surface.

mod dent;

use dent::Dent;
use palpate_tissue_view::{
    EyeLayout, LEVELS, OffScreen, Picture, ProbeKind, SurfaceColours, SurfaceData, SurfaceStyle,
};
use std::error::Error;
use std::io::BufWriter;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let out = words.next().ok_or("the name of a PNG file is missing")?;
    let words: Vec<String> = words.collect();
    let has = |word: &str| words.iter().any(|one| one == word);
    let dent = if has("hertz") { Dent::hertz()? } else { Dent::haptic()? };
    let mut look =
        SurfaceStyle::tissue(if has("dark") { SurfaceStyle::DARK } else { SurfaceStyle::LIGHT });
    look.thickness_mm = 9.0;
    if has("depth") {
        look.colours = SurfaceColours::Values { range: [0.0, dent.depth_mm] };
        look.contour_mm = Some(1.0);
    }
    let mut probe = dent.probe;
    if has("glove") {
        probe = probe.of_kind(ProbeKind::Glove);
    }
    let level = words.iter().find_map(|word| word.parse::<usize>().ok()).unwrap_or(0);
    let picture = Picture {
        camera: dent.camera(),
        surface: Arc::new(SurfaceData::Field(dent.field.with_depth_as_values())),
        probe: (!has("bare")).then_some(probe),
        eyes: if has("stereo") { EyeLayout::SideBySide } else { EyeLayout::Single },
        look,
        level: LEVELS[level.min(LEVELS.len() - 1)],
    };
    let image = OffScreen::new()?.colours(&picture, [1280, 800])?;
    let file = BufWriter::new(std::fs::File::create(&out)?);
    let mut encoder = png::Encoder::new(file, image.size[0], image.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header()?.write_image_data(image.pixels.as_flattened())?;
    Ok(())
}
