//! The little SVG that pictures need: text, lines and areas (SVG 1.1, W3C).
//!
//! A panel with axes is [`PlotPanel`].

pub use crate::panel::{AxisColours, PlotPanel, round_up};

use ecolor::Color32;
use std::fmt::Write;

/// Font size of everything but titles, in px.
pub const FONT: f64 = 13.0;

/// Opacity of what lies under curves: a shaded stretch, and a band.
pub const SHADE_OPACITY: f64 = 0.5;
pub const BAND_OPACITY: f64 = 0.18;

/// A picture under construction.
pub struct Svg {
    width: f64,
    shapes: Vec<DrawingShape>,
}

/// Elements of a picture, in px from its upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub enum DrawingShape {
    /// A text, turned a quarter to the left if upright.
    Text { at: [f64; 2], is_upright: bool, ink: TextStyle, text: String },
    /// A line through points, dashed by so many px if not 0.
    Line { points: Vec<[f64; 2]>, color: Color32, width: f64, dash: f64 },
    /// The area within a line.
    Band { points: Vec<[f64; 2]>, color: Color32 },
    /// A rectangle by its upper left and its lower right corner.
    Rectangle { corners: [[f64; 2]; 2], color: Color32 },
    /// A filled circle.
    Dot { at: [f64; 2], color: Color32, radius: f64 },
}

/// Horizontal position of a text relative to its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextStyle {
    pub color: Color32,
    pub size: f64,
    pub anchor: Anchor,
}

impl TextStyle {
    pub fn plain(color: Color32) -> Self {
        Self { color, size: FONT, anchor: Anchor::Start }
    }

    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }
}

/// A picture that is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    pub size: [f64; 2],
    pub ground: Color32,
    /// Text for a screen reader.
    pub title: String,
    pub shapes: Vec<DrawingShape>,
}

impl Drawing {
    /// The picture as a document of SVG.
    pub fn svg(&self) -> String {
        let [width, height] = self.size;
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width} {height:.0}\" font-family=\"sans-serif\" role=\"img\">\n\
             <title>{}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"{}\"/>\n",
            escape(&self.title),
            hex(self.ground),
        );
        for shape in &self.shapes {
            text += &shape.element();
            text.push('\n');
        }
        text + "</svg>\n"
    }
}

impl DrawingShape {
    fn element(&self) -> String {
        match self {
            Self::Text { at: [x, y], is_upright, ink, text } => {
                let place = match is_upright {
                    false => format!("x=\"{x:.1}\" y=\"{y:.1}\""),
                    true => format!("transform=\"translate({x:.1} {y:.1}) rotate(-90)\""),
                };
                let anchor = match ink.anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                format!(
                    "<text {place} font-size=\"{}\" text-anchor=\"{anchor}\" fill=\"{}\">{}</text>",
                    ink.size,
                    hex(ink.color),
                    escape(text)
                )
            }
            Self::Line { points, color, width, dash } => {
                let dashes = match *dash {
                    dash if dash > 0.0 => format!(" stroke-dasharray=\"{dash}\""),
                    _ => String::new(),
                };
                format!(
                    "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                     stroke-linejoin=\"round\"{dashes}/>",
                    list(points),
                    hex(*color)
                )
            }
            Self::Band { points, color } => format!(
                "<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"{BAND_OPACITY}\"/>",
                list(points),
                hex(*color)
            ),
            Self::Rectangle { corners: [[left, top], [right, bottom]], color } => format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\" \
                 fill-opacity=\"{SHADE_OPACITY}\"/>",
                right - left,
                bottom - top,
                hex(*color)
            ),
            Self::Dot { at: [x, y], color, radius } => format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{}\"/>",
                hex(*color)
            ),
        }
    }
}

fn list(points: &[[f64; 2]]) -> String {
    let mut list = String::with_capacity(12 * points.len());
    for [x, y] in points {
        // Writing to a string does not fail.
        let _ = write!(list, "{x:.1},{y:.1} ");
    }
    list.truncate(list.trim_end().len());
    list
}

impl Svg {
    pub fn new(width: f64) -> Self {
        Self { width, shapes: Vec::new() }
    }

    /// The document, `height` px high, on a ground; `title` is what a screen reader says.
    pub fn finish(self, height: f64, ground: Color32, title: &str) -> String {
        self.drawing(height, ground, title).svg()
    }

    /// The same, not yet in any format.
    pub fn drawing(self, height: f64, ground: Color32, title: &str) -> Drawing {
        Drawing {
            size: [self.width, height.round()],
            ground,
            title: title.to_owned(),
            shapes: self.shapes,
        }
    }

    pub fn text(&mut self, at: [f64; 2], ink: TextStyle, text: &str) {
        self.shapes.push(DrawingShape::Text { at, is_upright: false, ink, text: text.to_owned() });
    }

    /// A text turned a quarter to the left, for the names of vertical axes.
    pub fn upright_text(&mut self, at: [f64; 2], ink: TextStyle, text: &str) {
        self.shapes.push(DrawingShape::Text { at, is_upright: true, ink, text: text.to_owned() });
    }

    pub fn line(&mut self, points: &[[f64; 2]], color: Color32, width: f64) {
        self.dashed_line(points, color, width, 0.0);
    }

    /// A line in dashes of so many px, or whole for 0.
    pub fn dashed_line(&mut self, points: &[[f64; 2]], color: Color32, width: f64, dash: f64) {
        if points.is_empty() {
            return;
        }
        self.shapes.push(DrawingShape::Line { points: points.to_vec(), color, width, dash });
    }

    /// A rectangle between two corners.
    pub fn rectangle(&mut self, [left, top]: [f64; 2], [right, bottom]: [f64; 2], color: Color32) {
        self.shapes
            .push(DrawingShape::Rectangle { corners: [[left, top], [right, bottom]], color });
    }

    /// A band between an upper and a lower edge.
    pub fn band(&mut self, upper: &[[f64; 2]], lower: &[[f64; 2]], color: Color32) {
        self.shapes.push(DrawingShape::Band {
            points: upper.iter().chain(lower.iter().rev()).copied().collect(),
            color,
        });
    }

    pub fn dot(&mut self, at: [f64; 2], color: Color32, radius: f64) {
        self.shapes.push(DrawingShape::Dot { at, color, radius });
    }
}

pub fn hex(color: Color32) -> String {
    format!("#{:02x}{:02x}{:02x}", color.r(), color.g(), color.b())
}

/// Text as XML takes it: five characters spelt out, and none that XML 1.0 cannot hold.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&apos;"),
            control if control.is_control() => escaped.push(' '),
            // What turns the direction of writing could make a name read as another.
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}' => {
                escaped.push('\u{fffd}');
            }
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_becomes_valid_xml() {
        assert_eq!(escape("a<b> & \"c\"\u{0}'d'"), "a&lt;b&gt; &amp; &quot;c&quot; &apos;d&apos;");
    }
}
