//! What meshes, cuts and steps cost in exactness, and the planner against trying everything.

use palpate_haptics::surface::{
    Cut, CutPoint, FamilyPoint, HandPoke, MeshPoint, PokeScene, SceneCurves, ScenePlan,
    SceneRequirements, StepPoint, plan, updated_cost_factor,
};
use palpate_model::Newtons;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::integrators::{Scheme, SeriesBody};
use palpate_rheology::tolerance::Tolerance;
use palpate_test_support::record::Noise;

const SLOPE: f64 = 0.4;

fn scene(rest: fn(f64, f64) -> f64) -> PokeScene {
    PokeScene {
        extent: 40.0,
        slope: SLOPE,
        depth: 5.0,
        rest,
        places: vec![[20.0, 20.0], [13.37, 24.81], [29.13, 17.77], [3.21, 38.55]],
    }
}

#[test]
fn the_error_of_a_mesh_falls_with_its_spacing() {
    for rest in [|_: f64, _: f64| 0.0, |x: f64, y: f64| (0.3 * x).sin() + 0.02 * y] {
        let scene = scene(rest);
        let errors: Vec<_> = [51, 101, 201, 401]
            .map(|nodes| (nodes, scene.mesh_error_against(nodes, 1201).unwrap()))
            .into();
        for (nodes, error) in &errors {
            let spacing = 40.0 / (*nodes as f64 - 1.0);
            // Half a spacing along each axis to the nearest node, and as much for a bent cell.
            assert!(error.linf_mm <= 2.0 * SLOPE * (spacing + 40.0 / 1200.0), "{nodes} {error:?}");
            assert!(error.l2_mm < error.linf_mm && error.l2_mm > 0.0);
        }
        let order = |pick: fn(&palpate_haptics::surface::ShapeError) -> f64| {
            (pick(&errors[0].1) / pick(&errors[3].1)).log2() / 3.0
        };
        for order in [order(|e| e.l2_mm), order(|e| e.linf_mm)] {
            assert!((0.6..1.5).contains(&order), "{order}");
        }
        let itself = scene.mesh_error_against(101, 101).unwrap();
        assert!(itself.linf_mm < 1e-12);
    }
    assert!(scene(|_, _| 0.0).mesh_error_against(1, 101).is_err());
    let steep = scene(|x, _| x).mesh_error_against(51, 101).unwrap_err();
    assert!(steep.to_string().contains("steeper slope"));
}

#[test]
fn the_error_of_a_cut_is_at_most_its_threshold_or_what_is_left_at_its_range() {
    let scene = scene(|_, _| 0.0);
    let (nodes, spacing) = (201, 0.2);
    let error = |range, threshold| {
        let cut = Cut::new(range, threshold).unwrap();
        scene.cut_error(nodes, cut).unwrap()
    };
    let mut last = 0.0;
    for threshold in [0.0, 0.01, 0.1, 0.5] {
        let error = error(None, threshold).linf_mm;
        assert!(error <= threshold + 1e-12 && error >= last - 1e-12);
        last = error;
    }
    for range in [5u32, 20, 40, 80] {
        // From flat, the first node left out would have moved by this.
        let left: f64 = 5.0 - SLOPE * spacing * f64::from(range + 1);
        assert!((error(Some(range), 0.0).linf_mm - left.max(0.0)).abs() < 1e-9, "{range}");
    }
}

#[test]
fn the_error_of_force_falls_with_the_order_of_the_integrator() {
    let body: SeriesBody<3> = ModifiedKelvin::THESIS.into();
    let poke = HandPoke { depth: 10.0, duration: 2.0 };
    for (scheme, order) in [
        (Scheme::ExplicitEuler, 1.0),
        (Scheme::ImplicitEuler, 1.0),
        (Scheme::ExponentialLeft, 1.0),
        (Scheme::Trapezoid, 2.0),
        (Scheme::ExponentialFirstOrder, 2.0),
        // Exact for straight paths; this one is bent.
        (Scheme::Exact, 2.0),
    ] {
        let [coarse, fine] =
            [4e-3, 1e-3].map(|step| poke.force_error(&body, scheme, step).unwrap());
        let seen = (coarse[0] / fine[0]).log2() / 2.0;
        assert!((seen - order).abs() < 0.15, "{scheme:?} {seen}");
        assert!((coarse[1] - fine[1]).abs() < 1e-4 * fine[1]);
    }
    for step in [0.0, f64::NAN, 1e-12, 3.0] {
        assert!(poke.force_error(&body, Scheme::ExplicitEuler, step).is_err());
    }
}

