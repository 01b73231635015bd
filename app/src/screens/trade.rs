//! What accuracy costs on this machine: what is wanted on the left, error over time in the middle, what to
//! use on the right.

use crate::command::{Command, Commands};
use crate::plots::log_scatter::{Mark, Scatter, log_scatter_ui};
use crate::report::text::capital;
use crate::theme::Tokens;
use crate::trade::text::{advice, digits, percent, plain, terms, time};
use crate::trade::{self, Extent};
use crate::widgets::fact_row::section_ui;
use crate::widgets::quantity_input::{QuantityField, form_label, quantity_ui};
use crate::widgets::table::{Column, Row, RowLook, table_ui};
use crate::widgets::task_bar::{Pressed, task_ui};
use crate::workers::task::Task;
use eframe::egui::{Context, Label, RichText, TextEdit, Ui, vec2};
use palpate_model::tolerance::{BadTolerance, Tolerance};
use palpate_model::trade::{Recommendation, TradeCurves};
use palpate_sessions::trade::{read_trade, trade_file, write_trade};
use std::path::PathBuf;

/// Share of the height that the plot gets.
const PLOT_SHARE: f32 = 0.5;
/// Updates a second that can be asked for, as on the command line.
const RATE_MAX: f64 = 1e9;

/// What is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum View {
    Integrators,
    Families,
    Fit,
}

const VIEWS: [(View, &str); 3] = [
    (View::Integrators, "Integrators"),
    (View::Families, "Families"),
    (View::Fit, "Fit"),
];

/// Curves measured or read.
pub struct Known {
    curves: TradeCurves,
    /// Why not to rely on them.
    doubts: Vec<String>,
    /// Where they are stored, or why they are not.
    stored: Result<String, String>,
}

/// The screen's state.
pub struct TradeScreen {
    library: Result<PathBuf, String>,
    tolerance: String,
    rate: QuantityField,
    share: QuantityField,
    is_quick: bool,
    view: View,
    task: Task<Known>,
    is_read: bool,
}

