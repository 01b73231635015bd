//! What accuracy costs on this machine: requirements on the left, error over time in the middle, the recommendation on
//! the right.

mod tables;

use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::plots::figure::{PlotLook, plot_ui};
use crate::widgets::{
    NamedControl, QuantityField, alarm_ui, heading_ui, placeholder_ui, quantity_ui, quiet_ui,
    require, section_ui, sentence_ui, small_alarm_ui, small_ui, table_ui, tick_box, tolerance_ui,
    work_ui,
};
use crate::workers::BackgroundTask;
use eframe::egui::{Context, Key, Label, RichText, Ui, vec2};
use palpate_analysis::report::scatter::ScatterPlot;
use palpate_analysis::report::text::capital;
use palpate_analysis::trade::stored::{read_trade, trade_file, write_trade};
use palpate_analysis::trade::text::{advice, percent, terms};
use palpate_analysis::trade::{self, SCENE_PEAK, TradeExtent};
use palpate_haptics::surface::{SceneCurves, ScenePlan, ScenePlanError, SceneRequirements, plan};
use palpate_model::units::Newtons;
use palpate_rheology::tolerance::{BadTolerance, Tolerance};
use palpate_rheology::trade::{Recommendation, TradeCurves};
use std::path::PathBuf;
use std::sync::Arc;
use tables::{TradeTable, cuts, families, fits, integrators, meshes, plan_lines, steps};

/// Share of the height that the plot gets.
const PLOT_SHARE: f32 = 0.5;
/// Updates a second that can be asked for, as on the command line.
const RATE_MAX: f64 = 1e9;

/// Largest error of shape in mm and longest tick in us that can be asked for.
const SHAPE_MAX: f64 = 1e3;
const BUDGET_MAX: f64 = 1e6;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum View {
    Integrators,
    Families,
    Fit,
    Mesh,
    Cut,
    Step,
}

const VIEWS: [(View, &str); 6] = [
    (View::Integrators, "Integrators"),
    (View::Families, "Families"),
    (View::Fit, "Fit"),
    (View::Mesh, "Scene: mesh"),
    (View::Cut, "Scene: influence"),
    (View::Step, "Scene: step"),
];

impl View {
    const fn is_scene(self) -> bool {
        matches!(self, Self::Mesh | Self::Cut | Self::Step)
    }
}

/// Curves that were measured now or read from the library.
struct TradeMeasurement {
    curves: TradeCurves,
    doubts: Vec<String>,
    /// The file, or why there is none.
    stored: Result<String, String>,
}

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Trade",
    icon: lucide_icons::Icon::Gauge,
    purpose: "what accuracy costs on this machine",
    key: Some(Key::Num7),
    open: |workbench| Box::new(TradeScreen::new(workbench.library.clone())),
};

pub struct TradeScreen {
    library: Result<PathBuf, String>,
    tolerance: String,
    rate: QuantityField,
    share: QuantityField,
    is_quick: bool,
    view: View,
    task: BackgroundTask<TradeMeasurement>,
    is_read: bool,
    shape: QuantityField,
    budget: QuantityField,
    scene: BackgroundTask<Arc<SceneCurves>>,
}

