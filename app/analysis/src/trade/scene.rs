//! The cost of accuracy in a scene: mesh, influence cut, integrator and step, family. Errors are computed, times measured.

use super::timing::{self, Job};
use super::{TradeExtent, families, integrators, paths};
use crate::progress::Progress;
use palpate_haptics::surface::{
    ContactSide, Cut, CutPoint, FamilyPoint, HandPoke, MeshPoint, PokeScene, REFERENCE_NODES,
    SceneCurves, StepPoint, Surface, SurfaceContact, SurfaceMethod, SurfaceRecovery,
};
use palpate_model::units::{Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::Scheme;
use palpate_rheology::trade::{FamilyRow, MeasuredCost};
use std::hint::black_box;

/// Tick of the scene in s.
const TICK: f64 = 1e-3;

/// Nodes along a side, and those of the mesh that stands for the truth.
const MESHES: [usize; 5] = [51, 101, 201, 401, 801];
const MESHES_QUICK: [usize; 3] = [51, 101, 201];
const REFERENCE_QUICK: usize = 401;

/// Nodes along a side of the mesh on which cuts are tried.
const CUT_NODES: usize = 201;

/// Cuts by steps from the contact, then by least movement in mm; the absence of one first.
const CUTS: [(Option<u32>, f64); 8] = [
    (None, 0.0),
    (Some(60), 0.0),
    (Some(50), 0.0),
    (Some(40), 0.0),
    (Some(20), 0.0),
    (None, 0.01),
    (None, 0.1),
    (None, 0.5),
];

/// Steps in s.
const STEPS: [f64; 5] = [0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3];

/// The poke that forces are compared on: 10 mm and back in 2 s.
const POKE: HandPoke = HandPoke { depth: 10.0, duration: 2.0 };

/// Largest force along it, of the body of the source thesis; a scene's tolerance of force is meant at it.
pub const SCENE_PEAK: Newtons = Newtons(2.19);

/// Side of the tissue that is measured, in mm.
pub const SCENE_SIDE_MM: f64 = 40.0;

/// Its steepest slope.
pub const SCENE_SLOPE: f64 = 0.4;

/// 40 mm of flat tissue, 5 mm deep pokes on and off the nodes, with a slope that lets a poke reach 12.5 mm.
fn pokes() -> PokeScene {
    PokeScene {
        extent: SCENE_SIDE_MM,
        slope: SCENE_SLOPE,
        depth: 5.0,
        rest: |_, _| 0.0,
        places: vec![[20.0, 20.0], [13.37, 24.81], [29.13, 17.77], [3.21, 38.55]],
    }
}

/// A surface whose tool stays in its middle, so that every tick recovers and pushes all that a poke reaches.
fn job<'a>(scene: &PokeScene, nodes: usize, cut: Cut) -> Result<Job<'a>, String> {
    let field = scene.field(nodes).map_err(|err| err.to_string())?;
    let tau = Seconds(ModifiedKelvin::THESIS.tau_eps);
    let recovery = SurfaceRecovery::new(tau, Seconds(TICK)).map_err(|err| err.to_string())?;
    let mut surface = Surface::new(field, SurfaceMethod::Envelope, recovery, cut);
    let contact = [SurfaceContact {
        x: 0.5 * scene.extent,
        y: 0.5 * scene.extent,
        z: -scene.depth,
        side: ContactSide::Push,
    }];
    Ok(Job {
        per_call: 1.0,
        call: Box::new(move || {
            black_box(surface.tick(black_box(&contact)));
        }),
    })
}

/// The curves of this machine; none if `progress` ended it.
pub fn measure_scene(
    extent: TradeExtent,
    progress: &dyn Progress,
) -> Result<Option<SceneCurves>, String> {
    let meshes = extent.choose(&MESHES[..], &MESHES_QUICK);
    let reference = extent.choose(REFERENCE_NODES, REFERENCE_QUICK);
    let total = meshes.len() + 2 + timing::rounds(extent);
    let mut done = 0;
    let mut next = |what: &str| {
        done += 1;
        progress.report(done - 1, total, what).continue_value()
    };
    let scene = pokes();
    let mut curves = SceneCurves::default();
    let mut jobs = Vec::new();
    for &nodes in meshes {
        let Some(()) = next(&format!("shape error on {nodes} x {nodes} nodes")) else {
            return Ok(None);
        };
        let error = scene.mesh_error_against(nodes, reference);
        curves.meshes.push(MeshPoint {
            nodes: nodes as u32,
            error_mm: error.map_err(|err| err.to_string())?.linf_mm,
            cost_us: 0.0,
        });
        jobs.push(job(&scene, nodes, Cut::NONE)?);
    }
    let Some(()) = next("shape with a cut") else { return Ok(None) };
    for (range, threshold_mm) in CUTS {
        let cut = Cut::new(range, threshold_mm).map_err(|err| err.to_string())?;
        let error = scene.cut_error(CUT_NODES, cut);
        curves.cuts.push(CutPoint {
            range,
            threshold_mm,
            error_mm: error.map_err(|err| err.to_string())?.linf_mm,
            cost_share: 1.0,
        });
        jobs.push(job(&scene, CUT_NODES, cut)?);
    }
    let Some(()) = next("force errors of integrators and families") else { return Ok(None) };
    let body = ModifiedKelvin::THESIS.into();
    for scheme in Scheme::ALL {
        for step_s in STEPS {
            // An unstable scheme has no point in the picture.
            if let Ok([error_n, _]) = POKE.force_error::<3>(&body, scheme, step_s) {
                curves.steps.push(StepPoint { scheme, step_s, error_n, cost_us: 0.0 });
            }
        }
        jobs.push(integrators::job::<f64>(scheme));
    }
    let mut rows = families::rows(extent, &paths::ReferencePaths::new()?)?;
    rows.retain(|row| row.target == families::THESIS);
    jobs.extend(families::jobs(&rows)?);
    let costs = timing::measure(&mut jobs, extent, &mut || {
        done += 1;
        progress.report(done - 1, total, "times")
    });
    let Some(costs) = costs else { return Ok(None) };
    with_times(&mut curves, &costs, &rows);
    Ok(Some(curves))
}

/// Gives every point its time; `costs` are those of meshes, cuts, integrators and families in turn.
fn with_times(curves: &mut SceneCurves, costs: &[MeasuredCost], rows: &[FamilyRow]) {
    let mut micros = costs.iter().map(|cost: &MeasuredCost| 1e-3 * cost.ns);
    let of_meshes = micros.by_ref().take(curves.meshes.len());
    let slots = curves.meshes.iter_mut().map(|point| &mut point.cost_us);
    slots.zip(of_meshes).for_each(|(slot, cost)| *slot = cost);
    let of_cuts: Vec<f64> = micros.by_ref().take(CUTS.len()).collect();
    for (point, cost) in curves.cuts.iter_mut().zip(&of_cuts) {
        // Other work may have made a cut look dearer than none.
        point.cost_share = (cost / of_cuts[0]).min(1.0);
    }
    let of_schemes: Vec<f64> = micros.by_ref().take(Scheme::ALL.len()).collect();
    for point in &mut curves.steps {
        let scheme = Scheme::ALL.iter().position(|one| *one == point.scheme);
        // A step longer than a tick is made in one tick of several, which must have the time.
        point.cost_us = of_schemes[scheme.unwrap_or(0)] * (TICK / point.step_s).max(1.0);
    }
    let point = |(row, cost_us): (&FamilyRow, f64)| FamilyPoint {
        family: row.family.clone(),
        error_n: row.error_n,
        cost_us,
    };
    curves.families = rows.iter().zip(micros).map(point).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_haptics::surface::{SceneRequirements, plan};
    use palpate_rheology::tolerance::Tolerance;
    use std::ops::ControlFlow;

    #[test]
    fn what_is_measured_can_be_planned_from_and_finer_is_more_exact() {
        let go_on = |_: usize, _: usize, _: &str| ControlFlow::Continue(());
        let curves = measure_scene(TradeExtent::Quick, &go_on).unwrap().unwrap();
        for pair in curves.meshes.windows(2) {
            assert!(pair[1].error_mm < pair[0].error_mm, "{pair:?}");
            assert!(pair[1].cost_us > 0.0, "{pair:?}");
        }
        // Without a cut nothing is left out but rounding, of heights of some millimetres.
        assert!(curves.cuts[0].error_mm < 1e-13, "{:?}", curves.cuts[0]);
        assert_eq!(curves.cuts[0].cost_share, 1.0);
        assert!(curves.cuts.iter().skip(1).all(|cut| cut.error_mm <= 5.0));
        let exact = curves.steps.iter().filter(|one| one.scheme == Scheme::Exact);
        assert_eq!(exact.count(), STEPS.len());
        let body = ModifiedKelvin::THESIS.into();
        let [_, peak] = POKE.force_error::<3>(&body, Scheme::Exact, 1e-3).unwrap();
        assert!((peak - SCENE_PEAK.0).abs() < 0.01, "{peak}");
        let needs = SceneRequirements {
            force: Tolerance::PercentOfPeak(50.0),
            peak: SCENE_PEAK,
            shape_mm: 10.0,
            budget_us: 1e6,
        };
        let chosen = plan(&needs, &curves, 1.0).unwrap();
        // Everything is within 10 mm, and on a busy machine a fine mesh can take less than a coarse one.
        let cheapest = curves.meshes.iter().min_by(|a, b| a.cost_us.total_cmp(&b.cost_us));
        assert_eq!(Some(&chosen.mesh), cheapest);
        let ended =
            measure_scene(
                TradeExtent::Quick,
                &|_: usize, _: usize, _: &str| ControlFlow::Break(()),
            );
        assert!(ended.unwrap().is_none());
    }
}
