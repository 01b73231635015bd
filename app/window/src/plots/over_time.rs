//! Quantities of sessions over time, above each other with one time axis.

use super::navigate::{AxisRange, Gesture, gesture};
use super::stretches::Stretches;
use super::style::{name_up, still};
use crate::theme::Tokens;
use crate::widgets::tokens_of;
use eframe::egui::{Align2, Color32, RichText, Ui};
use egui_plot::{HLine, LineStyle, Plot, PlotPoint, PlotUi, Span as Shade, Text, VLine};
use palpate_model::rig::Phase;

pub struct TimeLayer<'a> {
    pub name: &'a str,
    pub color: Color32,
    pub width: f32,
    pub stretches: &'a Stretches,
}

/// A vertical mark at a time.
#[derive(Clone, Debug)]
pub struct TimeMark {
    pub t: f64,
    pub is_alarm: bool,
    /// A person wrote it.
    pub is_note: bool,
}

/// Drawn behind and before the lines of every plot.
#[derive(Clone, Debug, Default)]
pub struct TimeBackdrop {
    /// Start, end and phase, of the session in front.
    pub phases: Vec<(f64, f64, Phase)>,
    /// Stretches whose forces do not count.
    pub left_out: Vec<[f64; 2]>,
    pub moments: Vec<TimeMark>,
    pub cursors: [Option<f64>; 2],
}

pub struct TimePanel<'a> {
    pub id: &'static str,
    pub axis: &'static str,
    /// The line in front comes last.
    pub layers: Vec<TimeLayer<'a>>,
    /// Whether the axis' zero is drawn.
    pub has_zero: bool,
}

/// Room above and below the lines, as a share of their height.
const MARGIN: f64 = 0.06;
/// Room above for the names of phases in points, and the most of it as a share of the height of the lines.
const NAMES: f32 = 20.0;
const NAMES_SHARE: f64 = 0.4;
/// Width of a letter in points: the name of a phase that is narrower is left out.
const LETTER: f64 = 8.0;

/// Lowest and highest of all lines with room around them.
fn heights(panel: &TimePanel<'_>, points: f32) -> [f64; 2] {
    let known = panel.layers.iter().filter_map(|layer| layer.stretches.y());
    let ends = known.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let [low, high] = ends.unwrap_or([0.0, 1.0]);
    // A line without height has some all the same.
    let height = (high - low).max(1e-9 * high.abs().max(low.abs())).max(1e-6);
    let names = f64::from(NAMES / points.max(1.0)).min(NAMES_SHARE);
    [low - MARGIN * height, high + (MARGIN + names) * height]
}

/// Draws what all plots of a session have behind their lines: phases, what is left out, what happened.
fn setting_ui(plot_ui: &mut PlotUi<'_>, setting: &TimeBackdrop, shown: [f64; 2], tokens: &Tokens) {
    let per_second = f64::from(plot_ui.transform().frame().width()) / (shown[1] - shown[0]);
    for (number, (from, to, phase)) in setting.phases.iter().enumerate() {
        if *to < shown[0] || *from > shown[1] {
            continue;
        }
        let fill = match number % 2 {
            0 => Color32::TRANSPARENT,
            _ => tokens.phase_band,
        };
        let seen = to.min(shown[1]) - from.max(shown[0]);
        let has_room = seen * per_second > LETTER * phase.name().len() as f64;
        let name = if has_room { phase.name() } else { "" };
        plot_ui.span(Shade::new(name, *from..=*to).fill(fill).border_color(tokens.line));
    }
    for [from, to] in &setting.left_out {
        plot_ui.span(
            Shade::new("left out", *from..=*to)
                .fill(tokens.limit.gamma_multiply(0.16))
                .border_color(tokens.limit),
        );
    }
    for moment in &setting.moments {
        if !(shown[0]..=shown[1]).contains(&moment.t) {
            continue;
        }
        let (color, style) = match (moment.is_alarm, moment.is_note) {
            (true, _) => (tokens.alarm_fill, LineStyle::Solid),
            (_, true) => (tokens.text, LineStyle::dashed_loose()),
            _ => (tokens.text_quiet, LineStyle::dotted_dense()),
        };
        let line = VLine::new("event", moment.t).color(color).width(1.0);
        plot_ui.vline(line.style(style).allow_hover(false));
    }
}

/// Draws one plot in the space there is and returns what the pointer did in it. `is_last`: it has the time's name.
pub fn over_time_ui(
    ui: &mut Ui,
    panel: &TimePanel<'_>,
    span: &AxisRange,
    setting: &TimeBackdrop,
    time_axis: Option<&str>,
) -> Gesture {
    let tokens = tokens_of(ui);
    let (shown, [low, high]) = (span.shown(), heights(panel, ui.available_height()));
    let plot = still(ui, Plot::new(panel.id), tokens)
        .y_axis_label(name_up(ui, panel.axis, time_axis.is_some()))
        .x_axis_label(time_axis.unwrap_or_default())
        .show_axes([time_axis.is_some(), true]);
    let response = plot.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(shown[0]..=shown[1]);
        plot_ui.set_plot_bounds_y(low..=high);
        setting_ui(plot_ui, setting, shown, tokens);
        if panel.has_zero {
            let zero = HLine::new("zero", 0.0).color(tokens.text_quiet).width(1.0);
            plot_ui.hline(zero.allow_hover(false));
        }
        for (number, layer) in panel.layers.iter().enumerate() {
            let look = (layer.color, layer.width);
            layer.stretches.paint(plot_ui, layer.name, number, look);
        }
        for (name, cursor) in ["A", "B"].into_iter().zip(setting.cursors) {
            let Some(t) = cursor.filter(|t| (shown[0]..=shown[1]).contains(t)) else {
                continue;
            };
            let line = VLine::new(name, t).color(tokens.text).width(1.2);
            plot_ui.vline(line.allow_hover(false));
            let words = RichText::new(format!(" {name}")).strong();
            plot_ui.text(
                Text::new(name, PlotPoint::new(t, low), words)
                    .anchor(Align2::LEFT_BOTTOM)
                    .color(tokens.text)
                    .allow_hover(false),
            );
        }
    });
    gesture(ui, &response.response)
}
