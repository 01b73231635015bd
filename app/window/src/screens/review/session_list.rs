//! The sessions shown, one line each: what they have in common is said once above them.

use super::{ReviewScreen, ReviewSubject};
use crate::theme::Tokens;
use crate::widgets::{Glyph, NamedControl, alarm_ui, glyph_at, quiet_ui, steady, tokens_of};
use crate::workers::review::Stage;
use eframe::egui::text::{LayoutJob, TextFormat, TextWrapping};
use eframe::egui::{
    Align2, Color32, Rect, Response, Role, Sense, Stroke, StrokeKind, TextStyle, Ui, WidgetInfo,
    pos2, vec2,
};
use palpate_analysis::report::session::SessionNameParts;
use palpate_model::calibration::Calibration;
use palpate_sessions::DataQuality;

/// Height of a line in points.
const ROW: f32 = 26.0;
/// Width in points of a session's colour and of the button that removes it.
const SWATCH: f32 = 20.0;
const REMOVE: f32 = 26.0;

/// What was pressed in the list.
enum SessionAction {
    Front(usize),
    Remove(usize),
    Cancel(usize),
    ReadAgain(usize),
}

/// A change of the list that can be undone.
pub(super) enum ListChange {
    /// A session was at this place.
    Removed(usize, Box<ReviewSubject>),
    /// These were shown, in this order.
    Cleared(Vec<ReviewSubject>),
}

/// Changes that can be undone.
const UNDO_MAX: usize = 50;

impl ListChange {
    fn words(&self) -> String {
        match self {
            Self::Removed(_, subject) => format!("remove {}", subject.name),
            Self::Cleared(subjects) => format!("clear {} sessions", subjects.len()),
        }
    }
}

/// The colour of a session, or of its group.
pub(super) fn color_of(tokens: &Tokens, subject: &ReviewSubject) -> Color32 {
    tokens.sessions[subject.color % tokens.sessions.len()]
}

/// What all sessions shown have in common; nothing of one alone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct CommonParts([Option<String>; 3]);

fn list(parts: &SessionNameParts) -> [&String; 3] {
    [&parts.specimen, &parts.protocol, &parts.day]
}

impl CommonParts {
    pub fn of<'a>(subjects: impl ExactSizeIterator<Item = &'a ReviewSubject>) -> Self {
        let is_several = subjects.len() > 1;
        let mut all = subjects.filter_map(|one| one.parts.as_ref());
        let Some(first) = all.next().filter(|_| is_several) else {
            return Self::default();
        };
        let mut common = list(first).map(|part| Some(part.clone()));
        for parts in all {
            for (known, own) in common.iter_mut().zip(list(parts)) {
                known.take_if(|known| known != own);
            }
        }
        Self(common)
    }

    /// In words, empty without any.
    fn words(&self) -> String {
        self.0.iter().flatten().map(String::as_str).collect::<Vec<_>>().join(", ")
    }

    /// The name of a session without what it has in common with the others.
    pub fn short_name(&self, subject: &ReviewSubject) -> String {
        let Some(parts) = &subject.parts else { return subject.name.clone() };
        // The analysis by which it is read, and its number among those of one name.
        let rest = subject.name.strip_prefix(&parts.to_string()).unwrap_or_default();
        let own = list(parts).into_iter().zip(&self.0);
        let own = own.filter(|(_, common)| common.is_none()).map(|(part, _)| part.as_str());
        let own = own.chain([parts.time.as_str()]).collect::<Vec<_>>().join(", ");
        own + rest
    }
}

/// A small button of one word, which says aloud of which session.
fn action_ui(ui: &mut Ui, word: &str, session: &str) -> bool {
    let name = format!("{word}: {session}");
    ui.small_button(word).accessible_name(&name).named(&name).clicked()
}

/// Draws what the keyboard and the pointer see of a part of a line that can be pressed.
fn pressable(ui: &Ui, response: &Response, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, name));
    let tokens = tokens_of(ui);
    if response.hovered() {
        ui.painter().rect_filled(response.rect, 3.0, tokens.control_hover);
    }
    if response.has_focus() {
        let stroke = Stroke::new(1.5, tokens.focus);
        ui.painter().rect_stroke(response.rect, 3.0, stroke, StrokeKind::Inside);
    }
}

