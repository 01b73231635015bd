//! Tolerances of the scene, and the cheapest plan that meets them.

use super::SceneScreen;
use crate::command::{Commands, UiCommand};
use crate::widgets::{NamedControl, alarm_ui, fact_ui, quiet_ui, reason_button, section_ui};
use crate::workers::live_scene::LiveScene;
use eframe::egui::{Ui, vec2};
use palpate_analysis::report::scene::plan_text;
use palpate_analysis::scene_bench::{plan_scene, replan_scene, scene_from_plan};
use palpate_haptics::surface::{SceneCurves, ScenePlan, ScenePlanError};
use palpate_runner::haptics::scene_file::SceneFile;

/// A plan, what it was made of, and what it answers.
pub(super) struct PlannedScene {
    file: SceneFile,
    curves: SceneCurves,
    plan: Result<ScenePlan, ScenePlanError>,
}

impl PlannedScene {
    fn of(file: SceneFile, curves: &SceneCurves) -> Self {
        Self { plan: plan_scene(&file, curves, 1.0), curves: curves.clone(), file }
    }

    fn is_of(&self, file: &SceneFile, curves: &SceneCurves) -> bool {
        self.file == *file && self.curves == *curves
    }
}

impl SceneScreen {
    /// Plans what stands in the form, once there are curves of this computer.
    pub(super) fn plan(&mut self, curves: Option<&SceneCurves>) {
        let file = self.form.scene_file().ok().filter(|file| file.mesh.is_none());
        let (Some(curves), Some(file)) = (curves, file) else {
            self.planned = None;
            return;
        };
        if !self.planned.as_ref().is_some_and(|one| one.is_of(&file, curves)) {
            self.planned = Some(PlannedScene::of(file, curves));
        }
    }

    /// Draws it; the plan can be taken.
    pub(super) fn plan_ui(&mut self, ui: &mut Ui, is_running: bool, commands: &mut Commands) {
        section_ui(ui, "Tolerances and plan");
        if let Ok(file) = self.form.scene_file() {
            let one = &file.tolerances;
            let force =
                format!("{} % of the smallest difference that a hand notices", one.force_percent);
            fact_ui(ui, "force", force);
            fact_ui(ui, "shape", format!("{} mm", one.shape_mm));
            fact_ui(ui, "tick", format!("{} µs", one.tick_us));
        }
        if self.mesh.is_some() {
            return quiet_ui(ui, "The triangles of a mesh from a file are not planned.");
        }
        let verdict = match &self.planned {
            None => Err("measure the cost of a scene on the Trade screen first".to_owned()),
            Some(PlannedScene { plan: Err(none), .. }) => Err(none.reason.clone()),
            Some(_) if is_running => Err("the scene runs".to_owned()),
            Some(PlannedScene { plan: Ok(_), .. }) => Ok(()),
        };
        if self.planned.is_none() {
            const NAME: &str = "Measure on Trade...";
            if ui.button(NAME).named(NAME).clicked() {
                commands.push(UiCommand::MeasureScene);
            }
        }
        let is_used = reason_button(ui, "Use plan", vec2(170.0, 26.0), &verdict);
        if let Some(PlannedScene { file, plan: Ok(plan), .. }) = &self.planned {
            for line in plan_text(plan).lines() {
                quiet_ui(ui, line);
            }
            if is_used {
                self.form.take(scene_from_plan(file, plan));
            }
        }
        self.late_ui(ui);
    }

    /// That ticks of the scene that runs or ran take longer than it grants them, if they do, and what follows for its plan.
    fn late_ui(&self, ui: &mut Ui) {
        let timing = self.live.as_ref().map(LiveScene::kept);
        let Some(timing) = timing.filter(|timing| timing.work.count > 0) else { return };
        // Of what ran, which need not be what stands in the form by now.
        let file = &self.live_file;
        let (took, budget) = (1e6 * timing.work.p99_9.0, file.tolerances.tick_us);
        if took <= budget {
            return;
        }
        let words = format!(
            "one tick in a thousand took more than {took:.0} µs, but the budget is {budget} µs"
        );
        alarm_ui(ui, words);
        let planned = self.planned.as_ref();
        if let Some(PlannedScene { curves, .. }) = planned {
            alarm_ui(ui, after_miss(file, curves, took));
        }
    }
}

/// What follows for a scene whose ticks took so many microseconds. Only where its own plan was missed do the times of all others
/// change with it.
fn after_miss(file: &SceneFile, curves: &SceneCurves, took: f64) -> String {
    match plan_scene(file, curves, 1.0) {
        Ok(plan) if scene_from_plan(file, &plan) == *file => {
            let again = match replan_scene(file, curves, &plan, took) {
                Ok(plan) => plan_text(&plan),
                Err(none) => none.reason,
            };
            format!("planned again with the measured time:\n{again}")
        }
        Ok(_) => {
            "the scene does not follow its plan; use the plan and start the scene again".into()
        }
        Err(none) => none.reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_analysis::trade::{SCENE_SIDE_MM, SCENE_SLOPE};
    use palpate_haptics::surface::{CutPoint, FamilyPoint, MeshPoint, StepPoint};

    /// A fine mesh of 100 us, a coarse one of 10, and one way to step.
    fn curves(file: &SceneFile) -> SceneCurves {
        let mesh = |(nodes, error_mm, cost_us)| MeshPoint { nodes, error_mm, cost_us };
        SceneCurves {
            meshes: [(201, 0.01, 100.0), (51, 0.1, 10.0)].map(mesh).into(),
            cuts: vec![CutPoint { range: None, threshold_mm: 0.0, error_mm: 0.0, cost_share: 1.0 }],
            steps: vec![StepPoint {
                scheme: file.scheme,
                step_s: 1.0 / file.rate_hz,
                error_n: 0.0,
                cost_us: 0.1,
            }],
            families: vec![FamilyPoint { family: "series-3".into(), error_n: 0.0, cost_us: 0.1 }],
        }
    }

    #[test]
    fn a_miss_is_planned_again_with_the_times_seen_only_where_the_plan_is_what_ran() {
        let mut file = SceneFile::default();
        // The curves' side and slope, which leave their errors as they are.
        (file.side_mm, file.slope) = (SCENE_SIDE_MM, SCENE_SLOPE);
        file.tolerances.shape_mm = 0.05;
        file.tolerances.tick_us = 150.0;
        let curves = curves(&file);
        let plan = plan_scene(&file, &curves, 1.0).unwrap();
        assert_eq!(plan.mesh.nodes, 201);
        let fine = scene_from_plan(&file, &plan);
        // Four times as slow as measured: only the coarse mesh keeps to the budget, and it is too coarse.
        let words = after_miss(&fine, &curves, 400.0);
        assert!(words.contains("within the budget, 51 nodes a side"), "{words}");
        // A third slower still keeps to it.
        let words = after_miss(&fine, &curves, 130.0);
        assert!(
            words.contains("plan: 201 x 201 nodes") && words.contains("130.0 us a tick"),
            "{words}"
        );
        // Of the time of a mesh that was not planned nothing follows for those that were measured.
        let own = SceneFile { nodes: Some(801), ..fine };
        let words = after_miss(&own, &curves, 1000.0);
        assert!(words.contains("does not follow its plan"), "{words}");
    }
}
