//! The daily checks of the rig over time: deviations of its zero and of a known weight, and their limits.

use super::screen::{Commands, Screen, ScreenEntry, UiCommand, Workbench};
use crate::plots::figure::{PlotLook, plot_ui};
use crate::widgets::{
    Column, Emphasis, NamedControl, TableRow, alarm_ui, answer_ui, fact_ui, heading_ui, quiet_ui,
    section_ui, table_ui, work_ui,
};
use crate::workers::BackgroundTask;
use chrono::{DateTime, Local, Utc};
use eframe::egui::{Button, Context, Key, Ui, vec2};
use palpate_analysis::daily::{
    DailyCheckDeviation, PastCheck, control_limits, past_checks, trends,
};
use palpate_analysis::report::live::deviation_plot;
use std::path::PathBuf;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Checks",
    icon: lucide_icons::Icon::ListChecks,
    purpose: "the rig's daily checks over time",
    key: Some(Key::D),
    open: |workbench| {
        Box::new(ChecksScreen {
            library: workbench.library.clone(),
            rig: workbench.snapshot.rig.description.name.clone(),
            task: BackgroundTask::default(),
            was_shown: false,
            is_stale: true,
        })
    },
};

/// Checks that are read: a year of working days, with room for those that were repeated.
const CHECKS_MAX: usize = 400;

/// Share of the height that both plots get.
const PLOT_SHARE: f32 = 0.6;

/// Seconds in a day: the unit of the time axis.
const DAY_S: f64 = 86_400.0;

type Measured = fn(&PastCheck) -> Option<DailyCheckDeviation>;

const PLOTS: [(&str, Measured); 2] = [
    ("Known weight: measured - expected (N)", |one| one.weight),
    ("Zero: measured - expected (N)", |one| one.zero),
];

pub struct ChecksScreen {
    library: Result<PathBuf, String>,
    rig: String,
    task: BackgroundTask<Vec<PastCheck>>,
    /// It was shown in the last frame.
    was_shown: bool,
    /// A check may have been made since it was last shown.
    is_stale: bool,
}

impl ChecksScreen {
    /// The checks that were read last, oldest first.
    pub fn checks(&self) -> Option<&Result<Vec<PastCheck>, String>> {
        self.task.answer()
    }

    fn read(&mut self, ctx: &Context) {
        let (library, rig) = (self.library.clone(), self.rig.clone());
        self.task.start("checks", ctx, move |progress| {
            past_checks(&library?, &rig, CHECKS_MAX, progress)
        });
    }
}

impl Screen for ChecksScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        section_ui(ui, &format!("Daily checks of {}", self.rig));
        quiet_ui(
            ui,
            "A daily check reads the empty load cell and one known weight, and touches the home switch twice. A run in tissue needs a check that passed on the same day, or an acknowledgement by the operator.",
        );
        ui.add_space(8.0);
        work_ui(ui, "Read again  F6", &self.task, &Ok(()), commands);
        section_ui(ui, "New check");
        let words = "Run the daily check";
        let button = Button::new(words).min_size(vec2(150.0, 48.0));
        if ui.add_enabled(!workbench.is_busy(), button).named(words).clicked() {
            commands.push(UiCommand::CheckRig);
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        let before = "reading the library";
        let Some(checks) = answer_ui(ui, &self.task, before) else { return };
        if checks.is_empty() {
            heading_ui(ui, "No daily check of this rig yet");
            ui.label("Run it once a day before the first specimen; this screen then shows the drift of both readings, the empty load cell and the weight.");
            return;
        }
        let height = ui.available_height() * PLOT_SHARE / PLOTS.len() as f32 - 26.0;
        for (head, measured) in PLOTS {
            heading_ui(ui, head);
            ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
                let known: Vec<(f64, DailyCheckDeviation)> =
                    checks.iter().filter_map(|one| Some((days(one), measured(one)?))).collect();
                let look = PlotLook { x_text: Some(day_text), ..PlotLook::default() };
                let readings: Vec<DailyCheckDeviation> = known.iter().map(|(_, it)| *it).collect();
                let control = control_limits(&readings).map(|(limits, _)| limits);
                plot_ui(ui, head, &deviation_plot(head, &known, control), look);
            });
        }
        let columns = [
            Column::words("time", 120.0),
            Column::words("by", 80.0),
            Column::words("result", 50.0),
            Column::numbers("weight (N)", 72.0),
            Column::numbers("allowed (N)", 78.0),
            Column::numbers("zero (N)", 72.0),
            Column::numbers("allowed (N)", 78.0),
            Column::words("calibration", 160.0),
        ];
        let rows: Vec<TableRow> = checks.iter().rev().map(row).collect();
        table_ui(ui, "daily_checks", &columns, &rows);
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        section_ui(ui, "Last check");
        let Some(Ok(checks)) = self.task.answer() else { return };
        let Some(PastCheck { check, .. }) = checks.last() else {
            return quiet_ui(ui, "none");
        };
        fact_ui(ui, "time", time_text(check.at));
        fact_ui(ui, "by", &check.by);
        for part in &check.parts {
            section_ui(ui, &part.what);
            if part.is_passed { quiet_ui(ui, &part.sentence) } else { alarm_ui(ui, &part.sentence) }
        }
        section_ui(ui, "Trend");
        for (words, is_warning) in trends(checks) {
            if is_warning { alarm_ui(ui, words) } else { quiet_ui(ui, words) }
        }
        let failed = checks.iter().filter(|one| !one.check.is_passed).count();
        section_ui(ui, "All checks");
        fact_ui(ui, "failed", format!("{failed} of {}", checks.len()));
    }

    fn poll(&mut self, _ctx: &Context, _workbench: &mut Workbench) {
        self.is_stale |= !std::mem::take(&mut self.was_shown);
        self.task.poll();
    }

    fn shown(&mut self, ctx: &Context) {
        self.was_shown = true;
        if std::mem::take(&mut self.is_stale) {
            self.read(ctx);
        }
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        self.read(ctx);
    }

    fn cancel(&mut self) {
        self.task.cancel();
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy()
    }
}

/// Days since 1970, as the time axis has them.
fn days(check: &PastCheck) -> f64 {
    check.check.at.timestamp() as f64 / DAY_S
}

/// A moment by this computer's calendar.
fn time_text(at: DateTime<Utc>) -> String {
    at.with_timezone(&Local).format("%Y-%m-%d %H:%M").to_string()
}

/// The day of a place on the time axis.
fn day_text(days: f64) -> String {
    let at = DateTime::from_timestamp((days * DAY_S) as i64, 0);
    at.map_or_else(String::new, |at| at.format("%Y-%m-%d").to_string())
}

fn row(past: &PastCheck) -> TableRow {
    let check = &past.check;
    let force = |one: Option<DailyCheckDeviation>| {
        one.map_or("-".into(), |one| format!("{:+.4}", one.newtons))
    };
    let limit = |one: Option<DailyCheckDeviation>| {
        one.map_or("-".into(), |one| format!("{:.4}", one.limit))
    };
    let sentences = check.parts.iter().map(|part| part.sentence.as_str());
    TableRow {
        cells: vec![
            time_text(check.at),
            check.by.clone(),
            if check.is_passed { "pass" } else { "FAIL" }.into(),
            force(past.weight),
            limit(past.weight),
            force(past.zero),
            limit(past.zero),
            check.calibration.clone(),
        ],
        emphasis: if check.is_passed { Emphasis::Plain } else { Emphasis::Alarm },
        hint: Some(sentences.collect::<Vec<_>>().join("\n")),
    }
}
