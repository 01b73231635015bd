//! Events of the run: the newest in one line, or all of them with a filter and a copy of the lines shown.

use crate::command::{Commands, UiCommand};
use crate::widgets::{NamedControl, placeholder_ui, tokens_of};
use eframe::egui::{Align, Label, Layout, RichText, ScrollArea, TextEdit, TextStyle, Ui};
use palpate_runner::{LogLine, RunnerSnapshot};

/// Height of the log in one line, in points: as large as anything that a gloved finger has to hit.
pub const FOLDED_HEIGHT: f32 = 48.0;

#[derive(Clone, Debug, Default)]
pub struct EventLog {
    /// The filter as typed.
    filter: String,
    is_unfolded: bool,
    /// An alarm unfolded it, and no operator since.
    is_by_alarm: bool,
    /// Alarms so far.
    alarms: usize,
}

impl EventLog {
    /// A log that shows every line.
    #[must_use]
    pub fn unfolded() -> Self {
        Self { is_unfolded: true, ..Self::default() }
    }

    /// Whether it shows every line. A new alarm unfolds it.
    pub fn update(&mut self, snapshot: &RunnerSnapshot) -> bool {
        self.take(snapshot.run.as_ref().map_or(&[], |run| run.events.as_slice()));
        self.is_unfolded
    }

    fn take(&mut self, events: &[LogLine]) {
        let alarms = events.iter().filter(|line| line.is_alarm).count();
        if alarms > self.alarms && !self.is_unfolded {
            (self.is_unfolded, self.is_by_alarm) = (true, true);
        }
        // The next run begins without alarms.
        if alarms == 0 && std::mem::take(&mut self.is_by_alarm) {
            self.is_unfolded = false;
        }
        self.alarms = alarms;
    }

    /// Draws the newest line and the switch to all of them.
    pub fn folded_ui(&mut self, ui: &mut Ui, snapshot: &RunnerSnapshot, commands: &mut Commands) {
        let last = snapshot.run.as_ref().and_then(|run| run.events.last());
        ui.horizontal_centered(|ui| {
            if ui.button("All events").clicked() {
                (self.is_unfolded, self.is_by_alarm) = (true, false);
            }
            let tokens = tokens_of(ui);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                theme_button(ui, commands);
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    let text = last.map_or_else(|| "no event yet".to_owned(), line_text);
                    let is_alarm = last.is_some_and(|line| line.is_alarm);
                    let ink = if is_alarm { tokens.alarm_text } else { tokens.text_quiet };
                    ui.add(Label::new(RichText::new(text.trim_start()).color(ink)).truncate());
                });
            });
        });
    }

    /// Draws the log in the space there is.
    pub fn ui(&mut self, ui: &mut Ui, snapshot: &RunnerSnapshot, commands: &mut Commands) {
        let events = snapshot.run.as_ref().map_or(&[][..], |run| run.events.as_slice());
        let shown: Vec<&LogLine> =
            events.iter().filter(|line| is_shown(line, &self.filter)).collect();
        self.head_ui(ui, &shown, commands);
        let tokens = tokens_of(ui);
        if shown.is_empty() {
            let text =
                if events.is_empty() { "no event yet" } else { "no event matches the filter" };
            placeholder_ui(ui, text);
            return;
        }
        let height = ui.text_style_height(&TextStyle::Monospace);
        ScrollArea::vertical()
            .id_salt("events")
            .auto_shrink(false)
            .stick_to_bottom(true)
            .show_rows(ui, height, shown.len(), |ui, rows| {
                for line in &shown[rows] {
                    let ink = if line.is_alarm { tokens.alarm_text } else { tokens.text };
                    let text = RichText::new(line_text(line)).monospace().color(ink);
                    ui.add(Label::new(text).truncate());
                }
            });
    }

    fn head_ui(&mut self, ui: &mut Ui, shown: &[&LogLine], commands: &mut Commands) {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Events").heading().strong());
            ui.add_space(8.0);
            let label = ui.label("filter");
            ui.add(TextEdit::singleline(&mut self.filter).desired_width(160.0).char_limit(100))
                .labelled_by(label.id)
                .named("filter of the events");
            if ui.button("Fold").named("Fold the events").clicked() {
                self.is_unfolded = false;
            }
            if ui.button("Copy").clicked() {
                let lines: Vec<String> = shown.iter().map(|line| line_text(line)).collect();
                ui.ctx().copy_text(lines.join("\n"));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| theme_button(ui, commands));
        });
    }
}

fn theme_button(ui: &mut Ui, commands: &mut Commands) {
    let name = if ui.visuals().dark_mode { "Light screen" } else { "Dark screen" };
    if ui.button(name).clicked() {
        commands.push(UiCommand::SwitchTheme);
    }
}

fn is_shown(line: &LogLine, filter: &str) -> bool {
    let wanted = filter.trim().to_lowercase();
    wanted.is_empty() || line_text(line).to_lowercase().contains(&wanted)
}

fn line_text(line: &LogLine) -> String {
    let mark = if line.is_alarm { "ALARM  " } else { "" };
    format!("{:>9.3} s  {mark}{}", line.at.seconds().0, line.text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::Nanos;

    #[test]
    fn a_new_alarm_unfolds_the_log_and_an_old_one_does_not() {
        let line = |is_alarm| LogLine { at: Nanos::ZERO, text: "a line".into(), is_alarm };
        let mut log = EventLog::default();
        log.take(&[line(false)]);
        assert!(!log.is_unfolded);
        log.take(&[line(false), line(true)]);
        assert!(log.is_unfolded);
        log.is_unfolded = false;
        log.take(&[line(false), line(true), line(false)]);
        assert!(!log.is_unfolded);
        // The next run begins without alarms, and what an alarm has unfolded is folded again.
        log.take(&[]);
        log.take(&[line(true)]);
        assert!(log.is_unfolded);
        log.take(&[]);
        assert!(!log.is_unfolded);
    }

    #[test]
    fn the_filter_finds_words_times_and_alarms() {
        let line = |text: &str, is_alarm| LogLine {
            at: Nanos::from_millis(12_345),
            text: text.into(),
            is_alarm,
        };
        let alarm = line("Force interlock: 9.1 N", true);
        for filter in ["", "  ", "force", "FORCE INTER", "12.345", "alarm"] {
            assert!(is_shown(&alarm, filter), "{filter}");
        }
        assert!(!is_shown(&line("contact at 41.2 mm", false), "alarm"));
    }
}
