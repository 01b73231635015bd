//! Recording of a loop: the folder of the next recording, the result of the last one, and the replay of one.

use crate::command::{Commands, UiCommand};
use crate::widgets::{alarm_ui, quiet_ui, reason_button, require, section_ui, task_ui, text_row};
use crate::workers::{BackgroundTask, Dialog, Job};
use eframe::egui::{Context, Ui, vec2};
use palpate_analysis::progress::Progress;
use palpate_analysis::tick_replay::{FinishedRecording, ReplayResult, describe_finished};
use std::path::{Path, PathBuf};

/// Draws the button that starts a loop, or the one that stops it while it runs.
pub(super) fn loop_button_ui(
    ui: &mut Ui,
    name: &str,
    is_running: bool,
    verdict: &Result<(), String>,
    [start, stop]: [UiCommand; 2],
    commands: &mut Commands,
) {
    let size = vec2(170.0, 34.0);
    if is_running {
        if reason_button(ui, &format!("Stop the {name}"), size, &Ok(())) {
            commands.push(stop);
        }
    } else if reason_button(ui, &format!("Start the {name}"), size, verdict) {
        commands.push(start);
    }
}

/// Computes a recording again.
pub(super) type Replay = fn(&Path, &mut dyn FnMut(f64) -> bool) -> Result<ReplayResult, String>;

#[derive(Default)]
pub(super) struct TapePanel {
    to: String,
    from: String,
    dialog: Dialog<PathBuf>,
    /// The window to draw again when the recording in progress has ended.
    recording: Option<Context>,
    /// The end of a recording, which waits for the disk.
    ending: Job<FinishedRecording>,
    message: Option<Result<String, String>>,
    task: BackgroundTask<ReplayResult>,
}

impl TapePanel {
    /// Begins a recording with `start`, if a folder for the next run is named.
    pub fn begin<R>(
        &mut self,
        ctx: &Context,
        start: impl FnOnce(&Path) -> Result<R, String>,
    ) -> Result<Option<R>, String> {
        if self.ending.is_busy() {
            return Err("the last recording is still being written; try again in a moment".into());
        }
        self.message = None;
        let to = self.to.trim();
        if to.is_empty() {
            return Ok(None);
        }
        let recorder = start(Path::new(to))?;
        // What is recorded can be replayed, and the next run needs a folder of its own.
        self.from = std::mem::take(&mut self.to);
        self.message = Some(Ok("every tick is recorded".to_owned()));
        self.recording = Some(ctx.clone());
        Ok(Some(recorder))
    }

    /// Ends a loop, and its recording on a thread: a stop never waits for the disk.
    pub fn end(&mut self, work: impl FnOnce() -> FinishedRecording + Send + 'static) {
        let Some(ctx) = self.recording.clone() else {
            // Dropping it ends the loop.
            drop(work);
            return;
        };
        if self.ending.start("recording-end", &ctx, work).is_err() {
            self.ended(None);
        }
    }

    fn ended(&mut self, ended: FinishedRecording) {
        if self.recording.take().is_some() {
            self.message = Some(match ended {
                Some(ended) => ended.map(describe_finished),
                None => Err("the loop failed, so its recording has no end record".to_owned()),
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
        self.task.is_busy()
    }

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
    pub fn replayed(&self) -> Option<&Result<ReplayResult, String>> {
        self.task.answer()
    }

    /// Draws it. `is_running`: the loop is under way.
    pub fn ui(&mut self, ui: &mut Ui, is_running: bool, replay: Replay) {
        section_ui(ui, "Recording");
        ui.add_enabled_ui(!is_running, |ui| {
            let hint = "a new folder; leave empty for no recording";
            text_row(ui, "record to", hint, &mut self.to);
        });
        match &self.message {
            Some(Ok(words)) => quiet_ui(ui, words),
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
        text_row(ui, "replay", "the folder of a recording", &mut self.from);
        self.dialog.button_ui(ui, "Choose a recording...", |dialog| {
            dialog.set_title("Folder of a recording").pick_folder()
        });
        let is_free = require(!is_running && !self.ending.is_busy(), "the loop runs");
        let has_folder = require(!self.from.trim().is_empty(), "type the folder of a recording");
        if task_ui(ui, "Replay recording", &self.task, &is_free.and(has_folder)) {
            let from = PathBuf::from(self.from.trim());
            self.task.start("replay", ui.ctx(), move |progress| {
                replay(&from, &mut |share| progress.share(share, "the recording"))
            });
        }
        match self.task.answer() {
            Some(Ok(replayed)) => {
                replayed.words().lines().for_each(|line| quiet_ui(ui, line));
                if let Some(reason) = replayed.failure() {
                    alarm_ui(ui, reason);
                }
            }
            Some(Err(reason)) => alarm_ui(ui, reason),
            None => {}
        }
    }
}
