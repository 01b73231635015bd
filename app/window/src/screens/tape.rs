//! A loop's recording: the folder that the next run is written to, what the last one left, and a recording computed again.

use crate::widgets::fact_row::section_ui;
use crate::widgets::remark::{alarm_ui, quiet_ui};
use crate::widgets::task_bar::task_ui;
use crate::widgets::text_row::text_row;
use crate::workers::Job;
use crate::workers::path_dialog::Dialog;
use crate::workers::task::BackgroundTask;
use eframe::egui::{Context, Ui};
use palpate_analysis::progress::Progress;
use palpate_analysis::recorded::{Ended, Replayed, ended_words};
use std::path::{Path, PathBuf};

/// How a recording is computed again.
pub(super) type Replay = fn(&Path, &mut dyn FnMut(f64) -> bool) -> Result<Replayed, String>;

/// The panel.
#[derive(Default)]
pub(super) struct TapePanel {
    to: String,
    from: String,
    dialog: Dialog<PathBuf>,
    /// The window of a recording on its way, which is drawn again when that has ended.
    recording: Option<Context>,
    /// The end of a recording, which waits for the disk.
    ending: Job<Ended>,
    told: Option<Result<String, String>>,
    task: BackgroundTask<Replayed>,
}

impl TapePanel {
    /// Begins a recording with `start`, if a folder for the next run is named.
    pub fn begin<R>(
        &mut self,
        ctx: &Context,
        start: impl FnOnce(&Path) -> Result<R, String>,
    ) -> Result<Option<R>, String> {
        if self.ending.is_busy() {
            return Err("the last recording is still being written; wait a moment".into());
        }
        self.told = None;
        let to = self.to.trim();
        if to.is_empty() {
            return Ok(None);
        }
        let recorder = start(Path::new(to))?;
        // What is recorded can be replayed, and the next run needs a folder of its own.
        self.from = std::mem::take(&mut self.to);
        self.told = Some(Ok("every tick is recorded".to_owned()));
        self.recording = Some(ctx.clone());
        Ok(Some(recorder))
    }

    /// Ends a loop, and on a thread its recording if it has one: nobody who stops a loop waits for a disk.
    pub fn end(&mut self, work: impl FnOnce() -> Ended + Send + 'static) {
        let Some(ctx) = self.recording.clone() else {
            // Let go, the loop ends.
            drop(work);
            return;
        };
        let wake = move || ctx.request_repaint();
        if self.ending.start("recording-end", work, wake).is_err() {
            self.ended(None);
        }
    }

    fn ended(&mut self, ended: Ended) {
        if self.recording.take().is_some() {
            self.told = Some(match ended {
                Some(ended) => ended.map(ended_words),
                None => Err("the loop failed, and its recording was cut off".to_owned()),
            });
        }
    }

    /// The loop failed or did not begin: its recording, if it has one, gets no end.
    pub fn cut_off(&mut self) {
        // One that is being written out is of the loop before.
        if !self.ending.is_busy() {
            self.ended(None);
        }
    }

    /// Waits until the last recording is written: for a window that closes.
    pub fn settle(&mut self) {
        if self.ending.is_busy() {
            let ended = self.ending.wait().flatten();
            self.ended(ended);
        }
    }

    /// Takes the folder of a recording.
    pub fn take(&mut self, folder: &Path) {
        self.from = folder.display().to_string();
    }

    /// Whether a recording is computed again.
    pub fn is_busy(&self) -> bool {
        self.task.state().is_some()
    }

    /// Fetches answers that have come.
    pub fn poll(&mut self) {
        self.task.poll();
        if self.ending.is_busy() {
            let ended = self.ending.poll();
            if !self.ending.is_busy() {
                self.ended(ended.flatten());
            }
        }
        if let Some(folder) = self.dialog.poll() {
            self.take(&folder);
        }
    }

    /// What was computed again last.
    pub fn replayed(&self) -> Option<&Result<Replayed, String>> {
        self.task.answer()
    }

    /// Draws it. `is_running`: the loop is under way.
    pub fn ui(&mut self, ui: &mut Ui, is_running: bool, replay: Replay) {
        section_ui(ui, "Recording");
        ui.add_enabled_ui(!is_running, |ui| {
            let hint = "a new folder; not recorded without";
            text_row(ui, "record to", hint, &mut self.to);
        });
        match &self.told {
            Some(Ok(words)) => quiet_ui(ui, words),
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
        text_row(ui, "replay", "the folder of a recording", &mut self.from);
        self.dialog.button_ui(ui, "Choose a recording...", |dialog| {
            dialog.set_title("Folder of a recording").pick_folder()
        });
        let may = match (is_running || self.ending.is_busy(), self.from.trim()) {
            (true, _) => Err("the loop runs".to_owned()),
            (false, "") => Err("name the folder of a recording first".to_owned()),
            (false, _) => Ok(()),
        };
        if task_ui(ui, "Replay it", &self.task, &may) {
            let from = PathBuf::from(self.from.trim());
            self.task.start("replay", ui.ctx(), move |progress| {
                replay(&from, &mut |share| progress.share(share, "the recording"))
            });
        }
        match self.task.answer() {
            Some(Ok(replayed)) => {
                for line in replayed.words().lines() {
                    quiet_ui(ui, line);
                }
                if let Some(why) = replayed.failure() {
                    alarm_ui(ui, &why);
                }
            }
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
    }
}
