//! Search, refinement, judgement, report: the fit from end to end.

use super::identify;
use super::options::{CONTACT, FitOptions, LINEAR, LINEAR_COUNT, TAU};
use super::problem::{Outer, Problem, linear_units};
use super::refine::{Ranges, Refined, refine};
use super::report::{Findings, FitReport, MODEL_NAME, physical, residuals};
use super::sample::{FitError, FitSample, check_samples};
use super::scan::{best_start, contact_range, contact_starts, log_tau_range};

/// Starts followed when the contact position is free.
const CONTACT_STARTS: usize = 4;
/// Samples of the thinned record on which those starts compete.
const CONTEST_SAMPLES: usize = 3000;
/// `ln tau` this close to an end of the searched range is at the end.
const EDGE: f64 = 1e-3;
/// A scaled contact this close to the shallowest depth was stopped there.
const CONTACT_EDGE: f64 = 1e-6;
/// Neighbouring residuals correlated more than this have memory.
const LAG_ONE_MAX: f64 = 0.2;

/// Identifies the modified Kelvin body
/// `F + tau_eps F' = mu1 x + mu2 x^2 + mu3 x^3 + tau_sig x x'` with initial force and sensor
/// offset, from depth and force alone, by weighted least squares on the exact response.
///
/// The result depends on nothing but the arguments; no starting guess is needed. Standard errors
/// are those of independent noise and are widened by the scatter found; a warning says when the
/// residuals have memory, which makes them too small.
///
/// ```
/// use palpate_model::fit::{FitOptions, FitSample, fit};
/// use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
/// use palpate_model::{Depth, Newtons, Seconds};
///
/// // A ramp of 0.75 mm/s to 30 mm and a hold, ten samples a second.
/// let tissue = ModifiedKelvin::THESIS;
/// let mut state = KelvinState::at_rest();
/// let samples: Vec<FitSample> = (0..900)
///     .map(|i| {
///         let t = f64::from(i) * 0.1;
///         let depth = Depth((0.75 * t).min(30.0));
///         let dt = Seconds(if i == 0 { 0.0 } else { 0.1 });
///         let force = state.step(&tissue, depth, dt);
///         FitSample { t: Seconds(t), depth, force, sigma: Newtons(0.02) }
///     })
///     .collect();
///
/// let report = fit(&samples, &FitOptions::default())?;
/// assert!((report.body().tau_eps - 1.023).abs() < 1e-9);
/// # Ok::<(), palpate_model::fit::FitError>(())
/// ```
pub fn fit(samples: &[FitSample], options: &FitOptions) -> Result<FitReport, FitError> {
    let parameters = options.free_count();
    if samples.len() < parameters.max(2) {
        return Err(FitError::TooFewSamples {
            samples: samples.len(),
            parameters,
        });
    }
    check_samples(samples)?;
    let problem = Problem::new(samples, options)?;
    let free: Vec<usize> = (0..8).filter(|&k| options.fixed()[k].is_none()).collect();
    let ranges = Ranges {
        log_tau: log_tau_range(samples),
        contact: contact_range(&problem),
    };
    let redrawn = identify::redraw(samples, problem.depth_scale);
    let refined = match problem.fixed_contact {
        Some(contact) => {
            let start = best_start(&problem, contact);
            identify::check(&problem, &redrawn, &free, start.outer, None)?;
            refine(&problem, &start, ranges)
        }
        None => refine_with_contact(&problem, ranges),
    };
    if !refined.sum.is_finite() || refined.scaled.iter().any(|value| !value.is_finite()) {
        // A blind design divides by nothing; say which parameters rather than that.
        identify::check(&problem, &redrawn, &free, refined.outer, None)?;
        return Err(FitError::Overflow);
    }
    identify::check(
        &problem,
        &redrawn,
        &free,
        refined.outer,
        Some(&refined.scaled),
    )?;
    Ok(report(&problem, options, &refined, ranges))
}

/// The contact is searched on a grid, the best places compete on a thinned record, and the winner
/// is refined on all samples.
fn refine_with_contact(problem: &Problem<'_>, ranges: Ranges) -> Refined {
    let step = problem.samples.len().div_ceil(CONTEST_SAMPLES);
    let thin: Vec<FitSample> = problem.samples.iter().copied().step_by(step).collect();
    let contest = problem.on(&thin);
    let starts = contact_starts(problem);
    let mut winner = starts.first().copied().unwrap_or_else(|| {
        let contact = ranges.contact.0;
        best_start(problem, contact)
    });
    let mut lowest = f64::INFINITY;
    for start in starts.iter().take(CONTACT_STARTS) {
        let refined = refine(&contest, start, ranges);
        if refined.sum < lowest {
            lowest = refined.sum;
            winner.outer = refined.outer;
            winner.scaled = refined.scaled;
        }
    }
    refine(problem, &winner, ranges)
}

