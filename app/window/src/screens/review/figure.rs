//! The view as it stands as a figure: copied as a picture, or saved by the same painters as those of reports.

use super::groups::{Coloring, SessionGroup, groups};
use super::middle::tool_ui;
use super::side_by_side::{LIKE_TEXT, fitted_over_depth};
use super::subject::{LINE_MODELLED, LINE_RESIDUAL, ReviewSubject};
use super::{ReviewScreen, View};
use crate::plots::over_depth::loop_for_figure;
use crate::plots::stretches::Stretches;
use crate::theme::icon_text;
use crate::widgets::{alarm_ui, quiet_ui};
use crate::workers::review::{Quantity, ReviewRecording};
use crate::workers::{BackgroundTask, Dialog, Job};
use eframe::egui::{ColorImage, Context, Ui};
use egui_plot::PlotPoint;
use lucide_icons::Icon;
use palpate_analysis::report::panels::FigurePanels;
use palpate_analysis::session_actions::{ActionReport, SessionDocument, write_document};
use palpate_figures::drawing::Drawing;
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotBand, PlotLevel, PlotSeries, PlotStretch};
use palpate_figures::raster::{Raster, raster};
use palpate_figures::tokens::LIGHT;
use palpate_model::signal::track::SignalTrack;
use std::path::PathBuf;

const NO_DIALOG: &str =
    "this desktop shows no file dialog; Figure on the right writes to a path that is typed";

/// Columns of a figure of plots side by side.
const COLUMNS: usize = 3;
/// Width of a line in px, and room above for the names of phases as a share of the height of lines.
const WIDTH: f64 = 1.3;
const NAMES: f64 = 0.1;
/// Opacity of samples behind the line of their means.
const SAMPLES: f64 = 0.3;
/// Loops are drawn for a plot of this size: finer than any of the figure.
const LOOP_PIXELS: [f64; 2] = [900.0, 400.0];

/// Copies and saves under way.
#[derive(Default)]
pub(super) struct FigureExport {
    copy: Job<Result<Raster, String>>,
    dialog: Dialog<PathBuf>,
    /// The figure that waits for the name of its file.
    waiting: Option<PendingFigure>,
    save: BackgroundTask<ActionReport>,
    /// What came of the last copy, or why the last figure was not saved.
    copied: Option<Result<(), String>>,
}

impl FigureExport {
    pub fn poll(&mut self, ctx: &Context) {
        self.save.poll();
        if let Some(copied) = self.copy.poll() {
            self.copied = Some(copied.map(|picture| {
                ctx.copy_image(ColorImage::from_rgb(picture.size, &picture.rgb));
            }));
        }
        let chosen = self.dialog.poll();
        if self.dialog.take_refusal().is_some() {
            self.copied = Some(Err(NO_DIALOG.to_owned()));
        }
        if let Some(to) = chosen
            && let Some(figure) = self.waiting.take()
        {
            self.save.start("figure", ctx, move |progress| {
                let document = SessionDocument::Drawing(Box::new(figure.drawing()));
                write_document(&document, &to, progress)
            });
        }
    }

    fn copy(&mut self, figure: PendingFigure, ctx: &Context) {
        self.copied = None;
        let work = move || raster(&figure.drawing()).map_err(|err| err.to_string());
        if let Err(err) = self.copy.start("copy-figure", ctx, work) {
            self.copied = Some(Err(err.to_string()));
        }
    }

    fn save(&mut self, figure: PendingFigure, ctx: &Context) {
        self.copied = None;
        self.waiting = Some(figure);
        let opened = self.dialog.open(ctx, |dialog| {
            let dialog = dialog.set_title("Save figure").set_file_name("figure.svg");
            dialog.add_filter("figures", &["svg", "png"]).save_file()
        });
        if let Err(reason) = opened {
            self.copied = Some(Err(reason));
        }
    }

    fn answer_ui(&self, ui: &mut Ui) {
        match (&self.copied, self.save.answer()) {
            (Some(Err(reason)), _) | (None, Some(Err(reason))) => alarm_ui(ui, reason),
            (Some(Ok(())), _) => quiet_ui(ui, "copied"),
            (None, Some(Ok(done))) => quiet_ui(ui, &done.sentence),
            (None, None) => {}
        }
    }
}