fn curves(random: &mut Noise) -> SceneCurves {
    let count = |random: &mut Noise| 1 + (6.0 * random.uniform()) as usize;
    // Few values, so that there are ties.
    let value = |most: f64, random: &mut Noise| (random.uniform() * 12.0).floor() / 12.0 * most;
    let mut curves = SceneCurves::default();
    for nodes in 0..count(random) {
        curves.meshes.push(MeshPoint {
            nodes: nodes as u32,
            error_mm: value(1.0, random),
            cost_us: value(100.0, random),
        });
    }
    for range in 0..count(random) {
        curves.cuts.push(CutPoint {
            range: Some(range as u32),
            threshold_mm: 0.0,
            error_mm: value(0.5, random),
            cost_share: value(1.0, random),
        });
    }
    for _ in 0..count(random) {
        curves.steps.push(StepPoint {
            scheme: Scheme::Exact,
            step_s: 1e-3,
            error_n: value(0.1, random),
            cost_us: value(3.0, random),
        });
    }
    for _ in 0..count(random) {
        curves.families.push(FamilyPoint {
            family: "series-3".into(),
            error_n: value(0.1, random),
            cost_us: value(3.0, random),
        });
    }
    curves
}

/// Cost and errors of every combination.
fn all(curves: &SceneCurves, slower: f64) -> Vec<[f64; 3]> {
    let mut all = Vec::new();
    for mesh in &curves.meshes {
        for cut in &curves.cuts {
            for step in &curves.steps {
                for family in &curves.families {
                    let shape = slower * (mesh.cost_us * cut.cost_share);
                    let force = slower * (step.cost_us + family.cost_us);
                    let errors = [mesh.error_mm + cut.error_mm, step.error_n + family.error_n];
                    all.push([shape + force, errors[0], errors[1]]);
                }
            }
        }
    }
    all
}

fn of(plan: &ScenePlan) -> [f64; 3] {
    [plan.cost_us, plan.shape_error_mm, plan.force_error_n]
}

#[test]
fn the_plan_is_the_cheapest_of_all_that_hold() {
    let mut random = Noise::seeded(1);
    let mut outcomes = [0; 3];
    for _ in 0..3000 {
        let curves = curves(&mut random);
        let needs = SceneRequirements {
            force: Tolerance::PercentOfThreshold(25.0),
            peak: Newtons(8.0 * random.uniform()),
            shape_mm: 1.5 * random.uniform(),
            budget_us: 80.0 * random.uniform(),
        };
        let slower = 1.0 + random.uniform();
        // A quarter of a tenth of the peak force.
        let force = 0.01 * 25.0 * 0.1 * needs.peak.0;
        let all = all(&curves, slower);
        let within = all.iter().filter(|[cost, shape, newtons]| {
            *cost <= needs.budget_us && *shape <= needs.shape_mm && *newtons <= force
        });
        let cheapest = within.map(|one| one[0]).fold(f64::INFINITY, f64::min);
        match plan(&needs, &curves, slower) {
            Ok(plan) => {
                outcomes[0] += 1;
                let found = of(&plan);
                assert!(all.contains(&found));
                assert_eq!(found[0], cheapest);
                assert!(found[1] <= needs.shape_mm && found[2] <= force);
            }
            Err(none) => {
                assert_eq!(cheapest, f64::INFINITY, "{}", none.reason);
                let factor = |one: &[f64; 3]| (one[1] / needs.shape_mm).max(one[2] / force);
                let payable = all.iter().filter(|one| one[0] <= needs.budget_us);
                let least = payable.map(factor).fold(f64::INFINITY, f64::min);
                match none.nearest {
                    Some(nearest) => {
                        outcomes[1] += 1;
                        assert!(all.contains(&of(&nearest)));
                        assert_eq!(factor(&of(&nearest)), least);
                        assert!(least > 1.0 && nearest.cost_us <= needs.budget_us);
                    }
                    None => {
                        outcomes[2] += 1;
                        assert_eq!(least, f64::INFINITY);
                    }
                }
            }
        }
    }
    assert!(outcomes.iter().all(|count| *count > 50), "{outcomes:?}");
}

