//! The view as it stands as a figure: copied as a picture, or saved by the same painters as those of reports.

use super::groups::groups;
use super::side_by_side::fitted_over_depth;
use super::subject::{LINE_MODELLED, LINE_RESIDUAL, ReviewSubject};
use super::{ReviewScreen, View};
use crate::plots::stretches::Stretches;
use crate::widgets::{NamedControl, alarm_ui, quiet_ui};
use crate::workers::review::{Quantity, ReviewRecording};
use crate::workers::{BackgroundTask, Dialog, Job};
use eframe::egui::{ColorImage, Context, Ui};
use egui_plot::PlotPoint;
use palpate_analysis::report::panels::FigurePanels;
use palpate_analysis::session_actions::{ActionReport, SessionDocument, write_document};
use palpate_figures::drawing::Drawing;
use palpate_figures::figure::{Ink, Plot, PlotAxis, PlotLevel, PlotSeries, PlotStretch};
use palpate_figures::raster::{Raster, raster};
use std::path::PathBuf;

/// Columns of a figure of plots side by side.
const COLUMNS: usize = 3;
const WIDTH: f64 = 1.3;

/// Copies and saves under way.
#[derive(Default)]
pub(super) struct FigureExport {
    copy: Job<Result<Raster, String>>,
    dialog: Dialog<PathBuf>,
    /// The figure that waits for the name of its file.
    waiting: Option<Drawing>,
    save: BackgroundTask<ActionReport>,
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
        if let Some(to) = self.dialog.poll()
            && let Some(drawing) = self.waiting.take()
        {
            let document = SessionDocument::Drawing(Box::new(drawing));
            self.save
                .start("figure", ctx, move |progress| write_document(&document, &to, progress));
        }
    }

    fn copy(&mut self, drawing: Drawing, ctx: &Context) {
        self.copied = None;
        let work = move || raster(&drawing).map_err(|err| err.to_string());
        if let Err(err) = self.copy.start("copy-figure", ctx, work) {
            self.copied = Some(Err(err.to_string()));
        }
    }

    fn save(&mut self, drawing: Drawing, ctx: &Context) {
        self.waiting = Some(drawing);
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
            (Some(Err(reason)), _) | (_, Some(Err(reason))) => alarm_ui(ui, reason),
            (Some(Ok(())), None) => quiet_ui(ui, "copied"),
            (_, Some(Ok(done))) => quiet_ui(ui, &done.sentence),
            (None, None) => {}
        }
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

const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

fn over_time(stretches: &Stretches, x: [f64; 2], ink: Ink) -> impl Iterator<Item = PlotSeries> {
    lines(within(stretches.parts(), [x, EVERYWHERE]), ink)
}

fn ink_of(subject: &ReviewSubject) -> Ink {
    Ink::Session(usize::try_from(subject.id).unwrap_or_default())
}

impl ReviewScreen {
    /// Draws the buttons, where the view has a figure.
    pub(super) fn figure_ui(&mut self, ui: &mut Ui) {
        if ui.button("Copy figure").named("Copy figure").clicked() {
            let drawing = self.figure().drawing();
            self.figure.copy(drawing, ui.ctx());
        }
        if ui.button("Save figure...").named("Save figure").clicked() {
            let drawing = self.figure().drawing();
            self.figure.save(drawing, ui.ctx());
        }
        self.figure.answer_ui(ui);
    }

    fn figure(&self) -> FigurePanels {
        let has_fit = self.subjects.iter().any(|one| one.fitted().is_some());
        let fitted = || has_fit.then(|| ("fitted".to_owned(), Ink::Limit)).into_iter();
        let named = self.subjects.iter().map(|one| (one.name.clone(), ink_of(one)));
        match self.view {
            View::SideBySide => FigurePanels {
                title: "Sessions side by side".into(),
                words: format!("force of {} sessions, all with the same axes", self.subjects.len()),
                plots: self.plots_side_by_side(),
                columns: COLUMNS,
                legend: fitted().collect(),
            },
            View::OverTime => FigurePanels {
                title: "Sessions over time".into(),
                words: format!("time from {}", self.time_origin.name()),
                plots: self.plots_over_time(),
                columns: 1,
                legend: named.chain(fitted()).collect(),
            },
            _ => FigurePanels {
                title: "Sessions over depth".into(),
                words: "force over depth from contact".into(),
                plots: vec![self.plot_over_depth()],
                columns: 1,
                legend: named.collect(),
            },
        }
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
                series.extend(over_time(&front.lines[LINE_MODELLED], shown, Ink::Limit));
            }
            Plot {
                stretches: phases.clone(),
                x_levels: cursors.clone(),
                ..Plot::new("", self.time_axis(), PlotAxis::linear(axis)).with(series)
            }
        };
        wanted.into_iter().map(plot).collect()
    }

    fn depth_axes(&self) -> [PlotAxis; 2] {
        let depth = PlotAxis::linear("depth (mm)").with_range(self.depth.shown());
        [depth, PlotAxis::linear("force (N)").with_range(self.force.shown())]
    }

    /// Loops of more points than a frame can draw are pixels, which this figure does not have.
    fn plot_over_depth(&self) -> Plot {
        let shown = [self.depth.shown(), self.force.shown()];
        let series = self.subjects.iter().rev().flat_map(|one| {
            let parts = self.depth_lines.stretches(one.id).iter().map(Vec::as_slice);
            lines(within(parts, shown), ink_of(one))
        });
        let [x, y] = self.depth_axes();
        Plot::new("", x, y).with(series)
    }

    fn plots_side_by_side(&self) -> Vec<Plot> {
        let groups = groups(&self.subjects, self.grouping);
        let titled = groups.iter().flat_map(|group| {
            let short = group.short_names(&self.subjects).into_iter();
            let title = move |short| match group.name.as_str() {
                "" => short,
                name => format!("{name}, {short}"),
            };
            group.members.iter().copied().zip(short.map(title))
        });
        let [depth, force] = self.depth_axes();
        let y = self.force.shown();
        let plot = |(index, title): (usize, String)| {
            let subject = &self.subjects[index];
            let ink = ink_of(subject);
            let (x, series) = match self.side.is_over_depth {
                true => {
                    let shown = [self.depth.shown(), y];
                    let over = fitted_over_depth(subject);
                    let own = within(self.side.stretches(subject.id).into_iter(), shown);
                    let fitted = within(std::iter::once(over.as_slice()), shown);
                    let series = lines(own, ink).chain(lines(fitted, Ink::Limit));
                    (depth.clone(), series.collect::<Vec<_>>())
                }
                false => {
                    let shown = [self.time.shown(), y];
                    let own = within(subject.lines[Quantity::Force as usize].parts(), shown);
                    let series = lines(own, ink);
                    let fitted = subject.fitted().map(|_| &subject.lines[LINE_MODELLED]);
                    let fitted = fitted.into_iter().flat_map(|one| within(one.parts(), shown));
                    let series = series.chain(lines(fitted.collect(), Ink::Limit));
                    (self.time_axis(), series.collect())
                }
            };
            Plot::new(&title, x, force.clone()).with(series)
        };
        titled.map(plot).collect()
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
