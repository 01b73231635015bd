//! A figure as data: plots with axes, lines, dots, bands and what is marked in them. Painters put it on a screen or
//! into a file; none of them decides what it shows.

mod labels;
mod svg;

pub use svg::{AxisNames, legend};

use crate::tokens::Tokens;
use ecolor::Color32;

/// An ink by its use; each theme has its own colour for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Measured points.
    Series,
    /// Fitted curves, and limits.
    Limit,
    /// Emphasised text.
    Text,
    /// Secondary text.
    Quiet,
    /// Hairlines.
    Line,
    /// What needs attention.
    Notice,
    Alarm,
    /// Strong but grey.
    Active,
    /// One of several that are compared, by its place among them.
    Session(usize),
    /// From what was measured to what was fitted, in 255 parts.
    Between(u8),
}

impl Ink {
    #[must_use]
    pub fn of(self, tokens: &Tokens) -> Color32 {
        match self {
            Self::Series => tokens.series,
            Self::Limit => tokens.limit,
            Self::Text => tokens.text,
            Self::Quiet => tokens.text_quiet,
            Self::Line => tokens.line,
            Self::Notice => tokens.notice_fill,
            Self::Alarm => tokens.alarm_text,
            Self::Active => tokens.active_fill,
            Self::Between(part) => {
                tokens.series.lerp_to_gamma(tokens.limit, f32::from(part) / 255.0)
            }
            Self::Session(index) => tokens.sessions[index % tokens.sessions.len()],
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AxisScale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm; a number that has none is drawn as the least there is.
    Logarithmic,
    /// Evenly, without numbers: rows whose points have names.
    Rows,
}

/// A number at or below zero is drawn here on a logarithmic axis; nothing measured or computed is so small.
const LEAST: f64 = 1e-18;

impl AxisScale {
    /// Position of a number on an axis of this scale.
    #[must_use]
    pub fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear | Self::Rows => value,
            Self::Logarithmic => value.max(LEAST).log10(),
        }
    }
}

/// One axis of a plot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlotAxis {
    pub name: String,
    pub scale: AxisScale,
    /// Lowest and highest number drawn; without it, all points are.
    pub range: Option<[f64; 2]>,
    /// Numbers that are seen in any case.
    pub visible_values: Vec<f64>,
}

impl PlotAxis {
    /// An even axis of this name.
    #[must_use]
    pub fn linear(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// A logarithmic axis of this name.
    #[must_use]
    pub fn logarithmic(name: &str) -> Self {
        Self { scale: AxisScale::Logarithmic, ..Self::linear(name) }
    }

    /// From one number to another.
    #[must_use]
    pub fn with_range(self, range: [f64; 2]) -> Self {
        Self { range: Some(range), ..self }
    }

    /// With these numbers seen in any case.
    #[must_use]
    pub fn with_visible_values(self, seen: &[f64]) -> Self {
        Self { visible_values: seen.to_vec(), ..self }
    }
}

/// Length of dashes in px where nothing else is said.
const DASH: f64 = 5.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SeriesShape {
    /// A line of this width in px.
    Line {
        width: f64,
        /// Length of its dashes in px, 0 for a whole line.
        dash: f64,
    },
    /// A dot at each point, filled or hollow.
    Dots { radius: f64, is_filled: bool },
}

/// Text at points.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum PointLabels {
    /// Nothing; the legend has the name.
    #[default]
    None,
    /// The name, next to the last point.
    AtEnd,
    /// At each point: a short name next to it, and a longer text on demand.
    Each(Vec<[String; 2]>),
}

/// Points that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotSeries {
    /// Empty where no name is needed.
    pub name: String,
    pub ink: Ink,
    /// From 0 to 1.
    pub opacity: f64,
    pub shape: SeriesShape,
    /// In order along the line.
    pub points: Vec<[f64; 2]>,
    pub labels: PointLabels,
}

impl PlotSeries {
    /// A whole line.
    #[must_use]
    pub fn line(name: &str, ink: Ink, width: f64, points: Vec<[f64; 2]>) -> Self {
        let shape = SeriesShape::Line { width, dash: 0.0 };
        Self::new(name, ink, shape, points)
    }

    /// A dashed line.
    #[must_use]
    pub fn dashed(name: &str, ink: Ink, width: f64, points: Vec<[f64; 2]>) -> Self {
        let shape = SeriesShape::Line { width, dash: DASH };
        Self::new(name, ink, shape, points)
    }

    /// Filled dots.
    #[must_use]
    pub fn dots(name: &str, ink: Ink, radius: f64, points: Vec<[f64; 2]>) -> Self {
        let shape = SeriesShape::Dots { radius, is_filled: true };
        Self::new(name, ink, shape, points)
    }

