//! Model only what a scene requires: from what it tolerates and what was measured, the cheapest way.
//!
//! A plan takes one point of each measured curve: mesh, cut, integrator with its step, family. Errors
//! of shape add (mesh and cut), errors of force add (step and family), which is the most they can be.
//! A mesh costs its time multiplied by the share that the cut leaves; times add. So the cheapest pair for
//! the shape and the cheapest pair for the force are the cheapest of all.

use super::mesh::INERT;
use super::scene_curves::{CutPoint, FamilyPoint, MeshPoint, Pair, SceneCurves, StepPoint};
use palpate_model::units::Newtons;
use palpate_rheology::tolerance::Tolerance;
use serde::Serialize;
use std::cmp::Ordering;

/// Tolerances and time budget of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneRequirements {
    /// Error of force, such as so many percent of what a hand notices
    /// ([`THRESHOLD_SHARE`](palpate_rheology::tolerance::THRESHOLD_SHARE)).
    pub force: Tolerance,
    /// The force at which that is meant.
    pub peak: Newtons,
    /// Error of shape in mm.
    pub shape_mm: f64,
    /// Time of a tick's own work in microseconds.
    pub budget_us: f64,
}

/// What a plan leaves out, compared with the most exact that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OmittedPart {
    /// What, in words.
    pub what: String,
    /// The error of that part with it left out.
    pub error: f64,
    /// `mm` or `N`.
    pub unit: &'static str,
    /// Time saved in microseconds.
    pub saved_us: f64,
}

/// One of each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenePlan {
    pub mesh: MeshPoint,
    pub cut: CutPoint,
    pub step: StepPoint,
    pub family: FamilyPoint,
    /// Most that the shape is off, in mm.
    pub shape_error_mm: f64,
    /// Most that the force is off, in N.
    pub force_error_n: f64,
    /// Expected time of a tick in microseconds.
    pub cost_us: f64,
    pub dropped: Vec<OmittedPart>,
    /// Parts without effect, and why.
    pub inert: [(&'static str, &'static str); 2],
}

/// Nothing holds everything.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenePlanError {
    /// Why, in a sentence.
    #[serde(rename = "why")]
    pub reason: String,
    /// The plan within the budget that exceeds the tolerances by the least factor.
    pub nearest: Option<Box<ScenePlan>>,
}

/// The cheapest plan that holds every tolerance and the budget, with `slower` times the measured
/// costs: 1 at first, after a miss [`slower`].
pub fn plan(
    needs: &SceneRequirements,
    curves: &SceneCurves,
    slower: f64,
) -> Result<ScenePlan, ScenePlanError> {
    let refuse = |why: String| ScenePlanError { reason: why, nearest: None };
    let force_n = needs.force.in_newtons(needs.peak).0;
    for (what, value) in [
        ("force tolerance", force_n),
        ("shape tolerance", needs.shape_mm),
        ("tick budget", needs.budget_us),
        ("cost factor", slower),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(refuse(format!(
                "a {what} of {value} is not possible; it must be a finite number above zero"
            )));
        }
    }
    curves.checked().map_err(refuse)?;
    let shapes = curves.shape_pairs(slower);
    let forces = curves.force_pairs(slower);
    let shape = cheapest(&shapes, needs.shape_mm);
    let force = cheapest(&forces, force_n);
    let why = match (shape, force) {
        (Some(shape), Some(force)) if shape.cost + force.cost <= needs.budget_us => {
            return Ok(curves.assemble_plan(shape, force, slower));
        }
        (Some(shape), Some(force)) => format!(
            "the cheapest measured scene within {} mm and {force_n:.3} N takes {:.1} us a tick, but the budget is {} us",
            needs.shape_mm,
            shape.cost + force.cost,
            needs.budget_us
        ),
        (None, _) => format!(
            "no measured scene keeps the error of shape within {} mm; the smallest error is {} mm",
            needs.shape_mm,
            least_error(&shapes)
        ),
        (_, None) => format!(
            "no measured scene keeps the error of force within {force_n:.3} N; the smallest error is {:.3} N",
            least_error(&forces)
        ),
    };
    let nearest = nearest([&shapes, &forces], [needs.shape_mm, force_n], needs.budget_us)
        .map(|[shape, force]| curves.assemble_plan(shape, force, slower));
    let advice = match &nearest {
        Some(plan) => format!(
            "; within the budget, {} nodes a side and the family {} have errors of {:.3} mm and {:.3} N",
            plan.mesh.nodes, plan.family.family, plan.shape_error_mm, plan.force_error_n
        ),
        None => "; no measured scene is within the budget; allow more time per tick".to_owned(),
    };
    Err(ScenePlanError { reason: why + &advice, nearest: nearest.map(Box::new) })
}

/// The factor of cost after a tick of `plan`, made with the factor `slower`, took `measured_us`: with
/// it the plan costs what it was seen to. A tick faster than expected leaves the factor.
#[must_use]
pub fn updated_cost_factor(plan: &ScenePlan, slower: f64, measured_us: f64) -> f64 {
    let ratio = measured_us / plan.cost_us;
    if ratio > 1.0 && ratio.is_finite() { slower * ratio } else { slower }
}

