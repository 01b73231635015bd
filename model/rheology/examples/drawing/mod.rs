//! Arguments of the examples that draw, and axes, lines and dots of their pictures.

use std::error::Error;
use std::fmt::Write;

/// Okabe-Ito blue and vermilion.
pub const BLUE: &str = "#0072B2";
pub const RED: &str = "#D55E00";

/// Plot areas of two panels side by side, in px: left, top, width, height.
pub const LEFT_PANEL: [f64; 4] = [70.0, 60.0, 360.0, 260.0];
pub const RIGHT_PANEL: [f64; 4] = [530.0, 60.0, 360.0, 260.0];

/// The start of a picture of two panels.
pub const START: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"930\" height=\"380\" \
     font-family=\"sans-serif\" font-size=\"13\">\n\
     <rect width=\"930\" height=\"380\" fill=\"white\"/>\n";

/// Reads the table named first on the command line, rows of `N` numbers after `skipped` lines, and writes the picture
/// of them to the path named second.
pub fn draw_table<const N: usize>(
    usage: &str,
    skipped: usize,
    picture: impl Fn(&[[f64; N]]) -> Result<String, Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(csv), Some(svg)) = (arguments.next(), arguments.next()) else {
        return Err(usage.into());
    };
    let text = std::fs::read_to_string(&csv).map_err(|err| format!("cannot read {csv}: {err}"))?;
    let row = |(row, line): (usize, &str)| {
        let fields = line.split(',').map(|field| field.trim().parse());
        let fields = fields.collect::<Result<Vec<f64>, _>>().ok();
        let fields = fields.and_then(|fields| <[f64; N]>::try_from(fields).ok());
        fields.ok_or_else(|| format!("cannot read {csv}: row {} is not {N} numbers", row + 1))
    };
    let rows: Vec<[f64; N]> =
        text.lines().enumerate().skip(skipped).map(row).collect::<Result<_, _>>()?;
    std::fs::write(&svg, picture(&rows)?).map_err(|err| format!("cannot write {svg}: {err}"))?;
    Ok(())
}

/// A plot area, in px as left, top, width, height, and the values at its ends.
pub struct Axes {
    pub panel: [f64; 4],
    pub x: (f64, f64),
    pub y: (f64, f64),
}

impl Axes {
    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let [left, top, width, height] = self.panel;
        let share = |value: f64, (low, high): (f64, f64)| (value - low) / (high - low);
        (left + width * share(x, self.x), top + height * (1.0 - share(y, self.y)))
    }

    pub fn draw(
        &self,
        svg: &mut String,
        [title, x_title, y_title]: [&str; 3],
        [x_ticks, y_ticks]: [&[f64]; 2],
    ) -> std::fmt::Result {
        let [left, top, width, height] = self.panel;
        let (right, bottom, middle) = (left + width, top + height, left + 0.5 * width);
        let (above, below) = (top - 28.0, bottom + 42.0);
        writeln!(svg, "<text x=\"{left}\" y=\"{above}\" font-weight=\"bold\">{title}</text>")?;
        writeln!(
            svg,
            "<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">{x_title}</text>"
        )?;
        writeln!(svg, "<text x=\"{}\" y=\"{}\">{y_title}</text>", left - 40.0, top - 8.0)?;
        for &tick in y_ticks {
            let (x, y) = (left - 8.0, self.at((0.0, tick)).1);
            writeln!(svg, "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#dddddd\"/>")?;
            let y = y + 4.0;
            writeln!(svg, "<text x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{tick}</text>")?;
        }
        for &tick in x_ticks {
            let (x, y) = (self.at((tick, 0.0)).0, bottom + 20.0);
            writeln!(svg, "<path d=\"M{x:.1} {bottom}v5\" stroke=\"black\"/>")?;
            writeln!(svg, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{tick}</text>")?;
        }
        writeln!(svg, "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>")
    }

    pub fn line(
        &self,
        svg: &mut String,
        points: &[(f64, f64)],
        colour: &str,
        style: &str,
    ) -> std::fmt::Result {
        svg.push_str("<polyline points=\"");
        for &point in points {
            let (x, y) = self.at(point);
            write!(svg, "{x:.1},{y:.1} ")?;
        }
        writeln!(svg, "\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" {style}/>")
    }

    pub fn dot(
        &self,
        svg: &mut String,
        at: (f64, f64),
        colour: &str,
        radius: f64,
    ) -> std::fmt::Result {
        let (x, y) = self.at(at);
        writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{colour}\"/>")
    }

    pub fn text(
        &self,
        svg: &mut String,
        at: (f64, f64),
        colour: &str,
        text: &str,
    ) -> std::fmt::Result {
        let (x, y) = self.at(at);
        writeln!(svg, "<text x=\"{x:.0}\" y=\"{y:.0}\" fill=\"{colour}\">{text}</text>")
    }
}
