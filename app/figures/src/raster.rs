//! A drawing as pixels, for documents that take no SVG. Letters are those of the window.

use crate::drawing::{Anchor, BAND_OPACITY, Drawing, DrawingShape, SHADE_OPACITY, TextStyle};
use ecolor::Color32;
use epaint_default_fonts::{HACK_REGULAR, UBUNTU_LIGHT};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};
use std::io;
use vello_cpu::color::{AlphaColor, Srgb};
use vello_cpu::kurbo::{
    Affine, BezPath, Cap, Circle, Join, Point, Shape as SessionOutline, Stroke,
};
use vello_cpu::{Pixmap, RenderContext, Resources};

/// Pixels for a px of the drawing: sharp on paper and on fine screens.
const SCALE: f64 = 2.0;
/// Tolerance of the curves that make a circle, in px.
const ROUND: f64 = 0.05;

/// Pixels row by row, each red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Raster {
    pub size: [usize; 2],
    pub rgb: Vec<u8>,
}

/// The drawing as a PNG file (PNG, ISO/IEC 15948).
pub fn png(drawing: &Drawing) -> io::Result<Vec<u8>> {
    encoded(&raster(drawing)?)
}

/// The drawing as pixels, for a clipboard.
pub fn raster(drawing: &Drawing) -> io::Result<Raster> {
    let too_large = || io::Error::other("the figure is too large for a PNG; draw it as SVG");
    let [width, height] = drawing.size.map(|px| (px * SCALE).ceil());
    if !(width >= 1.0 && height >= 1.0) || width.max(height) > f64::from(u16::MAX) {
        return Err(too_large());
    }
    let (width, height) = (width as u16, height as u16);
    let letters = Letters::default();
    let mut context = RenderContext::new(width, height);
    let whole = vello_cpu::kurbo::Rect::new(0.0, 0.0, f64::from(width), f64::from(height));
    context.set_paint(ink(drawing.ground, 1.0));
    context.fill_rect(&whole);
    context.set_transform(Affine::scale(SCALE));
    for shape in &drawing.shapes {
        draw(&mut context, &letters, shape);
    }
    let mut pixels = Pixmap::new(width, height);
    context.flush();
    context.render(&mut pixels, &mut Resources::new());
    // The ground is opaque, so nothing is to be seen through and premultiplied colours are plain ones.
    let rgb = pixels.data().iter().flat_map(|pixel| [pixel.r, pixel.g, pixel.b]).collect();
    Ok(Raster { size: [pixels.width(), pixels.height()].map(usize::from), rgb })
}

fn encoded(pixels: &Raster) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    // No side is longer than a u16 tells.
    let size = pixels.size.map(|side| side as u32);
    let mut encoder = png::Encoder::new(&mut file, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let dots_per_m = (96.0 * SCALE / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: dots_per_m,
        yppu: dots_per_m,
        unit: png::Unit::Meter,
    }));
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels.rgb)?;
    writer.finish()?;
    Ok(file)
}

fn ink(color: Color32, opacity: f64) -> AlphaColor<Srgb> {
    let [r, g, b, _] = color.to_array();
    AlphaColor::from_rgba8(r, g, b, (opacity * 255.0).round() as u8)
}

fn path(points: &[[f64; 2]]) -> BezPath {
    let mut path = BezPath::new();
    for (index, &[x, y]) in points.iter().enumerate() {
        match index {
            0 => path.move_to((x, y)),
            _ => path.line_to((x, y)),
        }
    }
    path
}

fn draw(context: &mut RenderContext, letters: &Letters, shape: &DrawingShape) {
    match shape {
        DrawingShape::Text { at, is_upright, ink: own, text } => {
            context.set_paint(ink(own.color, 1.0));
            let place = Affine::translate((at[0], at[1]));
            let turn = match is_upright {
                true => Affine::rotate(-std::f64::consts::FRAC_PI_2),
                false => Affine::IDENTITY,
            };
            context.fill_path(&(place * turn * letters.line(text, *own)));
        }
        DrawingShape::Line { points, color, width, dash } => {
            let stroke = Stroke::new(*width).with_join(Join::Round).with_caps(Cap::Butt);
            context.set_stroke(match *dash {
                dash if dash > 0.0 => stroke.with_dashes(0.0, [dash]),
                _ => stroke,
            });
            context.set_paint(ink(*color, 1.0));
            context.stroke_path(&path(points));
        }
        DrawingShape::Band { points, color } => {
            context.set_paint(ink(*color, BAND_OPACITY));
            let mut area = path(points);
            area.close_path();
            context.fill_path(&area);
        }
        DrawingShape::Rectangle { corners: [[left, top], [right, bottom]], color } => {
            context.set_paint(ink(*color, SHADE_OPACITY));
            let area = vello_cpu::kurbo::Rect::new(*left, *top, *right, *bottom);
            context.fill_rect(&area);
        }
        DrawingShape::Dot { at, color, radius } => {
            context.set_paint(ink(*color, 1.0));
            let circle = Circle::new(Point::new(at[0], at[1]), *radius);
            context.fill_path(&circle.to_path(ROUND));
        }
    }
}