/// Curves as they look.
fn measured() -> SceneCurves {
    let mesh = |nodes, error_mm, cost_us| MeshPoint { nodes, error_mm, cost_us };
    let cut =
        |range, error_mm, cost_share| CutPoint { range, threshold_mm: 0.0, error_mm, cost_share };
    let step =
        |step_s, error_n, cost_us| StepPoint { scheme: Scheme::Exact, step_s, error_n, cost_us };
    let family =
        |family: &str, error_n, cost_us| FamilyPoint { family: family.into(), error_n, cost_us };
    SceneCurves {
        meshes: vec![mesh(51, 0.4, 3.0), mesh(201, 0.1, 40.0), mesh(801, 0.02, 600.0)],
        cuts: vec![cut(None, 0.0, 1.0), cut(Some(40), 0.05, 0.4)],
        steps: vec![step(1e-3, 1e-3, 0.05), step(5e-4, 2e-4, 0.1)],
        families: vec![family("series-3", 0.005, 0.1), family("kelvin", 0.2, 0.08)],
    }
}

#[test]
fn a_plan_says_what_it_dropped_and_a_missed_budget_makes_another() {
    let curves = measured();
    let needs = SceneRequirements {
        force: Tolerance::PercentOfThreshold(10.0),
        peak: Newtons(6.0),
        shape_mm: 0.12,
        budget_us: 100.0,
    };
    let first = plan(&needs, &curves, 1.0).unwrap();
    assert_eq!((first.mesh.nodes, first.cut.range), (201, None));
    assert_eq!((first.family.family.as_str(), first.step.step_s), ("series-3", 1e-3));
    let dropped: Vec<_> = first.dropped.iter().map(|one| (one.what.as_str(), one.error)).collect();
    assert!(dropped[0].0.contains("801") && dropped[0].0.contains("201") && dropped[0].1 == 0.1);
    assert_eq!(first.dropped[0].saved_us, 560.0);
    assert_eq!(dropped.len(), 2);
    assert!(dropped[1].0.contains("0.0005 s") && dropped[1].1 == 1e-3);
    assert_eq!(first.inert.map(|(name, _)| name), ["MinDist", "MaxDist"]);
    // It took longer than it may: with that, nothing holds 0.12 mm, and the refusal names the nearest.
    let again = updated_cost_factor(&first, 1.0, 130.0);
    let none = plan(&needs, &curves, again).unwrap_err();
    assert!(none.reason.contains("130.0 us") && none.reason.contains("100 us"), "{}", none.reason);
    let nearest = none.nearest.unwrap();
    assert_eq!((nearest.mesh.nodes, nearest.cut.range), (201, Some(40)));
    assert!(nearest.dropped.iter().any(|one| one.what.contains("40 nodes")));
    assert!((nearest.shape_error_mm - 0.15).abs() < 1e-12);
    // The factor makes the plan cost what it was seen to; faster ticks and no times change nothing.
    assert!((again * first.cost_us - 130.0).abs() < 1e-9);
    for harmless in [1.0, 0.0, f64::NAN, f64::INFINITY] {
        assert_eq!(updated_cost_factor(&first, 2.0, harmless), 2.0);
    }
}

#[test]
fn what_cannot_be_planned_is_refused_in_a_sentence() {
    let needs = SceneRequirements {
        force: Tolerance::PercentOfThreshold(10.0),
        peak: Newtons(6.0),
        shape_mm: 0.12,
        budget_us: 100.0,
    };
    let why = |needs: SceneRequirements, curves: &SceneCurves| {
        plan(&needs, curves, 1.0).unwrap_err().reason
    };
    let good = measured();
    for (shape_mm, budget_us) in [(f64::NAN, 1.0), (0.0, 1.0), (0.1, f64::INFINITY), (0.1, -1.0)] {
        let needs = SceneRequirements { shape_mm, budget_us, ..needs };
        assert!(why(needs, &good).contains("not possible"));
    }
    let finer = SceneRequirements { shape_mm: 0.01, ..needs };
    let said = why(finer, &good);
    assert!(said.contains("0.01 mm") && said.contains("0.02"));
    let firmer = SceneRequirements { peak: Newtons(0.1), ..needs };
    assert!(why(firmer, &good).contains("force"));
    let hurried = SceneRequirements { budget_us: 0.01, ..needs };
    assert!(why(hurried, &good).contains("budget"));
    let mut empty = good.clone();
    empty.cuts.clear();
    assert!(why(needs, &empty).contains("no cut"));
    let mut bad = good;
    bad.steps[0].cost_us = f64::NAN;
    assert!(why(needs, &bad).contains("integrator"));
}
