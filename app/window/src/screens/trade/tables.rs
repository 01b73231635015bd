//! The curves of accuracy over cost as points and table rows.

use crate::widgets::{Column, Emphasis, TableRow};
use palpate_analysis::report::scatter::ScatterPoint;
use palpate_analysis::trade::text::{digits, plain, time};
use palpate_haptics::surface::{SceneCurves, ScenePlan};
use palpate_rheology::trade::{TradeCurves, find_pareto_front};

/// A curve as points and table rows.
pub(super) struct TradeTable {
    pub axes: [&'static str; 2],
    pub marks: Vec<ScatterPoint>,
    pub columns: Vec<Column>,
    pub rows: Vec<TableRow>,
    /// The mark of what is recommended.
    pub chosen: Option<usize>,
}

impl TradeTable {
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
            chosen: None,
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
            self.marks
                .push(ScatterPoint { at: [cost, error], label: [String::new(), cells.join("\n")] });
        }
        let emphasis = match (is_front, at[1]) {
            (true, _) => Emphasis::Marked,
            (false, None) => Emphasis::Quiet,
            (false, Some(_)) => Emphasis::Plain,
        };
        self.rows.push(TableRow { cells, emphasis, hint });
    }

    /// With the front's rows first.
    fn finished(mut self) -> Self {
        self.rows.sort_by_key(|row| row.emphasis != Emphasis::Marked);
        self
    }
}

pub(super) fn integrators(curves: &TradeCurves) -> TradeTable {
    let mut shown = TradeTable::new(
        ["ns per second of simulated time", "error (% of peak force)"],
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
        shown.add([Some(row.second_ns), error], row.front, cells, row.refused.clone());
    }
    shown.finished()
}

pub(super) fn families(curves: &TradeCurves) -> TradeTable {
    let mut shown = TradeTable::new(
        ["ns a step", "error (% of peak force)"],
        &["family and its target", "a step", "error (%)"],
    );
    for row in &curves.families {
        let error = 100.0 * row.error_n / row.peak_n;
        let cells =
            vec![format!("{}, {}", row.family, row.target), time(row.cost.ns), digits(error)];
        // Fronts belong to one target each and would cross in one picture.
        shown.add([Some(row.cost.ns), Some(error)], false, cells, None);
        if let Some(last) = shown.rows.last_mut().filter(|_| row.front) {
            last.emphasis = Emphasis::Marked;
        }
    }
    shown.finished()
}

pub(super) fn fits(curves: &TradeCurves) -> TradeTable {
    let mut shown = TradeTable::new(
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

/// One point of a curve of a scene.
struct ScenePoint {
    words: String,
    cost: f64,
    error: f64,
    is_planned: bool,
}

/// Points with no error at all have no place on a logarithmic axis and are in the table alone.
fn scene_table(
    axes: [&'static str; 2],
    head: &str,
    points: impl Iterator<Item = ScenePoint>,
) -> TradeTable {
    let mut table = TradeTable::new(axes, &[head, axes[0], axes[1]]);
    let points: Vec<ScenePoint> = points.collect();
    let places: Vec<[f64; 2]> = points.iter().map(|one| [one.cost, one.error]).collect();
    let best = find_pareto_front(&places);
    for (index, mut one) in points.into_iter().enumerate() {
        if one.is_planned {
            one.words.push_str(" (planned)");
        }
        let error = Some(one.error).filter(|error| *error > 0.0);
        let cells = vec![one.words, digits(one.cost), digits(one.error)];
        table.add([Some(one.cost), error], best.contains(&index), cells, None);
        if one.is_planned && error.is_some() {
            table.chosen = Some(table.marks.len() - 1);
        }
    }
    table.finished()
}

pub(super) fn meshes(curves: &SceneCurves, planned: Option<&ScenePlan>) -> TradeTable {
    let points = curves.meshes.iter().map(|point| ScenePoint {
        words: format!("{0} x {0} nodes", point.nodes),
        cost: point.cost_us,
        error: point.error_mm,
        is_planned: planned.is_some_and(|plan| plan.mesh == *point),
    });
    scene_table(["µs a tick", "error of shape (mm)"], "mesh", points)
}

/// Cuts of the influence of a contact.
pub(super) fn cuts(curves: &SceneCurves, planned: Option<&ScenePlan>) -> TradeTable {
    let points = curves.cuts.iter().map(|point| ScenePoint {
        words: match (point.range, point.threshold_mm > 0.0) {
            (None, false) => "no cut".to_owned(),
            _ => point.description(),
        },
        cost: 100.0 * point.cost_share,
        error: point.error_mm,
        is_planned: planned.is_some_and(|plan| plan.cut == *point),
    });
    scene_table(["% of the time", "error of shape (mm)"], "influence ends", points)
}

/// Integrators and time steps of a scene.
pub(super) fn steps(curves: &SceneCurves, planned: Option<&ScenePlan>) -> TradeTable {
    let points = curves.steps.iter().map(|point| ScenePoint {
        words: format!("{}, {} ms", point.scheme.name(), plain(1e3 * point.step_s)),
        cost: point.cost_us,
        error: point.error_n,
        is_planned: planned.is_some_and(|plan| plan.step == *point),
    });
    scene_table(["µs a tick", "error of force (N)"], "integrator and step", points)
}

/// A plan in words.
pub(super) fn plan_lines(plan: &ScenePlan) -> Vec<String> {
    let cut = match (plan.cut.range, plan.cut.threshold_mm > 0.0) {
        (None, false) => "without a cut".to_owned(),
        _ => format!("cut at {}", plan.cut.description()),
    };
    let mut lines = vec![
        format!("{0} x {0} nodes, {cut}", plan.mesh.nodes),
        format!(
            "{} at {} ms, family {}",
            plan.step.scheme.name(),
            plain(1e3 * plan.step.step_s),
            plan.family.family
        ),
        format!(
            "a tick takes {} µs; the shape error is at most {} mm and the force error {} N",
            digits(plan.cost_us),
            digits(plan.shape_error_mm),
            digits(plan.force_error_n)
        ),
    ];
    lines.extend(plan.dropped.iter().map(|one| {
        format!(
            "left out: {} (error {} {}, {} µs saved)",
            one.what,
            digits(one.error),
            one.unit,
            digits(one.saved_us)
        )
    }));
    let inert = plan.inert.iter();
    lines.extend(inert.map(|(part, why)| format!("{part} has no effect: {why}")));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_haptics::surface::MeshPoint;

    fn curves(points: &[(u32, f64, f64)]) -> SceneCurves {
        let mesh =
            |&(nodes, error_mm, cost_us): &(u32, f64, f64)| MeshPoint { nodes, error_mm, cost_us };
        SceneCurves { meshes: points.iter().map(mesh).collect(), ..SceneCurves::default() }
    }

    #[test]
    fn the_front_comes_first_and_exact_points_are_listed_but_not_drawn() {
        // The second is dearer and worse than the third; the last is exact.
        let measured = curves(&[(51, 0.5, 1.0), (101, 0.4, 5.0), (201, 0.2, 4.0), (401, 0.0, 9.0)]);
        let shown = meshes(&measured, None);
        assert_eq!(shown.marks.len(), 3);
        let all: Vec<Emphasis> = shown.rows.iter().map(|row| row.emphasis).collect();
        let marked = all.iter().filter(|one| **one == Emphasis::Marked).count();
        assert_eq!(marked, 3, "{:?}", shown.rows);
        assert!(shown.rows[3].cells[0].starts_with("101 x 101"));
        assert_eq!(shown.chosen, None);
    }
}
