//! The force model's parameters as they become known, each with its uncertainty.

use crate::widgets::{quiet_ui, tokens_of};
use eframe::egui::text::LayoutJob;
use eframe::egui::{
    Align, Color32, FontSelection, Label, Layout, Response, RichText, Role, TextStyle, Ui,
    WidgetInfo, vec2,
};
use palpate_analysis::report::text::{ParameterText, typeset};
use palpate_model::estimate::{FittedParameter, LiveEstimate};
use palpate_model::rig::Phase;
use palpate_runner::RunView;

/// The parameters shown, in this order, with their units where no fit names them yet.
const SHOWN: [(&str, &str); 7] = [
    ("tau_eps", "s"),
    ("mu1", "N/mm"),
    ("mu2", "N/mm^2"),
    ("mu3", "N/mm^3"),
    ("tau_sig", "N*s/mm^2"),
    ("f0", "N"),
    ("f_offset", "N"),
];

/// Height of a symbol's index in points: two thirds of the letter, as in print.
const INDEX_SIZE: f32 = 9.0;

/// Columns of a parameter's name and value in points: a value of five digits with its uncertainty and a power of ten has room.
pub(super) const NAME_WIDTH: f32 = 68.0;
const VALUE_WIDTH: f32 = 190.0;

/// Draws one row per parameter.
pub fn parameters_ui(ui: &mut Ui, run: Option<&RunView>) {
    let live = run.and_then(|run| run.live.as_ref());
    let found = live.map_or(&[][..], |live| live.parameters.as_slice());
    tight(ui, |ui| {
        for (name, unit) in SHOWN {
            let parameter = found.iter().find(|parameter| parameter.name == name);
            row_ui(
                ui,
                name,
                parameter.map_or(unit, |known| &known.unit),
                parameter,
                live.and_then(|live| reason(live, name)),
            );
        }
    });
    let blind = live.and_then(|live| SHOWN.iter().find_map(|(name, _)| reason(live, name)));
    let remark = match (run, blind) {
        (None, _) => Some("parameters appear during the ramp".to_string()),
        (Some(_), Some(reason)) => Some(reason.to_owned()),
        (Some(run), None) => remark(run.phase, found),
    };
    if let Some(live) = live {
        for words in quality_words(live) {
            quiet_ui(ui, words);
        }
    }
    if let Some(remark) = remark {
        quiet_ui(ui, remark);
    }
}

/// RMSE of the live fit, and what its errors leave out.
fn quality_words(live: &LiveEstimate) -> [String; 2] {
    let residual =
        format!("weighted residual {:.1} mN, {} samples", live.rmse_weighted_n * 1e3, live.samples);
    let alone =
        "± is the statistical uncertainty; the exact fit adds the uncertainty of the calibration"
            .to_owned();
    [residual, alone]
}

/// Rows of numbers read better close together.
pub(super) fn tight(ui: &mut Ui, rows: impl FnOnce(&mut Ui)) {
    ui.scope(|ui| {
        ui.spacing_mut().interact_size.y = 18.0;
        ui.spacing_mut().item_spacing.y = 2.0;
        rows(ui);
    });
}

/// Why the live fit cannot identify a parameter yet.
fn reason<'a>(live: &'a LiveEstimate, name: &str) -> Option<&'a str> {
    let verdict = live.verdicts.iter().find(|verdict| verdict.parameter == name)?;
    verdict.reason.as_deref()
}

fn row_ui(
    ui: &mut Ui,
    name: &str,
    unit: &str,
    parameter: Option<&FittedParameter>,
    reason: Option<&str>,
) {
    let tokens = tokens_of(ui);
    let ink = if is_known(parameter) { tokens.text } else { tokens.text_quiet };
    let label = value_ui(ui, name, &value_text(parameter), ink, &typeset(unit));
    if let Some(reason) = reason {
        label.on_hover_text(reason);
    }
}

/// Draws name, value and unit of a parameter; returns the value.
pub(super) fn value_ui(ui: &mut Ui, name: &str, value: &str, ink: Color32, unit: &str) -> Response {
    let quiet = tokens_of(ui).text_quiet;
    let row = |ui: &mut Ui| {
        cell(ui, NAME_WIDTH, |ui| symbol_ui(ui, name));
        let value = cell(ui, VALUE_WIDTH, |ui| number_ui(ui, value, ink));
        ui.label(RichText::new(unit).color(quiet).small());
        value
    };
    ui.horizontal(row).inner
}