impl TradeScreen {
    /// A screen that keeps its curves in `library`, or the reason why there is none.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            library,
            tolerance: "1%".into(),
            rate: QuantityField::new(1000.0),
            share: QuantityField::new(10.0),
            is_quick: false,
            view: View::Integrators,
            task: Task::default(),
            is_read: false,
        }
    }

    /// Fetches an answer that has come.
    pub fn poll(&mut self) {
        self.task.poll();
        self.rate.check(|rate| in_range(rate, RATE_MAX));
        self.share.check(|share| in_range(share, 100.0));
    }

    /// The curves on the screen.
    #[must_use]
    pub fn curves(&self) -> Option<&TradeCurves> {
        let known = self.task.answer()?.as_ref().ok()?;
        Some(&known.curves)
    }

    /// Reads the stored curves of this machine, the first time the screen is shown.
    pub fn shown(&mut self, ctx: &Context) {
        if std::mem::replace(&mut self.is_read, true) {
            return;
        }
        let Ok(library) = &self.library else {
            return;
        };
        let file = trade_file(library, &trade::this_machine());
        if !file.exists() {
            return;
        }
        self.task.start("trade-read", ctx, move |_| {
            let curves = read_trade(&file).map_err(|err| err.to_string())?;
            Ok(Known {
                doubts: doubts(&curves),
                stored: Ok(file.display().to_string()),
                curves,
            })
        });
    }

    /// Measures.
    pub fn start(&mut self, ctx: &Context) {
        let extent = if self.is_quick {
            Extent::Quick
        } else {
            Extent::Full
        };
        let library = self.library.clone();
        self.task.start("trade", ctx, move |progress| {
            let tell = |done, of, what: &str| progress.tell(done, of, what);
            let curves = trade::measure(extent, &tell)?.ok_or("ended before it was done")?;
            let stored = library
                .and_then(|library| write_trade(&library, &curves).map_err(|err| err.to_string()));
            Ok(Known {
                doubts: doubts(&curves),
                stored: stored.map(|file| file.display().to_string()),
                curves,
            })
        });
    }

    /// Ends a measurement under way.
    pub fn cancel(&self) {
        self.task.cancel();
    }

    fn wanted(&self) -> Result<(Tolerance, f64, f64), String> {
        let tolerance = self
            .tolerance
            .parse()
            .map_err(|err: BadTolerance| err.to_string())?;
        Ok((
            tolerance,
            self.rate.value.clone()?,
            self.share.value.clone()?,
        ))
    }

    fn recommendation(&self) -> Option<Recommendation> {
        let (tolerance, rate, share) = self.wanted().ok()?;
        Some(self.curves()?.recommend(tolerance, rate, 0.01 * share))
    }

    /// What is wanted. `verdict` says whether a measurement would be disturbed.
    pub fn left_ui(&mut self, ui: &mut Ui, verdict: &Result<(), String>, commands: &mut Commands) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        section_ui(ui, "Wanted");
        ui.horizontal(|ui| {
            let label = form_label(ui, "tolerance");
            let input = TextEdit::singleline(&mut self.tolerance)
                .desired_width(96.0)
                .char_limit(24);
            ui.add(input).labelled_by(label.id);
        });
        match self.tolerance.parse::<Tolerance>() {
            Ok(tolerance) => {
                let text = format!("an error of {tolerance} does not matter");
                ui.label(RichText::new(text).color(tokens.text_quiet).small());
            }
            Err(reason) => {
                let text = RichText::new(reason.to_string()).color(tokens.alarm_text);
                ui.add(Label::new(text.small()).wrap());
            }
        }
        quantity_ui(ui, "rate", "updates a second", &mut self.rate);
        quantity_ui(ui, "share", "% of each period", &mut self.share);
        section_ui(ui, "Measure");
        ui.checkbox(&mut self.is_quick, "few rows, rough times");
        ui.add_space(4.0);
        match task_ui(ui, "Measure here  F6", &self.task, verdict) {
            Some(Pressed::Start) => commands.push(Command::Work),
            Some(Pressed::Cancel) => commands.push(Command::CancelWork),
            None => {}
        }
        let Some(Ok(known)) = self.task.answer() else {
            return;
        };
        section_ui(ui, "Measured");
        let facts = [
            known.curves.machine.words(),
            format!(
                "{} by palpate {}",
                known.curves.measured_at, known.curves.version
            ),
            format!(
                "even and odd rounds differ by {} at most",
                percent(known.curves.worst_halves())
            ),
        ];
        for fact in facts {
            ui.add(Label::new(RichText::new(fact).small()).wrap());
        }
        for doubt in &known.doubts {
            let text = RichText::new(doubt).color(tokens.alarm_text);
            ui.add(Label::new(text.small()).wrap());
        }
        let (text, ink) = match &known.stored {
            Ok(file) => (format!("stored in {file}"), tokens.text_quiet),
            Err(reason) => (format!("not stored: {reason}"), tokens.alarm_text),
        };
        ui.add(Label::new(RichText::new(text).small().color(ink)).wrap());
    }

    /// Error over time, and the table.
    pub fn middle_ui(&mut self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        ui.horizontal(|ui| {
            ui.label(RichText::new("Error over time").heading().strong());
            for (view, name) in VIEWS {
                ui.selectable_value(&mut self.view, view, name);
            }
        });
        let curves = match self.task.answer() {
            Some(Ok(known)) => &known.curves,
            Some(Err(reason)) => {
                ui.add(Label::new(RichText::new(reason).color(tokens.alarm_text)).wrap());
                return;
            }
            None => {
                let text = "nothing measured on this machine yet";
                ui.label(RichText::new(text).color(tokens.text_quiet));
                return;
            }
        };
        let shown = match self.view {
            View::Integrators => integrators(curves),
            View::Families => families(curves),
            View::Fit => fits(curves),
        };
        let level = match (self.view, self.wanted()) {
            (View::Integrators, Ok((tolerance, ..))) => Some(tolerance),
            _ => None,
        };
        let peak = palpate_model::Newtons(curves.peak.ramp_hold_n);
        let level = level.map(|tolerance| 100.0 * tolerance.in_newtons(peak).0 / peak.0);
        let height = ui.available_height() * PLOT_SHARE;
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            let scatter = Scatter {
                axes: shown.axes,
                marks: &shown.marks,
                has_front: self.view != View::Families,
                chosen: None,
                level,
            };
            log_scatter_ui(ui, shown.axes[0], &scatter);
        });
        table_ui(ui, shown.axes[0], &shown.columns, &shown.rows);
    }

    /// What to use.
    pub fn right_ui(&self, ui: &mut Ui) {
        let tokens = Tokens::of(ui.visuals().dark_mode);
        section_ui(ui, "What to use");
        let Some(recommendation) = self.recommendation() else {
            let text = match self.wanted() {
                Err(_) => "the tolerance, rate or share cannot be read",
                Ok(_) => "measure first",
            };
            ui.label(RichText::new(text).color(tokens.text_quiet));
            return;
        };
        ui.add(Label::new(format!("For {}:", terms(&recommendation))).wrap());
        for (name, words) in advice(&recommendation) {
            section_ui(ui, &capital(&name));
            ui.add(Label::new(words).wrap());
        }
    }
}

