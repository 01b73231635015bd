//! Measured error and cost of a scene's parts.

use palpate_rheology::integrators::Scheme;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshPoint {
    /// Nodes along a side.
    pub nodes: u32,
    /// Error of shape in mm.
    pub error_mm: f64,
    /// Time of a tick without a cut in microseconds.
    pub cost_us: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutPoint {
    /// Most steps from a contact; null for none.
    pub range: Option<u32>,
    /// Least movement in mm.
    pub threshold_mm: f64,
    /// Error of shape in mm.
    pub error_mm: f64,
    /// Share of a mesh's time that remains with this cut.
    pub cost_share: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepPoint {
    pub scheme: Scheme,
    /// Step in s.
    pub step_s: f64,
    /// Error of force in N.
    pub error_n: f64,
    /// Time of a tick in microseconds.
    pub cost_us: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FamilyPoint {
    pub family: String,
    /// Error of its fit in N.
    pub error_n: f64,
    /// Added time of a tick in microseconds.
    pub cost_us: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneCurves {
    pub meshes: Vec<MeshPoint>,
    /// Cuts, the absence of one among them.
    pub cuts: Vec<CutPoint>,
    pub steps: Vec<StepPoint>,
    pub families: Vec<FamilyPoint>,
}

/// Two points, their error together and their cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub indices: [usize; 2],
    pub error: f64,
    pub cost: f64,
}

impl SceneCurves {
    /// Why nothing can be planned from them, if so.
    pub(super) fn checked(&self) -> Result<(), String> {
        let meshes = self.meshes.iter().map(|p| (p.error_mm, p.cost_us));
        let cuts = self.cuts.iter().map(|p| (p.error_mm, p.cost_share));
        let steps = self.steps.iter().map(|p| (p.error_n, p.cost_us));
        let families = self.families.iter().map(|p| (p.error_n, p.cost_us));
        let curves: [(&str, Vec<(f64, f64)>); 4] = [
            ("mesh", meshes.collect()),
            ("cut", cuts.collect()),
            ("integrator", steps.collect()),
            ("family", families.collect()),
        ];
        for (what, points) in curves {
            if points.is_empty() {
                return Err(format!("no {what} was measured; measure the scene first"));
            }
            let good = |value: f64| value >= 0.0 && value.is_finite();
            if let Some((error, cost)) = points.iter().find(|(e, c)| !(good(*e) && good(*c))) {
                return Err(format!(
                    "the measurement of the scene is invalid: a {what} has the error {error} and the cost {cost}; measure again"
                ));
            }
        }
        Ok(())
    }

    /// Every mesh with every cut.
    pub(super) fn shape_pairs(&self, slower: f64) -> Vec<Pair> {
        pairs(&self.meshes, &self.cuts, |mesh, cut| {
            (mesh.error_mm + cut.error_mm, slower * (mesh.cost_us * cut.cost_share))
        })
    }

    /// Every step with every family.
    pub(super) fn force_pairs(&self, slower: f64) -> Vec<Pair> {
        pairs(&self.steps, &self.families, |step, family| {
            (step.error_n + family.error_n, slower * (step.cost_us + family.cost_us))
        })
    }
}

fn pairs<A, B>(first: &[A], second: &[B], sum: impl Fn(&A, &B) -> (f64, f64)) -> Vec<Pair> {
    let indices = (0..first.len()).flat_map(|i| (0..second.len()).map(move |j| [i, j]));
    let pair = |indices: [usize; 2]| {
        let (error, cost) = sum(&first[indices[0]], &second[indices[1]]);
        Pair { indices, error, cost }
    };
    indices.map(pair).collect()
}

impl CutPoint {
    pub fn description(&self) -> String {
        match (self.range, self.threshold_mm > 0.0) {
            (Some(range), true) => {
                format!("{range} nodes or where nodes move < {} mm", self.threshold_mm)
            }
            (Some(range), false) => format!("{range} nodes"),
            (None, _) => format!("where nodes move < {} mm", self.threshold_mm),
        }
    }
}
