//! The window driven by accessible name: no display, no graphics card, no pixels.
//!
//! Every wait has an end that no busy computer reaches, so a flow that hangs fails instead.
#![expect(
    clippy::unwrap_used,
    clippy::missing_panics_doc,
    reason = "a test that cannot go on must fail"
)]

use eframe::egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::report::text::{self, ParameterText};
use palpate_analysis::source::SourceSelection;
use palpate_drivers::sim::SimSettings;
use palpate_model::rig::Phase;
use palpate_rheology::fit::{FitOptions, FitReport};
use palpate_runner::{LogLine, RunView, TimeScale};
use palpate_test_support::wait::Deadline;
use palpate_window::app::WorkbenchApp;
use palpate_window::screens::screen::{Screen, ScreenEntry};
use palpate_window::window::WindowOptions;
use palpate_window::workers::fit::Refit;
use std::path::PathBuf;
use std::time::Duration;
use tempfile::TempDir;

pub type TestWindow = Harness<'static, WorkbenchApp>;

/// A screen of a window.
#[must_use]
pub fn screen_of<T: Screen>(window: &TestWindow) -> &T {
    window.state().screen().unwrap()
}

/// State of the exact fit of the run on the screen.
#[must_use]
pub fn refit(window: &TestWindow) -> Refit<'_> {
    window.state().refit()
}

/// Sleep between two frames of a wait.
pub const FRAME: Duration = Duration::from_millis(5);

/// A window on a simulated rig, driven by accessible name.
pub struct WindowFlow {
    pub window: TestWindow,
    /// Folder of its sessions.
    pub folder: TempDir,
}

impl WindowFlow {
    /// Opens a window; the rig answers.
    #[must_use]
    pub fn open(scale: TimeScale) -> Self {
        Self::open_in(tempfile::tempdir().unwrap(), scale)
    }

    /// With a folder that may hold sessions.
    #[must_use]
    pub fn open_in(folder: TempDir, scale: TimeScale) -> Self {
        let settings = SimSettings { seed: 7, ..SimSettings::default() };
        let options = WindowOptions::open("sim", &settings, scale).unwrap();
        Self::open_on(options, folder)
    }

    #[must_use]
    pub fn open_on(mut options: WindowOptions, folder: TempDir) -> Self {
        options.sessions = Some(folder.path().to_path_buf());
        let window = Harness::builder()
            .with_size((1280.0, 800.0))
            .build_eframe(|cc| WorkbenchApp::new(options, &cc.egui_ctx).unwrap());
        let mut flow = Self { window, folder };
        flow.wait("the first sample", |window| window.state().snapshot().rig.reading.is_some());
        flow
    }

    /// Draws frames until `is_done`.
    pub fn wait(&mut self, what: &str, is_done: impl Fn(&TestWindow) -> bool) {
        let end = Deadline::new();
        loop {
            self.window.step();
            if is_done(&self.window) {
                return;
            }
            assert!(!end.is_over(), "{what} did not come; {}", self.story());
            std::thread::sleep(FRAME);
        }
    }

    /// Draws frames until a label has these words, and some more.
    pub fn wait_for_words(&mut self, words: &str) {
        self.wait(words, |window| window.query_all_by_label_contains(words).next().is_some());
        self.window.run_steps(2);
    }

    /// Events so far, for a failure's message.
    fn story(&self) -> String {
        let lines = self.run().map_or(Vec::new(), |run| {
            let text = |line: &LogLine| format!("{} {}", line.at, line.text);
            run.events.iter().map(text).collect()
        });
        format!("the events were:\n{}", lines.join("\n"))
    }

    /// Waits for a phase of the run; any stop before it is a failure.
    pub fn wait_for_phase(&mut self, phase: Phase) {
        let is_there = |run: &RunView| run.phase == phase;
        let is_stopped = |run: &RunView| run.holding.is_some() || run.outcome.is_some();
        self.wait(phase.name(), |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| is_there(run) || is_stopped(run))
        });
        assert!(self.run().is_some_and(|run| is_there(&run)), "{}", self.story());
    }

    #[must_use]
    pub fn run(&self) -> Option<RunView> {
        self.window.state().snapshot().run.clone()
    }

    /// Opens the list of everything by name, types and takes the first that is found.
    pub fn act_by_name(&mut self, words: &str) {
        self.window.key_press_modifiers(Modifiers::COMMAND, Key::K);
        self.window.run_steps(3);
        self.type_into("command", words);
        self.window.key_press(Key::Enter);
        self.window.run_steps(3);
    }

    pub fn type_into(&mut self, name: &str, text: &str) {
        self.window.get_by_label(name).focus();
        self.window.step();
        self.window.get_by_label(name).set_text_value_accesskit(text);
        self.window.run_steps(2);
    }

    pub fn click(&mut self, name: &str) {
        // By name and not by place: a control may be scrolled out of sight.
        self.window.get_by_label(name).click_accesskit();
        self.window.run_steps(2);
    }

    /// Shows a screen by its key.
    pub fn show(&mut self, screen: &ScreenEntry) {
        self.window.key_press_modifiers(Modifiers::COMMAND, screen.key.unwrap());
        self.window.run_steps(3);
    }

    /// Whether a named control can be pressed.
    #[must_use]
    pub fn is_enabled(&self, name: &str) -> bool {
        !self.window.get_by_label(name).accesskit_node().is_disabled()
    }

    /// Whether any label has these words.
    #[must_use]
    pub fn says(&self, words: &str) -> bool {
        self.window.query_all_by_label_contains(words).next().is_some()
    }

    /// Sessions written.
    #[must_use]
    pub fn sessions(&self) -> Vec<PathBuf> {
        std::fs::read_dir(self.folder.path())
            .unwrap()
            .map(|item| item.unwrap().path())
            .filter(|path| path.is_dir())
            .collect()
    }

    /// Waits for the exact fit of the last session; the window must then say of it what
    /// `palpate fit` prints, be it a report or a refusal. Returns the report.
    pub fn same_words_as_the_command_line(&mut self) -> Option<FitReport> {
        self.wait("the exact fit", |window| {
            matches!(refit(window), Refit::Done(_) | Refit::Refused(_))
        });
        self.window.run_steps(2);
        let session = self.sessions().pop().unwrap();
        let result =
            match FitRecipe::new(FitOptions::default(), SourceSelection::default()).fit(&session) {
                Ok(fitted) => fitted.result.map_err(|err| err.to_string()),
                Err(err) => Err(err.to_string()),
            };
        match result {
            Ok(report) => {
                self.says_all_of(&report);
                Some(report)
            }
            Err(reason) => {
                assert!(self.says(&format!("No exact fit: {reason}")), "{reason}");
                None
            }
        }
    }

    /// The window must say every word of a report.
    fn says_all_of(&self, report: &FitReport) {
        let mut words: Vec<String> = report.sentences().map(String::from).collect();
        words.push(text::quality(report));
        for parameter in &report.parameters {
            let text = ParameterText::of(parameter);
            words.extend([text.name, text.value, text.unit, text.interval, text.total]);
        }
        for word in words {
            assert!(self.says(&word), "the window does not say '{word}'");
        }
    }

    /// Waits for the end of the run.
    pub fn wait_for_end(&mut self) -> RunView {
        self.wait("the end of the run", |window| {
            let run = window.state().snapshot().run.as_ref();
            run.is_some_and(|run| run.outcome.is_some())
        });
        self.run().unwrap()
    }
}
