//! A loop's recording: the folder that the next run is written to, what the last one left, and a recording computed again.

use crate::theme::Tokens;
use crate::widgets::fact_row::section_ui;
use crate::widgets::remark::quiet_ui;
use crate::widgets::task_bar::{Pressed, task_ui};
use crate::widgets::text_row::text_row;
use crate::workers::Job;
use crate::workers::path_dialog::FolderDialog;
use crate::workers::recorded::{RecordedTicks, Replayed};
use crate::workers::task::Task;
use eframe::egui::{Label, RichText, Ui};
use palpate_sessions::ticks::Recorded;
use std::path::{Path, PathBuf};

/// How a recording is computed again.
pub(super) type Replay = fn(&Path, &mut dyn FnMut(f64) -> bool) -> Result<Replayed, String>;

/// The panel.
#[derive(Default)]
pub(super) struct TapePanel {
    to: String,
    from: String,
    dialog: FolderDialog,
    refusal: Option<String>,
    /// The end of a recording, which waits for the disk.
    ending: Job<Option<Result<Recorded, String>>>,
    told: Option<Result<String, String>>,
    task: Task<Replayed>,
}

impl TapePanel {
    /// The folder that the next run is recorded in, if it is.
    pub fn folder(&self) -> Option<PathBuf> {
        let to = self.to.trim();
        (!to.is_empty()).then(|| PathBuf::from(to))
    }

    /// A recording has begun.
    pub fn begun(&mut self) {
        // What is recorded can be replayed, and the next run needs a folder of its own.
        self.from = std::mem::take(&mut self.to);
        self.told = Some(Ok("recording".to_owned()));
    }

    /// Ends it on a thread; `work` gives what was recorded, if it was.
    pub fn end(
        &mut self,
        work: impl FnOnce() -> Option<Result<Recorded, String>> + Send + 'static,
    ) {
        // The window is drawn at least once a second.
        if let Err(err) = self.ending.start("recording-end", work, || ()) {
            self.told = Some(Err(format!("the recording cannot be ended: {err}")));
        }
    }

    /// Fetches answers that have come.
    pub fn poll(&mut self) {
        self.task.poll();
        if let Some(Some(recorded)) = self.ending.poll() {
            self.told = Some(recorded.map(|one| RecordedTicks::from(one).words()));
        }
        if let Some(folder) = self.dialog.poll() {
            self.from = folder.display().to_string();
        }
    }

    /// What was computed again last.
    pub fn replayed(&self) -> Option<&Result<Replayed, String>> {
        self.task.answer()
    }

    /// Draws it. `is_running`: the loop is under way.
    pub fn ui(&mut self, ui: &mut Ui, is_running: bool, replay: Replay) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        let alarm = |ui: &mut Ui, words: &str| {
            ui.add(Label::new(RichText::new(words).color(tokens.alarm_text)).wrap());
        };
        section_ui(ui, "Recording");
        ui.add_enabled_ui(!is_running, |ui| {
            let hint = "a new folder; not recorded without";
            text_row(ui, "record to", hint, &mut self.to);
        });
        match &self.told {
            Some(Ok(words)) => quiet_ui(ui, words),
            Some(Err(reason)) => alarm(ui, reason),
            None => {}
        }
        text_row(ui, "replay", "the folder of a recording", &mut self.from);
        let is_open = self.dialog.is_open();
        let button = eframe::egui::Button::new("Choose a recording...");
        if ui.add_enabled(!is_open, button).clicked()
            && let Err(err) = self.dialog.open("Folder of a recording", ui.ctx())
        {
            self.refusal = Some(format!("the dialog cannot be opened: {err}"));
        }
        if let Some(refusal) = &self.refusal {
            alarm(ui, refusal);
        }
        let may = match (is_running || self.ending.is_busy(), self.from.trim()) {
            (true, _) => Err("the loop runs".to_owned()),
            (false, "") => Err("name the folder of a recording first".to_owned()),
            (false, _) => Ok(()),
        };
        match task_ui(ui, "Replay it", &self.task, &may) {
            Some(Pressed::Start) => {
                let from = PathBuf::from(self.from.trim());
                self.task.start("replay", ui.ctx(), move |progress| {
                    replay(&from, &mut |share| {
                        let done = (1000.0 * share) as usize;
                        progress.tell(done, 1000, "the recording").is_continue()
                    })
                });
            }
            Some(Pressed::Cancel) => self.task.cancel(),
            None => {}
        }
        match self.task.answer() {
            Some(Ok(replayed)) => {
                for line in replayed.words().lines() {
                    quiet_ui(ui, line);
                }
                if let Some(why) = replayed.failure() {
                    alarm(ui, &why);
                }
            }
            Some(Err(reason)) => alarm(ui, reason),
            None => {}
        }
    }
}