/// A figure whose loops are still to be found, away from the window's thread.
struct PendingFigure {
    panels: FigurePanels,
    /// Loops of sessions, those in front first: each with its plot and ink.
    loops: Vec<(usize, SignalTrack, Ink)>,
    /// Depths and forces shown.
    shown: [[f64; 2]; 2],
}

impl PendingFigure {
    fn drawing(mut self) -> Drawing {
        for (plot, track, ink) in self.loops {
            let found = loop_for_figure(&track, self.shown, LOOP_PIXELS);
            let found = within(found.iter().map(Vec::as_slice), self.shown);
            // Behind what is there: means, fits, and sessions in front.
            let samples = lines(found, ink).map(|one| PlotSeries { opacity: SAMPLES, ..one });
            self.panels.plots[plot].series.splice(0..0, samples);
        }
        self.panels.drawing()
    }
}

/// The parts of a line that are within the axes.
fn within<'a>(
    parts: impl Iterator<Item = &'a [PlotPoint]>,
    [x, y]: [[f64; 2]; 2],
) -> Vec<Vec<[f64; 2]>> {
    let is_in =
        |point: &PlotPoint| (x[0]..=x[1]).contains(&point.x) && (y[0]..=y[1]).contains(&point.y);
    let runs = parts.flat_map(move |part| part.chunk_by(move |a, b| is_in(a) == is_in(b)));
    let runs = runs.filter(|run| is_in(&run[0]));
    runs.map(|run| run.iter().map(|point| [point.x, point.y]).collect()).collect()
}

fn lines(parts: Vec<Vec<[f64; 2]>>, ink: Ink) -> impl Iterator<Item = PlotSeries> {
    parts.into_iter().map(move |points| PlotSeries::line("", ink, WIDTH, points))
}

/// Columns of a small plot in a figure.
const PLOT_PIXELS: f64 = 600.0;
const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

fn over_time(stretches: &Stretches, x: [f64; 2], ink: Ink) -> impl Iterator<Item = PlotSeries> {
    lines(within(stretches.parts(), [x, EVERYWHERE]), ink)
}

/// The line of a session's means over depth, as far as it is within the axes.
fn loop_means(
    subject: &ReviewSubject,
    shown: [[f64; 2]; 2],
) -> impl Iterator<Item = PlotSeries> + use<> {
    let stretches = subject.loop_means.stretches.iter().map(Vec::as_slice);
    lines(within(stretches, shown), ink_of(subject))
}

/// The areas of samples behind the lines of their means, as far as they are within the axes.
fn areas(stretches: &Stretches, [from, to]: [f64; 2], ink: Ink) -> impl Iterator<Item = PlotBand> {
    stretches.bands().iter().filter_map(move |band| {
        let first = band.times.partition_point(|t| *t < from);
        let end = band.times.partition_point(|t| *t <= to);
        let edge = |values: &[f64]| {
            let points = band.times.iter().zip(values).map(|(t, value)| [*t, *value]);
            points.take(end).skip(first).collect()
        };
        let edges = [edge(&band.low), edge(&band.high)];
        (first < end).then(|| PlotBand { name: String::new(), ink, edges })
    })
}

/// The ink of a fit over its session, as on the screen.
fn fitted_ink(subject: &ReviewSubject) -> Ink {
    if subject.color % LIGHT.sessions.len() == LIKE_TEXT { Ink::Limit } else { Ink::Text }
}

fn ink_of(subject: &ReviewSubject) -> Ink {
    Ink::Session(subject.color)
}

impl ReviewScreen {
    /// Brings the lines over time of plots that are scrolled out of sight up to date.
    fn update_hidden(&mut self) {
        if self.view != View::SideBySide || self.side.is_over_depth {
            return;
        }
        for subject in &mut self.subjects {
            let window = subject.line_window(self.time.shown(), PLOT_PIXELS, self.time_origin);
            subject.update(Quantity::Force, window);
            subject.update_fit(window);
        }
    }

    /// Draws the buttons, where the view has a figure.
    pub(super) fn figure_ui(&mut self, ui: &mut Ui) {
        if tool_ui(ui, icon_text(Icon::Copy), "Copy figure", "to the clipboard") {
            self.update_hidden();
            let figure = self.pending_figure();
            self.figure.copy(figure, ui.ctx());
        }
        if tool_ui(ui, icon_text(Icon::Save), "Save figure", "as .svg or .png") {
            self.update_hidden();
            let figure = self.pending_figure();
            self.figure.save(figure, ui.ctx());
        }
        self.figure.answer_ui(ui);
    }

