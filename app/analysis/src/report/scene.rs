//! Texts on the run, the plan and the curves of a scene.

use super::haptics::run_text;
use crate::scene::SceneRun;
use crate::scene_bench::SceneBench;
use crate::scene_device::DeviceReport;
use palpate_haptics::surface::ScenePlan;

#[must_use]
pub fn played_text(played: &SceneRun) -> String {
    let tissue = match (&played.mesh, played.nodes) {
        (Some(mesh), _) => {
            format!("{} triangles of {}, materials: {}", mesh.triangles, mesh.file, mesh.materials)
        }
        (None, nodes) => format!("{0} x {0} nodes", nodes.unwrap_or_default()),
    };
    let mut lines = vec![format!(
        "scene '{}', {tissue}, path {}: {} ticks, depth up to {:.2} mm, force up to {:.2} N",
        played.name, played.path, played.ticks, played.depth_max_mm, played.force_max_n
    )];
    for (why, share) in &played.why {
        lines.push(format!("{:>4.0} %  {why}", 100.0 * share));
    }
    if let Some(device) = &played.device {
        lines.push(format!(
            "device: {} reports, {} that could not be, connection lost {} times; at the end {}",
            device.reports, device.faults, device.losses, device.stop
        ));
    }
    lines.push(run_text(&played.paced));
    let work = 1e6 * played.paced.statistics.work.p99_9.0;
    lines.push(if played.is_within_budget {
        format!(
            "999 ticks in a thousand take {work:.0} us or less, within the budget of {} us",
            played.tick_us
        )
    } else {
        format!(
            "one tick in a thousand takes more than {work:.0} us, but the budget is {} us; use fewer {}, or end other programs",
            played.tick_us,
            if played.mesh.is_some() { "triangles" } else { "nodes" }
        )
    });
    lines.push(format!("surface {}", played.surface_hash));
    lines.join("\n")
}

/// What is to be known of a device before the first touch.
#[must_use]
pub fn device_lines(report: &DeviceReport) -> Vec<String> {
    let mut lines = vec![format!(
        "{}: a round trip takes {:.2} ms, 99 % at most {:.2} ms; the loop is {:.1} ticks late",
        report.description,
        report.round_trip_median_ms,
        report.round_trip_p99_ms,
        report.delay_ticks
    )];
    lines.extend(report.warnings.iter().map(|warning| (*warning).to_owned()));
    lines.extend(report.sentences.iter().cloned());
    lines
}

/// A plan in words: what is taken, what that costs, what was left out.
#[must_use]
pub fn plan_text(plan: &ScenePlan) -> String {
    let mut lines = vec![format!(
        "plan: {0} x {0} nodes, {1}, cut {2}: shape within {3:.3} mm, force within {4:.4} N, {5:.1} us a tick",
        plan.mesh.nodes,
        plan.step.scheme.name(),
        if plan.cut.threshold_mm > 0.0 { plan.cut.description() } else { "nowhere".to_owned() },
        plan.shape_error_mm,
        plan.force_error_n,
        plan.cost_us
    )];
    for dropped in &plan.dropped {
        lines.push(format!(
            "left out: {} (error {:.4} {}, {:.1} us saved)",
            dropped.what, dropped.error, dropped.unit, dropped.saved_us
        ));
    }
    for (part, why) in plan.inert {
        lines.push(format!("without effect: {part}, because {why}"));
    }
    lines.join("\n")
}

/// Measured curves in words; a star marks what nothing beats in both error and time.
#[must_use]
pub fn bench_text(bench: &SceneBench) -> String {
    let star = |is_on: &bool| if *is_on { "*" } else { " " };
    let machine = &bench.machine;
    let mut lines =
        vec![format!("{}, {} cores, {} build", machine.cpu, machine.cores, machine.profile)];
    lines.push("mesh: nodes a side, largest error of shape, time of a tick".to_owned());
    for (mesh, is_on) in bench.curves.meshes.iter().zip(&bench.meshes_on_front) {
        lines.push(format!(
            "{} {:>5}  {:>8.4} mm  {:>8.1} us  {:>8.0} Hz at most",
            star(is_on),
            mesh.nodes,
            mesh.error_mm,
            mesh.cost_us,
            1e6 / mesh.cost_us
        ));
    }
    lines.push("cut: largest error of shape, time in percent of the time without a cut".to_owned());
    for cut in &bench.curves.cuts {
        let words = match (cut.range, cut.threshold_mm > 0.0) {
            (None, false) => "none".to_owned(),
            _ => cut.description(),
        };
        lines.push(format!(
            "  {words:<28}  {:>8.4} mm  {:>5.0} %",
            cut.error_mm,
            100.0 * cut.cost_share
        ));
    }
    lines.push("integrator: step, largest error of force, time of a tick".to_owned());
    for (step, is_on) in bench.curves.steps.iter().zip(&bench.steps_on_front) {
        lines.push(format!(
            "{} {:<30} {:>6.2} ms  {:>9.2e} N  {:>7.3} us",
            star(is_on),
            step.scheme.name(),
            1e3 * step.step_s,
            step.error_n,
            step.cost_us
        ));
    }
    lines.push("nodes moved in a millisecond".to_owned());
    for one in &bench.methods {
        lines.push(format!(
            "  {:<20} {:>5} nodes a side  {:>9.0}",
            one.method, one.nodes, one.nodes_per_ms
        ));
    }
    lines.extend(bench.plan.as_ref().map(plan_text));
    lines.extend(bench.no_plan.as_ref().map(|none| none.reason.clone()));
    lines.join("\n")
}
