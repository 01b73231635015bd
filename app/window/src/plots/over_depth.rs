//! Force over depth of recorded sessions. Which points are drawn is found beside the window, once for a zoom. Lines of more
//! points than a frame can draw are found as a picture.

use super::navigate::{AxisRange, Gesture, gesture};
use super::style::still;
use crate::theme::Tokens;
use crate::workers::Job;
use eframe::egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions, Ui, vec2};
use egui_plot::{Line, Plot, PlotImage, PlotPoint, PlotPoints, Points};
use palpate_model::signal::polyline::{Coverage, Reducer};
use palpate_model::signal::track::Track;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Points that a frame can draw in a few milliseconds, of all lines together.
const POINTS_MAX: usize = 30_000;

/// What of one session is drawn.
#[derive(Clone, Copy, Debug)]
pub struct DepthSource<'a> {
    /// Its samples.
    pub track: &'a Track,
    /// Columns of depth and force in them.
    pub columns: [usize; 2],
    /// The first sample drawn and the one behind the last.
    pub rows: [usize; 2],
    /// Number that changes with the samples.
    pub version: u64,
    /// Number that tells it from the others.
    pub id: u64,
    /// Its colour.
    pub color: Color32,
}

/// What lines were found for.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    depth: [f64; 2],
    force: [f64; 2],
    pixels: [f64; 2],
    versions: Vec<(u64, u64, [usize; 2], Color32)>,
}

/// The line of one session.
#[derive(Clone, Debug, Default)]
struct ReducedLine {
    id: u64,
    stretches: Vec<Vec<PlotPoint>>,
    samples: u64,
    points: usize,
}

/// The lines for a view.
struct DepthPicture {
    key: Key,
    lines: Vec<ReducedLine>,
    /// Those of too many points, over each other.
    picture: Option<ColorImage>,
}

/// The lines last found, and the search for others.
#[derive(Default)]
pub struct DepthLines {
    job: Job<Option<DepthPicture>>,
    is_unwanted: Arc<AtomicBool>,
    sought: Option<Key>,
    made: Option<DepthPicture>,
    texture: Option<TextureHandle>,
}