    fn pending_figure(&self) -> PendingFigure {
        let mut panels = FigurePanels { columns: 1, ..FigurePanels::default() };
        let mut loops = Vec::new();
        let track = |one: &ReviewSubject| one.recording.track.clone();
        let named = self.legend();
        let fitted = |is_drawn: bool, name: &str, ink| is_drawn.then(|| (name.to_owned(), ink));
        match self.view {
            View::SideBySide => {
                let order: Vec<(usize, String)> = self.titles_side_by_side();
                panels.title = "Sessions side by side".into();
                panels.words = format!("{} sessions, all with the same axes", order.len());
                panels.columns = COLUMNS;
                let has = |ink| {
                    let mut fits = self.subjects.iter().filter(|one| one.fitted().is_some());
                    fits.any(|one| fitted_ink(one) == ink)
                };
                panels.legend.extend(fitted(has(Ink::Text), "fitted", Ink::Text));
                panels.legend.extend(fitted(has(Ink::Limit), "fitted, over black", Ink::Limit));
                if self.side.is_over_depth {
                    let tracks = order.iter().map(|(index, _)| &self.subjects[*index]).enumerate();
                    loops = tracks.map(|(plot, one)| (plot, track(one), ink_of(one))).collect();
                }
                panels.plots = order.into_iter().map(|one| self.plot_side_by_side(one)).collect();
            }
            View::OverTime => {
                panels.title = "Sessions over time".into();
                panels.words = format!("time from {}", self.time_origin.name());
                panels.plots = self.plots_over_time();
                let front = self.front().filter(|front| front.fitted().is_some());
                let fit = front.map(|front| (format!("fit of {}", front.name), fitted_ink(front)));
                panels.legend = named.into_iter().chain(fit).collect();
            }
            _ => {
                panels.title = "Sessions over depth".into();
                panels.words = "force over depth from contact".into();
                let [x, y] = self.depth_axes();
                let shown = [self.depth.shown(), self.force.shown()];
                let means = |one: &ReviewSubject| loop_means(one, shown).collect::<Vec<_>>();
                let series = self.subjects.iter().rev().flat_map(means);
                panels.plots = vec![Plot::new("", x, y).with(series)];
                panels.legend = named;
                loops = self.subjects.iter().map(|one| (0, track(one), ink_of(one))).collect();
            }
        }
        PendingFigure { panels, loops, shown: [self.depth.shown(), self.force.shown()] }
    }

    /// What each colour stands for: a session, or a group of them.
    fn legend(&self) -> Vec<(String, Ink)> {
        if self.coloring() == Coloring::Session {
            return self.subjects.iter().map(|one| (one.name.clone(), ink_of(one))).collect();
        }
        let groups = groups(&self.subjects, self.grouping).into_iter();
        let first = |group: &SessionGroup| ink_of(&self.subjects[group.members[0]]);
        groups.map(|group| (group.name.clone(), first(&group))).collect()
    }

    fn time_axis(&self) -> PlotAxis {
        let name = format!("time from {} (s)", self.time_origin.name());
        PlotAxis::linear(&name).with_range(self.time.shown())
    }

