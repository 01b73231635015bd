//! What the scene tolerates, and the cheapest way to play it that does.

use super::SceneScreen;
use crate::report::scene::plan_text;
use crate::theme::Tokens;
use crate::widgets::fact_row::{fact_ui, section_ui};
use crate::widgets::reason_button::reason_button;
use crate::widgets::remark::quiet_ui;
use crate::workers::scene_bench::{made_after, planned, planned_again};
use eframe::egui::{Label, RichText, Ui, vec2};
use palpate_model::surface::{NoPlan, SceneCurves, ScenePlan};
use palpate_protocols::haptics::scene_file::SceneFile;

/// A plan, what it was made of, and what it answers.
pub(super) struct Planned {
    file: SceneFile,
    curves: SceneCurves,
    plan: Result<ScenePlan, NoPlan>,
}

impl Planned {
    fn of(file: SceneFile, curves: &SceneCurves) -> Self {
        Self {
            plan: planned(&file, curves, 1.0),
            curves: curves.clone(),
            file,
        }
    }

    fn is_of(&self, file: &SceneFile, curves: &SceneCurves) -> bool {
        self.file == *file && self.curves == *curves
    }
}

impl SceneScreen {
    /// Plans what stands in the form, once there are curves of this computer.
    pub fn plan(&mut self, curves: Option<&SceneCurves>) {
        let (Some(curves), Ok(file)) = (curves, self.form.scene_file()) else {
            self.planned = None;
            return;
        };
        if !self
            .planned
            .as_ref()
            .is_some_and(|one| one.is_of(&file, curves))
        {
            self.planned = Some(Planned::of(file, curves));
        }
    }

    /// Draws it; the plan can be taken.
    pub(super) fn plan_ui(&mut self, ui: &mut Ui, is_running: bool) {
        section_ui(ui, "Tolerances and plan");
        if let Ok(file) = self.form.scene_file() {
            let one = &file.tolerances;
            let force = format!("{} % of what a hand notices", one.force_percent);
            fact_ui(ui, "force", force);
            fact_ui(ui, "shape", format!("{} mm", one.shape_mm));
            fact_ui(ui, "tick", format!("{} µs", one.tick_us));
        }
        let verdict = match &self.planned {
            None => Err("measure what a scene costs on the screen Trade first".to_owned()),
            Some(Planned {
                plan: Err(none), ..
            }) => Err(none.why.clone()),
            Some(_) if is_running => Err("the scene runs".to_owned()),
            Some(Planned { plan: Ok(_), .. }) => Ok(()),
        };
        let is_taken = reason_button(ui, "Take the plan", vec2(170.0, 26.0), &verdict);
        let Some(Planned {
            file,
            curves,
            plan: Ok(plan),
        }) = &self.planned
        else {
            return;
        };
        for line in plan_text(plan).lines() {
            quiet_ui(ui, line);
        }
        if is_taken {
            self.form.take(made_after(file, plan));
            return;
        }
        let Some(touch) = self
            .touch
            .as_ref()
            .filter(|touch| touch.kept().work.count > 0)
        else {
            return;
        };
        let (took, budget) = (1e6 * touch.kept().work.p99_9.0, file.tolerances.tick_us);
        if took > budget {
            let again = match planned_again(file, curves, plan, took) {
                Ok(plan) => plan_text(&plan),
                Err(none) => none.why,
            };
            let words = format!(
                "one tick in a thousand took {took:.0} µs, over the budget of {budget} µs. Planned again with that:\n{again}"
            );
            let tokens = Tokens::of(ui.visuals().dark_mode);
            ui.add(Label::new(RichText::new(words).color(tokens.alarm_text)).wrap());
        }
    }
}
