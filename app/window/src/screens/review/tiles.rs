//! The views of the sessions shown as tiles: behind each other with a tab each, or beside each other.

use super::middle::tool_ui;
use super::{ReviewScreen, View};
use crate::shell::panels::frame;
use crate::theme::icon_text;
use crate::widgets::NamedControl;
use eframe::egui::{Color32, Id, Response, Stroke, Style, Ui, Visuals, WidgetText};
use egui_tiles::{
    Behavior, SimplificationOptions, TabState, Tabs, Tile, TileId, Tiles, Tree, UiResponse,
};
use lucide_icons::Icon;
use serde_json::Value;

/// Height of the tabs in points: large enough for a gloved finger.
const TABS: f32 = 36.0;
/// Least width and height of a tile in points.
const TILE_MIN: f32 = 160.0;
/// In a room narrower than this in points, a tile that is split off stands below the others.
const ROOM_BESIDE: f32 = 760.0;

/// Where the views are.
pub(super) struct ViewTiles(Tree<View>);

impl Default for ViewTiles {
    fn default() -> Self {
        Self(Tree::new_tabs(Id::unique("review views"), View::ALL.to_vec()))
    }
}

impl ViewTiles {
    /// An arrangement that was kept; the usual one where it does not hold every view once.
    pub fn from_kept(kept: &Value) -> Self {
        let tree: Option<Tree<View>> = serde_json::from_value(kept.clone()).ok();
        let has_all = |tree: &Tree<View>| {
            let panes = tree.tiles.tiles().filter_map(|tile| match tile {
                Tile::Pane(view) => Some(*view),
                Tile::Container(_) => None,
            });
            let panes: Vec<View> = panes.collect();
            panes.len() == View::ALL.len() && View::ALL.iter().all(|view| panes.contains(view))
        };
        tree.filter(has_all).map(Self).unwrap_or_default()
    }

    /// None for the usual arrangement.
    pub fn kept(&self) -> Option<Value> {
        self.is_split().then(|| serde_json::to_value(&self.0).ok()).flatten()
    }

    /// Whether views stand beside each other.
    pub fn is_split(&self) -> bool {
        self.seen().len() > 1
    }

    /// The views that are seen.
    pub fn seen(&self) -> Vec<View> {
        let tiles = self.0.active_tiles().into_iter();
        tiles.filter_map(|id| self.0.tiles.get_pane(&id).copied()).collect()
    }

    /// Brings a view before those that hide it.
    pub fn bring(&mut self, view: View) {
        self.0.make_active(|_, tile| matches!(tile, Tile::Pane(own) if *own == view));
    }

    /// Takes a view from among its tabs and gives it a tile of its own, beside all others or below them.
    fn split_off(&mut self, view: View, is_beside: bool) {
        let Self(tree) = self;
        let Some(pane) = tree.tiles.find_pane(&view) else { return };
        let parent = tree.tiles.parent_of(pane).and_then(|parent| tree.tiles.get_mut(parent));
        if let Some(Tile::Container(container)) = parent {
            container.remove_child(pane);
        }
        let tabs = tree.tiles.insert_tab_tile(vec![pane]);
        let Some(rest) = tree.root else { return };
        tree.root = Some(match is_beside {
            true => tree.tiles.insert_horizontal_tile(vec![rest, tabs]),
            false => tree.tiles.insert_vertical_tile(vec![rest, tabs]),
        });
    }
}

/// Draws the tiles of a screen, which they are taken out of as long.
struct Drawn<'a> {
    screen: &'a mut ReviewScreen,
    /// A view that is to have a tile of its own.
    split_off: Option<View>,
}