impl DepthLines {
    /// Fetches what was found, and looks again where the view or the samples are others.
    pub fn update(
        &mut self,
        ctx: &Context,
        sources: &[DepthSource<'_>],
        [depth, force]: [&AxisRange; 2],
        pixels: [f64; 2],
    ) {
        if let Some(Some(mut made)) = self.job.poll() {
            let picture = made.picture.take();
            self.texture = picture
                .map(|picture| ctx.load_texture("review-loops", picture, TextureOptions::LINEAR));
            self.made = Some(made);
        }
        let key = Key {
            depth: depth.shown(),
            force: force.shown(),
            pixels: pixels.map(f64::round),
            versions: sources
                .iter()
                .map(|one| (one.id, one.version, one.rows, one.color))
                .collect(),
        };
        if self.made.as_ref().is_some_and(|made| made.key == key) {
            return;
        }
        if self.job.is_busy() {
            // Other samples are waited for; another view is not.
            let is_other = self.sought.as_ref().is_some_and(|sought| {
                (sought.depth, sought.force, sought.pixels) != (key.depth, key.force, key.pixels)
            });
            if is_other {
                self.is_unwanted.store(true, Ordering::Relaxed);
            }
            return;
        }
        self.is_unwanted = Arc::default();
        self.sought = Some(key.clone());
        let own = sources.iter();
        let sources: Vec<Owned> = own
            .map(|one| Owned {
                track: one.track.clone(),
                columns: one.columns,
                rows: one.rows,
                id: one.id,
                color: one.color,
            })
            .collect();
        let (is_unwanted, wake) = (Arc::clone(&self.is_unwanted), ctx.clone());
        // Without a thread the lines there stay; it is tried again in the next frame.
        let _ = self.job.start(
            "review-loops",
            move || reduce(key, &sources, &is_unwanted),
            move || wake.request_repaint(),
        );
    }

    /// What a reader must know of the lines: for how many samples how many points are drawn.
    pub fn remark(&self) -> Option<String> {
        let made = self.made.as_ref()?;
        let samples: u64 = made.lines.iter().map(|line| line.samples).sum();
        let points: usize = made.lines.iter().map(|line| line.points).sum();
        if self.texture.is_some() {
            return Some(format!(
                "over depth the pixels that {samples} samples cross are drawn, to a quarter of a pixel"
            ));
        }
        (samples > points as u64).then(|| {
            format!(
                "over depth {points} points stand for {samples} samples; none is more than half a pixel from the line"
            )
        })
    }

    /// Whether lines for another view or more samples are being found.
    pub fn is_busy(&self) -> bool {
        self.job.is_busy()
    }

    /// The stretches of a session, as they are drawn.
    pub fn stretches(&self, id: u64) -> &[Vec<PlotPoint>] {
        let lines = self.made.as_ref().map_or(&[][..], |made| &made.lines);
        let own = lines.iter().find(|line| line.id == id);
        own.map_or(&[], |line| &line.stretches)
    }
}

/// The same as [`DepthSource`], for a thread.
struct Owned {
    track: Track,
    columns: [usize; 2],
    rows: [usize; 2],
    id: u64,
    color: Color32,
}

fn reduce(key: Key, sources: &[Owned], is_unwanted: &AtomicBool) -> Option<DepthPicture> {
    let [width, height] = key.pixels;
    let [x, y] = [key.depth, key.force];
    let scale = [width / (x[1] - x[0]), height / (y[1] - y[0])];
    let points_max = POINTS_MAX / sources.len().max(1);
    let mut lines = Vec::with_capacity(sources.len());
    let mut picture = None;
    // The first is in front, so it comes last into the picture.
    for source in sources.iter().rev() {
        let mut reducer = Reducer::new(width, height).with_points_max(points_max);
        let mut before = 0;
        for segment in source.track.segments() {
            if is_unwanted.load(Ordering::Relaxed) {
                return None;
            }
            let count = segment.times().len();
            let [from, to] = source.rows.map(|row| row.saturating_sub(before).min(count));
            before += count;
            let values = |column: usize| &segment.values(column)[from..to.max(from)];
            let [depths, forces] = source.columns.map(values);
            for (depth, force) in depths.iter().zip(forces) {
                let place = [f64::from(*depth) - x[0], f64::from(*force) - y[0]];
                reducer.push(place[0] * scale[0], place[1] * scale[1]);
            }
        }
        if let Some(coverage) = reducer.coverage() {
            paint(&mut picture, &coverage, source.color);
        }
        let (found, samples) = reducer.finish();
        let point = |[px, py]: [f64; 2]| PlotPoint::new(x[0] + px / scale[0], y[0] + py / scale[1]);
        let stretches: Vec<Vec<PlotPoint>> =
            found.into_iter().map(|stretch| stretch.into_iter().map(point).collect()).collect();
        lines.push(ReducedLine {
            id: source.id,
            points: stretches.iter().map(Vec::len).sum(),
            stretches,
            samples,
        });
    }
    Some(DepthPicture { key, lines, picture })
}

/// Lays what a line crosses over the picture.
fn paint(picture: &mut Option<ColorImage>, coverage: &Coverage, color: Color32) {
    let picture =
        picture.get_or_insert_with(|| ColorImage::filled(coverage.size, Color32::TRANSPARENT));
    // Pictures begin above.
    let rows = coverage.pixels.chunks_exact(coverage.size[0]).rev();
    let pixels = picture.pixels.iter_mut().zip(rows.flatten());
    for (pixel, share) in pixels.filter(|(_, share)| **share > 0) {
        *pixel = pixel.blend(color.gamma_multiply_u8(*share));
    }
}

/// One session's line as it is drawn.
pub struct DepthLayer<'a> {
    /// What it is.
    pub name: &'a str,
    /// Its colour.
    pub color: Color32,
    /// Number that tells it from the others.
    pub id: u64,
    /// Where the cursors stand on it: depth and force.
    pub cursors: [Option<[f64; 2]>; 2],
}

