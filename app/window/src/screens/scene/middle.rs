//! The picture of the scene, and force and depth over time below it.

use super::SceneScreen;
use crate::plots::strip::{Curve, Strip, legend_ui, strip_ui};
use crate::scene::view::Shown;
use crate::theme::Tokens;
use crate::widgets::places::Place;
use crate::widgets::tick_box::tick_box;
use crate::workers::touch::TouchPoint;
use crate::workers::trail::PAST_S;
use eframe::egui::{Label, RichText, Ui, vec2};

/// What the middle shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// The path that was computed.
    Ahead,
    /// The scene that runs or ran.
    Live,
}

/// Share of the height that the picture gets.
const PICTURE_SHARE: f32 = 0.52;
/// Room for a legend.
const HEAD: f32 = 24.0;

impl SceneScreen {
    /// Picture and plots.
    pub fn middle_ui(&mut self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        ui.horizontal(|ui| {
            for (side, name) in [(Side::Ahead, "Computed"), (Side::Live, "Live")] {
                ui.selectable_value(&mut self.side, side, name).place(name);
            }
            ui.separator();
            tick_box(ui, &mut self.view.has_lines, "mesh lines");
            if ui.button("Look as at first").clicked() {
                self.view.reset();
            }
        });
        let (moment, trail, shown, title): (_, Vec<TouchPoint>, _, _) =
            match (self.side, &self.touch, self.ahead.answer()) {
                (Side::Live, Some(touch), _) => {
                    let end = touch.now().max(PAST_S);
                    let title = match (touch.is_running(), touch.is_led()) {
                        (false, _) => "stopped; as it was seen last".to_owned(),
                        (true, true) => "the path leads the hand".to_owned(),
                        (true, false) => "the pointer and the keys lead the hand".to_owned(),
                    };
                    let trail = touch.trail().copied().collect();
                    (touch.moment(), trail, end - PAST_S..=end, title)
                }
                (Side::Ahead, _, Some(Ok(ahead))) => {
                    let name = ahead.path.name();
                    let at = ahead.settings.period.time_of(ahead.deepest.tick.tick);
                    let title = format!(
                        "{name}, computed: where it is deepest, after {:.2} s",
                        at.seconds().0
                    );
                    let end = ahead.path.seconds();
                    (&ahead.deepest, ahead.trail.clone(), 0.0..=end, title)
                }
                (Side::Ahead, _, Some(Err(reason))) => {
                    ui.add(Label::new(RichText::new(reason).color(tokens.alarm_text)).wrap());
                    return;
                }
                (Side::Live, None, _) => {
                    ui.label(RichText::new("the scene has not run yet").color(tokens.text_quiet));
                    return;
                }
                (Side::Ahead, _, None) => {
                    ui.label(RichText::new("nothing computed yet").color(tokens.text_quiet));
                    return;
                }
            };
        ui.label(RichText::new(title).color(tokens.text_quiet).small());
        let now = match moment.now() {
            Ok(now) => now,
            Err(reason) => {
                let text = RichText::new(reason.to_string()).color(tokens.alarm_text);
                ui.add(Label::new(text).wrap());
                return;
            }
        };
        let tick = &moment.tick;
        let picture = Shown {
            now,
            rest: moment.rest(),
            device: tick.device,
            turn: tick.turn,
            contact: tick.is_contact().then_some(tick.proxy),
            force: tick.force,
        };
        let height = PICTURE_SHARE * ui.available_height();
        let size = vec2(ui.available_width(), height);
        ui.allocate_ui(size, |ui| self.view.ui(ui, &picture));
        let curve = |name, ink, of: fn(&TouchPoint) -> f64| Curve {
            name,
            ink,
            points: trail.iter().map(|point| [point.t, of(point)]).collect(),
        };
        let force = curve("force on the hand", tokens.limit, |point| point.force);
        let depth = curve("depth of the stylus", tokens.series, |point| point.depth);
        let height = (ui.available_height() - 2.0 * HEAD) / 2.0;
        for (id, axes, curve) in [
            ("scene_force", ["", "force (N)"], force),
            ("scene_depth", ["time (s)", "depth (mm)"], depth),
        ] {
            ui.horizontal(|ui| legend_ui(ui, curve.ink, curve.name));
            let strip = Strip {
                id,
                axes,
                shown: shown.clone(),
                // A scene at rest is a line at zero and no noise.
                least: 0.0..=0.5,
                curves: vec![curve],
            };
            ui.allocate_ui(vec2(ui.available_width(), height), |ui| strip_ui(ui, strip));
        }
    }
}