impl Behavior<View> for Drawn<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, view: &mut View) -> UiResponse {
        let place = ui.max_rect();
        let is_pressed = ui.input(|input| {
            let at = input.pointer.interact_pos();
            input.pointer.any_pressed() && at.is_some_and(|at| place.contains(at))
        });
        if is_pressed {
            self.screen.view = *view;
        }
        frame(ui, true).show(ui, |ui| self.screen.view_ui(ui, *view));
        UiResponse::None
    }

    fn tab_title_for_tile(&mut self, tiles: &Tiles<View>, id: TileId) -> WidgetText {
        let mut names = Vec::new();
        let mut left = vec![id];
        while let Some(next) = left.pop() {
            match tiles.get(next) {
                Some(Tile::Pane(view)) => names.push(view.name()),
                Some(Tile::Container(container)) => {
                    left.extend(container.active_children(tiles));
                }
                None => {}
            }
        }
        names.join(" + ").into()
    }

    fn tab_title_for_pane(&mut self, view: &View) -> WidgetText {
        view.name().into()
    }

    fn on_tab_button(&mut self, tiles: &mut Tiles<View>, id: TileId, button: Response) -> Response {
        let Some(view) = tiles.get_pane(&id).copied() else { return button };
        if button.clicked() {
            self.screen.view = view;
        }
        button.named(view.name()).on_hover_text("drag it beside another view to see both")
    }

    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<View>,
        ui: &mut Ui,
        _: TileId,
        tabs: &Tabs,
        _: &mut f32,
    ) {
        let active = tabs.active.and_then(|id| tiles.get_pane(&id).copied());
        if let Some(view) = active.filter(|_| tabs.children.len() > 1) {
            let hint = format!("shows {view} beside the other views");
            if tool_ui(ui, icon_text(Icon::Columns2), "Split off", &hint) {
                self.split_off = Some(view);
            }
        }
    }

    fn tab_title_spacing(&self, _: &Visuals) -> f32 {
        6.0
    }

    fn tab_bar_height(&self, _: &Style) -> f32 {
        TABS
    }

    fn gap_width(&self, _: &Style) -> f32 {
        3.0
    }

    fn min_size(&self) -> f32 {
        TILE_MIN
    }

    fn simplification_options(&self) -> SimplificationOptions {
        // Without its tab a view could not be moved.
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn tab_bar_color(&self, _: &Visuals) -> Color32 {
        Color32::TRANSPARENT
    }

    fn tab_bg_color(
        &self,
        visuals: &Visuals,
        _: &Tiles<View>,
        _: TileId,
        state: &TabState,
    ) -> Color32 {
        if state.active { visuals.selection.bg_fill } else { Color32::TRANSPARENT }
    }

    fn tab_outline_stroke(&self, _: &Visuals, _: &Tiles<View>, _: TileId, _: &TabState) -> Stroke {
        Stroke::NONE
    }

    fn tab_text_color(
        &self,
        visuals: &Visuals,
        _: &Tiles<View>,
        _: TileId,
        _: &TabState,
    ) -> Color32 {
        visuals.text_color()
    }
}

impl ReviewScreen {
    pub(super) fn tiles_ui(&mut self, ui: &mut Ui) {
        let is_beside = ui.available_width() > ROOM_BESIDE;
        let mut tiles = std::mem::take(&mut self.tiles);
        let mut drawn = Drawn { screen: self, split_off: None };
        tiles.0.ui(&mut drawn, ui);
        if let Some(view) = drawn.split_off {
            tiles.split_off(view, is_beside);
            self.view = view;
        }
        // A tile may have been dragged over the view that keys and tools moved.
        let seen = tiles.seen();
        if !seen.contains(&self.view)
            && let Some(first) = seen.first()
        {
            self.view = *first;
        }
        self.tiles = tiles;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_that_is_split_off_is_seen_beside_the_others_and_kept() {
        let mut tiles = ViewTiles::default();
        assert_eq!((tiles.seen(), tiles.kept()), (vec![View::OverTime], None));
        tiles.bring(View::Cycles);
        assert_eq!(tiles.seen(), [View::Cycles]);
        tiles.split_off(View::Parameters, true);
        assert_eq!(tiles.seen(), [View::Cycles, View::Parameters]);
        let kept = tiles.kept().unwrap();
        assert_eq!(ViewTiles::from_kept(&kept).seen(), tiles.seen());
        // One of another version, which had a view more or less.
        let text = kept.to_string().replace("Parameters", "Prediction");
        let other = serde_json::from_str(&text).unwrap();
        assert_eq!(ViewTiles::from_kept(&other).seen(), [View::OverTime]);
        assert_eq!(ViewTiles::from_kept(&Value::Null).seen(), [View::OverTime]);
    }
}
