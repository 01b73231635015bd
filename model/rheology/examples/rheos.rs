//! Draws `docs/pictures/rheos.svg`: a published Maxwell fit and its discretisation bias.
//!
//! `cargo run -p palpate-rheology --example rheos -- example1_data.csv docs/pictures/rheos.svg`

mod drawing;
mod maxwell_fit;

use drawing::{Axes, BLUE, LEFT_PANEL, RED, RIGHT_PANEL, START};
use maxwell_fit::{Integrator, Maxwell, MaxwellFit, MaxwellState, StrainSample, fit_maxwell};
use palpate_model::Seconds;
use std::error::Error;

const DASHED: &str = "stroke-dasharray=\"4 5\"";

fn main() -> Result<(), Box<dyn Error>> {
    let usage = "give the recording and the picture to write: rheos RECORDING.csv OUT.svg";
    drawing::draw_table(usage, 0, picture)
}

fn picture(rows: &[[f64; 3]]) -> Result<String, Box<dyn Error>> {
    let sample = |&[t, strain, stress]: &[f64; 3]| StrainSample { t: Seconds(t), strain, stress };
    let samples: Vec<StrainSample> = rows.iter().map(sample).collect();
    let samples = samples.as_slice();
    let exact = fit_maxwell(samples, Integrator::Exact)?;
    let backward = fit_maxwell(samples, Integrator::BackwardDifference)?;
    let mut svg = START.to_owned();
    recording(&mut svg, samples, [&exact, &backward])?;
    bias(&mut svg, exact.body)?;
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// Left: the recording and both fits, which are one curve.
fn recording(
    svg: &mut String,
    samples: &[StrainSample],
    [exact, backward]: [&MaxwellFit; 2],
) -> Result<(), Box<dyn Error>> {
    let axes = Axes { panel: LEFT_PANEL, x: (0.0, 10.0), y: (0.0, 3.0) };
    axes.draw(
        svg,
        ["Recording (dots) and both fits", "time in s", "stress"],
        [&[0.0, 2.0, 4.0, 6.0, 8.0, 10.0], &[0.0, 1.0, 2.0, 3.0]],
    )?;
    for sample in samples {
        axes.dot(svg, (sample.t.0, sample.stress), "#999999", 2.5)?;
    }
    let stress = curve(samples, exact.body, Integrator::Exact);
    axes.line(svg, &stress, BLUE, "")?;
    let stress = curve(samples, backward.body, Integrator::BackwardDifference);
    axes.line(svg, &stress, RED, DASHED)?;
    let rows = [(BLUE, "exact", exact.body), (RED, "backward difference", backward.body)];
    for (row, (colour, name, Maxwell { eta, k })) in rows.into_iter().enumerate() {
        let y = 2.75 - 0.5 * row as f64;
        axes.text(svg, (4.6, y), colour, name)?;
        let numbers = format!("eta {eta:.4}, k {k:.4}");
        axes.text(svg, (4.6, y - 0.2), colour, &numbers)?;
    }
    Ok(())
}

/// Right: fitted over true stiffness of simulated records, against the sampling interval.
fn bias(svg: &mut String, body: Maxwell) -> Result<(), Box<dyn Error>> {
    let axes = Axes { panel: RIGHT_PANEL, x: (0.0, 0.52), y: (0.75, 1.05) };
    axes.draw(
        svg,
        [
            "Simulated records: fitted over true eta and k",
            "r = sampling interval / relaxation time",
            "",
        ],
        [&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5], &[0.75, 0.8, 0.85, 0.9, 0.95, 1.0, 1.05]],
    )?;
    let law: Vec<(f64, f64)> =
        (1..=52).map(|i| f64::from(i) * 0.01).map(|r: f64| (r, -(-r).exp_m1() / r)).collect();
    axes.line(svg, &law, RED, DASHED)?;
    axes.line(svg, &[(0.0, 1.0), (0.52, 1.0)], BLUE, "")?;
    for intervals in [2, 3, 4, 5, 7, 10, 20, 50] {
        let (r, ratios) = simulated(body, intervals)?;
        for (ratio, colour) in ratios.into_iter().zip([BLUE, RED]) {
            axes.dot(svg, (r, ratio), colour, 4.0)?;
        }
    }
    axes.text(svg, (0.34, 1.012), BLUE, "exact")?;
    let text = "backward difference: (1 - e^-r) / r";
    axes.text(svg, (0.17, 0.955), RED, text)?;
    Ok(())
}

/// `dt / tau`, and the fitted over the true `k` of both integrators, on the recording's protocol of
/// 2 s of ramp and 8 s of hold with `5 * ramp_intervals` intervals.
fn simulated(body: Maxwell, ramp_intervals: u32) -> Result<(f64, [f64; 2]), Box<dyn Error>> {
    let dt = 2.0 / f64::from(ramp_intervals);
    let t = |i: u32| f64::from(i) * dt;
    let path: Vec<StrainSample> = (0..=5 * ramp_intervals)
        .map(|i| StrainSample { t: Seconds(t(i)), strain: t(i.min(ramp_intervals)), stress: 0.0 })
        .collect();
    let stress = curve(&path, body, Integrator::Exact);
    let record: Vec<StrainSample> = path
        .iter()
        .zip(stress)
        .map(|(sample, (_, stress))| StrainSample { stress, ..*sample })
        .collect();
    let ratio =
        |integrator| Ok::<_, Box<dyn Error>>(fit_maxwell(&record, integrator)?.body.k / body.k);
    Ok((dt / body.tau().0, [ratio(Integrator::Exact)?, ratio(Integrator::BackwardDifference)?]))
}

/// Time and the stress a body gives along the strain of some samples.
fn curve(samples: &[StrainSample], body: Maxwell, integrator: Integrator) -> Vec<(f64, f64)> {
    let mut before = samples[0];
    let mut state = MaxwellState::at_rest_from(before.strain);
    samples
        .iter()
        .map(|sample| {
            let dt = Seconds(sample.t.0 - before.t.0);
            before = *sample;
            let stress = state.step(&body, integrator, sample.strain, dt);
            (sample.t.0, stress)
        })
        .collect()
}