/// Draws the plot in the space there is; returns what the pointer did and how many pixels it has.
pub fn over_depth_ui(
    ui: &mut Ui,
    lines: &DepthLines,
    layers: &[DepthLayer<'_>],
    [depth, force]: [&AxisRange; 2],
) -> (Gesture, [f64; 2]) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let (x, y) = (depth.shown(), force.shown());
    let plot = still(ui, Plot::new("review_force_depth"), tokens)
        .x_axis_label("depth from contact (mm)")
        .y_axis_label("force above tare (N)");
    let response = plot.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(x[0]..=x[1]);
        plot_ui.set_plot_bounds_y(y[0]..=y[1]);
        if let (Some(texture), Some(made)) = (&lines.texture, &lines.made) {
            // Where it was found, also while another view is still looked for.
            let (x, y) = (made.key.depth, made.key.force);
            let middle = PlotPoint::new(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
            let size = vec2((x[1] - x[0]) as f32, (y[1] - y[0]) as f32);
            let picture = PlotImage::new("loops", texture.id(), middle, size);
            plot_ui.image(picture.allow_hover(false));
        }
        for layer in layers {
            for (number, stretch) in lines.stretches(layer.id).iter().enumerate() {
                let line = Line::new(layer.name, PlotPoints::Borrowed(stretch));
                plot_ui.line(
                    line.id((layer.id, number)).color(layer.color).width(1.2).allow_hover(false),
                );
            }
        }
        for layer in layers {
            for (name, place) in ["A", "B"].into_iter().zip(layer.cursors) {
                if let Some([depth, force]) = place {
                    let at = vec![PlotPoint::new(depth, force)];
                    let mark = Points::new(name, PlotPoints::Owned(at));
                    plot_ui.points(mark.radius(4.0).color(tokens.text).allow_hover(false));
                }
            }
        }
    });
    let scale = f64::from(ui.ctx().pixels_per_point());
    let size = response.response.rect.size();
    let pixels = [size.x, size.y].map(|side| f64::from(side) * scale);
    (gesture(ui, &response.response), pixels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::signal::track::Segment;

    const KEY: [f64; 2] = [0.0, 100.0];

    /// Depth is the number of the sample, force the same from above, in segments of ten.
    fn track() -> Track {
        let mut track = Track::default();
        for begin in [0, 10, 20] {
            let own = || (begin..begin + 10).map(|index| index as f32);
            let times = own().map(f64::from).collect();
            let columns = [own().collect(), own().map(|index| 90.0 - index).collect()];
            track.push(Arc::new(Segment::new(times, &columns)));
        }
        track
    }

    fn made(parts: &[([usize; 2], Color32)], pixels: f64) -> DepthPicture {
        let sources: Vec<Owned> = parts
            .iter()
            .enumerate()
            .map(|(id, (rows, color))| Owned {
                track: track(),
                columns: [0, 1],
                rows: *rows,
                id: id as u64,
                color: *color,
            })
            .collect();
        let key = Key { depth: KEY, force: KEY, pixels: [pixels; 2], versions: Vec::new() };
        reduce(key, &sources, &AtomicBool::new(false)).unwrap()
    }

    #[test]
    fn of_a_part_the_line_goes_from_its_first_sample_to_its_last() {
        let tokens = Tokens::of(false);
        let made = made(&[([7, 23], tokens.text), ([0, 30], tokens.text)], 1000.0);
        for (id, ends) in [(0, [7.0, 22.0]), (1, [0.0, 29.0])] {
            let line = made.lines.iter().find(|line| line.id == id).unwrap();
            assert_eq!(line.samples as f64, ends[1] - ends[0] + 1.0);
            let points: Vec<&PlotPoint> = line.stretches.iter().flatten().collect();
            let reached = [points[0], points[points.len() - 1]].map(|point| point.x);
            assert!((reached[0] - ends[0]).abs() < 1e-9 && (reached[1] - ends[1]).abs() < 1e-9);
        }
        assert!(made.picture.is_none());
    }

    #[test]
    fn a_picture_begins_above_and_has_the_first_line_in_front() {
        let (front, back) = (Tokens::of(false).series, Tokens::of(false).limit);
        let mut picture = None;
        // Two pixels wide and three high; what is given begins below.
        let coverage = |pixels: [u8; 6]| Coverage { size: [2, 3], pixels: pixels.to_vec() };
        paint(&mut picture, &coverage([255, 255, 0, 0, 0, 0]), back);
        paint(&mut picture, &coverage([255, 0, 0, 0, 0, 255]), front);
        let none = Color32::TRANSPARENT;
        assert_eq!(picture.unwrap().pixels, [none, front, none, none, front, back]);
    }
}