    fn plots_over_time(&self) -> Vec<Plot> {
        let Some(front) = self.front() else { return Vec::new() };
        let shift = front.shift(self.time_origin);
        let shown @ [first, last] = self.time.shown();
        let end = front.recording.track.span().map_or(0.0, |span| span[1]);
        let phases = ReviewRecording::ended(&front.recording.phases, end).enumerate();
        let phases = phases.map(|(number, (from, to, phase))| PlotStretch {
            name: phase.name().to_owned(),
            ends: [(from - shift).max(first), (to - shift).min(last)],
            ink: (number % 2 == 1).then_some(Ink::Line),
        });
        let phases: Vec<_> = phases.filter(|one| one.ends[0] < one.ends[1]).collect();
        let cursors = ["A", "B"].into_iter().zip(self.cursors);
        let cursors = cursors.filter_map(|(name, at)| {
            Some(PlotLevel { name: name.into(), ..PlotLevel::plain(at?, Ink::Text) })
        });
        let cursors: Vec<_> = cursors.filter(|one| (first..=last).contains(&one.at)).collect();
        let mut wanted: Vec<(usize, &str)> =
            self.quantities.iter().map(|one| (*one as usize, one.axis())).collect();
        if self.has_residuals && self.subjects.iter().any(|one| one.fitted().is_some()) {
            wanted.push((LINE_RESIDUAL, "residual (mN)"));
        }
        let plot = |(place, axis): (usize, &str)| {
            let is_drawn = |one: &&ReviewSubject| place != LINE_RESIDUAL || one.fitted().is_some();
            let back_to_front = self.subjects.iter().rev().filter(is_drawn);
            let mut series: Vec<PlotSeries> = back_to_front
                .flat_map(|one| over_time(&one.lines[place], shown, ink_of(one)))
                .collect();
            if place == Quantity::Force as usize && front.fitted().is_some() {
                series.extend(over_time(&front.lines[LINE_MODELLED], shown, fitted_ink(front)));
            }
            let back_to_front = self.subjects.iter().rev().filter(is_drawn);
            let bands: Vec<PlotBand> = back_to_front
                .flat_map(|one| areas(&one.lines[place], shown, ink_of(one)))
                .collect();
            let edges = || bands.iter().flat_map(|one| one.edges.iter().flatten());
            let points = || series.iter().flat_map(|one| &one.points).chain(edges());
            let values = || points().map(|point| point[1]);
            let (low, high) = values()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), one| {
                    (low.min(one), high.max(one))
                });
            // Room for the names of phases.
            let room = (low <= high).then_some(high + NAMES * (high - low));
            let y = PlotAxis::linear(axis).with_visible_values(room.as_slice());
            Plot {
                stretches: phases.clone(),
                x_levels: cursors.clone(),
                bands,
                ..Plot::new("", self.time_axis(), y).with(series)
            }
        };
        wanted.into_iter().map(plot).collect()
    }

    fn depth_axes(&self) -> [PlotAxis; 2] {
        let depth = PlotAxis::linear("depth (mm)").with_range(self.depth.shown());
        [depth, PlotAxis::linear("force (N)").with_range(self.force.shown())]
    }

    /// Places and titles of the sessions side by side, group by group.
    fn titles_side_by_side(&self) -> Vec<(usize, String)> {
        let groups = groups(&self.subjects, self.grouping);
        let titled = groups.iter().flat_map(|group| {
            let short = group.short_names(&self.subjects).into_iter();
            let title = move |short| match group.name.as_str() {
                "" => short,
                name => format!("{name}, {short}"),
            };
            group.members.iter().copied().zip(short.map(title))
        });
        titled.collect()
    }

    /// The plot of a session; over depth its own line comes later.
    fn plot_side_by_side(&self, (index, title): (usize, String)) -> Plot {
        let subject = &self.subjects[index];
        let [depth, force_axis] = self.depth_axes();
        let y = self.force.shown();
        if self.side.is_over_depth {
            let over = fitted_over_depth(subject);
            let over = within(std::iter::once(over.as_slice()), [self.depth.shown(), y]);
            let means = loop_means(subject, [self.depth.shown(), y]);
            let series = means.chain(lines(over, fitted_ink(subject)));
            return Plot::new(&title, depth, force_axis).with(series);
        }
        let shown = [self.time.shown(), y];
        let force = &subject.lines[Quantity::Force as usize];
        let own = within(force.parts(), shown);
        let bands = areas(force, shown[0], ink_of(subject)).collect();
        let over = subject.fitted().map(|_| within(subject.lines[LINE_MODELLED].parts(), shown));
        let over = lines(over.unwrap_or_default(), fitted_ink(subject));
        let plot = Plot::new(&title, self.time_axis(), force_axis);
        Plot { bands, ..plot.with(lines(own, ink_of(subject)).chain(over)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_ends_where_the_axes_end() {
        let points: Vec<PlotPoint> =
            (0..6).map(|index| PlotPoint::new(f64::from(index), f64::from(index % 3))).collect();
        let found = within([points.as_slice()].into_iter(), [[1.0, 9.0], [0.0, 1.0]]);
        assert_eq!(found, [vec![[1.0, 1.0]], vec![[3.0, 0.0], [4.0, 1.0]]]);
    }
}
