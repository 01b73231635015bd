//! A picture of tissue under a probe: `cargo run -p palpate-tissue-view --example picture -- OUT.png`.
//!
//! Without a further word it is a dent in a square of heights. Further words: `stomach`, `phantom` or `pressed-phantom` for
//! a mesh; `depth`, `force` or `stiffness` for colours with a legend, which is printed; `lines` for lines of equal depth;
//! `dark` for a dark panel, `glove` for a finger, `stereo` for two eyes, `bare` for no probe, `narrow` for a picture higher than wide,
//! `hertz` for the closed form of an elastic half space in place of the haptic surface, a number for the level of detail.

mod dent;
mod organ;

use dent::Dent;
use organ::Organ;
use palpate_tissue_view::{
    Camera, ElasticModel, EyeLayout, GrowingRange, LEVELS, Legend, ModelQuantity, OffScreen,
    Picture, PictureShape, Probe, ProbeKind, SurfaceData, SurfaceStyle,
};
use std::error::Error;
use std::io::BufWriter;
use std::sync::Arc;

/// Height of the block's sides in mm.
const THICKNESS: f64 = 9.0;
/// Pig stomach, equation 3.5 of the thesis that palpate implements.
const STOMACH: ElasticModel = ElasticModel { mu: [0.05333, -0.0086, 0.0004345] };

/// What is drawn: with the values of a quantity, or of depth.
fn surface(
    has: impl Fn(&str) -> bool,
    quantity: Option<ModelQuantity>,
    shape: PictureShape,
) -> Result<(SurfaceData, Option<Probe>, Camera), Box<dyn Error>> {
    let organ = match () {
        () if has("stomach") => Some(Organ::stomach()?),
        () if has("phantom") => Some(Organ::phantom()?),
        () if has("pressed-phantom") => Some(Organ::pressed_phantom()?),
        () => None,
    };
    if let Some(organ) = organ {
        let mesh = organ.shape.displaced(organ.moved(1.0))?;
        let mesh = match quantity {
            Some(quantity) => mesh.with_model_as_values(quantity, &organ.models)?,
            None => mesh.with_depth_as_values(),
        };
        return Ok((SurfaceData::Mesh(mesh), organ.probe, organ.camera(shape)));
    }
    let dent = if has("hertz") { Dent::hertz()? } else { Dent::haptic()? };
    let camera = if shape.aspect < 1.0 || has("stereo") {
        let [[x, y, _], high] = dent.field.bounds();
        dent.camera().fitted([[x, y, -THICKNESS], high], shape)
    } else {
        dent.camera()
    };
    let field = match quantity {
        Some(quantity) => dent.field.with_model_as_values(quantity, &STOMACH),
        None => dent.field.with_depth_as_values(),
    };
    Ok((SurfaceData::Field(field), Some(dent.probe), camera))
}

#[expect(clippy::print_stdout, reason = "an example that prints its legend")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let out = words.next().ok_or("the name of a PNG file is missing")?;
    let words: Vec<String> = words.collect();
    let has = |word: &str| words.iter().any(|one| one == word);
    let size = if has("narrow") { [480, 800] } else { [1280, 800] };
    let eyes = if has("stereo") { EyeLayout::SideBySide } else { EyeLayout::Single };
    let quantity = match () {
        () if has("force") => Some(ModelQuantity::Force),
        () if has("stiffness") => Some(ModelQuantity::Stiffness),
        () => None,
    };
    let shape = PictureShape::new(size.map(f64::from), eyes);
    let (surface, probe, camera) = surface(has, quantity, shape)?;
    let background = if has("dark") { SurfaceStyle::DARK } else { SurfaceStyle::LIGHT };
    let mut look = SurfaceStyle::tissue(background);
    if quantity.is_some() || has("depth") {
        let mut range = quantity.map_or(GrowingRange::to(1.0), ModelQuantity::first_range);
        range.take(surface.value_range().unwrap_or_default());
        look = SurfaceStyle::values(range.range(), background);
        let title = quantity.map_or("depth (mm)", ModelQuantity::title);
        let legend = Legend::new(title, range.range());
        let numbers: Vec<&str> = legend.ticks.iter().map(|tick| tick.text.as_str()).collect();
        println!("{}: {}", legend.title, numbers.join(" "));
    }
    look.contour_mm = has("lines").then_some(1.0);
    look.thickness_mm = THICKNESS;
    let kind = if has("glove") { ProbeKind::Glove } else { ProbeKind::Steel };
    let level = words.iter().find_map(|word| word.parse::<usize>().ok()).unwrap_or(0);
    let picture = Picture {
        surface: Arc::new(surface),
        probe: probe.filter(|_| !has("bare")).map(|probe| probe.of_kind(kind)),
        camera,
        eyes,
        look,
        level: LEVELS[level.min(LEVELS.len() - 1)],
    };
    let image = OffScreen::new()?.colours(&picture, size)?;
    let file = BufWriter::new(std::fs::File::create(&out)?);
    let mut encoder = png::Encoder::new(file, image.size[0], image.size[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header()?.write_image_data(image.pixels.as_flattened())?;
    Ok(())
}
