//! How long a population takes: `large_study SESSIONS... [--parameters N]` prints a line for each number of sessions. Twenty specimens of
//! each animal, three sites of each, two presses each; half of the animals treated; all intervals.
#![expect(clippy::disallowed_methods, clippy::print_stdout, reason = "it measures and prints")]

use palpate_model::random::SplitMix;
use palpate_population::{
    Evidence, PopulationOptions, Study, StudySession, SymmetricMatrix, fit_population,
};
use std::time::Instant;

/// Standard deviations of logarithms from animal to animal, specimen to specimen, site to site, press to press, and of one fit.
const DEVIATIONS: [f64; 4] = [0.2, 0.1, 0.05, 0.03];
const NOISE: f64 = 1e-3;

fn study(sessions: usize, parameters: usize) -> Study {
    let mut random = SplitMix::seeded(7);
    let mut draw =
        |size: f64| -> Vec<f64> { (0..parameters).map(|_| size * random.normal()).collect() };
    let mut study = Study {
        parameters: (1..=parameters).map(|k| format!("p{k}")).collect(),
        effects: vec!["mean".into(), "treated".into()],
        levels: ["animal", "specimen", "site", "press"].map(String::from).to_vec(),
        sessions: Vec::new(),
    };
    let mut shifts = [Vec::new(), Vec::new(), Vec::new()];
    for k in 0..sessions {
        for (level, every) in [120, 6, 2].into_iter().enumerate() {
            if k % every == 0 {
                shifts[level] = draw(DEVIATIONS[level]);
            }
        }
        let (press, noise) = (draw(DEVIATIONS[3]), draw(NOISE));
        let value = |p: usize| shifts.iter().map(|one| one[p]).sum::<f64>() + press[p] + noise[p];
        let information = SymmetricMatrix::identity(parameters, parameters) * NOISE.powi(-2);
        study.sessions.push(StudySession {
            name: format!("session {k}"),
            groups: vec![format!("{}", k / 120), format!("{}", k / 6), format!("{}", k / 2)],
            design: vec![1.0, ((k / 120) % 2) as f64],
            values: (0..parameters).map(value).collect(),
            evidence: Evidence::Information(information),
        });
    }
    study
}

fn main() {
    let mut words = std::env::args().skip(1);
    let (mut counts, mut parameters) = (Vec::new(), 1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--parameters" => {
                parameters = words.next().and_then(|word| word.parse().ok()).unwrap_or(1);
            }
            word => counts.extend(word.parse::<usize>().ok()),
        }
    }
    if counts.is_empty() {
        counts = vec![1000, 10_000];
    }
    let options =
        PopulationOptions { has_deviation_intervals: true, ..PopulationOptions::default() };
    for sessions in counts {
        let study = study(sessions, parameters);
        let begun = Instant::now();
        match fit_population(&study, &options) {
            Ok(fit) => {
                let seconds = begun.elapsed().as_secs_f64();
                let found: Vec<f64> = fit.standard_deviations.iter().map(|one| one.value).collect();
                println!(
                    "{sessions} sessions, {parameters} parameters: {seconds:.2} s; standard deviations {found:.4?}"
                );
            }
            Err(err) => println!("{sessions} sessions: {err}"),
        }
    }
}
