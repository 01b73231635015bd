//! The cost of accuracy in a scene on this computer, and the cheapest settings that a scene's tolerances allow.

use crate::progress::Progress;
use crate::trade::{self, SCENE_PEAK, SCENE_SIDE_MM, SCENE_SLOPE, TradeExtent, measure_scene};
use palpate_haptics::surface::{
    ContactSide, Cut, Grid, HeightField, SceneCurves, ScenePlan, ScenePlanError, SceneRequirements,
    StepPoint, Surface, SurfaceContact, SurfaceMethod, SurfaceRecovery, plan, updated_cost_factor,
};
use palpate_rheology::tolerance::Tolerance;
use palpate_rheology::trade::{Machine, mark_pareto_optimal};
use palpate_runner::Stopwatch;
use palpate_runner::haptics::scene_file::SceneFile;
use serde::Serialize;

/// The family that a scene plays: the modified Kelvin body of third order.
const FAMILY: &str = "series-3";

/// For how long one method is timed, in s.
const TIMED_S: f64 = 0.2;

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MethodSpeed {
    pub method: &'static str,
    /// Nodes along a side.
    pub nodes: usize,
    /// Nodes moved in a millisecond.
    pub nodes_per_ms: f64,
}

/// Measured curves of a scene, and the plan from them.
#[derive(Clone, Debug, Serialize)]
pub struct SceneBench {
    pub machine: Machine,
    pub quick: bool,
    /// Errors against times.
    pub curves: SceneCurves,
    /// For each mesh whether none other is both as exact and as cheap.
    pub meshes_on_front: Vec<bool>,
    /// For each integrator with its step the same.
    pub steps_on_front: Vec<bool>,
    /// The closed form beside the chain as it was published, in this run.
    pub methods: Vec<MethodSpeed>,
    pub plan: Option<ScenePlan>,
    /// The reason there is no plan that meets all tolerances.
    pub no_plan: Option<ScenePlanError>,
}

/// `None` if `progress` cancelled it.
pub fn bench(
    file: &SceneFile,
    extent: TradeExtent,
    progress: &dyn Progress,
) -> Result<Option<SceneBench>, String> {
    let Some(curves) = measure_scene(extent, progress)? else { return Ok(None) };
    let methods = [201, 401]
        .into_iter()
        .flat_map(|nodes| {
            [SurfaceMethod::Envelope, SurfaceMethod::Chain].map(|method| (nodes, method))
        })
        .map(|(nodes, method)| speed(nodes, method))
        .collect::<Result<_, _>>()?;
    let (plan, no_plan) = match plan_scene(file, &curves, 1.0) {
        Ok(plan) => (Some(plan), None),
        Err(why) => (None, Some(why)),
    };
    let meshes = curves.meshes.iter().map(|p| (Some(p.error_mm), p.cost_us));
    let steps = curves.steps.iter().map(|p| (Some(p.error_n), p.cost_us));
    Ok(Some(SceneBench {
        machine: trade::this_machine(),
        quick: extent == TradeExtent::Quick,
        meshes_on_front: mark_pareto_optimal(&meshes.collect::<Vec<_>>()),
        steps_on_front: mark_pareto_optimal(&steps.collect::<Vec<_>>()),
        curves,
        methods,
        plan,
        no_plan,
    }))
}

/// The cheapest way that a scene's tolerances allow.
///
/// Its rate and its body are its own, so that of the measured steps the nearest to its tick alone and of the families the
/// body's own alone are left. A scene of another side and slope with as many nodes is the measured one drawn larger, and its errors of
/// shape are larger in proportion. A cut after so many nodes is another length on every mesh and is not planned; one by movement is off
/// by no more than that movement on any.
pub fn plan_scene(
    file: &SceneFile,
    curves: &SceneCurves,
    slower: f64,
) -> Result<ScenePlan, ScenePlanError> {
    let tick = 1.0 / file.rate_hz;
    let off = |step: &StepPoint| (step.step_s / tick).ln().abs();
    let nearest = curves.steps.iter().map(off).fold(f64::INFINITY, f64::min);
    let mut own = curves.clone();
    own.steps.retain(|step| off(step) <= nearest);
    let larger = file.side_mm * file.slope / (SCENE_SIDE_MM * SCENE_SLOPE);
    own.meshes.iter_mut().for_each(|mesh| mesh.error_mm *= larger);
    own.cuts.retain(|cut| cut.range.is_none());
    for cut in &mut own.cuts {
        cut.error_mm = cut.threshold_mm;
    }
    own.families.retain(|family| family.family == FAMILY);
    let needs = SceneRequirements {
        force: Tolerance::PercentOfThreshold(file.tolerances.force_percent),
        peak: SCENE_PEAK,
        shape_mm: file.tolerances.shape_mm,
        budget_us: file.tolerances.tick_us,
    };
    plan(&needs, &own, slower)
}

#[must_use]
pub fn scene_from_plan(file: &SceneFile, plan: &ScenePlan) -> SceneFile {
    SceneFile {
        nodes: Some(plan.mesh.nodes as usize),
        cut_nodes: None,
        cut_mm: plan.cut.threshold_mm,
        scheme: plan.step.scheme,
        ..file.clone()
    }
}

/// The plan after a tick took longer than it should.
pub fn replan_scene(
    file: &SceneFile,
    curves: &SceneCurves,
    before: &ScenePlan,
    measured_us: f64,
) -> Result<ScenePlan, ScenePlanError> {
    plan_scene(file, curves, updated_cost_factor(before, 1.0, measured_us))
}

/// A poke that reaches half of the way to the border, repeated in every tick.
fn speed(nodes: usize, method: SurfaceMethod) -> Result<MethodSpeed, String> {
    let grid = Grid::new(nodes, nodes, 1.0).map_err(|err| err.to_string())?;
    let middle = 0.5 * (nodes - 1) as f64;
    let contact =
        [SurfaceContact { x: middle, y: middle, z: -0.5 * middle, side: ContactSide::Push }];
    let field = HeightField::flat(grid, 1.0).map_err(|err| err.to_string())?;
    let mut surface = Surface::new(field, method, SurfaceRecovery::ELASTIC, Cut::NONE);
    let watch = Stopwatch::start();
    let mut moved = 0;
    while watch.seconds() < TIMED_S {
        for _ in 0..10 {
            moved += surface.tick(&contact).moved.moved;
        }
    }
    Ok(MethodSpeed {
        method: method.name(),
        nodes,
        nodes_per_ms: moved as f64 / (1e3 * watch.seconds()),
    })
}
