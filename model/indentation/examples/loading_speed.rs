//! Time of the fits of many loading curves by Hertz's law, with contact and force zero free, on two threads.
//!
//! Usage: `loading_speed FILE SAMPLES RADIUS_MM POISSON`. The file has curves of so many samples, each of which is a depth in mm
//! and a force in N as numbers of 8 bytes, the lowest first. Prints a line of JSON.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "an example that measures time"
)]

use palpate_indentation::{
    Base, ContactLaw, Indenter, LoadingKnowledge, LoadingSample, PoissonBasis, Quantity, Specimen,
    fit_loading,
};
use std::error::Error;
use std::thread;
use std::time::Instant;

const THREADS: usize = 2;
/// So thick that its base adds nothing.
const THICKNESS_MM: f64 = 1e6;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, samples, radius, poisson] = arguments.as_slice() else {
        return Err("give FILE SAMPLES RADIUS_MM POISSON".into());
    };
    let bytes = std::fs::read(file)?;
    let numbers: Vec<f64> =
        bytes.as_chunks().0.iter().map(|eight| f64::from_le_bytes(*eight)).collect();
    let sample = |pair: &[f64]| LoadingSample { depth_mm: pair[0], force_newtons: pair[1] };
    let samples_all: Vec<LoadingSample> = numbers.chunks_exact(2).map(sample).collect();
    let curves: Vec<&[LoadingSample]> = samples_all.chunks_exact(samples.parse()?).collect();
    let exact = |value| Quantity { value, standard_uncertainty: 0.0 };
    let indenter = Indenter::Sphere { radius_mm: exact(radius.parse()?) };
    let specimen = Specimen {
        thickness_mm: exact(THICKNESS_MM),
        base: Base::Bonded,
        poisson_ratio: exact(poisson.parse()?),
        poisson_basis: PoissonBasis::Assumed,
    };
    let free =
        LoadingKnowledge { noise_newtons: None, contact_error_mm: None, zero_error_newtons: None };
    let fit = |curve: &&[LoadingSample]| {
        let fit = fit_loading(ContactLaw::Hertz, &indenter, &specimen, curve, free);
        fit.map_or(f64::NAN, |fit| fit.modulus_mpa)
    };
    let start = Instant::now();
    let moduli_mpa: Vec<f64> = thread::scope(|scope| {
        let parts = curves.chunks(curves.len().div_ceil(THREADS).max(1));
        let running: Vec<_> =
            parts.map(|part| scope.spawn(|| part.iter().map(fit).collect::<Vec<f64>>())).collect();
        running.into_iter().flat_map(|one| one.join().unwrap_or_default()).collect()
    });
    let seconds = start.elapsed().as_secs_f64();
    println!("{}", serde_json::json!({ "seconds": seconds, "moduli_mpa": moduli_mpa }));
    Ok(())
}
