//! Recordings to compare, and the options of the comparison.

use crate::command::{Commands, UiCommand};
use crate::widgets::{
    NamedControl, choice_ui, form_label, placeholder_ui, quiet_ui, require, tick_box, tolerance_ui,
};
use crate::workers::PathPurpose;
use eframe::egui::{Button, Label, TextEdit, Ui};
use palpate_analysis::recordings::RecordingNames;
use palpate_analysis::select::SelectRequest;
use palpate_analysis::source::RecordStretch;
use palpate_rheology::select::{HoldOut, SelectOptions};
use palpate_rheology::tolerance::{BadTolerance, Tolerance};
use std::path::{Path, PathBuf};

/// More recordings than this compared by hand are a job for the command line.
const SOURCES_MAX: usize = 24;

const HOLD_OUTS: [(HoldOut, &str); 5] = [
    (HoldOut::Auto, "each recording in turn"),
    (HoldOut::Speed, "each speed in turn"),
    (HoldOut::Depth, "each depth in turn"),
    (HoldOut::Specimen, "each specimen in turn"),
    (HoldOut::None, "nothing"),
];

/// The form as typed.
#[derive(Clone, Debug)]
pub struct ModelsForm {
    sources: Vec<PathBuf>,
    typed: String,
    tolerance: String,
    hold_out: HoldOut,
    with_unload: bool,
}

impl Default for ModelsForm {
    fn default() -> Self {
        Self {
            sources: Vec::new(),
            typed: String::new(),
            tolerance: "2%".into(),
            hold_out: HoldOut::Auto,
            with_unload: false,
        }
    }
}

impl ModelsForm {
    /// Adds a recording, once.
    pub fn add(&mut self, path: &Path) {
        if self.sources.len() < SOURCES_MAX && !self.sources.iter().any(|known| known == path) {
            self.sources.push(path.to_path_buf());
        }
    }

    /// The comparison to make, or why there is none.
    pub fn request(&self) -> Result<SelectRequest, String> {
        require(!self.sources.is_empty(), "add a recording first")?;
        Ok(SelectRequest {
            paths: self.sources.clone(),
            wanted: RecordStretch::with_unload(self.with_unload).into(),
            naming: RecordingNames::Stem,
            options: SelectOptions {
                tolerance: self.tolerance()?,
                hold_out: self.hold_out,
                ..SelectOptions::default()
            },
            ..SelectRequest::default()
        })
    }

    fn tolerance(&self) -> Result<Option<Tolerance>, String> {
        match self.tolerance.trim() {
            "" => Ok(None),
            text => text.parse().map(Some).map_err(|err: BadTolerance| err.to_string()),
        }
    }

    pub(super) fn sources_ui(
        &mut self,
        ui: &mut Ui,
        last_run: Option<&Path>,
        commands: &mut Commands,
    ) {
        let mut dropped = None;
        for (index, path) in self.sources.iter().enumerate() {
            ui.horizontal(|ui| {
                let name = short(path);
                let hint = format!("leave out {name}");
                let button = ui.add(Button::new("×").small()).on_hover_text(&hint);
                if button.accessible_name(hint).clicked() {
                    dropped = Some(index);
                }
                ui.add(Label::new(name).truncate()).on_hover_text(path.display().to_string());
            });
        }
        if let Some(index) = dropped {
            self.sources.remove(index);
        }
        if self.sources.is_empty() {
            placeholder_ui(ui, "none yet");
        }
        ui.horizontal(|ui| {
            let label = form_label(ui, "path");
            let width = ui.available_width() - 52.0;
            let input = TextEdit::singleline(&mut self.typed)
                .desired_width(width)
                .char_limit(4096)
                .hint_text("session folder or table");
            let typed = ui.add(input).labelled_by(label.id).named("path");
            let is_entered =
                typed.lost_focus() && ui.input(|input| input.key_pressed(eframe::egui::Key::Enter));
            let is_pressed = ui.button("Add").clicked();
            let path = PathBuf::from(self.typed.trim());
            if (is_entered || is_pressed) && !path.as_os_str().is_empty() {
                self.add(&path);
                self.typed.clear();
            }
        });
        ui.horizontal_wrapped(|ui| {
            if ui.button("Choose table...").clicked() {
                commands.push(UiCommand::Choose(PathPurpose::Table));
            }
            if ui.button("Choose session...").clicked() {
                commands.push(UiCommand::Choose(PathPurpose::Session));
            }
            let button = Button::new("Add the last run");
            if ui.add_enabled(last_run.is_some(), button).clicked()
                && let Some(path) = last_run
            {
                self.add(path);
            }
        });
        if last_run.is_none() {
            quiet_ui(ui, "no run has ended on the Run screen yet");
        }
    }

    pub(super) fn choices_ui(&mut self, ui: &mut Ui) {
        let without = Some("no tolerance: the information criteria alone decide");
        tolerance_ui(ui, &mut self.tolerance, without);
        choice_ui(ui, "hold out", &mut self.hold_out, &HOLD_OUTS);
        tick_box(ui, &mut self.with_unload, "unloading too, where recorded");
    }
}

/// The last two parts of a path: enough to tell recordings apart.
fn short(path: &Path) -> String {
    let parts: Vec<String> =
        path.iter().rev().take(2).map(|part| part.to_string_lossy().into_owned()).collect();
    parts.into_iter().rev().collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_form_asks_for_nothing_without_recordings_or_with_a_bad_tolerance() {
        let mut form = ModelsForm::default();
        assert!(form.request().unwrap_err().contains("add a recording"));
        form.add(Path::new("a/b/c.csv"));
        form.add(Path::new("a/b/c.csv"));
        let request = form.request().unwrap();
        assert_eq!(request.paths.len(), 1);
        assert!(request.options.tolerance.is_some());
        form.tolerance = "much".into();
        assert!(form.request().unwrap_err().contains("'much' is not a tolerance"));
        form.tolerance = " ".into();
        assert!(form.request().unwrap().options.tolerance.is_none());
    }

    #[test]
    fn a_path_is_shown_by_its_end() {
        assert_eq!(short(Path::new("/data/runs/s1/log.csv")), "s1/log.csv");
        assert_eq!(short(Path::new("log.csv")), "log.csv");
    }
}
