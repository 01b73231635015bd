//! The panels of a screen.

use super::sizes::{PanelEdge, Sizes};
use crate::theme::Tokens;
use eframe::egui::{Color32, Frame, Margin, Panel, ScrollArea, Stroke, Ui};

/// The frame of a panel; the canvas is what plots and tables stand on.
pub(crate) fn frame(ui: &Ui, is_canvas: bool) -> Frame {
    let tokens = Tokens::of(ui.visuals().dark_mode);
    Frame::new()
        // The window is cleared in this colour already. Filling canvases and plots again delays a stop key on a software
        // renderer: median 27 ms with, 14 ms without (`scripts/key-to-wire`).
        .fill(if is_canvas { Color32::TRANSPARENT } else { tokens.panel })
        .inner_margin(Margin::symmetric(8, 6))
        .stroke(Stroke::NONE)
}

/// A panel beside the middle that scrolls.
pub(crate) fn side_ui(
    ui: &mut Ui,
    sizes: &mut Sizes,
    edge: PanelEdge,
    content: impl FnOnce(&mut Ui),
) {
    let panel = match edge {
        PanelEdge::Left => Panel::left("left"),
        _ => Panel::right("right"),
    };
    let scrolled = |ui: &mut Ui| {
        ScrollArea::vertical().id_salt("side").auto_shrink(false).show(ui, content);
    };
    let panel = sizes.of(edge, panel).frame(frame(ui, false));
    let shown = panel.show(ui, scrolled);
    sizes.drag(ui, edge, shown.response.rect);
}