fn in_range(value: f64, high: f64) -> Result<(), String> {
    if value > 0.0 && value <= high {
        Ok(())
    } else {
        Err(format!("must be above 0 and at most {high}"))
    }
}

fn doubts(curves: &TradeCurves) -> Vec<String> {
    curves.doubts(
        &trade::this_machine(),
        trade::version(),
        trade::age_days(curves),
    )
}

/// One table as points and rows.
struct Shown {
    axes: [&'static str; 2],
    marks: Vec<Mark>,
    columns: Vec<Column>,
    rows: Vec<Row>,
}

impl Shown {
    fn new(axes: [&'static str; 2], heads: &[&str]) -> Self {
        let column = |(index, head): (usize, &&str)| match index {
            0 => Column::words(head, 250.0),
            _ => Column::numbers(head, 96.0),
        };
        Self {
            axes,
            marks: Vec::new(),
            columns: heads.iter().enumerate().map(column).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row, and its point where it has an error in percent.
    fn add(
        &mut self,
        at: [Option<f64>; 2],
        is_front: bool,
        cells: Vec<String>,
        hint: Option<String>,
    ) {
        if let [Some(cost), Some(error)] = at {
            self.marks.push(Mark {
                at: [cost, error],
                name: cells.join("\n"),
            });
        }
        let look = match (is_front, at[1]) {
            (true, _) => RowLook::Marked,
            (false, None) => RowLook::Quiet,
            (false, Some(_)) => RowLook::Plain,
        };
        self.rows.push(Row { cells, look, hint });
    }

    /// With the front's rows first.
    fn finished(mut self) -> Self {
        self.rows.sort_by_key(|row| row.look != RowLook::Marked);
        self
    }
}

fn integrators(curves: &TradeCurves) -> Shown {
    let mut shown = Shown::new(
        ["ns a second of simulated time", "error (% of peak force)"],
        &["integrator", "step (ms)", "a step", "error (%)"],
    );
    for row in &curves.integrators {
        let error = row.error.map(|error| 100.0 * error.share_of(&curves.peak));
        let cells = vec![
            format!("{}, {}", row.scheme.name(), row.precision.name()),
            plain(1e3 * row.step_s),
            time(row.cost.ns),
            error.map_or("unstable".into(), digits),
        ];
        shown.add(
            [Some(row.second_ns), error],
            row.front,
            cells,
            row.refused.clone(),
        );
    }
    shown.finished()
}

fn families(curves: &TradeCurves) -> Shown {
    let mut shown = Shown::new(
        ["ns a step", "error (% of peak force)"],
        &["family and what it stands for", "a step", "error (%)"],
    );
    for row in &curves.families {
        let error = 100.0 * row.error_n / row.peak_n;
        let cells = vec![
            format!("{}, {}", row.family, row.target),
            time(row.cost.ns),
            digits(error),
        ];
        // Fronts belong to one target each and would cross in one picture.
        shown.add([Some(row.cost.ns), Some(error)], false, cells, None);
        if let Some(last) = shown.rows.last_mut().filter(|_| row.front) {
            last.look = RowLook::Marked;
        }
    }
    shown.finished()
}

fn fits(curves: &TradeCurves) -> Shown {
    let mut shown = Shown::new(
        ["ns a fit", "error of tau (%)"],
        &["recording or live fit", "time", "tau (%)"],
    );
    for row in &curves.fit {
        let error = 100.0 * row.tau_error;
        let cells = vec![
            format!("{} Hz, {} samples", plain(row.rate_hz), row.samples),
            time(row.cost.ns),
            digits(error),
        ];
        shown.add([Some(row.cost.ns), Some(error)], row.front, cells, None);
    }
    for row in &curves.live {
        let error = row.tau_error.map(|error| 100.0 * error);
        let cells = vec![
            format!("live, {} relaxation times, a sample", row.nodes),
            time(row.cost.ns),
            error.map_or("no answer".into(), digits),
        ];
        // A sample of the live fit is no fit: it has a row and no point.
        shown.add([None, error], row.front, cells, None);
    }
    shown.finished()
}
