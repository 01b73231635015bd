//! The search for the surface as the probe feels it: force over position, and what each pass found.

use crate::plots::style::quiet;
use crate::theme::Tokens;
use eframe::egui::{RichText, Ui};
use egui_plot::{Line, MarkerShape, Plot, PlotPoint, PlotPoints, Points, VLine};
use palpate_model::signal::LiveTrace;
use palpate_runner::RunView;
use std::sync::Arc;

/// Air shown in front of the first touch, in mm.
const LEAD_MM: f64 = 3.0;

/// The points of the newest search, converted when it changed.
#[derive(Debug, Default)]
pub struct Approach {
    trace: Option<Arc<LiveTrace>>,
    points: Vec<PlotPoint>,
}

impl Approach {
    /// Draws the search in the space there is.
    pub fn ui(&mut self, ui: &mut Ui, run: &RunView) {
        self.update(&run.approach);
        let tokens = Tokens::of(ui.visuals().dark_mode);
        ui.label(
            RichText::new("Force over position while the surface is searched").heading().strong(),
        );
        for line in words(run) {
            ui.label(line);
        }
        let touches: Vec<[f64; 2]> =
            run.touches.iter().map(|touch| [touch.position.0, touch.force.0]).collect();
        let from = touches.iter().map(|touch| touch[0]).reduce(f64::min);
        let end = self.points.iter().map(|point| point.x).fold(f64::NEG_INFINITY, f64::max);
        quiet(ui, Plot::new("approach"), tokens)
            .x_axis_label("position from home (mm)")
            .y_axis_label("force above tare (N)")
            .include_y(0.1)
            .auto_bounds([from.is_none(), true])
            .show(ui, |plot_ui| {
                if let Some(from) = from {
                    plot_ui.set_plot_bounds_x(from - LEAD_MM..=end.max(from) + 0.5);
                }
                plot_ui.line(
                    Line::new("force", PlotPoints::Borrowed(&self.points))
                        .color(tokens.series)
                        .width(1.5),
                );
                plot_ui.points(
                    Points::new("felt", PlotPoints::from(touches.clone()))
                        .shape(MarkerShape::Diamond)
                        .radius(5.0)
                        .color(tokens.limit),
                );
                if let Some(contact) = run.contact {
                    plot_ui.vline(
                        VLine::new("contact", contact.position.0).color(tokens.limit).width(1.5),
                    );
                }
            });
    }

    fn update(&mut self, trace: &Arc<LiveTrace>) {
        if self.trace.as_ref().is_some_and(|old| Arc::ptr_eq(old, trace)) {
            return;
        }
        self.points = trace
            .points()
            .iter()
            .filter(|point| point.depth.is_finite() && point.force.is_finite())
            .map(|point| PlotPoint::new(point.depth, point.force))
            .collect();
        self.trace = Some(Arc::clone(trace));
    }
}

/// What was felt and found, for those who do not see the plot.
fn words(run: &RunView) -> Vec<String> {
    let mut words: Vec<String> = run
        .touches
        .iter()
        .map(|touch| {
            format!("pass {} felt {:.3} at {:.3}", touch.pass, touch.force, touch.position)
        })
        .collect();
    words.push(match run.contact {
        Some(contact) => format!(
            "the surface is at {:.3} ± {:.3} mm from home",
            contact.position.0, contact.std_error_mm
        ),
        None if run.touches.is_empty() => "nothing felt yet".into(),
        None => "the surface is not known yet".into(),
    });
    words
}
