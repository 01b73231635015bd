//! The bar that stands on every screen: state, run, progress, the numbers, the stop control.

use super::activity::{Activity, is_motion_possible, run_in_progress};
use super::panels::is_narrow;
use crate::command::{Commands, UiCommand};
use crate::theme::reading_style;
use crate::widgets::{announce, badge_ui, quiet_ui, share_ui, tokens_of};
use eframe::egui::accesskit::Live;
use eframe::egui::{
    Align, Button, Context, Id, Label, Layout, RichText, Role, Sense, Stroke, Ui, Vec2, WidgetInfo,
    vec2,
};
use palpate_figures::uncertain::clock;
use palpate_model::rig::command::position_from_pulses;
use palpate_runner::{RunView, RunnerSnapshot};

/// Height of the bar's content in points.
pub const HEIGHT: f32 = 52.0;

/// Width of the run's name and progress in points, and in a narrow window.
const RUN_WIDTHS: [f32; 2] = [226.0, 150.0];

/// Draws the bar. `specimen` is the one of the run in progress or of the form.
pub fn top_bar_ui(ui: &mut Ui, snapshot: &RunnerSnapshot, activity: &Activity, specimen: &str) {
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        badge_ui(ui, activity, vec2(146.0, HEIGHT));
        ui.add_space(6.0);
        run_ui(ui, snapshot.run.as_ref(), specimen);
        announce_numbers(ui, snapshot);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let stop = stop_ui(ui, is_motion_possible(snapshot));
            let buttons = StopButtons { stop, halt: halt_ui(ui) };
            ui.data_mut(|data| data.insert_temp(Id::unique("stop buttons"), buttons));
            numbers_ui(ui, snapshot);
        });
    });
}

/// Where the two buttons were drawn last.
#[derive(Clone, Copy)]
struct StopButtons {
    stop: Id,
    halt: Id,
}

/// Pushes the commands of the two buttons if they were pressed since the last frame: before anything is drawn, so that no
/// screen can delay a stop.
pub fn push_stop_buttons(ctx: &Context, commands: &mut Commands) {
    let drawn = ctx.data(|data| data.get_temp::<StopButtons>(Id::unique("stop buttons")));
    let Some(StopButtons { stop, halt }) = drawn else { return };
    for (button, command) in [(stop, UiCommand::Stop), (halt, UiCommand::Halt)] {
        if ctx.read_response(button).is_some_and(|one| one.clicked()) {
            commands.push(command);
        }
    }
}

fn stop_ui(ui: &mut Ui, is_motion_possible: bool) -> Id {
    let tokens = tokens_of(ui);
    let text = RichText::new("Stop motion  F12").size(17.0).strong();
    // Grey while nothing can move, and always there: it also stops what we do not know of.
    let button = if is_motion_possible {
        Button::new(text.color(tokens.on_alarm)).fill(tokens.alarm_fill)
    } else {
        Button::new(text).fill(tokens.control)
    };
    let button = button.stroke(Stroke::new(2.0, tokens.alarm_fill)).min_size(vec2(176.0, HEIGHT));
    ui.add(button).id
}

/// Immediate stop: no braking, and the axis must be homed again.
fn halt_ui(ui: &mut Ui) -> Id {
    let tokens = tokens_of(ui);
    let button = Button::new("Halt  F11")
        .fill(tokens.control)
        .stroke(Stroke::new(1.0, tokens.alarm_fill))
        .min_size(vec2(72.0, HEIGHT));
    let hint = "stops the motion at once, without slowing down; the axis must be homed again";
    ui.add(button).on_hover_text(hint).id
}

fn run_ui(ui: &mut Ui, run: Option<&RunView>, specimen: &str) {
    let tokens = tokens_of(ui);
    let width = RUN_WIDTHS[usize::from(is_narrow(ui.ctx()))];
    ui.allocate_ui_with_layout(vec2(width, HEIGHT), Layout::top_down(Align::Min), |ui| {
        ui.set_width(width);
        ui.spacing_mut().item_spacing.y = 2.0;
        let specimen = match specimen.trim() {
            "" => "specimen not named".to_string(),
            name => format!("specimen {name}"),
        };
        ui.add(Label::new(specimen).truncate());
        let line = run.map_or_else(|| "no run yet".into(), run_line);
        ui.add(Label::new(RichText::new(line).color(tokens.text_quiet)).truncate());
        if let Some(run) = run.filter(|run| run.outcome.is_none()) {
            share_ui(ui, run.fraction);
        }
    });
}

