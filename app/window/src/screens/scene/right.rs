//! Force on the hand, its limits, and timing of the loop.

use super::middle::PictureSource;
use super::{SceneScreen, SeenScene};
use crate::widgets::{fact_ui, loop_times_ui, placeholder_ui, section_ui, small_ui, tokens_of};
use crate::workers::live_scene::{LiveScene, PlayedDevice, force_of, margin_of};
use eframe::egui::{Label, RichText, Ui};
use palpate_analysis::report::haptics::margin_text;
use palpate_analysis::report::scene::device_lines;
use palpate_haptics::scene::SceneTick;

impl SceneScreen {
    pub fn draw_right(&self, ui: &mut Ui) {
        let Some(seen) = self.seen() else {
            return placeholder_ui(ui, "no scene yet");
        };
        force_ui(ui, &seen.instant.tick);
        guard_ui(ui, &seen);
        let live = self.live.as_ref().filter(|_| self.side == PictureSource::Live);
        if let Some(live) = live {
            if let Some(device) = live.device() {
                device_ui(ui, device);
            }
            loop_ui(ui, live);
        }
    }
}

fn force_ui(ui: &mut Ui, tick: &SceneTick) {
    section_ui(ui, "Force");
    let now = format!("{:.2} N at {:.2} mm", force_of(tick), tick.depth);
    ui.label(RichText::new(now).heading().monospace());
    let [x, y, z] = tick.device;
    fact_ui(ui, "stylus", format!("{x:.1}, {y:.1}, {z:.2} mm"));
    fact_ui(ui, "speed", format!("{:.1} mm/s inwards", tick.speed));
    fact_ui(ui, "moved", format!("{} nodes", tick.moved));
    section_ui(ui, "Why no force?");
    ui.add(Label::new(tick.no_force_reason.name()).wrap());
}

fn guard_ui(ui: &mut Ui, seen: &SeenScene<'_>) {
    let (settings, tick) = (seen.settings, &seen.instant.tick);
    let tokens = tokens_of(ui);
    section_ui(ui, "Margin and guard");
    if tick.is_contact() {
        let margin = margin_text(&margin_of(settings, &seen.bodies, seen.device, tick));
        ui.add(Label::new(margin).wrap());
    } else {
        ui.label("no margin without contact");
    }
    let added = match settings.controller {
        Some(_) => format!("{:.2} N s/m of damping", 1e3 * tick.injected_damping),
        None => "nothing: guards and controller are off".to_owned(),
    };
    fact_ui(ui, "added", added);
    fact_ui(ui, "energy", format!("{:.2} mJ absorbed", tick.energy));
    for sentence in tick.flags.sentences() {
        small_ui(ui, sentence);
    }
    if tick.is_buzzing {
        let words = RichText::new("limit cycle: the loop vibrates by itself");
        ui.label(words.strong().color(tokens.alarm_text));
    }
}

/// A real device: how the connection is, and what was known before the first touch.
fn device_ui(ui: &mut Ui, device: &PlayedDevice) {
    section_ui(ui, "Device");
    let used = device.used();
    fact_ui(ui, "now", used.stop);
    let counts = format!(
        "{} reports, {} of them impossible; lost {} times",
        used.reports, used.faults, used.losses
    );
    fact_ui(ui, "connection", counts);
    for line in device_lines(&device.report) {
        small_ui(ui, line);
    }
}

fn loop_ui(ui: &mut Ui, live: &LiveScene) {
    section_ui(ui, "Loop");
    let rate = live.settings().period.hz();
    fact_ui(ui, "target", format!("{rate:.0} ticks a second"));
    fact_ui(ui, "priority", live.priority());
    loop_times_ui(ui, live.kept());
}