/// Fonts in the order in which they are asked for a letter.
struct Letters(Vec<FontRef<'static>>);

impl Default for Letters {
    fn default() -> Self {
        let fonts = [UBUNTU_LIGHT, HACK_REGULAR];
        Self(fonts.iter().filter_map(|font| FontRef::new(font).ok()).collect())
    }
}

impl Letters {
    /// The outline of a line of text on the origin.
    fn line(&self, text: &str, ink: TextStyle) -> BezPath {
        let size = Size::new(ink.size as f32);
        let mut pen = Pen::default();
        for letter in text.chars() {
            let has_it = |font: &&FontRef<'static>| font.charmap().map(letter).is_some();
            let Some(font) = self.0.iter().find(has_it).or(self.0.first()) else {
                continue;
            };
            let glyph = font.charmap().map(letter).unwrap_or_default();
            if let Some(outline) = font.outline_glyphs().get(glyph) {
                // A letter that cannot be drawn leaves its place empty.
                let settings = DrawSettings::unhinted(size, LocationRef::default());
                let _ = outline.draw(settings, &mut pen);
            }
            let metrics = font.glyph_metrics(size, LocationRef::default());
            pen.x += f64::from(metrics.advance_width(glyph).unwrap_or(0.0));
        }
        let back = match ink.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * pen.x,
            Anchor::End => pen.x,
        };
        Affine::translate((-back, 0.0)) * pen.path
    }
}

/// Outlines of letters one after another; fonts count upwards, pictures downwards.
#[derive(Default)]
struct Pen {
    path: BezPath,
    x: f64,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> Point {
        Point::new(f64::from(x) + self.x, -f64::from(y))
    }
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.at(x, y));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.at(x, y));
    }

    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        self.path.quad_to(self.at(cx0, cy0), self.at(x, y));
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (first, second) = (self.at(cx0, cy0), self.at(cx1, cy1));
        self.path.curve_to(first, second, self.at(x, y));
    }

    fn close(&mut self) {
        self.path.close_path();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Svg;
    use crate::tokens::LIGHT;

    /// The pixels of a file, row by row, and its width.
    fn read(file: &[u8]) -> (Vec<[u8; 3]>, usize) {
        let mut reader = png::Decoder::new(io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let pixels = bytes.chunks_exact(3).map(|it| [it[0], it[1], it[2]]);
        (pixels.collect(), info.width as usize)
    }

    #[test]
    fn every_shape_is_where_it_belongs_and_in_its_ink() {
        let mut svg = Svg::new(100.0);
        svg.rectangle([0.0, 0.0], [20.0, 20.0], LIGHT.text);
        svg.line(&[[0.0, 30.0], [100.0, 30.0]], LIGHT.limit, 4.0);
        svg.dashed_line(&[[0.0, 40.0], [100.0, 40.0]], LIGHT.limit, 4.0, 10.0);
        svg.dot([50.0, 60.0], LIGHT.series, 5.0);
        svg.text([60.0, 20.0], TextStyle::plain(LIGHT.text), "µ² ±");
        let (pixels, width) = read(&png(&svg.drawing(80.0, LIGHT.canvas, "t")).unwrap());
        assert_eq!((width, pixels.len()), (200, 200 * 160));
        let at = |x: usize, y: usize| pixels[2 * y * width + 2 * x];
        let rgb = |color: Color32| [color.r(), color.g(), color.b()];
        assert_eq!(at(95, 75), rgb(LIGHT.canvas));
        assert_eq!((at(5, 30), at(95, 30)), (rgb(LIGHT.limit), rgb(LIGHT.limit)));
        assert_eq!((at(5, 40), at(15, 40)), (rgb(LIGHT.limit), rgb(LIGHT.canvas)));
        assert_eq!(at(50, 60), rgb(LIGHT.series));
        // Half of text on canvas.
        let half = at(10, 10)[0];
        assert!(half > 0x80 && half < 0x98, "{half:#x}");
        let is_dark = |x: usize, y: usize| at(x, y)[0] < 0x80;
        let ink = (58..90).flat_map(|x| (8..24).map(move |y| (x, y)));
        assert!(ink.filter(|(x, y)| is_dark(*x, *y)).count() > 10);
    }

    #[test]
    fn what_no_file_can_hold_is_refused() {
        let drawing = Svg::new(1e6).drawing(10.0, LIGHT.canvas, "t");
        assert!(png(&drawing).unwrap_err().to_string().contains("as SVG"));
    }
}