/// A verdict that is not the usual one, and its reason.
pub(super) fn doubt_of(subject: &ReviewSubject) -> Option<&(DataQuality, String)> {
    let verdict = subject.recording.facts.as_ref()?.verdict.as_ref();
    verdict.filter(|(verdict, _)| *verdict != DataQuality::Valid)
}

/// Names of the calibrations by which the sessions are read, where they are not all read by the same one.
fn mixed_calibrations(subjects: &[ReviewSubject]) -> Vec<&str> {
    let facts = subjects.iter().filter_map(|one| one.recording.facts.as_ref());
    let mut found: Vec<&Calibration> = Vec::new();
    for calibration in facts.filter_map(|facts| facts.calibration.as_ref()) {
        if !found.contains(&calibration) {
            found.push(calibration);
        }
    }
    let names = found.iter().map(|one| one.name.as_str());
    if found.len() > 1 { names.collect() } else { Vec::new() }
}

/// Draws a line; returns whether its session is to come to the front, and whether it is to be removed.
fn row_ui(ui: &mut Ui, subject: &ReviewSubject, short: &str, is_front: bool) -> [bool; 2] {
    let tokens = tokens_of(ui);
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let place = Rect::from_min_max(rect.min, pos2(rect.right() - REMOVE, rect.bottom()));
    if is_front {
        ui.painter().rect_filled(rect, 3.0, tokens.selection);
    }
    let id = ui.scope_id().with(("session", subject.id));
    let name = match is_front {
        true => format!("in front: {}", subject.name),
        false => format!("front: {}", subject.name),
    };
    let row = ui.interact(place, id, Sense::click());
    pressable(ui, &row, &name);
    let doubt = doubt_of(subject);
    let hint = match doubt {
        Some((verdict, reason)) => format!("{}\n{verdict}: {reason}", subject.name),
        None => subject.name.clone(),
    };
    let row = row.named(&name).on_hover_text(hint);
    let middle = place.center().y;
    let swatch =
        Rect::from_center_size(pos2(place.left() + 0.5 * SWATCH, middle), vec2(10.0, 14.0));
    ui.painter().rect_filled(swatch, 2.0, color_of(tokens, subject));
    let font = TextStyle::Body.resolve(ui.style());
    let mut job =
        LayoutJob::single_section(short.to_owned(), TextFormat::simple(font.clone(), tokens.text));
    if let Some((verdict, _)) = doubt {
        let words = format!("  {verdict}");
        job.append(&words, 0.0, TextFormat::simple(font, tokens.alarm_text));
    }
    job.wrap = TextWrapping::truncate_at_width(place.width() - SWATCH - 2.0);
    let galley = ui.fonts_mut(|fonts| fonts.layout_job(job));
    let at = pos2(place.left() + SWATCH, middle);
    let text = Align2::LEFT_CENTER.anchor_size(at, galley.size());
    ui.painter().galley(text.min, galley.clone(), tokens.text);
    if is_front {
        // The fonts have no bold: once more, a third of a point to the right.
        ui.painter().galley(text.min + vec2(0.35, 0.0), galley, tokens.text);
    }
    let place = Rect::from_min_max(pos2(place.right(), rect.top()), rect.max);
    let remove = ui.interact(place, id.with("remove"), Sense::click());
    let name = format!("remove: {}", subject.name);
    pressable(ui, &remove, &name);
    let ink = if remove.hovered() { tokens.text } else { tokens.text_quiet };
    glyph_at(ui.painter(), Glyph::Cross, place.center(), 4.0, ink);
    let remove = remove.named(&name).on_hover_text("remove from the view");
    [row.clicked() && !is_front, remove.clicked()]
}

/// Draws how far a session is read, where that is not to its end; returns the button that was pressed.
fn stage_ui(ui: &mut Ui, index: usize, subject: &ReviewSubject) -> Option<SessionAction> {
    let recording = &subject.recording;
    let percent = 100.0 * recording.share();
    let (words, button) = match &recording.stage {
        Stage::Whole => return None,
        Stage::Waiting => ("waiting to be read".to_owned(), None),
        Stage::Reading => (format!("still reading {percent:.0} %"), Some("cancel")),
        Stage::Cancelled => {
            (format!("reading was cancelled at {percent:.0} %"), Some("read again"))
        }
        Stage::Failed(reason) => {
            ui.horizontal(|ui| {
                ui.add_space(SWATCH);
                ui.vertical(|ui| alarm_ui(ui, reason));
            });
            (String::new(), Some("read again"))
        }
    };
    let mut pressed = None;
    ui.horizontal(|ui| {
        ui.add_space(SWATCH);
        if button.is_some_and(|word| action_ui(ui, word, &subject.name)) {
            pressed = Some(match recording.stage {
                Stage::Reading => SessionAction::Cancel(index),
                _ => SessionAction::ReadAgain(index),
            });
        }
        if !words.is_empty() {
            quiet_ui(ui, words);
        }
    });
    pressed
}

