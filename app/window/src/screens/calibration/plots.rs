//! The chosen calibration as four plots over force: signal, residual, slope and uncertainty.

use crate::plots::style::{quiet, round_marks};
use crate::theme::Tokens;
use eframe::egui::{Color32, Id, RichText, Ui, vec2};
use egui_plot::{HoverPosition, Line, LineStyle, Plot, PlotPoints, Points, Span};
use palpate_analysis::report::calibration_plot::Curves;

/// Labelled steps across one plot, at most: it is half as wide as those of the run.
const STEPS_ACROSS: f64 = 4.0;

/// Draws all four in the space there is, two beside each other.
pub fn curves_ui(ui: &mut Ui, curves: &Curves) {
    let size = vec2(
        (ui.available_width() - 12.0) * 0.5,
        (ui.available_height() - 62.0) * 0.5,
    );
    let tokens = Tokens::of(ui.visuals().dark_mode);
    let zero = vec![[curves.x[0], 0.0], [curves.x[1], 0.0]];
    for row in [
        ["signal (V)", "residual (mN)"],
        ["slope (V/N)", "uncertainty (mN)"],
    ] {
        ui.horizontal(|ui| {
            for title in row {
                let (lines, dots) = match title {
                    "signal (V)" => (
                        vec![
                            (&curves.signal, tokens.text),
                            (&curves.beyond, tokens.text_quiet),
                        ],
                        Some(&curves.readings),
                    ),
                    "residual (mN)" => (vec![(&zero, tokens.text_quiet)], Some(&curves.misses)),
                    "slope (V/N)" => (vec![(&curves.slope, tokens.text)], None),
                    _ => (vec![(&curves.sigma, tokens.text)], None),
                };
                ui.vertical(|ui| {
                    ui.label(RichText::new(title).heading().strong());
                    ui.allocate_ui(size, |ui| {
                        ui.set_min_size(size);
                        one_ui(ui, title, curves, &lines, dots);
                    });
                });
            }
        });
    }
    let words = if curves.flat.is_empty() {
        "blue: loading, orange: unloading"
    } else {
        "blue: loading, orange: unloading, shaded: flat stretch"
    };
    ui.label(RichText::new(words).color(tokens.text_quiet).small());
}

fn one_ui(
    ui: &mut Ui,
    title: &'static str,
    curves: &Curves,
    lines: &[(&Vec<[f64; 2]>, Color32)],
    dots: Option<&[Vec<[f64; 2]>; 2]>,
) {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    quiet(ui, Plot::new(title), tokens)
        .x_axis_label("force (N)")
        .x_grid_spacer(|input| round_marks(input, STEPS_ACROSS))
        .include_y(0.0)
        .link_axis(Id::unique("calibration_force"), [true, false])
        .label_formatter(|hover| match hover {
            HoverPosition::NearDataPoint { position, .. } => {
                Some(format!("{:.3} N\n{:.4}", position.x, position.y))
            }
            HoverPosition::Elsewhere { .. } => None,
        })
        .show(ui, |plot_ui| {
            for [from, to] in &curves.flat {
                let span = Span::new("flat", *from..=*to);
                plot_ui.span(span.fill(tokens.phase_band).border_color(tokens.line));
            }
            for (i, (line, ink)) in lines.iter().enumerate() {
                let points: PlotPoints<'_> = line.iter().copied().collect();
                let line = Line::new(title, points)
                    .id((title, i))
                    .color(*ink)
                    .width(1.5);
                // Beyond the heaviest weight nothing was measured.
                plot_ui.line(if i == 1 {
                    line.style(LineStyle::dashed_dense())
                } else {
                    line
                });
            }
            let inks = [("loading", tokens.series), ("unloading", tokens.limit)];
            for ((name, ink), dots) in inks.into_iter().zip(dots.into_iter().flatten()) {
                let dots: PlotPoints<'_> = dots.iter().copied().collect();
                plot_ui.points(Points::new(name, dots).radius(3.0).color(ink));
            }
        });
}
