//! Draws `docs/pictures/master_curve.svg` and prints its figures: a published Prony series reproduced, and
//! how many terms the same curve needs when their relaxation times are fitted too.
//!
//! `cargo run -p palpate-rheology --example master_curve -- time_user_master.csv docs/pictures/master_curve.svg`

#![expect(clippy::print_stdout, reason = "an example prints what it found")]

mod drawing;

use drawing::{Axes, BLUE, LEFT_PANEL, RED, RIGHT_PANEL, START};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families::{Model, Prony};
use palpate_rheology::fit::{FitOptions, FitSample, fit, fit_coefficients};
use std::error::Error;
use std::fmt::Write;
use std::sync::Arc;

/// Relaxation times of the published series, in s: one to a decade.
const DECADES: std::ops::Range<i32> = -2..29;

/// Duration in s of the step that stands for the sudden one of a relaxation test: a millionth of the first
/// sample's time.
const STEP: f64 = 1e-9;

/// Terms fitted with free relaxation times, as long as the curve holds so many.
const FREE: std::ops::RangeInclusive<usize> = 1..=40;

fn main() -> Result<(), Box<dyn Error>> {
    // Columns t in s and modulus in MPa, under a row of names and one of units.
    let usage = "give the curve and the picture to write: master_curve CURVE.csv OUT.svg";
    drawing::draw_table(usage, 2, fit_curve)
}

fn fit_curve(curve: &[[f64; 2]]) -> Result<String, Box<dyn Error>> {
    let samples = relaxation(curve);
    let taus: Vec<f64> = DECADES.map(|decade| 10f64.powi(decade)).collect();
    let family = Prony::of_terms(taus.len()).ok_or("too many terms")?;
    let fixed = fit_coefficients(Arc::new(family), &taus, &[("master curve", &samples)])?;
    let sum: f64 = fixed.linear.iter().sum();
    println!("relaxation times laid down: E_0 {sum:.2} MPa");
    for (tau, modulus) in taus.iter().zip(&fixed.linear[1..]) {
        println!("  {tau:.0e} s  {:.6e}", modulus / sum);
    }
    println!("{:3} terms laid down: rms {:.3} MPa", taus.len(), rms(&fixed, &samples)?);
    let mut ladder = Vec::new();
    let mut best = fixed.clone();
    for terms in FREE {
        let family = Prony::of_terms(terms).ok_or("too many terms")?;
        let mut options = FitOptions::of(Arc::new(family)).at_rest();
        options.fix("f_offset", 0.0)?;
        let fit = match fit(&samples, &options) {
            Ok(fit) => fit,
            Err(reason) => {
                println!("{terms:3} terms are refused: {reason}");
                break;
            }
        };
        println!("{terms:3} terms fitted:    rms {:.3} MPa", fit.rmse_n);
        ladder.push((terms as f64, fit.rmse_n));
        if fit.rmse_n < rms(&fixed, &samples)? && best.family == fixed.family {
            best = fit.body;
        }
    }
    picture(&samples, &fixed, &best, &ladder)
}

/// A curve of moduli as the force after a step to 1 mm, so that MPa stand for N/mm.
fn relaxation(curve: &[[f64; 2]]) -> Vec<FitSample> {
    let sample = |t, depth, force, sigma| FitSample {
        t: Seconds(t),
        depth: Depth(depth),
        force: Newtons(force),
        sigma: Newtons(sigma),
    };
    let step = [sample(0.0, 0.0, 0.0, f64::INFINITY), sample(STEP, 1.0, 0.0, f64::INFINITY)];
    let held = curve.iter().map(|&[t, modulus]| sample(t, 1.0, modulus, 1.0));
    step.into_iter().chain(held).collect()
}

/// Root mean square of what a model leaves, in MPa.
fn rms(model: &Model, samples: &[FitSample]) -> Result<f64, Box<dyn Error>> {
    let forces = model.along(samples.iter().map(|sample| (sample.t, sample.depth)))?;
    let squares = samples
        .iter()
        .zip(forces)
        .filter(|(sample, _)| sample.is_measured())
        .map(|(sample, force)| (sample.force.0 - force).powi(2));
    let count = samples.iter().filter(|sample| sample.is_measured()).count();
    Ok((squares.sum::<f64>() / count as f64).sqrt())
}

fn picture(
    samples: &[FitSample],
    fixed: &Model,
    best: &Model,
    ladder: &[(f64, f64)],
) -> Result<String, Box<dyn Error>> {
    let mut svg = START.to_owned();
    let axes = Axes { panel: LEFT_PANEL, x: (-3.0, 29.0), y: (0.0, 1800.0) };
    axes.draw(
        &mut svg,
        ["Master curve (dots) and both series", "log10 of time in s", "MPa"],
        [&[0.0, 5.0, 10.0, 15.0, 20.0, 25.0], &[0.0, 500.0, 1000.0, 1500.0]],
    )?;
    for sample in samples.iter().filter(|sample| sample.is_measured()).step_by(4) {
        axes.dot(&mut svg, (sample.t.0.log10(), sample.force.0), "#999999", 2.5)?;
    }
    for (model, colour, style) in [(best, BLUE, ""), (fixed, RED, "stroke-dasharray=\"4 5\"")] {
        let forces = model.along(samples.iter().map(|sample| (sample.t, sample.depth)))?;
        let line: Vec<(f64, f64)> = samples
            .iter()
            .zip(forces)
            .filter(|(sample, _)| sample.is_measured())
            .map(|(sample, force)| (sample.t.0.log10(), force))
            .collect();
        axes.line(&mut svg, &line, colour, style)?;
    }
    let (terms, laid) = (best.outer.len(), fixed.outer.len());
    axes.text(&mut svg, (-1.0, 420.0), BLUE, &format!("{terms} terms, times fitted"))?;
    axes.text(&mut svg, (-1.0, 280.0), RED, &format!("{laid} terms, one to a decade"))?;
    let axes = Axes { panel: RIGHT_PANEL, x: (0.0, 32.0), y: (-0.5, 2.5) };
    axes.draw(
        &mut svg,
        ["What each term buys", "terms", "rms in MPa"],
        [&[1.0, 5.0, 10.0, 15.0, 20.0, 25.0, 31.0], &[]],
    )?;
    for (log, label) in [(0.0, "1"), (1.0, "10"), (2.0, "100")] {
        axes.line(&mut svg, &[(0.0, log), (32.0, log)], "#dddddd", "")?;
        axes.text(&mut svg, (-2.6, log - 0.04), "black", label)?;
    }
    for &(terms, rms) in ladder {
        axes.dot(&mut svg, (terms, rms.log10()), BLUE, 4.0)?;
    }
    axes.dot(&mut svg, (laid as f64, rms(fixed, samples)?.log10()), RED, 5.0)?;
    axes.text(&mut svg, (16.0, 1.6), BLUE, "relaxation times fitted")?;
    axes.text(&mut svg, (20.0, 0.45), RED, "as published")?;
    writeln!(svg, "</svg>")?;
    Ok(svg)
}
