//! The checks of a run that has ended: what somebody should look at stands first.

use crate::widgets::{GLYPH_RADIUS, GLYPH_WIDTH, Glyph, glyph_at, section_ui, tokens_of};
use eframe::egui::{Align, CollapsingHeader, Label, Layout, RichText, Sense, Ui, vec2};
use palpate_model::assessment::{Assessment, QualityCheck, QualityRank};

pub fn quality_ui(ui: &mut Ui, quality: &Assessment) {
    section_ui(ui, "Quality");
    let doubts = quality.doubts();
    doubts.iter().for_each(|check| check_ui(ui, check));
    let others = quality.checks.iter().filter(|check| !doubts.contains(check));
    let (good, unknown): (Vec<_>, Vec<_>) =
        others.partition(|check| check.rank == QualityRank::Good);
    let words = match unknown.len() {
        0 => format!("{} checks good", good.len()),
        unknown => format!("{} checks good, {unknown} not judged", good.len()),
    };
    CollapsingHeader::new(words).default_open(true).show(ui, |ui| {
        unknown.iter().chain(&good).for_each(|check| check_ui(ui, check));
    });
}

/// Rank as a glyph and a word, then the sentence.
fn check_ui(ui: &mut Ui, check: &QualityCheck) {
    let tokens = tokens_of(ui);
    let (glyph, ink) = match check.rank {
        QualityRank::NotJudged => (Glyph::Dash, tokens.text_quiet),
        QualityRank::Good => (Glyph::Tick, tokens.text),
        QualityRank::Doubtful => (Glyph::Question, tokens.text),
        QualityRank::Bad => (Glyph::Cross, tokens.alarm_text),
    };
    ui.with_layout(Layout::left_to_right(Align::Min), |ui| {
        let size = vec2(GLYPH_WIDTH, ui.text_style_height(&eframe::egui::TextStyle::Body));
        let (place, _) = ui.allocate_exact_size(size, Sense::empty());
        glyph_at(ui.painter(), glyph, place.center(), GLYPH_RADIUS, ink);
        let place = match check.at_s {
            Some([from, to]) if to - from > 0.1 => format!(", {from:.1} to {to:.1} s"),
            Some([from, _]) => format!(", at {from:.1} s"),
            None => String::new(),
        };
        let words = format!("{} {}{place}: {}", check.name, check.rank, check.sentence);
        ui.add(Label::new(RichText::new(words).color(ink)).wrap());
    });
}