fn report(
    problem: &Problem<'_>,
    options: &FitOptions,
    refined: &Refined,
    ranges: Ranges,
) -> FitReport {
    let Refined { outer, scaled, .. } = *refined;
    let free = options.free_count();
    let spare = problem.samples.len() - free;
    let range = ranges.log_tau;
    let edge = edge_of(problem, outer, range);
    let contact_is_at_start =
        problem.fixed_contact.is_none() && outer.contact < ranges.contact.0 + CONTACT_EDGE;
    let residuals = residuals(problem, outer, &scaled);
    let findings = Findings {
        values: physical(outer, &scaled, problem.depth_scale),
        std_errors: std_errors(
            problem,
            options,
            refined,
            [edge.is_some(), contact_is_at_start],
        ),
        is_fixed: std::array::from_fn(|k| options.fixed()[k].is_some()),
        degrees_of_freedom: spare,
    };
    let mut warnings = Vec::new();
    if let Some(edge) = edge {
        warnings.push(format!(
            "tau_eps lies at the {edge} end of what this record can show ({:.3e} s to {:.3e} s); \
             the other parameters are conditional on it",
            range.0.exp(),
            range.1.exp()
        ));
    }
    if contact_is_at_start {
        warnings.push(
            "contact lies at or before the shallowest depth recorded, where it cannot be told \
             from the elastic coefficients; record the approach as well"
                .to_owned(),
        );
    }
    if !refined.is_converged {
        warnings.push(
            "the iteration did not settle; the parameters depend on each other too strongly"
                .to_owned(),
        );
    }
    let chance = 3.0 / (problem.samples.len() as f64).sqrt();
    if spare > 0 && residuals.lag_one > LAG_ONE_MAX + chance && residuals.r2 < 1.0 - 1e-12 {
        warnings.push(format!(
            "neighbouring residuals are correlated ({:.2}); the standard errors assume \
             independent noise and are too small",
            residuals.lag_one
        ));
    }
    let parameters = findings.parameters();
    for parameter in &parameters {
        if parameter.name == "tau_eps"
            && parameter
                .std_error
                .is_some_and(|error| error > 0.5 * parameter.value)
        {
            warnings.push(
                "tau_eps is uncertain by more than half its value; record a longer hold".to_owned(),
            );
        }
    }
    FitReport {
        model: MODEL_NAME.to_owned(),
        parameters,
        r2: residuals.r2,
        rmse_n: residuals.rmse_n,
        samples: problem.samples.len(),
        warnings,
        findings: Vec::new(),
    }
}

fn edge_of(problem: &Problem<'_>, outer: Outer, (low, high): (f64, f64)) -> Option<&'static str> {
    if problem.fixed_tau.is_some() {
        None
    } else if outer.log_tau < low + EDGE {
        Some("short")
    } else if outer.log_tau > high - EDGE {
        Some("long")
    } else {
        None
    }
}

fn std_errors(
    problem: &Problem<'_>,
    options: &FitOptions,
    refined: &Refined,
    [tau_is_at_edge, contact_is_at_edge]: [bool; 2],
) -> [Option<f64>; 8] {
    let spare = problem.samples.len() - options.free_count();
    let free = problem.basis.len();
    let all = free + problem.outer_free();
    let scatter = if spare > 0 {
        (refined.factor.residual_sum(all) / spare as f64).sqrt()
    } else {
        return [None; 8];
    };
    let units = linear_units(problem.depth_scale);
    let deviation = |combination: &[f64]| scatter * refined.factor.deviation(combination);
    let outer_deviation = |position: usize| {
        let mut combination = vec![0.0; all];
        combination[free + position] = 1.0;
        deviation(&combination)
    };
    std::array::from_fn(|index| {
        if options.fixed()[index].is_some() {
            return None;
        }
        match index {
            TAU if tau_is_at_edge => None,
            TAU => Some(outer_deviation(0) * refined.outer.tau()),
            CONTACT if contact_is_at_edge => None,
            CONTACT => {
                let position = usize::from(problem.fixed_tau.is_none());
                Some(outer_deviation(position) * problem.depth_scale)
            }
            _ => {
                let k = index - LINEAR;
                debug_assert!(k < LINEAR_COUNT);
                let mut combination: Vec<f64> =
                    problem.basis.iter().map(|column| column[k]).collect();
                combination.resize(all, 0.0);
                Some(deviation(&combination) / units[k])
            }
        }
    })
}
