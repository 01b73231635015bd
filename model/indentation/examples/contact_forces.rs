//! Contact radius and force over modulus of cases on standard input, a JSON object a line; for `scripts/contact-oracle`.
//!
//! `cargo run -p palpate-indentation --example contact_forces < cases.jsonl`

#![expect(clippy::print_stdout, reason = "an example that prints figures")]

use palpate_indentation::{ContactLaw, Indenter, Specimen};
use serde::Deserialize;
use std::error::Error;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    law: ContactLaw,
    indenter: Indenter,
    specimen: Specimen,
    depth_mm: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    for line in std::io::stdin().lines() {
        let Case { law, indenter, specimen, depth_mm } = serde_json::from_str(&line?)?;
        let answer = match law.contact(&indenter, &specimen, depth_mm) {
            Ok(contact) => serde_json::json!({
                "radius_mm": contact.radius_mm,
                "force_over_modulus_mm2": contact.force_over_modulus,
            }),
            Err(refusal) => serde_json::json!({ "refusal": refusal.to_string() }),
        };
        println!("{answer}");
    }
    Ok(())
}