/// Where the run is and how long it goes on.
fn run_line(run: &RunView) -> String {
    let step = match run.cycle_starts.last() {
        Some((_, cycle)) if run.cycles > 1 => format!("cycle {cycle} of {}", run.cycles),
        _ => format!("step {} of {}", (run.step_index + 1).min(run.steps.len()), run.steps.len()),
    };
    match (&run.outcome, &run.holding) {
        (Some(outcome), _) => {
            format!("last run {}, {}", outcome.ending, clock(run.now.seconds().0))
        }
        (None, Some(_)) => format!("{step}, waiting for Retract or Close session"),
        // What matters most comes first: a narrow window cuts the rest.
        (None, None) => format!("{}, {} left, {step}", run.phase, clock(run.time_left.0)),
    }
}

/// Force, depth, position and velocity, right to left.
pub fn numbers_ui(ui: &mut Ui, snapshot: &RunnerSnapshot) {
    let derived = run_in_progress(snapshot).map(|run| run.derived);
    let at_rest = snapshot.rig.reading.filter(|_| snapshot.rig.is_homed).map(|reading| {
        position_from_pulses(reading.pulses, snapshot.rig.description.mm_per_pulse).0
    });
    let position = match derived {
        Some(derived) if snapshot.rig.is_homed => Some(derived.position.0),
        _ => at_rest,
    };
    let depth = derived.and_then(|derived| derived.depth).map(|depth| depth.0);
    let force = derived.and_then(|derived| derived.force).map(|force| force.0);
    let velocity = derived.map(|derived| derived.velocity.0);
    let all = [
        ("force F", "N", number(force, 3), 100.0),
        ("depth", "mm", number(depth, 3), 100.0),
        ("position x", "mm", number(position, 3), 118.0),
        ("velocity v", "mm/s", number(velocity, 2), 110.0),
    ];
    let gap = ui.spacing().item_spacing.x;
    let mut left = ui.available_width();
    let fits = |(_, _, _, width): &&(&str, &str, String, f32)| {
        left -= width + gap;
        left >= 0.0
    };
    // The ones that matter most are kept in a narrow window.
    let count = all.iter().take_while(fits).count();
    for (name, unit, text, width) in all.into_iter().take(count).rev() {
        number_ui(ui, name, unit, text, width);
    }
}

/// Has a screen reader say force and depth of a run in progress now and then. Nothing is drawn.
fn announce_numbers(ui: &mut Ui, snapshot: &RunnerSnapshot) {
    let id = Id::unique("announced numbers");
    let Some(run) = run_in_progress(snapshot) else {
        return ui.data_mut(|data| data.remove::<AnnouncedNumbers>(id));
    };
    let number = |value: Option<f64>| number(value, 2);
    let force = number(run.derived.force.map(|force| force.0));
    let depth = number(run.derived.depth.map(|depth| depth.0));
    let now = ui.input(|input| input.time);
    let words = ui.data_mut(|data| {
        let said = data.get_temp_mut_or_default::<AnnouncedNumbers>(id);
        if said.words.is_empty() || now - said.at >= ANNOUNCE_EVERY_SECS {
            *said =
                AnnouncedNumbers { at: now, words: format!("force {force} N, depth {depth} mm") };
        }
        said.words.clone()
    });
    let response = ui.allocate_response(Vec2::ZERO, Sense::empty());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
    announce(&response, Live::Polite);
}

/// What was announced last, and when in s of the window's clock.
#[derive(Clone, Debug, Default)]
struct AnnouncedNumbers {
    at: f64,
    words: String,
}

/// A sentence of two numbers takes a screen reader about four seconds.
const ANNOUNCE_EVERY_SECS: f64 = 8.0;

/// A number of fixed decimals, or dashes where there is none. Minus zero is zero.
fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) if value.is_finite() => {
            let text = format!("{value:.decimals$}");
            let is_zero = text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.'));
            if is_zero { format!("{:.decimals$}", 0.0) } else { text }
        }
        _ => "--".into(),
    }
}

fn number_ui(ui: &mut Ui, name: &str, unit: &str, text: String, width: f32) {
    ui.allocate_ui_with_layout(vec2(width, HEIGHT), Layout::top_down(Align::Max), |ui| {
        ui.set_width(width);
        ui.spacing_mut().item_spacing.y = 0.0;
        let head = format!("{name} ({unit})");
        quiet_ui(ui, head);
        ui.label(RichText::new(text).text_style(reading_style()));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_fixed_decimals_and_no_minus_zero() {
        for (value, text) in [
            (Some(5.591_4), "5.591"),
            (Some(-0.000_2), "0.000"),
            (Some(-1.0), "-1.000"),
            (Some(f64::NAN), "--"),
            (None, "--"),
        ] {
            assert_eq!(number(value, 3), text);
        }
    }
}
