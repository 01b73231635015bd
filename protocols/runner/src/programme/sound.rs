//! What of a programme could never work, though every part of it can be read: told before anything moves.

use super::document::Task;
use palpate_protocols::plans::{Plan, Step};
use std::collections::BTreeSet;

/// Why a task can do nothing of what it says it does; `before` are the tasks ahead of it.
pub(super) fn doubts(task: &Task, before: &[Task]) -> Vec<String> {
    let mut doubts = Vec::new();
    let plan = task.plan(1, None);
    if task.calibrates && !plan.as_ref().is_some_and(weighs) {
        doubts.push(format!(
            "calibrates = true, and its protocol {} weighs nothing, so there would be no calibration; take it out, or use load-cell-calibration",
            task.protocol.name
        ));
    }
    if let Some(model) = &task.validates {
        let fitted = before.iter().find(|one| one.name == model.task);
        if let Some(reason) = fitted.and_then(unfitted) {
            doubts.push(format!(
                "validates = \"{}\", and that task gives no model to compare with, because {reason}; name a task that is one ramp and hold",
                model.task
            ));
        }
        if let Some(reason) = unfitted(task) {
            doubts.push(format!(
                "validates = \"{}\", and nothing could be compared, because {reason}; take it out, or use a protocol that is one ramp and hold",
                model.task
            ));
        }
    }
    doubts
}

/// Whether a reading under a known mass is taken.
fn weighs(plan: &Plan) -> bool {
    let is_loaded = |step: &Step| matches!(step, Step::Weigh(weigh) if weigh.mass_g > 0.0);
    plan.steps.iter().any(|planned| is_loaded(&planned.step))
}

/// Why no session of a task is fitted, if so: the page fits those with one way in, and no sine.
fn unfitted(task: &Task) -> Option<String> {
    let name = &task.protocol.name;
    if task.calibrates {
        return Some(format!("task '{}' calibrates", task.name));
    }
    let plan = task.plan(1, None)?;
    let is_sine = |step: &Step| matches!(step, Step::Sine(_));
    let is_way_in = |step: &Step| matches!(step, Step::Ramp(_) | Step::LoadTo(_));
    if plan.steps.iter().any(|planned| is_sine(&planned.step)) {
        return Some(format!("its protocol {name} follows a sine"));
    }
    let ways_in = plan.steps.iter().filter(|one| is_way_in(&one.step));
    // Steps outside any loop belong to the first cycle.
    let cycles: BTreeSet<u32> = ways_in.map(|planned| planned.cycle.max(1)).collect();
    match cycles.len() {
        0 => Some(format!("its protocol {name} presses into nothing")),
        1 => None,
        count => Some(format!("its protocol {name} has {count} cycles")),
    }
}