    /// Rings.
    #[must_use]
    pub fn rings(name: &str, ink: Ink, radius: f64, points: Vec<[f64; 2]>) -> Self {
        let shape = SeriesShape::Dots { radius, is_filled: false };
        Self::new(name, ink, shape, points)
    }

    fn new(name: &str, ink: Ink, shape: SeriesShape, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.to_owned(), ink, opacity: 1.0, shape, points, labels: PointLabels::None }
    }

    /// With something written at its points.
    #[must_use]
    pub fn labelled(self, labels: PointLabels) -> Self {
        Self { labels, ..self }
    }
}

/// The area between two lines over the same abscissas.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotBand {
    pub name: String,
    /// Its ink, drawn thinly.
    pub ink: Ink,
    /// Lower and upper edge.
    pub edges: [Vec<[f64; 2]>; 2],
}

/// A shaded stretch of the abscissa.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotStretch {
    pub name: String,
    /// From and to.
    pub ends: [f64; 2],
    /// Its ink, drawn thinly; none for a stretch that only has a name.
    pub ink: Option<Ink>,
}

/// A value that is marked across the whole plot, along either axis.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotLevel {
    /// Empty for a zero line.
    pub name: String,
    pub at: f64,
    pub ink: Ink,
    pub is_dashed: bool,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    pub title: String,
    pub x: PlotAxis,
    /// The upright one.
    pub y: PlotAxis,
    /// Shaded stretches, behind everything.
    pub stretches: Vec<PlotStretch>,
    /// Bands, behind the lines.
    pub bands: Vec<PlotBand>,
    pub levels: Vec<PlotLevel>,
    /// Marked places of the abscissa.
    pub x_levels: Vec<PlotLevel>,
    /// Lines and dots, those in front last.
    pub series: Vec<PlotSeries>,
    /// A sentence in the plot, such as why there is nothing to see.
    pub remark: Option<String>,
}

impl PlotLevel {
    /// Length of its dashes in px, 0 for a whole line.
    pub fn dash(&self) -> f64 {
        if self.is_dashed { DASH } else { 0.0 }
    }

    /// A whole line of an ink, without a name.
    #[must_use]
    pub fn plain(at: f64, ink: Ink) -> Self {
        Self { name: String::new(), at, ink, is_dashed: false }
    }
}

impl Plot {
    /// An empty plot of two axes.
    #[must_use]
    pub fn new(title: &str, x: PlotAxis, y: PlotAxis) -> Self {
        Self { title: title.to_owned(), x, y, ..Self::default() }
    }

    /// With these lines and dots.
    #[must_use]
    pub fn with(self, series: impl IntoIterator<Item = PlotSeries>) -> Self {
        Self { series: series.into_iter().collect(), ..self }
    }

    /// Position of a point on both axes.
    #[must_use]
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.scale.place(x), self.y.scale.place(y)]
    }

    /// Names and inks of what has no name next to it: series, then stretches, each name once.
    pub fn legend(&self) -> Vec<(&str, Ink)> {
        let series = self.series.iter();
        let series = series.filter(|one| one.labels == PointLabels::None);
        let series = series.map(|one| (one.name.as_str(), one.ink));
        let bands = self.bands.iter().map(|one| (one.name.as_str(), one.ink));
        let shaded = self.stretches.iter();
        let shaded = shaded.filter_map(|one| Some((one.name.as_str(), one.ink?)));
        let mut names: Vec<(&str, Ink)> = Vec::new();
        for (name, ink) in series.chain(bands).chain(shaded) {
            if !name.is_empty() && names.iter().all(|(known, _)| *known != name) {
                names.push((name, ink));
            }
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_names_each_thing_once_and_nothing_that_has_its_name_beside_it() {
        let line = |name: &str| PlotSeries::line(name, Ink::Series, 1.0, Vec::new());
        let plot = Plot {
            stretches: vec![PlotStretch {
                name: "flat".into(),
                ends: [0.0, 1.0],
                ink: Some(Ink::Line),
            }],
            ..Plot::default().with([
                line("one"),
                line(""),
                line("one"),
                line("two").labelled(PointLabels::AtEnd),
            ])
        };
        assert_eq!(plot.legend(), [("one", Ink::Series), ("flat", Ink::Line)]);
    }

    #[test]
    fn what_has_no_logarithm_is_drawn_as_the_least() {
        assert_eq!(AxisScale::Logarithmic.place(1000.0), 3.0);
        assert_eq!(AxisScale::Logarithmic.place(0.0), -18.0);
        assert_eq!(AxisScale::Linear.place(-2.0), -2.0);
    }
}