/// Draws a number with its power of ten as in print; as typed, it is what a screen reader says.
pub(super) fn number_ui(ui: &mut Ui, text: &str, ink: Color32) -> Response {
    let full = TextStyle::Monospace.resolve(ui.style()).size;
    let mut job = number_job(ui, text, ink, full);
    let (has, needs) = (ui.available_width(), width_of_job(ui, &job));
    if needs > has {
        // Rather in smaller letters than broken in two.
        job = number_job(ui, text, ink, (full * has / needs - 0.1).max(INDEX_SIZE));
    }
    let label = ui.add(Label::new(job).wrap());
    label.widget_info(|| WidgetInfo::labeled(Role::Label, true, text));
    label
}

/// A number in digits of this size.
fn number_job(ui: &Ui, text: &str, ink: Color32, size: f32) -> LayoutJob {
    let mut job = LayoutJob::default();
    let mut append = |text: RichText, size: f32, align: Align| {
        let text = text.color(ink).monospace().size(size);
        text.append_to(&mut job, ui.style(), FontSelection::Default, align);
    };
    match text.rsplit_once('e').filter(|(_, exponent)| exponent.parse::<i32>().is_ok()) {
        Some((number, exponent)) => {
            append(RichText::new(format!("{number}·10")), size, Align::BOTTOM);
            append(RichText::new(exponent), INDEX_SIZE, Align::TOP);
        }
        None => append(RichText::new(text), size, Align::BOTTOM),
    }
    job
}

fn width_of_job(ui: &Ui, job: &LayoutJob) -> f32 {
    ui.fonts_mut(|fonts| fonts.layout_job(job.clone())).size().x
}

/// Draws a parameter's symbol as in print; its key is the tooltip and what a screen reader says.
pub(super) fn symbol_ui(ui: &mut Ui, name: &str) {
    let label = ui.label(symbol_job(ui, name, "")).on_hover_text(name);
    label.widget_info(|| WidgetInfo::labeled(Role::Label, true, name));
}

/// A parameter's symbol as in print, and its unit where one is given.
pub(super) fn symbol_job(ui: &Ui, name: &str, unit: &str) -> LayoutJob {
    let quiet = tokens_of(ui).text_quiet;
    let (letter, index) = symbol(name);
    let mut job = LayoutJob::default();
    let unit = if unit.is_empty() { String::new() } else { format!(" ({})", typeset(unit)) };
    let unit = RichText::new(unit).small();
    for text in [RichText::new(letter), RichText::new(index).size(INDEX_SIZE), unit] {
        let style = FontSelection::Default;
        text.color(quiet).append_to(&mut job, ui.style(), style, Align::BOTTOM);
    }
    job
}

/// Letter and index of a parameter's key: `tau_eps` is τ with the index ε, `mu1` is μ with the index 1.
fn symbol(name: &str) -> (String, String) {
    let greek = |word: &str| match word {
        "tau" => "τ".to_owned(),
        "mu" => "μ".to_owned(),
        "eta" => "η".to_owned(),
        "alpha" => "α".to_owned(),
        "beta" => "β".to_owned(),
        "eps" => "ε".to_owned(),
        "sig" => "σ".to_owned(),
        "f" => "F".to_owned(),
        other => other.to_owned(),
    };
    let end = name.find(|one: char| one == '_' || one.is_ascii_digit()).unwrap_or(name.len());
    let (letter, index) = name.split_at(end);
    (greek(letter), greek(index.trim_start_matches('_')))
}

pub(super) fn cell<R>(ui: &mut Ui, width: f32, content: impl FnOnce(&mut Ui) -> R) -> R {
    let layout = Layout::left_to_right(Align::Center);
    let content = |ui: &mut Ui| {
        ui.set_min_width(width);
        content(ui)
    };
    ui.allocate_ui_with_layout(vec2(width, 18.0), layout, content).inner
}

fn is_known(parameter: Option<&FittedParameter>) -> bool {
    parameter.is_some_and(|parameter| parameter.is_fixed || parameter.std_error.is_some())
}

