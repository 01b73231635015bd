//! The population of a study that is read from standard input as JSON, for comparison with other programs:
//! `scripts/population-oracle` uses it.

use palpate_population::{
    Evidence, PopulationOptions, Study, StudySession, SymmetricMatrix, fit_population,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct StudyText {
    levels: Vec<String>,
    parameters: Vec<String>,
    effects: Vec<String>,
    sessions: Vec<SessionText>,
    #[serde(default)]
    has_deviation_intervals: bool,
}

#[derive(Deserialize)]
struct SessionText {
    groups: Vec<String>,
    design: Vec<f64>,
    values: Vec<f64>,
    /// Rows of the inverse of the covariance; none of exact values.
    information: Option<Vec<Vec<f64>>>,
}

#[expect(clippy::print_stdout, reason = "an example prints its result")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text: StudyText = serde_json::from_reader(std::io::stdin())?;
    let session = |(index, one): (usize, SessionText)| {
        let evidence = match one.information {
            None => Evidence::Exact,
            Some(rows) => Evidence::Information(SymmetricMatrix::from_fn(
                rows.len(),
                rows.len(),
                |row, column| rows[row][column],
            )),
        };
        let name = format!("session {}", index + 1);
        StudySession { name, groups: one.groups, design: one.design, values: one.values, evidence }
    };
    let study = Study {
        parameters: text.parameters,
        effects: text.effects,
        levels: text.levels,
        sessions: text.sessions.into_iter().enumerate().map(session).collect(),
    };
    let options = PopulationOptions {
        has_deviation_intervals: text.has_deviation_intervals,
        ..Default::default()
    };
    let fit = fit_population(&study, &options)?;
    println!("{}", serde_json::to_string(&fit)?);
    Ok(())
}
