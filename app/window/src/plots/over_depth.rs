//! Force over depth of recorded sessions. A thread finds the points that are drawn, once for a zoom. Lines of more points
//! than a frame can draw become a picture.

use super::navigate::{AxisRange, Gesture, gesture};
use super::style::{name_up, paint_grid, steps, still};
use crate::widgets::tokens_of;
use crate::workers::Job;
use crate::workers::review::Quantity;
use eframe::egui::{
    Align2, Color32, ColorImage, Context, Rect, RichText, Shape, TextureHandle, TextureOptions, Ui,
    vec2,
};
use egui_plot::{Line, Plot, PlotImage, PlotPoint, PlotPoints, PlotUi, Points, Text};
use palpate_model::signal::polyline::{PixelCoverage, PolylineReducer};
use palpate_model::signal::track::SignalTrack;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Points that a frame can draw in a few milliseconds, of all lines together.
const POINTS_MAX: usize = 30_000;

/// Columns of a track that are drawn: depth to the right, force up.
const COLUMNS: [usize; 2] = [Quantity::Depth as usize, Quantity::Force as usize];

/// What the points of a line depend on, next to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthLineKey {
    pub id: u64,
    /// Changes with the samples.
    pub version: u64,
    /// The first sample drawn and the one behind the last.
    pub rows: [usize; 2],
    pub color: Color32,
}

/// A line of force over depth.
#[derive(Clone, Copy, Debug)]
pub struct DepthLine<'a> {
    pub name: &'a str,
    pub track: &'a SignalTrack,
    pub key: DepthLineKey,
    /// Drawn over it, with its ink and width: the means of the samples, and a fit.
    pub over: [(&'a [Vec<PlotPoint>], Color32, f32); 2],
    /// Depth and force at the cursors A and B.
    pub cursors: [Option<[f64; 2]>; 2],
}

/// A view for which lines are found.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    depth: [f64; 2],
    force: [f64; 2],
    pixels: [f64; 2],
    lines: Vec<DepthLineKey>,
}

/// The points found for one line.
#[derive(Clone, Debug, Default)]
struct ReducedLine {
    id: u64,
    stretches: Vec<Vec<PlotPoint>>,
    samples: u64,
    points: usize,
}

/// The lines of a view.
struct DepthPicture {
    key: Key,
    lines: Vec<ReducedLine>,
    /// Lines of too many points, over each other.
    picture: Option<ColorImage>,
}

/// The lines found last, and the search for those of another view.
#[derive(Default)]
pub struct DepthLines {
    job: Job<Option<DepthPicture>>,
    is_cancelled: Arc<AtomicBool>,
    requested: Option<Key>,
    found: Option<DepthPicture>,
    texture: Option<TextureHandle>,
    /// Size of the plot in pixels, once it was drawn.
    pixels: Option<[f64; 2]>,
    /// Plots that share the points of a frame; 0 for one alone.
    pub sharing: usize,
}

impl DepthLines {
    /// Fetches the lines that were found.
    pub fn poll(&mut self, ctx: &Context) {
        if let Some(Some(mut found)) = self.job.poll() {
            let picture = found.picture.take();
            self.texture = picture
                .map(|picture| ctx.load_texture("review-loops", picture, TextureOptions::LINEAR));
            self.found = Some(found);
        }
    }