impl TradeScreen {
    fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            library,
            tolerance: "1%".into(),
            rate: QuantityField::new(1000.0),
            share: QuantityField::new(10.0),
            is_quick: false,
            view: View::Integrators,
            task: BackgroundTask::default(),
            is_read: false,
            shape: QuantityField::new(0.5),
            budget: QuantityField::new(100.0),
            scene: BackgroundTask::default(),
        }
    }

    pub fn curves(&self) -> Option<&TradeCurves> {
        let measured = self.task.answer()?.as_ref().ok()?;
        Some(&measured.curves)
    }

    pub fn scene_curves(&self) -> Option<&SceneCurves> {
        self.scene_answer().map(Arc::as_ref)
    }

    fn scene_answer(&self) -> Option<&Arc<SceneCurves>> {
        self.scene.answer()?.as_ref().ok()
    }

    /// The plan for what is wanted of a scene; none before its curves are measured.
    fn planned(&self) -> Option<Result<ScenePlan, ScenePlanError>> {
        let curves = self.scene_curves()?;
        let needs = SceneRequirements {
            force: self.tolerance.parse().ok()?,
            peak: SCENE_PEAK,
            shape_mm: self.shape.value.clone().ok()?,
            budget_us: self.budget.value.clone().ok()?,
        };
        Some(plan(&needs, curves, 1.0))
    }

    fn wanted(&self) -> Result<(Tolerance, f64, f64), String> {
        let tolerance = self.tolerance.parse().map_err(|err: BadTolerance| err.to_string())?;
        Ok((tolerance, self.rate.value.clone()?, self.share.value.clone()?))
    }

    fn recommendation(&self) -> Option<Recommendation> {
        let (tolerance, rate, share) = self.wanted().ok()?;
        Some(self.curves()?.recommend(tolerance, rate, 0.01 * share))
    }

    /// What the view shows and the level not to exceed in it, once that is measured.
    fn drawn(&self) -> Result<Option<(TradeTable, Option<f64>)>, String> {
        if self.view.is_scene() {
            let planned = self.planned().and_then(Result::ok);
            let curves = self.scene.answer().map(|answer| answer.as_ref());
            let Some(curves) = curves.transpose().map_err(Clone::clone)? else {
                return Ok(None);
            };
            let planned = planned.as_ref();
            let shape = self.shape.value.clone().ok();
            let force = self.tolerance.parse::<Tolerance>().ok();
            let force = force.map(|tolerance| tolerance.in_newtons(SCENE_PEAK).0);
            return Ok(Some(match self.view {
                View::Cut => (cuts(curves, planned), shape),
                View::Step => (steps(curves, planned), force),
                _ => (meshes(curves, planned), shape),
            }));
        }
        let measured = self.task.answer().map(|answer| answer.as_ref());
        let Some(measured) = measured.transpose().map_err(Clone::clone)? else {
            return Ok(None);
        };
        let curves = &measured.curves;
        let peak = Newtons(curves.peak.ramp_hold_n);
        let level = self.tolerance.parse::<Tolerance>().ok();
        let level = level.map(|tolerance| 100.0 * tolerance.in_newtons(peak).0 / peak.0);
        Ok(Some(match self.view {
            View::Families => (families(curves), None),
            View::Fit => (fits(curves), None),
            _ => (integrators(curves), level),
        }))
    }

    fn plan_ui(&self, ui: &mut Ui) {
        match self.planned() {
            None if self.scene_curves().is_none() => placeholder_ui(ui, "measure first"),
            None => placeholder_ui(
                ui,
                "the tolerance, shape or budget is invalid; correct the entry on the left",
            ),
            Some(Ok(plan)) => {
                ui.label(RichText::new("the cheapest plan that meets both tolerances").strong());
                plan_lines(&plan).iter().for_each(|line| sentence_ui(ui, line));
            }
            Some(Err(none)) => {
                alarm_ui(ui, format!("no plan: {}", none.reason));
                if let Some(plan) = &none.nearest {
                    section_ui(ui, "Nearest within the budget");
                    plan_lines(plan).iter().for_each(|line| sentence_ui(ui, line));
                }
            }
        }
    }
}

