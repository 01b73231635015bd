//! The panels of a screen.

use super::sizes::{PanelEdge, Sizes};
use crate::widgets::tokens_of;
use eframe::egui::{Color32, Frame, Margin, Panel, ScrollArea, Stroke, Ui};

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

/// A panel to the left or right of the middle, which scrolls as a whole or not.
pub(crate) fn side_ui(
    ui: &mut Ui,
    sizes: &mut Sizes,
    edge: PanelEdge,
    scrolls: bool,
    content: impl FnOnce(&mut Ui),
) {
    let panel = match edge {
        PanelEdge::Left => Panel::left("left"),
        _ => Panel::right("right"),
    };
    let scrolled = |ui: &mut Ui| {
        let area = ScrollArea::vertical().id_salt("side").auto_shrink(false);
        if scrolls { area.show(ui, content).inner } else { content(ui) }
    };
    let panel = sizes.of(edge, panel).frame(frame(ui, false));
    let shown = panel.show(ui, scrolled);
    sizes.drag(ui, edge, shown.response.rect);
}