/// The cheapest within a tolerance; of equal ones the most exact.
fn cheapest(pairs: &[Pair], tolerance: f64) -> Option<Pair> {
    let within = pairs.iter().filter(|pair| pair.error <= tolerance);
    within.copied().min_by(by_cost)
}

fn by_cost(a: &Pair, b: &Pair) -> Ordering {
    a.cost.total_cmp(&b.cost).then(a.error.total_cmp(&b.error))
}

fn least_error(pairs: &[Pair]) -> f64 {
    let errors = pairs.iter().map(|pair| pair.error);
    errors.fold(f64::INFINITY, f64::min)
}

/// The two within a budget together whose errors are beyond their tolerances by the least factor; of
/// equal ones the cheapest.
fn nearest(pairs: [&[Pair]; 2], tolerances: [f64; 2], budget: f64) -> Option<[Pair; 2]> {
    let [shapes, forces] = pairs.map(pareto_front);
    let mut best: Option<([f64; 2], [Pair; 2])> = None;
    for shape in &shapes {
        for force in &forces {
            let cost = shape.cost + force.cost;
            let factor = (shape.error / tolerances[0]).max(force.error / tolerances[1]);
            let key = [factor, cost];
            if cost <= budget && best.is_none_or(|(known, _)| key < known) {
                best = Some((key, [*shape, *force]));
            }
        }
    }
    best.map(|(_, pair)| pair)
}

/// Those than which nothing is both cheaper and more exact, the cheapest first.
fn pareto_front(pairs: &[Pair]) -> Vec<Pair> {
    let mut sorted = pairs.to_vec();
    sorted.sort_by(by_cost);
    let mut least = f64::INFINITY;
    sorted.retain(|pair| {
        let is_better = pair.error < least;
        least = least.min(pair.error);
        is_better
    });
    sorted
}

impl SceneCurves {
    fn assemble_plan(&self, shape: Pair, force: Pair, slower: f64) -> ScenePlan {
        let (mesh, cut) = (&self.meshes[shape.indices[0]], &self.cuts[shape.indices[1]]);
        let step = &self.steps[force.indices[0]];
        let family = &self.families[force.indices[1]];
        let mut plan = ScenePlan {
            mesh: mesh.clone(),
            cut: cut.clone(),
            step: step.clone(),
            family: family.clone(),
            shape_error_mm: shape.error,
            force_error_n: force.error,
            cost_us: shape.cost + force.cost,
            dropped: Vec::new(),
            inert: INERT,
        };
        plan.dropped = self.dropped(&plan, slower);
        plan
    }

    /// Part by part, what the most exact measured would be instead.
    fn dropped(&self, plan: &ScenePlan, slower: f64) -> Vec<OmittedPart> {
        let ScenePlan { mesh, cut, step, family, .. } = plan;
        let finest = most_exact(&self.meshes, |point| (point.error_mm, point.cost_us));
        let widest = most_exact(&self.cuts, |point| (point.error_mm, point.cost_share));
        let shortest = most_exact(&self.steps, |point| (point.error_n, point.cost_us));
        let fullest = most_exact(&self.families, |point| (point.error_n, point.cost_us));
        let words = |step: &StepPoint| format!("{} at {} s", step.scheme.name(), step.step_s);
        let of_mesh = finest.map(|finest| {
            let what =
                format!("a mesh of {} nodes a side; the plan has {}", finest.nodes, mesh.nodes);
            let saved_us = (finest.cost_us - mesh.cost_us) * cut.cost_share;
            (what, [mesh.error_mm, finest.error_mm], "mm", saved_us)
        });
        let of_cut = widest.map(|widest| {
            let what = format!("influence beyond the cut, {}", cut.description());
            let saved_us = (widest.cost_share - cut.cost_share) * mesh.cost_us;
            (what, [cut.error_mm, widest.error_mm], "mm", saved_us)
        });
        let of_step = shortest.map(|shortest| {
            let what = format!("{}; the plan has {}", words(shortest), words(step));
            (what, [step.error_n, shortest.error_n], "N", shortest.cost_us - step.cost_us)
        });
        let of_family = fullest.map(|fullest| {
            let what = format!("the family {}; the plan has {}", fullest.family, family.family);
            (what, [family.error_n, fullest.error_n], "N", fullest.cost_us - family.cost_us)
        });
        // What is as exact as the most exact leaves nothing out.
        let parts = [of_mesh, of_cut, of_step, of_family].into_iter().flatten();
        let parts = parts.filter(|(_, [error, least], ..)| error > least);
        let part = |(what, [error, _], unit, saved_us): (String, [f64; 2], _, f64)| OmittedPart {
            what,
            error,
            unit,
            saved_us: slower * saved_us,
        };
        parts.map(part).collect()
    }
}

/// The point of the least error; of equal ones the cheapest.
fn most_exact<T>(points: &[T], key: impl Fn(&T) -> (f64, f64)) -> Option<&T> {
    points.iter().min_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    })
}
