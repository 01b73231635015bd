//! The picture of the scene, and force and depth over time below it.

use super::{SceneScreen, ViewedTissue};
use crate::plots::figure::strip_ui;
use crate::scene::graphics::PictureGraphics;
use crate::scene::look::PicturedTissue;
use crate::scene::view::ScenePicture;
use crate::widgets::{NamedControl, alarm_ui, placeholder_ui, quiet_ui};
use crate::workers::live_scene::{ComputedPath, ForcePoint, LiveScene};
use crate::workers::scene_tissue::{SceneInstant, ShownTissue, elastic_model};
use crate::workers::trail::PAST_S;
use eframe::egui::{Ui, vec2};
use palpate_figures::figure::{Ink, PlotSeries};
use palpate_haptics::surface::Heights;
use palpate_model::viscoelastic::ModifiedKelvin;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PictureSource {
    /// A computed path.
    Computed,
    /// The scene that runs, or ran last.
    Live,
}

/// Share of the height that the picture gets.
const PICTURE_SHARE: f32 = 0.56;
/// Room for a legend.
const HEAD: f32 = 32.0;

struct ShownScene<'a> {
    instant: &'a SceneInstant,
    body: ModifiedKelvin,
    trail: Vec<ForcePoint>,
    /// Seconds along the plots.
    shown: [f64; 2],
    title: String,
}

/// The scene to show, or why there is none; no reason where nothing is computed yet.
fn shown_scene<'a>(
    side: PictureSource,
    live: Option<&'a LiveScene>,
    computed: Option<&'a Result<ComputedPath, String>>,
) -> Result<ShownScene<'a>, Option<&'a str>> {
    match (side, live, computed) {
        (PictureSource::Live, Some(live), _) => {
            let end = live.now().max(PAST_S);
            let title = match (live.is_running(), live.is_led(), live.device()) {
                (false, ..) => "stopped; the last picture",
                (true, _, Some(_)) => "the device moves the stylus",
                (true, true, None) => "the path moves the hand",
                (true, false, None) => "the pointer and the keys move the hand",
            };
            Ok(ShownScene {
                instant: live.moment(),
                body: live.settings().body,
                trail: live.trail().copied().collect(),
                shown: [end - PAST_S, end],
                title: title.to_owned(),
            })
        }
        (PictureSource::Computed, _, Some(Ok(computed))) => {
            let at = computed.settings.period.time_of(computed.deepest.tick.tick);
            Ok(ShownScene {
                instant: &computed.deepest,
                body: computed.settings.body,
                trail: computed.trail.clone(),
                shown: [0.0, computed.path.seconds()],
                title: format!(
                    "{}, computed: the deepest point, after {:.2} s",
                    computed.path.name(),
                    at.seconds().0
                ),
            })
        }
        (PictureSource::Computed, _, Some(Err(reason))) => Err(Some(reason)),
        (PictureSource::Live, None, _) | (PictureSource::Computed, _, None) => Err(None),
    }
}

impl SceneScreen {
    pub fn draw_middle(&mut self, ui: &mut Ui, graphics: &mut PictureGraphics) {
        ui.horizontal(|ui| {
            for (side, name) in
                [(PictureSource::Computed, "Computed"), (PictureSource::Live, "Live")]
            {
                ui.selectable_value(&mut self.side, side, name).named(name);
            }
            ui.separator();
            if ui.button("Reset camera").clicked() {
                self.view.reset();
            }
        });
        let ShownScene { instant, body, trail, shown, title } =
            match shown_scene(self.side, self.live.as_ref(), self.computed.answer()) {
                Ok(shown_scene) => shown_scene,
                Err(None) => {
                    let words = match self.side {
                        PictureSource::Live => "the scene has not run yet",
                        PictureSource::Computed => "nothing computed yet",
                    };
                    placeholder_ui(ui, words);
                    return;
                }
                Err(Some(reason)) => return alarm_ui(ui, reason),
            };
        quiet_ui(ui, title);
        let tick = &instant.tick;
        let heights = match &instant.tissue {
            ShownTissue::Square { grid, heights, .. } => Heights::new(*grid, heights).map(Some),
            ShownTissue::Mesh(_) => Ok(None),
        };
        let tissue = match (heights, &instant.tissue, &self.viewed) {
            (Err(reason), ..) => return alarm_ui(ui, reason.to_string()),
            (Ok(Some(now)), ..) => PicturedTissue::Square { now, model: elastic_model(&body) },
            (Ok(_), ShownTissue::Mesh(sunk), ViewedTissue::Mesh(tissue)) => {
                PicturedTissue::Mesh { tissue, sunk }
            }
            // Another scene was opened since.
            (Ok(_), ..) => return placeholder_ui(ui, "nothing computed yet"),
        };
        let picture = ScenePicture {
            tissue,
            device: tick.device,
            turn: tick.turn,
            contact: tick.is_contact().then_some(tick.proxy),
            force: tick.force,
            is_running: self.side == PictureSource::Live
                && self.live.as_ref().is_some_and(LiveScene::is_running),
        };
        let height = PICTURE_SHARE * ui.available_height();
        let size = vec2(ui.available_width(), height);
        ui.allocate_ui(size, |ui| self.view.ui(ui, &picture, graphics));
        let curve = |name, ink, of: fn(&ForcePoint) -> f64| {
            PlotSeries::line(
                name,
                ink,
                1.4,
                trail.iter().map(|point| [point.t, of(point)]).collect(),
            )
        };
        let force = curve("force on the hand", Ink::Limit, |point| point.force);
        let depth = curve("depth of the stylus", Ink::Series, |point| point.depth);
        let height = (ui.available_height() - 2.0 * HEAD) / 2.0;
        strip_ui(ui, ["", "force (N)"], vec![force], shown, height);
        strip_ui(ui, ["time (s)", "depth (mm)"], vec![depth], shown, height);
    }
}