    /// The same, and starts a search where the view or the samples have changed.
    pub fn update(
        &mut self,
        ctx: &Context,
        lines: &[DepthLine<'_>],
        [depth, force]: [&AxisRange; 2],
    ) {
        self.poll(ctx);
        let Some(pixels) = self.pixels else { return };
        let key = Key {
            depth: depth.shown(),
            force: force.shown(),
            pixels: pixels.map(f64::round),
            lines: lines.iter().map(|line| line.key).collect(),
        };
        if self.found.as_ref().is_some_and(|found| found.key == key) {
            return;
        }
        if self.job.is_busy() {
            // The search goes on while more samples arrive, but not for another view.
            let is_other = self.requested.as_ref().is_some_and(|old| {
                (old.depth, old.force, old.pixels) != (key.depth, key.force, key.pixels)
            });
            if is_other {
                self.is_cancelled.store(true, Ordering::Relaxed);
            }
            return;
        }
        self.is_cancelled = Arc::default();
        self.requested = Some(key.clone());
        let tracks: Vec<SignalTrack> = lines.iter().map(|line| line.track.clone()).collect();
        let is_cancelled = Arc::clone(&self.is_cancelled);
        // Without a thread the lines stay as they are, and the next frame tries again.
        let points_max = POINTS_MAX / (tracks.len() * self.sharing.max(1)).max(1);
        let search = move || reduce(key, &tracks, points_max, &is_cancelled);
        let _ = self.job.start("review-loops", ctx, search);
    }

    /// How many samples the points drawn stand for, where these are fewer.
    pub fn remark(&self) -> Option<String> {
        let found = self.found.as_ref()?;
        let samples: u64 = found.lines.iter().map(|line| line.samples).sum();
        let points: usize = found.lines.iter().map(|line| line.points).sum();
        if self.texture.is_some() {
            return Some(format!(
                "the plot marks every pixel that the line through the {samples} samples crosses, accurate to a quarter of a pixel"
            ));
        }
        (samples > points as u64).then(|| {
            format!(
                "the plot draws {points} points for {samples} samples; every sample is within half a pixel of the line"
            )
        })
    }

    pub fn is_busy(&self) -> bool {
        self.job.is_busy()
    }

    fn stretches(&self, id: u64) -> &[Vec<PlotPoint>] {
        let lines = self.found.as_ref().map_or(&[][..], |found| &found.lines);
        let own = lines.iter().find(|line| line.id == id);
        own.map_or(&[], |line| &line.stretches)
    }

    /// Draws lines in the space there is, the first in front; returns what the pointer did.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        lines: &[DepthLine<'_>],
        [depth, force]: [&AxisRange; 2],
    ) -> Gesture {
        self.update(ui.ctx(), lines, [depth, force]);
        let tokens = tokens_of(ui);
        let (x, y) = (depth.shown(), force.shown());
        let has_picture = self.texture.is_some();
        let grid = ui.painter().add(Shape::Noop);
        let steps = steps(ui.available_size());
        let plot = still(ui, Plot::new("review_force_depth"), tokens)
            .show_grid(!has_picture)
            .x_axis_label("depth from contact (mm)")
            .y_axis_label(name_up(ui, "force above tare (N)", true));
        let response = plot.show(ui, |plot_ui| {
            plot_ui.set_plot_bounds_x(x[0]..=x[1]);
            plot_ui.set_plot_bounds_y(y[0]..=y[1]);
            self.paint(plot_ui, lines);
            for (number, line) in lines.iter().enumerate().rev() {
                for (name, place) in ["A", "B"].into_iter().zip(line.cursors) {
                    let Some([depth, force]) = place else { continue };
                    let at = PlotPoint::new(depth, force);
                    let mark = Points::new(name, PlotPoints::Owned(vec![at]));
                    plot_ui.points(mark.radius(4.0).color(tokens.text).allow_hover(false));
                    if number == 0 {
                        let words = RichText::new(format!(" {name}")).strong();
                        let text = Text::new(name, at, words).anchor(Align2::LEFT_BOTTOM);
                        plot_ui.text(text.color(tokens.text).allow_hover(false));
                    }
                }
            }
        });
        if has_picture {
            paint_grid(ui, grid, &response.transform, steps, tokens);
        }
        self.measure(ui, response.response.rect);
        gesture(ui, &response.response)
    }

    /// Takes the size of the plot that was drawn, for the search to come.
    pub fn measure(&mut self, ui: &Ui, rect: Rect) {
        let scale = f64::from(ui.ctx().pixels_per_point());
        let pixels = [rect.width(), rect.height()].map(|side| f64::from(side) * scale);
        if self.pixels.replace(pixels).is_none() {
            ui.ctx().request_repaint();
        }
    }

    /// Draws what was found of lines, the first in front.
    pub fn paint<'a>(&'a self, plot_ui: &mut PlotUi<'a>, lines: &[DepthLine<'a>]) {
        if let (Some(texture), Some(found)) = (&self.texture, &self.found) {
            // At its own place, also while another view is searched for.
            let (x, y) = (found.key.depth, found.key.force);
            let middle = PlotPoint::new(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
            let size = vec2((x[1] - x[0]) as f32, (y[1] - y[0]) as f32);
            let picture = PlotImage::new("loops", texture.id(), middle, size);
            plot_ui.image(picture.allow_hover(false));
        }
        for line in lines.iter().rev() {
            for (number, stretch) in self.stretches(line.key.id).iter().enumerate() {
                let drawn = Line::new(line.name, PlotPoints::Borrowed(stretch))
                    .id((line.key.id, number))
                    .color(line.key.color);
                plot_ui.line(drawn.width(1.2).allow_hover(false));
            }
            for (layer, (stretches, color, width)) in line.over.into_iter().enumerate() {
                for (number, stretch) in stretches.iter().enumerate() {
                    let drawn = Line::new(line.name, PlotPoints::Borrowed(stretch))
                        .id((line.key.id, layer, number))
                        .color(color);
                    plot_ui.line(drawn.width(width).allow_hover(false));
                }
            }
        }
    }
}

/// The whole of a line for a figure of so many pixels each way: as many points as it takes.
#[must_use]
pub fn loop_for_figure(
    track: &SignalTrack,
    [depth, force]: [[f64; 2]; 2],
    pixels: [f64; 2],
) -> Vec<Vec<PlotPoint>> {
    let rows = [0, track.len()];
    let line = DepthLineKey { id: 0, version: 0, rows, color: Color32::TRANSPARENT };
    let key = Key { depth, force, pixels, lines: vec![line] };
    let found = reduce(key, std::slice::from_ref(track), usize::MAX, &AtomicBool::new(false));
    found.into_iter().flat_map(|found| found.lines).flat_map(|line| line.stretches).collect()
}

