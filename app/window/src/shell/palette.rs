//! The command palette: all commands by name, with their keys.

use crate::command::{Commands, UiCommand};
use crate::widgets::{placeholder_ui, tokens_of};
use eframe::egui::{
    Align, Align2, Area, Button, Frame, Id, Key, Label, Layout, Margin, Modifiers, Order, RichText,
    ScrollArea, Stroke, TextEdit, Ui, vec2,
};

/// A command in the palette.
#[derive(Clone, Debug)]
pub struct PaletteAction {
    pub name: String,
    /// Empty if it has none.
    pub keys: String,
    pub command: UiCommand,
    /// Whether it is possible now, or why not.
    pub verdict: Result<(), String>,
}

impl PaletteAction {
    /// An action that is always possible.
    #[must_use]
    pub fn new(name: impl Into<String>, keys: &str, command: UiCommand) -> Self {
        Self { name: name.into(), keys: keys.into(), command, verdict: Ok(()) }
    }

    /// The same with a condition.
    #[must_use]
    pub fn if_ok(self, verdict: Result<(), String>) -> Self {
        Self { verdict, ..self }
    }
}

#[derive(Debug, Default)]
pub struct Palette {
    is_open: bool,
    is_fresh: bool,
    typed: String,
    chosen: usize,
}

impl Palette {
    /// Opens it empty, or closes it.
    pub fn toggle(&mut self) {
        let is_open = !self.is_open;
        *self = Self { is_open, is_fresh: is_open, ..Self::default() };
    }

    pub fn close(&mut self) {
        *self = Self::default();
    }

    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Draws it above the window; controls beneath can still be pressed.
    pub fn ui(&mut self, ui: &Ui, actions: &[PaletteAction], commands: &mut Commands) {
        if !self.is_open {
            return;
        }
        let tokens = tokens_of(ui);
        // Never over the stop button.
        Area::new(Id::unique("palette"))
            .order(Order::Foreground)
            .anchor(Align2::CENTER_TOP, vec2(0.0, 74.0))
            .show(ui.ctx(), |ui| {
                Frame::new()
                    .fill(tokens.panel)
                    .stroke(Stroke::new(2.0, tokens.text_quiet))
                    .inner_margin(Margin::same(10))
                    .show(ui, |ui| {
                        ui.set_width(620.0);
                        self.content_ui(ui, actions, commands);
                    });
            });
    }

    fn content_ui(&mut self, ui: &mut Ui, actions: &[PaletteAction], commands: &mut Commands) {
        let (mut moved, mut is_taken) = (0_isize, false);
        ui.input_mut(|input| {
            for (key, by) in [(Key::ArrowDown, 1), (Key::ArrowUp, -1)] {
                if input.consume_key(Modifiers::NONE, key) {
                    moved = by;
                }
            }
            is_taken = input.consume_key(Modifiers::NONE, Key::Enter);
        });
        ui.horizontal(|ui| {
            let label = ui.label("command");
            let input = TextEdit::singleline(&mut self.typed)
                .desired_width(ui.available_width() - 90.0)
                .char_limit(100)
                .hint_text("a few letters of the command's name");
            let response = ui.add(input).labelled_by(label.id);
            if std::mem::take(&mut self.is_fresh) {
                response.request_focus();
            }
            if response.changed() {
                self.chosen = 0;
            }
            if ui.button("Close").clicked() {
                self.is_open = false;
            }
        });
        let mut found: Vec<&PaletteAction> =
            actions.iter().filter(|one| is_found(&one.name, &self.typed)).collect();
        found.sort_by_key(|one| distance(&one.name, &self.typed));
        let last = found.len().saturating_sub(1);
        self.chosen = self.chosen.saturating_add_signed(moved).min(last);
        ui.add_space(4.0);
        if found.is_empty() {
            placeholder_ui(ui, "no command has this name");
        }
        ScrollArea::vertical()
            .id_salt("actions")
            .max_height(420.0)
            // The area remembers the few lines of the last search.
            .min_scrolled_height(420.0)
            .auto_shrink([false, true])
            .show(ui, |ui| {
                for (index, action) in found.iter().enumerate() {
                    let is_chosen = index == self.chosen;
                    if action_ui(ui, action, is_chosen, moved != 0) || (is_taken && is_chosen) {
                        self.take(action, commands);
                    }
                }
            });
    }

    fn take(&mut self, action: &PaletteAction, commands: &mut Commands) {
        if action.verdict.is_ok() {
            commands.push(action.command.clone());
            self.is_open = false;
        }
    }
}

/// One line; true when it is pressed.
fn action_ui(ui: &mut Ui, action: &PaletteAction, is_chosen: bool, is_followed: bool) -> bool {
    let tokens = tokens_of(ui);
    ui.horizontal(|ui| {
        let button = Button::selectable(is_chosen, &action.name);
        let response = ui.add_enabled(action.verdict.is_ok(), button);
        if is_chosen && is_followed {
            response.scroll_to_me(None);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(RichText::new(&action.keys).monospace());
            if let Err(reason) = &action.verdict {
                let reason = RichText::new(reason).color(tokens.text_quiet).small();
                ui.add(Label::new(reason).truncate());
            }
        });
        response.clicked()
    })
    .inner
}

/// Whether the name contains every word typed.
fn is_found(name: &str, typed: &str) -> bool {
    let name = name.to_lowercase();
    let typed = typed.to_lowercase();
    typed.split_whitespace().all(|word| name.contains(word))
}

/// How far a name is from what is typed: the same, or the same behind "Go to", or begun with it, or only containing it.
fn distance(name: &str, typed: &str) -> u8 {
    let (name, typed) = (name.to_lowercase(), typed.trim().to_lowercase());
    let [own, typed] = [&name, &typed].map(|one| one.strip_prefix("go to ").unwrap_or(one));
    match (own == typed, own.starts_with(typed)) {
        _ if typed.is_empty() => 0,
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_that_was_typed_comes_before_those_that_contain_it() {
        let names = ["Show Result: judge the run and see its parameters", "Go to Parameters"];
        assert!(distance(names[1], "parameters") < distance(names[0], "parameters"));
        assert_eq!(names.map(|name| distance(name, "")), [0, 0]);
        let near = |name| distance(name, "Go to session");
        assert!(near("Go to session") < near("Go to session start"));
        assert!(near("Go to session start") < near("Go to a colour for each session"));
    }

    #[test]
    fn words_are_found_in_any_order_and_case() {
        assert!(is_found("Show the screen Library", "LIB screen"));
        assert!(is_found("Stop motion", ""));
        assert!(!is_found("Stop motion", "stop it"));
    }
}
