//! The panels of a screen.

use super::sizes::{PanelEdge, Sizes};
use crate::widgets::tokens_of;
use eframe::egui::{Color32, Context, Frame, Margin, Panel, ScrollArea, Stroke, Ui};

/// The frame of a panel; the canvas is what plots and tables stand on.
pub(crate) fn frame(ui: &Ui, is_canvas: bool) -> Frame {
    let tokens = tokens_of(ui);
    Frame::new()
        // The window is cleared in this colour already. Filling canvases and plots again delays a stop key on a software
        // renderer: median 27 ms with, 14 ms without (`scripts/key-to-wire`).
        .fill(if is_canvas { Color32::TRANSPARENT } else { tokens.panel })
        .inner_margin(Margin::symmetric(8, 6))
        .stroke(Stroke::NONE)
}

/// Points below which a window has no room for panels on both sides of plots: what is right of them stands below them then.
const ROOM_FOR_BOTH: f32 = 1180.0;
/// Share of the height that it has there.
const SHARE_BELOW: f32 = 0.34;

/// Whether the window is narrow: a tablet held upright, or large text.
pub fn is_narrow(ctx: &Context) -> bool {
    ctx.content_rect().width() < ROOM_FOR_BOTH
}

/// A panel to the left or right of the middle, which scrolls as a whole or not.
pub(crate) fn side_ui(
    ui: &mut Ui,
    sizes: &mut Sizes,
    edge: PanelEdge,
    scrolls: bool,
    content: impl FnOnce(&mut Ui),
) {
    let scrolled = |ui: &mut Ui| {
        let area = ScrollArea::vertical().id_salt("side").auto_shrink(false);
        if scrolls { area.show(ui, content).inner } else { content(ui) }
    };
    if edge == PanelEdge::Right && is_narrow(ui.ctx()) {
        let below = Panel::bottom("below").resizable(false).frame(frame(ui, false));
        below.exact_size(SHARE_BELOW * ui.available_height()).show(ui, scrolled);
        return;
    }
    let panel = match edge {
        PanelEdge::Left => Panel::left("left"),
        _ => Panel::right("right"),
    };
    let panel = sizes.of(edge, panel).frame(frame(ui, false));
    let shown = panel.show(ui, scrolled);
    sizes.drag(ui, edge, shown.response.rect);
}
