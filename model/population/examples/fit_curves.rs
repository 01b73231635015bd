//! The population of curves that are read from standard input as JSON, for comparison with other programs:
//! `scripts/population-oracle` uses it. Depths count from contact and forces from zero; nothing but the body is found.

use palpate_model::{Depth, Newtons, Seconds};
use palpate_population::{
    CurveEvidence, Evidence, PopulationOptions, Study, StudyError, StudySession, expand_curves,
    fit_population,
};
use palpate_rheology::fit::{
    CurveLikelihood, FitOptions, FitSample, FitSolution, LikelihoodExpansion,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct StudyText {
    family: String,
    levels: Vec<String>,
    parameters: Vec<String>,
    effects: Vec<String>,
    curves: Vec<CurveText>,
}

#[derive(Deserialize)]
struct CurveText {
    groups: Vec<String>,
    design: Vec<f64>,
    t_s: Vec<f64>,
    depth_mm: Vec<f64>,
    force_n: Vec<f64>,
}

impl CurveText {
    fn samples(&self) -> Vec<FitSample> {
        let numbers = self.t_s.iter().zip(&self.depth_mm).zip(&self.force_n);
        let sample = |((&t, &depth), &force)| FitSample {
            t: Seconds(t),
            depth: Depth(depth),
            force: Newtons(force),
            // The scatter is found.
            sigma: Newtons(1.0),
        };
        numbers.map(sample).collect()
    }
}

fn evidence(found: LikelihoodExpansion) -> CurveEvidence {
    CurveEvidence::of_rows(found.centre, &found.covariance)
}

#[expect(clippy::print_stdout, reason = "an example prints its result")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text: StudyText = serde_json::from_reader(std::io::stdin())?;
    let mut options = FitOptions::by_key(&text.family)?.at_rest();
    options.fix("f_offset", 0.0)?;
    let names: Vec<&str> = text.parameters.iter().map(String::as_str).collect();
    let records: Vec<Vec<FitSample>> = text.curves.iter().map(CurveText::samples).collect();
    let fits = records.iter().map(|samples| FitSolution::of(samples, &options));
    let fits = fits.collect::<Result<Vec<_>, _>>()?;
    let likelihoods = fits.iter().map(|fit| CurveLikelihood::of(fit, 0, &names));
    let likelihoods = likelihoods.collect::<Result<Vec<_>, _>>()?;
    let sessions = text.curves.into_iter().zip(&likelihoods).enumerate();
    let sessions = sessions.map(|(index, (curve, likelihood))| StudySession {
        name: format!("curve {}", index + 1),
        groups: curve.groups,
        design: curve.design,
        values: likelihood.best().to_vec(),
        // Until the first expansion.
        evidence: Evidence::Exact,
    });
    let mut study = Study {
        parameters: text.parameters.clone(),
        effects: text.effects,
        levels: text.levels,
        sessions: sessions.collect(),
    };
    expand_curves::<StudyError>(&mut study, |modes| {
        let pairs = likelihoods.iter().zip(modes);
        Ok(pairs.map(|(likelihood, mode)| likelihood.expand(mode).map(evidence)).collect())
    })?;
    let fit = fit_population(&study, &PopulationOptions::default())?;
    println!("{}", serde_json::to_string(&fit)?);
    Ok(())
}
