//! What the course of the force says: a slip or a tear, and a base under the tissue.

use palpate_model::assessment::{QualityCheck, QualityRank, rank_of};
use palpate_rheology::fit::FitSample;

/// Forces are averaged over so long before a drop is looked for, in s: a slip takes a few hundredths of a second.
pub(super) const DROP_SECS: f64 = 0.02;
/// A drop is one beyond so many standard uncertainties and this share of the highest force so far ...
const DROP_SIGMAS: f64 = 8.0;
const DROP_SHARE: f64 = 0.02;
/// ... and so many times that of the time before: relaxation slows down, it never speeds up.
const DROP_RATIO: f64 = 2.0;
/// The probe goes on as it did if its way over so many means before and after differs by no more than this share and this
/// length in mm: two pulses of the source's slider.
const STEADY_MEANS: usize = 10;
const STEADY_SHARE: f64 = 0.2;
const STEADY_MM: f64 = 0.03;
/// A probe that is so near the base, as a share of the thickness, presses what it pushed aside against the base; the model has
/// no base.
const THICKNESS_SHARE: f64 = 0.9;
/// The stiffness over the last part of a ramp may be so many times that over the part before. A cubic spring has 1.2.
const STIFFENING: f64 = 3.0;
/// The last part of a ramp, and the part before, as shares of its way.
const LAST_WAY: f64 = 0.03;
const WAY_BEFORE: f64 = 0.15;

/// A sudden loss of force while the probe presses or rests: it slipped, or the tissue tore.
pub(super) fn force_drop(samples: &[FitSample], start: f64) -> QualityCheck {
    let means = means(samples);
    let mut highest = f64::NEG_INFINITY;
    // A drop within the fourth mean shows whole between the third and the fifth.
    for (k, five) in means.windows(5).enumerate() {
        let [first, _, one, _, next] = five else { continue };
        highest = highest.max(one.force);
        let (drop, usual) = (one.force - next.force, first.force - one.force);
        let is_drop = drop > DROP_SIGMAS * one.sigma.hypot(next.sigma)
            && drop > DROP_SHARE * highest
            && drop > DROP_RATIO * usual
            && is_steady(&means, k + 2);
        if is_drop {
            let words = format!(
                "the force fell from {:.2} to {:.2} N within {:.0} ms; the probe slipped or the tissue tore",
                one.force,
                next.force,
                1e3 * (next.t - one.t)
            );
            let check = QualityCheck::new("force drop", QualityRank::Bad, words);
            return check.at(start + one.t, start + next.t);
        }
    }
    QualityCheck::new("force drop", QualityRank::Good, "the force never fell suddenly")
}

/// The mean over a short time.
#[derive(Clone, Copy, Debug, Default)]
struct ShortMean {
    t: f64,
    depth: f64,
    force: f64,
    sigma: f64,
}

/// Whether the probe goes on at a mean as it did and no time is missing near it: where a ramp ends, tissue relaxes at once.
fn is_steady(means: &[ShortMean], at: usize) -> bool {
    let near = STEADY_MEANS.min(at).min(means.len() - 1 - at);
    let [first, one, next] = [at - near, at, at + near].map(|k| means[k]);
    let [before, after] = [one.depth - first.depth, next.depth - one.depth];
    let is_alike = (after - before).abs() < STEADY_SHARE * before.abs() + STEADY_MM;
    is_alike && next.t - first.t < 3.0 * near as f64 * DROP_SECS
}

fn means(samples: &[FitSample]) -> Vec<ShortMean> {
    let first = samples.first().map_or(0.0, |one| one.t.0);
    let block = |one: &FitSample| ((one.t.0 - first) / DROP_SECS) as u64;
    let blocks = samples.chunk_by(|one, next| block(one) == block(next));
    let mean = |block: &[FitSample]| {
        let over = 1.0 / block.len() as f64;
        let of = |value: fn(&FitSample) -> f64| over * block.iter().map(value).sum::<f64>();
        ShortMean {
            t: of(|one| one.t.0),
            depth: of(|one| one.depth.0),
            force: of(|one| one.force.0),
            sigma: over.sqrt() * of(|one| one.sigma.0),
        }
    };
    blocks.map(mean).collect()
}

/// Whether the probe met what lies under the tissue.
pub(super) fn base(samples: &[FitSample], start: f64, thickness_mm: Option<f64>) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("base", rank, words);
    let Some(deepest) = samples.iter().max_by(|a, b| a.depth.0.total_cmp(&b.depth.0)) else {
        return of(QualityRank::NotJudged, "no force is known in this run".into());
    };
    let (deep, at) = (deepest.depth.0, start + deepest.t.0);
    if let Some(thickness) = thickness_mm {
        let share = deep / thickness;
        let words = format!(
            "the probe went to {deep:.1} mm, {:.0} % of the thickness of {thickness:.1} mm",
            100.0 * share
        );
        return of(rank_of(share, THICKNESS_SHARE, 1.0), words).at(at, at);
    }
    let way = |from: f64, to: f64| slope(samples, deep * from, deep * to);
    let last = way(1.0 - LAST_WAY, 1.0);
    let before = way(1.0 - LAST_WAY - WAY_BEFORE, 1.0 - LAST_WAY);
    match (last, before) {
        (Some(last), Some(before)) if last > STIFFENING * before && before > 0.0 => {
            let from = samples.iter().find(|one| one.depth.0 > (1.0 - LAST_WAY) * deep);
            let words = format!(
                "over the last {:.1} mm the force rises {:.1} times as steeply as before; the probe may have met what is under the tissue",
                LAST_WAY * deep,
                last / before
            );
            let check = of(QualityRank::Doubtful, words);
            check.at(from.map_or(at, |one| start + one.t.0), at)
        }
        (Some(_), Some(_)) => of(
            QualityRank::Good,
            "the force does not stiffen suddenly at the end of the ramp".into(),
        ),
        _ => {
            of(QualityRank::NotJudged, "the ramp is too short to tell whether it met a base".into())
        }
    }
}

/// Mean rise of the force in N/mm between two depths on the way to the deepest sample; `None` where few samples lie there.
fn slope(samples: &[FitSample], from: f64, to: f64) -> Option<f64> {
    let deepest =
        samples.iter().position(|one| one.depth.0 >= to - 1e-9).unwrap_or(samples.len() - 1);
    let near = samples[..=deepest].iter().filter(|one| (from..=to).contains(&one.depth.0));
    let (mut count, mut depth, mut force, mut both, mut square) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for one in near {
        count += 1.0;
        depth += one.depth.0;
        force += one.force.0;
        both += one.depth.0 * one.force.0;
        square += one.depth.0.powi(2);
    }
    let spread = square - depth * depth / count;
    (count > 20.0 && spread > 0.0).then(|| (both - depth * force / count) / spread)
}