/// The words of a fit for what is known; live, what is not identified is not yet shown as a number.
fn value_text(parameter: Option<&FittedParameter>) -> String {
    match parameter.filter(|_| is_known(parameter)) {
        Some(known) => ParameterText::of(known).value,
        None => "not yet".into(),
    }
}

/// Why something is not known yet, or never became known; `None` when all is known.
fn remark(phase: Phase, parameters: &[FittedParameter]) -> Option<String> {
    let missing: Vec<&str> = SHOWN
        .iter()
        .map(|(name, _)| *name)
        .filter(|name| !is_known(parameters.iter().find(|parameter| parameter.name == *name)))
        .collect();
    if missing.is_empty() {
        return None;
    }
    let names = match missing.len() == SHOWN.len() {
        true => "none known".to_owned(),
        false => format!("{} not yet", missing.join(", ")),
    };
    let why = match phase {
        Phase::Ramp => "the ramp is still too short",
        Phase::Hold => "the hold is still too short",
        Phase::Creep | Phase::Sine | Phase::Follow => "the live fit covers only ramps and holds",
        Phase::Unload
        | Phase::Retract
        | Phase::Stopped
        | Phase::Ended
        | Phase::Paused
        | Phase::Jog => "the ramp and hold were too short",
        _ => "the probe has not indented the specimen",
    };
    Some(format!("{names}: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Context, RawInput};

    #[test]
    fn symbols_are_those_of_print() {
        for (key, letter, index) in [
            ("tau_eps", "τ", "ε"),
            ("tau_sig", "τ", "σ"),
            ("mu3", "μ", "3"),
            ("f0", "F", "0"),
            ("x_contact", "x", "contact"),
            ("alpha", "α", ""),
        ] {
            assert_eq!(symbol(key), (letter.to_owned(), index.to_owned()), "{key}");
        }
    }

    #[test]
    fn a_wide_value_stands_in_one_line() {
        let ctx = Context::default();
        crate::theme::apply(&ctx);
        let height = |value: &str| {
            let mut height = 0.0;
            let mut drawn = ctx.run_ui(RawInput::default(), |ui| {
                let ink = tokens_of(ui).text;
                tight(ui, |ui| {
                    height = value_ui(ui, "tau_sig", value, ink, "N·s/mm²").rect.height()
                });
            });
            drawn.textures_delta.clear();
            height
        };
        let usual = height("1.50 ± 0.10");
        assert!(usual > 10.0);
        for value in ["(5.18013 ± 0.00031)e-2", "(-5.180132 ± 0.000031)e-12"] {
            assert!(height(value) <= usual + 1.0, "{value}: {} over {usual}", height(value));
        }
    }

    fn parameter(name: &str, std_error: Option<f64>) -> FittedParameter {
        FittedParameter {
            name: name.into(),
            value: 1.5,
            unit: "s".into(),
            std_error,
            ci95: None,
            is_fixed: false,
            systematic_error: None,
            total95: None,
            budget: Vec::new(),
        }
    }

    #[test]
    fn what_is_not_identified_is_never_shown_as_a_number() {
        assert_eq!(value_text(None), "not yet");
        assert_eq!(value_text(Some(&parameter("mu1", None))), "not yet");
        assert_eq!(value_text(Some(&parameter("mu1", Some(0.1)))), "1.50 ± 0.10");
    }

    #[test]
    fn live_errors_are_called_statistical() {
        let live = LiveEstimate {
            parameters: Vec::new(),
            rmse_weighted_n: 0.0123,
            samples: 1000,
            verdicts: Vec::new(),
        };
        let [residual, alone] = quality_words(&live);
        assert_eq!(residual, "weighted residual 12.3 mN, 1000 samples");
        assert!(alone.contains("statistical") && alone.contains("calibration"));
    }

    #[test]
    fn the_remark_names_what_is_missing_and_why() {
        let early = remark(Phase::Contact, &[]).unwrap();
        assert!(early.contains("none known") && early.contains("not indented"));
        let mut known: Vec<FittedParameter> =
            SHOWN.iter().map(|(name, _)| parameter(name, Some(0.1))).collect();
        assert_eq!(remark(Phase::Hold, &known), None);
        known[4].std_error = None;
        let text = remark(Phase::Ramp, &known).unwrap();
        assert!(text.contains("tau_sig not yet") && text.contains("ramp"), "{text}");
    }
}