fn reduce(
    key: Key,
    tracks: &[SignalTrack],
    points_max: usize,
    is_cancelled: &AtomicBool,
) -> Option<DepthPicture> {
    let [width, height] = key.pixels;
    let [x, y] = [key.depth, key.force];
    let scale = [width / (x[1] - x[0]), height / (y[1] - y[0])];
    let mut lines = Vec::with_capacity(tracks.len());
    let mut picture = None;
    // The first is in front, so it comes last into the picture.
    for (line, track) in key.lines.iter().zip(tracks).rev() {
        let mut reducer = PolylineReducer::new(width, height).with_points_max(points_max);
        let mut before = 0;
        for segment in track.segments() {
            if is_cancelled.load(Ordering::Relaxed) {
                return None;
            }
            let count = segment.times().len();
            let [from, to] = line.rows.map(|row| row.saturating_sub(before).min(count));
            before += count;
            let values = |column: usize| &segment.values(column)[from..to.max(from)];
            let [depths, forces] = COLUMNS.map(values);
            for (depth, force) in depths.iter().zip(forces) {
                let place = [f64::from(*depth) - x[0], f64::from(*force) - y[0]];
                reducer.push(place[0] * scale[0], place[1] * scale[1]);
            }
        }
        if let Some(coverage) = reducer.coverage() {
            paint(&mut picture, &coverage, line.color);
        }
        let (found, samples) = reducer.finish();
        let point = |[px, py]: [f64; 2]| PlotPoint::new(x[0] + px / scale[0], y[0] + py / scale[1]);
        let stretches: Vec<Vec<PlotPoint>> =
            found.into_iter().map(|stretch| stretch.into_iter().map(point).collect()).collect();
        lines.push(ReducedLine {
            id: line.id,
            points: stretches.iter().map(Vec::len).sum(),
            stretches,
            samples,
        });
    }
    Some(DepthPicture { key, lines, picture })
}

/// Lays what a line crosses over the picture.
fn paint(picture: &mut Option<ColorImage>, coverage: &PixelCoverage, color: Color32) {
    let picture =
        picture.get_or_insert_with(|| ColorImage::filled(coverage.size, Color32::TRANSPARENT));
    // Pictures begin above.
    let rows = coverage.pixels.chunks_exact(coverage.size[0]).rev();
    let pixels = picture.pixels.iter_mut().zip(rows.flatten());
    for (pixel, share) in pixels.filter(|(_, share)| **share > 0) {
        *pixel = pixel.blend(color.gamma_multiply_u8(*share));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theme::Tokens;
    use palpate_model::signal::track::TrackSegment;

    const KEY: [f64; 2] = [0.0, 100.0];

    /// Depth is the number of the sample, force the same from above, in segments of ten.
    fn track() -> SignalTrack {
        let mut track = SignalTrack::default();
        for begin in [0, 10, 20] {
            let own = || (begin..begin + 10).map(|index| index as f32);
            let times = own().map(f64::from).collect();
            // Force is the first column.
            let columns = [own().map(|index| 90.0 - index).collect(), own().collect()];
            track.push(Arc::new(TrackSegment::new(times, &columns)));
        }
        track
    }

    fn found(parts: &[([usize; 2], Color32)], pixels: f64) -> DepthPicture {
        let parts = parts.iter().enumerate();
        let lines: Vec<DepthLineKey> = parts
            .map(|(id, &(rows, color))| DepthLineKey { id: id as u64, version: 0, rows, color })
            .collect();
        let tracks = vec![track(); lines.len()];
        let key = Key { depth: KEY, force: KEY, pixels: [pixels; 2], lines };
        reduce(key, &tracks, POINTS_MAX, &AtomicBool::new(false)).unwrap()
    }

    #[test]
    fn of_a_part_the_line_goes_from_its_first_sample_to_its_last() {
        let tokens = Tokens::of(false);
        let found = found(&[([7, 23], tokens.text), ([0, 30], tokens.text)], 1000.0);
        for (id, ends) in [(0, [7.0, 22.0]), (1, [0.0, 29.0])] {
            let line = found.lines.iter().find(|line| line.id == id).unwrap();
            assert_eq!(line.samples as f64, ends[1] - ends[0] + 1.0);
            let points: Vec<&PlotPoint> = line.stretches.iter().flatten().collect();
            let reached = [points[0], points[points.len() - 1]].map(|point| point.x);
            assert!((reached[0] - ends[0]).abs() < 1e-9 && (reached[1] - ends[1]).abs() < 1e-9);
        }
        assert!(found.picture.is_none());
    }

    #[test]
    fn a_picture_begins_above_and_has_the_first_line_in_front() {
        let (front, back) = (Tokens::of(false).series, Tokens::of(false).limit);
        let mut picture = None;
        // Two pixels wide and three high; what is given begins below.
        let coverage = |pixels: [u8; 6]| PixelCoverage { size: [2, 3], pixels: pixels.to_vec() };
        paint(&mut picture, &coverage([255, 255, 0, 0, 0, 0]), back);
        paint(&mut picture, &coverage([255, 0, 0, 0, 0, 255]), front);
        let none = Color32::TRANSPARENT;
        assert_eq!(picture.unwrap().pixels, [none, front, none, none, front, back]);
    }
}
