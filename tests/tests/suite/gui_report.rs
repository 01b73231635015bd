//! The panel of analyses driven by accessible name: a fit, another calibration, a stretch left out, what is taken back,
//! and the papers that are written of it.

use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::report::budget::UncertaintyBudget;
use palpate_analysis::report::text::ParameterText;
use palpate_analysis::source::SourceSelection;
use palpate_model::calibration::Calibration;
use palpate_rheology::fit::FitOptions;
use palpate_sessions::analyses::{Analyses, AnalysisContent};
use palpate_sessions::edits::{DataQuality, Edits};
use palpate_tests::workspace;
use palpate_window::screens::review::ReviewSource;
use palpate_window::screens::review::analyses::AnalysesPanel;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// Most frames of a wait: two minutes.
const FRAMES_MAX: usize = 12_000;

struct Shown {
    panel: AnalysesPanel,
    looked: ReviewSource,
}

struct Panel {
    window: Harness<'static, Shown>,
    session: PathBuf,
    folder: TempDir,
}

impl Panel {
    /// A recorded session in a folder of its own, and the panel on it.
    fn open() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let [session, beside] = ["press", "beside"].map(|name| {
            let session = folder.path().join(name);
            fs::create_dir(&session).expect("a session folder");
            let log = workspace().join("tests/sessions/ramp-hold-lab/000.mcap");
            fs::copy(log, session.join("000.mcap")).expect("a log");
            session
        });
        let shown = Shown {
            panel: AnalysesPanel::new(Ok(folder.path().join("library"))),
            looked: ReviewSource { session: session.clone(), analysis: None },
        };
        let window = Harness::builder().with_size((340.0, 1400.0)).build_ui_state(
            move |ui, shown: &mut Shown| {
                shown.panel.poll(&ui.ctx().clone());
                let second = ReviewSource { session: beside.clone(), analysis: None };
                let all = [shown.looked.clone(), second];
                shown.panel.set_shown(&all);
                let mut commands = Default::default();
                shown.panel.ui(ui, &mut shown.looked, &mut commands);
            },
            shown,
        );
        let mut panel = Self { window, session, folder };
        panel.wait_for("as measured");
        panel
    }

    fn says(&self, words: &str) -> bool {
        let mut found = self.window.query_all_by_label_contains(words);
        found.next().is_some()
    }

    fn wait_for(&mut self, words: &str) {
        for _ in 0..FRAMES_MAX {
            self.window.step();
            if self.says(words) {
                self.window.run_steps(2);
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("'{words}' did not come");
    }

    fn type_into(&mut self, name: &str, text: &str) {
        self.window.get_by_label(name).focus();
        self.window.step();
        self.window.get_by_label(name).set_text_value_accesskit(text);
        self.window.run_steps(2);
    }

    fn click(&mut self, name: &str) {
        self.window.get_by_label(name).click_accesskit();
        self.window.run_steps(2);
    }

    fn is_enabled(&self, name: &str) -> bool {
        let node = self.window.get_by_label(name);
        !node.accesskit_node().is_disabled()
    }

    fn chosen(&self) -> Option<String> {
        self.window.state().looked.analysis.clone()
    }

    fn cursors(&mut self, cursors: Option<[f64; 2]>) {
        self.window.state_mut().panel.set_cursors(cursors);
        self.window.run_steps(2);
    }

    fn analyses(&self) -> Analyses {
        Analyses::read(&self.session, &self.id()).expect("analyses")
    }

    fn id(&self) -> String {
        let summary = palpate_sessions::SessionSummary::read(&self.session).expect("a summary");
        summary.manifest.session_id
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

#[test]
fn a_fit_is_made_compared_and_taken_back() {
    let mut panel = Panel::open();
    assert!(!panel.is_enabled("Make analysis") && panel.says("give the new analysis a name"));
    panel.type_into("name", "all of it");
    panel.type_into("by", "Ada");
    panel.type_into("reason", "whole hold");
    panel.click("profile intervals too");
    panel.click("Make analysis");
    panel.wait_for("saved as 'all of it'");
    panel.wait_for("Found by 'all of it'");
    assert_eq!(panel.chosen().as_deref(), Some("all of it"));
    assert!(panel.says("95 % from the profile likelihood"));
    // The numbers of the command line, in its words.
    let recipe = FitRecipe::new(FitOptions::default(), SourceSelection::default());
    let report = recipe.fit(&panel.session).expect("a source").result.expect("a fit");
    panel.click("Compare with the session's own fit");
    panel.wait_for("session: ");
    for parameter in &report.parameters {
        let text = ParameterText::of(parameter);
        // The analysis keeps total intervals and the budget.
        for words in [&text.value, &text.interval, &text.total] {
            assert!(panel.says(words), "{words}");
        }
        assert!(panel.says(&format!("session: {}", text.value)), "{}", text.value);
    }
    panel.click("Uncertainty budget of 'all of it'");
    let budget = UncertaintyBudget::of(&report.parameters);
    assert!(!budget.remedies.is_empty());
    for words in &budget.remedies {
        assert!(panel.says(words), "{words}");
    }
    let kept = panel.analyses();
    assert_eq!((kept.all.len(), kept.all[0].by.as_str()), (1, "Ada"));
    assert_eq!(kept.all[0].reason, "whole hold");
    assert!(
        matches!(&kept.all[0].what, AnalysisContent::Fit { results, .. } if results["profile"].is_array())
    );
    // A name is used once.
    panel.type_into("name", "all of it");
    assert!(!panel.is_enabled("Make analysis") && panel.says("never used twice"));
    // Taking back needs a reason, and is a record.
    assert!(!panel.is_enabled("Withdraw analysis") && panel.says("type a reason above"));
    panel.type_into("reason", "the probe slipped");
    panel.click("Withdraw analysis");
    panel.wait_for("withdrawn by Ada");
    assert_eq!(panel.chosen(), None);
    assert_eq!(panel.analyses().all.len(), 2);
    assert_eq!(panel.analyses().active().count(), 0);
    assert!(panel.says("the session has no analysis to withdraw"));
}

#[test]
fn another_model_another_calibration_and_a_stretch_left_out() {
    let mut panel = Panel::open();
    panel.click("Leave out");
    assert!(!panel.is_enabled("Between the cursors") && panel.says("set the cursors A and B"));
    panel.cursors(Some([22.0, 20.00001]));
    panel.click("Between the cursors");
    panel.type_into("name", "knock");
    panel.click("Make analysis");
    panel.wait_for("forces are left out");
    panel.wait_for("Found by 'knock'");
    let kept = panel.analyses();
    let AnalysisContent::Mask { left_out_s } = &kept.all[0].what else {
        panic!("{:?}", kept.all[0]);
    };
    assert_eq!(left_out_s, &[[20.0, 22.0]]);
    assert_eq!(panel.chosen().as_deref(), Some("knock"));
    // What is made now is based on what the session is read by.
    panel.click("Fit");
    panel.click("model");
    panel.click("kelvin");
    panel.type_into("name", "simpler");
    panel.click("Make analysis");
    panel.wait_for("saved as 'simpler'");
    panel.wait_for("Found by 'simpler'");
    let kept = panel.analyses();
    let AnalysisContent::Fit { based_on, settings, .. } = &kept.all[1].what else {
        panic!("{:?}", kept.all[1]);
    };
    assert_eq!((based_on.as_deref(), &settings["family"]), (Some("knock"), &"kelvin".into()));
    // A calibration of a file.
    let document = panel.at("other.json");
    let calibration = serde_json::to_string(&Calibration::thesis()).expect("a document");
    fs::write(&document, calibration).expect("a file");
    panel.click("Other calibration");
    panel.type_into("name", "repeat");
    assert!(panel.says("choose a calibration"));
    panel.type_into("or file", "nowhere.json");
    panel.click("Make analysis");
    panel.wait_for("nowhere.json");
    panel.type_into("or file", &document.display().to_string());
    panel.click("Make analysis");
    panel.wait_for("saved as 'repeat'");
    panel.wait_for("Found by 'repeat'");
    panel.wait_for("N rms and at most");
    assert_eq!(panel.analyses().active().count(), 3);
    panel.type_into("reason", "only tried");
    panel.click("Withdraw last analysis");
    panel.wait_for("withdrawn by");
    assert!(panel.analyses().get("repeat").is_err());
    // The log is read again only where an edit changes what it means.
    assert_eq!(panel.window.state_mut().panel.take_changed(), None);
}

#[test]
fn sessions_shown_together_are_fitted_as_one_body() {
    let mut panel = Panel::open();
    panel.click("fit this session and the other session shown as one material");
    panel.type_into("name", "together");
    panel.click("Make analysis");
    panel.wait_for("saved as 'together'");
    let kept = panel.analyses();
    let AnalysisContent::Fit { settings, results, .. } = &kept.all[0].what else {
        panic!("{:?}", kept.all[0]);
    };
    assert_eq!(settings["together_with"][0]["session"], "beside");
    assert_eq!(results["shared"].as_array().map(Vec::len), Some(5));
    let logs = kept.all[0].inputs.iter();
    assert_eq!(logs.filter(|one| one.what.ends_with("000.mcap")).count(), 2);
}

#[test]
fn a_verdict_and_a_contact_are_corrected_with_a_reason() {
    let mut panel = Panel::open();
    assert!(!panel.is_enabled("Set verdict") && !panel.is_enabled("Correct contact"));
    panel.type_into("reason", "hair under the probe");
    panel.click("verdict");
    panel.click("suspect");
    panel.click("Set verdict");
    panel.wait_for("suspect, by");
    panel.type_into("reason", "by eye");
    panel.type_into("correct to", "4000");
    panel.click("Correct contact");
    panel.wait_for("outside the rig's travel");
    panel.type_into("correct to", "40.5");
    panel.click("Correct contact");
    panel.wait_for("contact 1 at 40.500 mm");
    let changed = panel.window.state_mut().panel.take_changed();
    assert_eq!(changed.as_deref(), Some(panel.session.as_path()));
    let edits = Edits::read(&panel.session, &panel.id()).expect("edits");
    let verdict = edits.verdict().map(|(verdict, edit)| (verdict, edit.reason.as_str()));
    assert_eq!(verdict, Some((DataQuality::Suspect, "hair under the probe")));
    assert!(edits.contact(1).is_some());
}

#[test]
fn a_report_and_figures_are_written_once() {
    let mut panel = Panel::open();
    assert!(!panel.is_enabled("Write report") && !panel.is_enabled("Write figure"));
    panel.type_into("report file", "page.txt");
    assert!(panel.says("the file name must end in .html"));
    let page = panel.at("page.html");
    panel.type_into("report file", &page.display().to_string());
    panel.click("Write report");
    panel.wait_for("written: ");
    let html = fs::read_to_string(&page).expect("a page");
    assert!(html.contains("Files that this page describes") && !html.contains("Comparison of"));
    panel.click("of all 2 shown");
    panel.click("Write report");
    panel.wait_for("exists already");
    let both = panel.at("both.html");
    panel.type_into("report file", &both.display().to_string());
    panel.click("Write report");
    panel.wait_for("both.html");
    wait_for_file(&both);
    assert!(fs::read_to_string(&both).expect("a page").contains("Comparison of 2 sessions"));
    let figure = panel.at("figure.png");
    panel.type_into("figure file", &figure.display().to_string());
    panel.click("Write figure");
    panel.wait_for("figure.png");
    wait_for_file(&figure);
}

fn wait_for_file(path: &Path) {
    for _ in 0..FRAMES_MAX {
        if path.metadata().is_ok_and(|found| found.len() > 1000) {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("{} was not written", path.display());
}