impl Screen for TradeScreen {
    fn left_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        section_ui(ui, "Requirements");
        tolerance_ui(ui, &mut self.tolerance, None);
        let is_scene = self.view.is_scene();
        if is_scene {
            quantity_ui(ui, "shape", "mm of error", &mut self.shape);
            quantity_ui(ui, "budget", "µs of each tick", &mut self.budget);
        } else {
            quantity_ui(ui, "rate", "updates a second", &mut self.rate);
            quantity_ui(ui, "share", "% of each period", &mut self.share);
        }
        section_ui(ui, "Measure");
        let verdict = workbench.measure_verdict();
        tick_box(ui, &mut self.is_quick, "few rows, rough times");
        ui.add_space(4.0);
        match is_scene {
            true => work_ui(ui, "Measure here  F6", &self.scene, &verdict, commands),
            false => work_ui(ui, "Measure here  F6", &self.task, &verdict, commands),
        }
        let Some(Ok(measured)) = self.task.answer().filter(|_| !is_scene) else { return };
        section_ui(ui, "Measured");
        let facts = [
            measured.curves.machine.words(),
            format!("{} by palpate {}", measured.curves.measured_at, measured.curves.version),
            format!(
                "even and odd rounds differ by {} at most",
                percent(measured.curves.worst_halves())
            ),
        ];
        facts.into_iter().for_each(|fact| small_ui(ui, fact));
        measured.doubts.iter().for_each(|doubt| small_alarm_ui(ui, doubt));
        match &measured.stored {
            Ok(file) => quiet_ui(ui, format!("stored in {file}")),
            Err(reason) => small_alarm_ui(ui, format!("not stored: {reason}")),
        }
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        heading_ui(ui, "Error over time");
        ui.horizontal_wrapped(|ui| {
            for (view, name) in VIEWS {
                ui.selectable_value(&mut self.view, view, name).named(name);
            }
        });
        let (shown, level) = match self.drawn() {
            Ok(Some(shown)) => shown,
            Ok(None) => return placeholder_ui(ui, "nothing measured on this machine yet"),
            Err(reason) => return alarm_ui(ui, reason),
        };
        let height = ui.available_height() * PLOT_SHARE;
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            let scatter = ScatterPlot {
                axes: shown.axes,
                marks: &shown.marks,
                has_front: self.view != View::Families,
                chosen: shown.chosen,
                level,
            };
            plot_ui(ui, shown.axes[0], &scatter.plot(), PlotLook::default());
        });
        table_ui(ui, shown.axes[0], &shown.columns, &shown.rows);
    }

    fn right_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        section_ui(ui, "Recommendation");
        if self.view.is_scene() {
            self.plan_ui(ui);
            return;
        }
        let Some(recommendation) = self.recommendation() else {
            let text = match self.wanted() {
                Err(_) => "the tolerance, rate or share is invalid; correct the entry on the left",
                Ok(_) => "measure first",
            };
            return placeholder_ui(ui, text);
        };
        ui.add(Label::new(format!("For {}:", terms(&recommendation))).wrap());
        for (name, words) in advice(&recommendation) {
            section_ui(ui, &capital(&name));
            ui.add(Label::new(words).wrap());
        }
    }

    fn poll(&mut self, _ctx: &Context, workbench: &mut Workbench) {
        self.task.poll();
        self.rate.check(|rate| in_range(rate, RATE_MAX));
        self.share.check(|share| in_range(share, 100.0));
        self.scene.poll();
        self.shape.check(|shape| in_range(shape, SHAPE_MAX));
        self.budget.check(|budget| in_range(budget, BUDGET_MAX));
        let curves = self.scene_answer();
        if workbench.front.scene_curves.as_ref().map(Arc::as_ptr) != curves.map(Arc::as_ptr) {
            workbench.front.scene_curves = curves.cloned();
        }
    }

    fn shown(&mut self, ctx: &Context) {
        if std::mem::replace(&mut self.is_read, true) {
            return;
        }
        let Ok(library) = &self.library else { return };
        let file = trade_file(library, &trade::this_machine());
        if !file.exists() {
            return;
        }
        self.task.start("trade-read", ctx, move |_| {
            let curves = read_trade(&file).map_err(|err| err.to_string())?;
            Ok(TradeMeasurement {
                doubts: doubts(&curves),
                stored: Ok(file.display().to_string()),
                curves,
            })
        });
    }

    fn act(&mut self, _ctx: &Context, command: &UiCommand, _workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::MeasureScene => self.view = View::Mesh,
            _ => return Reaction::NotMine,
        }
        Reaction::Show
    }

    fn work(&mut self, ctx: &Context, workbench: &mut Workbench) {
        if workbench.measure_verdict().is_err() {
            return;
        }
        let extent = if self.is_quick { TradeExtent::Quick } else { TradeExtent::Full };
        if self.view.is_scene() {
            self.scene.start("scene-curves", ctx, move |progress| {
                let curves = trade::measure_scene(extent, progress)?;
                curves.map(Arc::new).ok_or_else(|| "the measurement was cancelled".to_owned())
            });
            return;
        }
        let library = self.library.clone();
        self.task.start("trade", ctx, move |progress| {
            let curves =
                trade::measure(extent, progress)?.ok_or("the measurement was cancelled")?;
            let stored = library
                .and_then(|library| write_trade(&library, &curves).map_err(|err| err.to_string()));
            Ok(TradeMeasurement {
                doubts: doubts(&curves),
                stored: stored.map(|file| file.display().to_string()),
                curves,
            })
        });
    }

    fn cancel(&mut self) {
        if self.view.is_scene() { self.scene.cancel() } else { self.task.cancel() }
    }

    fn is_busy(&self) -> bool {
        self.task.is_busy() || self.scene.is_busy()
    }
}

fn in_range(value: f64, high: f64) -> Result<(), String> {
    require(value > 0.0 && value <= high, format!("must be above 0 and at most {high}"))
}

fn doubts(curves: &TradeCurves) -> Vec<String> {
    curves.doubts(&trade::this_machine(), trade::version(), trade::age_days(curves))
}
