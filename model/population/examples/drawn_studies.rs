//! Coverage probability of the intervals of a drawn population: `drawn_studies STUDIES` prints a line for each number of
//! animals, each with three sites of two repeats, half of the animals treated.
//!
//! With `heavy` animals scatter by Student's t with three degrees of freedom, with `one-bad` one specimen in each study is
//! far off.

use palpate_model::random::SplitMix;
use palpate_population::{
    Evidence, PopulationFit, PopulationOptions, Study, StudySession, SymmetricMatrix,
    fit_population, outlying_group,
};

const ANIMALS: [usize; 3] = [4, 6, 12];
const SITES: usize = 3;
const REPEATS: usize = 2;
/// Standard deviations of logarithms from animal to animal, from site to site, from repeat to repeat, and of one fit.
const DEVIATIONS: [f64; 3] = [0.25, 0.15, 0.1];
const NOISE: f64 = 0.05;
const MEAN: f64 = 1.5;
const EFFECT: f64 = 0.3;

#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    None,
    HeavyTails,
    OneBad,
}

fn study(animals: usize, effect: f64, trouble: Trouble, random: &mut SplitMix) -> Study {
    let mut study = Study {
        parameters: vec!["stiffness".into()],
        effects: vec!["mean".into(), "treated".into()],
        levels: ["animal", "site", "repeat"].map(String::from).to_vec(),
        sessions: Vec::new(),
    };
    for animal in 0..animals {
        let treated = (animal % 2) as f64;
        let mut shift = DEVIATIONS[0] * random.normal();
        if trouble == Trouble::HeavyTails {
            let squares: f64 = (0..3).map(|_| random.normal().powi(2)).sum();
            // Student's t of three degrees of freedom has a variance of three.
            shift /= squares.sqrt();
        }
        for site in 0..SITES {
            let mut at = shift + DEVIATIONS[1] * random.normal();
            if trouble == Trouble::OneBad && animal == 0 && site == 0 {
                at += 6.0 * DEVIATIONS[1];
            }
            for _ in 0..REPEATS {
                let noise = DEVIATIONS[2] * random.normal() + NOISE * random.normal();
                study.sessions.push(StudySession {
                    name: format!("session {}", study.sessions.len() + 1),
                    groups: vec![format!("animal {animal}"), format!("site {site}")],
                    design: vec![1.0, treated],
                    values: vec![MEAN + effect * treated + at + noise],
                    evidence: Evidence::Information(SymmetricMatrix::from_element(
                        1,
                        1,
                        NOISE.powi(-2),
                    )),
                });
            }
        }
    }
    study
}

#[derive(Default)]
struct Tally {
    mean: usize,
    effect: usize,
    deviations: [usize; 3],
    widths: [f64; 2],
    zeros: [usize; 3],
    /// Studies in which a group of any level is said to be outlying, and those in which none is, with how many of the latter have
    /// intervals around the standard deviations.
    outlying: usize,
    silent: [usize; 3],
}

impl Tally {
    fn count(&mut self, fit: &PopulationFit, effect: f64) {
        let covers = |[low, high]: [f64; 2], truth: f64| usize::from(low <= truth && truth <= high);
        let [mean, treated] = [0, 1].map(|k| &fit.effects[k]);
        self.mean += covers(mean.interval, MEAN);
        self.effect += covers(treated.interval, effect);
        self.widths[0] += mean.interval[1] - mean.interval[0];
        self.widths[1] += treated.interval[1] - treated.interval[0];
        let is_outlying =
            ["animal", "site", "repeat"].iter().any(|one| outlying_group(fit, one, 0).is_some());
        self.outlying += usize::from(is_outlying);
        for (k, one) in fit.standard_deviations.iter().enumerate() {
            let [low, high] = one.interval;
            let ends = [low.unwrap_or(0.0), high.unwrap_or(f64::INFINITY)];
            let is_covered = covers(ends, DEVIATIONS[k]);
            self.deviations[k] += is_covered;
            self.silent[k] += if is_outlying { 0 } else { is_covered };
            self.zeros[k] += usize::from(one.is_zero);
        }
    }
}

#[expect(clippy::print_stdout, reason = "an example prints its result")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let studies: usize = arguments.next().map_or(Ok(1000), |text| text.parse())?;
    let trouble = match arguments.next().as_deref() {
        Some("heavy") => Trouble::HeavyTails,
        Some("one-bad") => Trouble::OneBad,
        _ => Trouble::None,
    };
    let options = PopulationOptions { has_deviation_intervals: true, ..Default::default() };
    for animals in ANIMALS {
        let mut random = SplitMix::seeded(animals as u64);
        let (mut tally, mut false_positives) = (Tally::default(), 0);
        for _ in 0..studies {
            let fit = fit_population(&study(animals, EFFECT, trouble, &mut random), &options)?;
            tally.count(&fit, EFFECT);
            let plain = PopulationOptions::default();
            let none = fit_population(&study(animals, 0.0, trouble, &mut random), &plain)?;
            false_positives += usize::from(none.effects[1].p_value < 0.05);
        }
        let share = |count: usize| 100.0 * count as f64 / studies as f64;
        let [animal, site, repeat] = tally.deviations.map(share);
        println!(
            "{animals:2} animals: mean {:.1} %, effect {:.1} %, standard deviations of animals {animal:.1} %, sites {site:.1} %, repeats {repeat:.1} %; false positives {:.1} %; said to be outlying {:.1} %, else standard deviations {:.1?} %; zero {:?}; widths {:.3} {:.3}",
            share(tally.mean),
            share(tally.effect),
            share(false_positives),
            share(tally.outlying),
            tally.silent.map(|one| 100.0 * one as f64 / (studies - tally.outlying) as f64),
            tally.zeros,
            tally.widths[0] / studies as f64,
            tally.widths[1] / studies as f64,
        );
    }
    Ok(())
}
