//! Forces of cases on standard input, a JSON object a line; for `scripts/contact-oracle`.
//!
//! `cargo run -p palpate-indentation --example contact_forces < cases.jsonl`

#![expect(clippy::print_stdout, reason = "an example that prints figures")]

use palpate_indentation::{
    ContactLaw, DepthHistory, Indenter, PowerLaw, RelaxationModulus, Specimen, ting_force,
};
use serde::Deserialize;
use serde_json::{Value, json};
use std::error::Error;

#[derive(Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum Case {
    /// Contact radius and force over modulus of a law.
    Elastic { law: ContactLaw, indenter: Indenter, specimen: Specimen, depth_mm: f64 },
    /// Forces of Ting's law.
    Viscoelastic {
        indenter: Indenter,
        poisson_ratio: f64,
        shear_modulus: RelaxationModulus,
        times_secs: Vec<f64>,
        depths_mm: Vec<f64>,
    },
}

fn main() -> Result<(), Box<dyn Error>> {
    for line in std::io::stdin().lines() {
        let case = serde_json::from_str(&line?)?;
        println!(
            "{}",
            answer(case).unwrap_or_else(|error| json!({ "refusal": error.to_string() }))
        );
    }
    Ok(())
}

fn answer(case: Case) -> Result<Value, Box<dyn Error>> {
    match case {
        Case::Elastic { law, indenter, specimen, depth_mm } => {
            let contact = law.contact(&indenter, &specimen, depth_mm)?;
            let force = contact.force_over_modulus;
            Ok(json!({ "radius_mm": contact.radius_mm, "force_over_modulus_mm2": force }))
        }
        Case::Viscoelastic { indenter, poisson_ratio, shear_modulus, times_secs, depths_mm } => {
            let law = PowerLaw::new(indenter.shape()?, poisson_ratio)?;
            let history = DepthHistory::new(&times_secs, &depths_mm)?;
            Ok(json!({ "forces_newtons": ting_force(law, &shear_modulus, &history)? }))
        }
    }
}