impl ReviewScreen {
    pub(super) fn sessions_ui(&mut self, ui: &mut Ui) {
        if self.subjects.is_empty() {
            let words = "no session is shown yet: choose some in the library, or type the path of a session";
            quiet_ui(ui, words);
        }
        let common = CommonParts::of(self.subjects.iter());
        let words = common.words();
        if !words.is_empty() {
            quiet_ui(ui, format!("all {}: {words}", self.subjects.len()));
        }
        let mixed = mixed_calibrations(&self.subjects);
        if !mixed.is_empty() {
            let names = mixed.join(", ");
            alarm_ui(ui, format!("read by {} calibrations: {names}", mixed.len()));
        }
        let mut pressed = None;
        let spacing = std::mem::replace(&mut ui.spacing_mut().item_spacing.y, 0.0);
        for (index, subject) in self.subjects.iter().enumerate() {
            let short = common.short_name(subject);
            let [front, remove] = row_ui(ui, subject, &short, index == 0);
            if front {
                pressed = Some(SessionAction::Front(index));
            } else if remove {
                pressed = Some(SessionAction::Remove(index));
            }
            let stage = steady(ui, subject.id, |ui| stage_ui(ui, index, subject));
            pressed = pressed.or(stage);
        }
        ui.spacing_mut().item_spacing.y = spacing;
        match pressed {
            Some(SessionAction::Front(index)) => self.bring_to_front(index),
            Some(SessionAction::Remove(index)) => self.remove(index),
            Some(SessionAction::Cancel(index)) => self.subjects[index].recording.cancel(),
            Some(SessionAction::ReadAgain(index)) => self.subjects[index].read_again(),
            None => {}
        }
        ui.horizontal(|ui| {
            let clear = (self.subjects.len() > 1).then(|| ui.small_button("Clear list"));
            if clear.is_some_and(|button| button.named("Clear list").clicked()) {
                self.clear();
            }
            let Some(words) = self.changes.last().map(ListChange::words) else { return };
            let name = format!("Undo: {words}");
            let button = steady(ui, "undo", |ui| ui.small_button("Undo"));
            let button = button.accessible_name(&name).named("Undo");
            if button.on_hover_text(format!("{name}  (Ctrl+Z)")).clicked() {
                self.undo();
            }
        });
    }

    pub(super) fn bring_to_front(&mut self, index: usize) {
        if (1..self.subjects.len()).contains(&index) {
            self.subjects[..=index].rotate_right(1);
        }
    }

    fn remove(&mut self, index: usize) {
        let subject = released(self.subjects.remove(index));
        self.note(ListChange::Removed(index, Box::new(subject)));
    }

    pub(super) fn clear(&mut self) {
        let subjects: Vec<_> = self.subjects.drain(..).map(released).collect();
        if !subjects.is_empty() {
            self.note(ListChange::Cleared(subjects));
        }
    }

    fn note(&mut self, change: ListChange) {
        if self.changes.len() == UNDO_MAX {
            self.changes.remove(0);
        }
        self.changes.push(change);
    }

    /// Takes back the last change; sessions that were added since stay.
    pub(super) fn undo(&mut self) {
        let is_shown = |subjects: &[ReviewSubject], one: &ReviewSubject| {
            subjects.iter().any(|shown| shown.source.session == one.source.session)
        };
        match self.changes.pop() {
            Some(ListChange::Removed(index, subject)) if !is_shown(&self.subjects, &subject) => {
                self.subjects.insert(index.min(self.subjects.len()), *subject);
            }
            Some(ListChange::Cleared(before)) => {
                let added = std::mem::replace(&mut self.subjects, before);
                for one in added {
                    if !is_shown(&self.subjects, &one) {
                        self.subjects.push(one);
                    }
                }
            }
            _ => {}
        }
    }
}

/// A session that is no longer shown, without its samples: they are read again if it comes back.
fn released(mut subject: ReviewSubject) -> ReviewSubject {
    subject.read_again();
    subject
}
