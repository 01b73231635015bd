//! `palpate material` with relaxation and sines, against closed forms that are written out here.

use crate::support::{answer, assert_refused, stdout, succeeded, typed};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

const RADIUS_MM: f64 = 3.0;
const POISSON: f64 = 0.45;
const EQUILIBRIUM_MPA: f64 = 0.01;
const TERMS: [(f64, f64); 3] = [(0.03, 0.1), (0.02, 1.0), (0.015, 10.0)];
pub(super) const PUNCH: &str =
    "--indenter flat-punch --radius 3.00 --poisson 0.45 --law sneddon --thickness 800";

fn modulus(t: f64) -> f64 {
    EQUILIBRIUM_MPA + TERMS.iter().map(|(g, tau)| g * (-t / tau).exp()).sum::<f64>()
}

/// Noise of unit variance or so that is the same on every machine.
fn noise(index: i32) -> f64 {
    let sawtooth = |k: f64| (f64::from(index) * k).fract() - 0.5;
    6f64.sqrt() * (sawtooth(0.754_877_67) + sawtooth(0.569_840_29))
}

/// A punch pressed at constant speed to 0.2 mm and held: `F = 4 R / (1 - nu) v` times what has relaxed, the integral of the modulus
/// from `t - s` to `t`, with `s` the time up to which it moves. Of the ramp and the hold in s, and of the noise in N.
pub(super) fn press_table(
    at: &Path,
    name: &str,
    [ramp, hold, rms]: [f64; 3],
    relaxed: impl Fn(f64, f64) -> f64,
) {
    let speed = 0.2 / ramp;
    let mut times: Vec<f64> = (0..(100.0 * hold) as i32).map(|k| 0.01 * f64::from(k)).collect();
    times.extend((1..=20).map(|k| 0.05 * f64::from(k) * ramp));
    times.sort_by(f64::total_cmp);
    times.dedup_by(|later, earlier| *later - *earlier < 1e-9);
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for (index, t) in times.into_iter().enumerate() {
        let moved = t.min(ramp);
        let force = 4.0 * RADIUS_MM / (1.0 - POISSON) * speed * relaxed(t, moved);
        let force = force + rms * noise(index as i32);
        let _ = writeln!(text, "{t},{},{force}", speed * moved);
    }
    std::fs::write(at.join(name), text).unwrap();
}

/// What has relaxed of the three terms: each `tau (exp(-(t - s) / tau) - exp(-t / tau))`.
fn relaxed(t: f64, moved: f64) -> f64 {
    let of_term = |(g, tau): &(f64, f64)| g * tau * ((-(t - moved) / tau).exp() - (-t / tau).exp());
    EQUILIBRIUM_MPA * moved + TERMS.iter().map(of_term).sum::<f64>()
}

pub(super) fn number(object: &Value, path: &str) -> f64 {
    object.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {object}"))
}

#[test]
fn three_terms_come_back_from_ramps_short_and_long() {
    let at = tempfile::tempdir().unwrap();
    let mut worst: f64 = 0.0;
    for ramp_over_time in [0.01, 0.1, 1.0, 3.0] {
        press_table(at.path(), "press.csv", [0.1 * ramp_over_time, 60.0, 2e-4], relaxed);
        let line = format!("material press.csv --property relaxation {PUNCH} --json");
        let found = answer(&typed(at.path(), &line));
        let terms = found["terms"].as_array().unwrap();
        assert_eq!(terms.len(), 3, "{ramp_over_time}: {found}");
        let fitted = |t: f64| {
            let of_term = |term: &Value| {
                let tau = number(term, "/time_s/value");
                number(term, "/modulus_mpa/value") * (-t / tau).exp()
            };
            number(&found, "/equilibrium_mpa/value") + terms.iter().map(of_term).sum::<f64>()
        };
        for k in 0..80 {
            let t = 1e-3 * 10f64.powf(0.06 * f64::from(k));
            worst = worst.max((fitted(t) / modulus(t) - 1.0).abs());
        }
        for row in found["modulus"].as_array().unwrap() {
            let (t, value) = (number(row, "/t_s"), number(row, "/mpa/value"));
            assert!((value / fitted(t) - 1.0).abs() < 1e-9, "{t}: {found}");
        }
        assert_eq!(found["not_included"][0], "contact");
    }
    println!("off: {worst:e}");
    // What the guide states of it.
    assert!(worst < 3e-4, "{worst}");
}

/// At late times `J` is one over the equilibrium less what still creeps, and the product with `G` stays below one (Ferry,
/// Viscoelastic Properties of Polymers, 3rd ed., 1980, chapter 1).
#[test]
fn creep_compliance_belongs_to_the_modulus() {
    let at = tempfile::tempdir().unwrap();
    press_table(at.path(), "press.csv", [0.1, 60.0, 2e-4], relaxed);
    let line = format!("material press.csv --property relaxation {PUNCH} --terms 3 --json");
    let found = answer(&typed(at.path(), &line));
    let creep = &found["creep"];
    let instantaneous = number(creep, "/instantaneous_per_mpa/value");
    assert!((instantaneous * number(&found, "/instantaneous_mpa/value") - 1.0).abs() < 1e-12);
    let sum: f64 = creep["terms"]
        .as_array()
        .unwrap()
        .iter()
        .map(|term| number(term, "/compliance_per_mpa/value"))
        .sum();
    let last = number(&found, "/equilibrium_mpa/value");
    assert!(((instantaneous + sum) * last - 1.0).abs() < 1e-9, "{found}");
    let both =
        found["modulus"].as_array().unwrap().iter().zip(creep["compliance"].as_array().unwrap());
    for (modulus, compliance) in both {
        let product = number(modulus, "/mpa/value") * number(compliance, "/per_mpa/value");
        assert!((0.5..1.0).contains(&product), "{product}: {found}");
    }
    assert!(found["term_choice"].is_null());
}

/// The modulus of a punch falls with the radius and, at a given force, with `1 / (1 - nu)`: so does every standard uncertainty.
#[test]
fn budget_of_a_relaxation_modulus_is_that_of_its_law() {
    let at = tempfile::tempdir().unwrap();
    press_table(at.path(), "press.csv", [0.1, 30.0, 2e-4], relaxed);
    let line = "material press.csv --property relaxation --indenter flat-punch --radius 3.00±0.03 --poisson 0.45±0.01 --law sneddon --thickness 800 --contact-error 0.002 --terms 3";
    let found = answer(&typed(at.path(), &format!("{line} --json")));
    let row = |source: &str| {
        let rows = found["budget"].as_array().unwrap();
        let row = rows.iter().find(|row| row["source"] == source).unwrap();
        ["/instantaneous_mpa", "/equilibrium_mpa"]
            .map(|name| number(row, name) / number(&found, &format!("{name}/value")))
    };
    for (source, expected) in [("radius", 0.01), ("Poisson's ratio", 0.01 / 0.55)] {
        for share in row(source) {
            assert!((share / expected - 1.0).abs() < 0.02, "{source}: {share} {expected}");
        }
    }
    // A contact that is deeper by its error, as a fit of the same forces finds it.
    let text = std::fs::read_to_string(at.path().join("press.csv")).unwrap();
    let moved = text.lines().map(|row| match row.split(',').collect::<Vec<_>>()[..] {
        [t, depth, force] if depth.parse::<f64>().is_ok() => {
            format!("{t},{},{force}\n", depth.parse::<f64>().unwrap() - 0.002)
        }
        _ => format!("{row}\n"),
    });
    std::fs::write(at.path().join("moved.csv"), moved.collect::<String>()).unwrap();
    let moved = line.replace("press.csv", "moved.csv");
    let moved = answer(&typed(at.path(), &format!("{moved} --json")));
    let names = ["/instantaneous_mpa/value", "/equilibrium_mpa/value"];
    for (name, share) in names.into_iter().zip(row("contact")) {
        let expected = number(&moved, name) / number(&found, name) - 1.0;
        assert!((share / expected - 1.0).abs() < 0.05, "{name}: {share} {expected}");
    }
    let missing = ["force zero", "calibration", "machine compliance"];
    assert_eq!(found["not_included"], serde_json::json!(missing));
    let text = stdout(&typed(at.path(), line));
    for words in ["G instantaneous", "Poisson's ratio is the same at all times", "a second radius"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn what_a_record_does_not_hold_is_refused_in_one_sentence() {
    let at = tempfile::tempdir().unwrap();
    press_table(at.path(), "slow.csv", [3.0, 60.0, 2e-4], relaxed);
    press_table(at.path(), "noisy.csv", [0.1, 60.0, 5e-2], relaxed);
    press_table(at.path(), "short.csv", [0.1, 2.0, 2e-4], relaxed);
    let relaxation = format!("--property relaxation {PUNCH}");
    for (line, code, reason) in [
        (format!("slow.csv {relaxation} --terms 3"), 1, "is not identifiable behind a ramp of 2.9"),
        (format!("noisy.csv {relaxation} --terms 3"), 1, "is not identifiable in this record"),
        (format!("short.csv {relaxation} --terms 3"), 1, "is not identifiable in this record"),
        (format!("slow.csv {relaxation} --terms 9"), 2, "the number of terms is 9"),
        (format!("slow.csv {relaxation} --contact-error free"), 2, "(--contact-error MM)"),
        (format!("slow.csv {relaxation} --contact-error=-1"), 2, "the contact is -1 mm"),
        (format!("slow.csv {relaxation} --depth-max 0.1"), 2, "--depth-max belongs to the modulus"),
        (format!("slow.csv {relaxation} --frequency 1"), 2, "--frequency belongs to dynamic moduli"),
        (format!("slow.csv {PUNCH} --terms 2"), 2, "--terms belongs to a relaxation modulus"),
        (
            "slow.csv --property relaxation --indenter sphere --radius 0.5 --poisson 0.45 --thickness 400"
                .into(),
            2,
            "the strain is 0.1",
        ),
        (format!("slow.csv --property dynamic {PUNCH}"), 2, "(--frequency HZ)"),
    ] {
        assert_refused(&typed(at.path(), &format!("material {line}")), code, reason);
    }
    // Without a number of terms it takes those that it sees, and says from when on.
    let found = answer(&typed(at.path(), &format!("material slow.csv {relaxation} --json")));
    assert!(number(&found, "/seen_from_s") > 2.9, "{found}");
    for row in found["modulus"].as_array().unwrap() {
        let (t, mpa) = (number(row, "/t_s"), number(row, "/mpa/value"));
        assert!((mpa / modulus(t) - 1.0).abs() < 0.01, "{t}: {found}");
    }
}

/// A sine on the same body about 0.2 mm, long after it began: each term adds `G i w tau / (1 + i w tau)`.
fn sine_table(at: &Path, name: &str, frequency: f64, amplitude: f64, radius: f64) -> [f64; 2] {
    let angle = |tau: f64| TAU * frequency * tau;
    let storage = |(g, tau): &(f64, f64)| g * angle(*tau).powi(2) / (1.0 + angle(*tau).powi(2));
    let loss = |(g, tau): &(f64, f64)| g * angle(*tau) / (1.0 + angle(*tau).powi(2));
    let shear = [
        EQUILIBRIUM_MPA + TERMS.iter().map(storage).sum::<f64>(),
        TERMS.iter().map(loss).sum::<f64>(),
    ];
    let law = 4.0 * radius / (1.0 - POISSON);
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for index in 0..1600 {
        let t = f64::from(index) / (200.0 * frequency);
        let (sin, cos) = (TAU * frequency * t).sin_cos();
        let depth = 0.2 + amplitude * sin;
        let force = law * (EQUILIBRIUM_MPA * 0.2 + amplitude * (shear[0] * sin + shear[1] * cos));
        let _ = writeln!(text, "{t},{depth},{}", force + 1e-6 * noise(index));
    }
    std::fs::write(at.join(name), text).unwrap();
    shear
}

#[test]
fn sine_on_maxwell_elements_has_its_closed_form() {
    let at = tempfile::tempdir().unwrap();
    for frequency in [0.05, 0.5, 5.0] {
        let shear = sine_table(at.path(), "sine.csv", frequency, 0.01, RADIUS_MM);
        let line = format!(
            "material sine.csv --property dynamic {PUNCH} --frequency {frequency} --contact-error 0.002"
        );
        let found = answer(&typed(at.path(), &format!("{line} --json")));
        let sine = &found["sines"][0];
        let value = |name: &str| number(sine, &format!("/{name}/value"));
        let error = |name: &str| number(sine, &format!("/{name}/standard_uncertainty"));
        for (name, exact) in [
            ("shear_storage_mpa", shear[0]),
            ("shear_loss_mpa", shear[1]),
            ("storage_mpa", 2.9 * shear[0]),
            ("loss_mpa", 2.9 * shear[1]),
            ("tan_delta", shear[1] / shear[0]),
        ] {
            let off = (value(name) - exact).abs();
            assert!(off < 5e-4 * exact && off < 4.5 * error(name), "{name}: {off:e} {found}");
        }
        // A punch is as wide at any depth.
        let rows = sine["budget"].as_array().unwrap();
        let contact = rows.iter().find(|row| row["source"] == "contact").unwrap();
        assert!(number(contact, "/storage_mpa") < 1e-12, "{found}");
        let text = stdout(&typed(at.path(), &line));
        assert!(text.contains("is the same at all frequencies"), "{text}");
    }
}

#[test]
fn sines_of_too_much_or_too_little_are_refused() {
    let at = tempfile::tempdir().unwrap();
    sine_table(at.path(), "sine.csv", 1.0, 0.03, RADIUS_MM);
    let sphere = "--indenter sphere --radius 20 --poisson 0.45 --thickness 400";
    let dynamic = |more: &str| format!("material sine.csv --property dynamic {more}");
    let wide = typed(at.path(), &dynamic(&format!("{sphere} --frequency 1")));
    assert_refused(&wide, 1, "the amplitude is 0.150 of the mean depth");
    let line = dynamic(&format!("{PUNCH} --frequency 1 --moving-mass=-3"));
    assert_refused(&typed(at.path(), &line), 2, "the moving mass is -3");
    let other = typed(at.path(), &dynamic(&format!("{PUNCH} --frequency 7.3")));
    assert_refused(&other, 1, "check the frequency");
}

/// The simulated tissue about a depth `x`: `(mu1 + 2 mu2 x + 3 mu3 x^2 + i w tau_sig x) / (1 + i w tau_eps)` is its stiffness, and
/// `E = K (1 - nu^2) / (2 R)` the modulus under a punch that is wide enough for the law.
#[test]
fn frequency_sweep_of_the_simulated_rig_gives_the_moduli_of_its_tissue() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&typed(
        at,
        "run frequency-sweep --seed 3 --operator Ada --specimen one --about specimen.source=simulated --time-scale max --out sweep --truth truth.json",
    ));
    let truth: Value =
        serde_json::from_str(&std::fs::read_to_string(at.join("truth.json")).unwrap()).unwrap();
    let parameter = |name: &str| number(&truth, &format!("/parameters/{name}"));
    let line = "material sweep --property dynamic --indenter flat-punch --radius 140 --poisson 0.45 --law sneddon --thickness 40000 --moving-mass 0±1";
    let found = answer(&typed(at, &format!("{line} --json")));
    let sines = found["sines"].as_array().unwrap();
    assert_eq!(sines.len(), 5, "{found}");
    for sine in sines {
        let (frequency, x) = (number(sine, "/frequency_hz"), number(sine, "/depth_mean_mm"));
        let (angle, tau) = (TAU * frequency, parameter("tau_eps"));
        let elastic =
            parameter("mu1") + 2.0 * parameter("mu2") * x + 3.0 * parameter("mu3") * x * x;
        let viscous = angle * parameter("tau_sig") * x;
        let under = 1.0 + (angle * tau).powi(2);
        let stiffness =
            [(elastic + viscous * angle * tau) / under, (viscous - elastic * angle * tau) / under];
        for (name, exact) in ["storage_mpa", "loss_mpa"].into_iter().zip(stiffness) {
            let exact = exact * (1.0 - POISSON * POISSON) / 280.0;
            let off = number(sine, &format!("/{name}/value")) - exact;
            let error = number(sine, &format!("/{name}/standard_uncertainty"));
            // The tissue is bent over the amplitude by its cubic part, 2e-4 of the stiffness.
            assert!(
                off.abs() < 4.0 * error + 1e-3 * exact,
                "{frequency} {name}: {off:e} {error:e}"
            );
        }
        let sources: Vec<&str> = sine["budget"]
            .as_array()
            .unwrap()
            .iter()
            .map(|row| row["source"].as_str().unwrap())
            .collect();
        for source in ["residuals", "contact", "calibration", "moving mass"] {
            assert!(sources.contains(&source), "{source}: {sine}");
        }
    }
    assert_eq!(found["not_included"], serde_json::json!(["machine compliance"]));
    // A punch's law is no law of this tissue, whose force grows with the square of the depth: its relaxation is refused.
    assert!(found["prediction_refused"].is_string(), "{found}");
    let relaxation = line.replace("dynamic", "relaxation").replace(" --moving-mass 0±1", "");
    assert_refused(&typed(at, &relaxation), 1, "autocorrelated");
}

/// Its commands are run as they stand, and print every line that the page shows.
#[test]
fn worked_examples_of_the_guide_print_what_it_shows() {
    let folder = tempfile::tempdir().unwrap();
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/guide/relaxation-modulus.md");
    let page = std::fs::read_to_string(page).unwrap();
    let mut printed = String::new();
    let mut shown = 0;
    // Every second part is between fences.
    for block in page.split("```").skip(1).step_by(2) {
        match block.strip_prefix("text\n") {
            Some(lines) => {
                for line in lines.lines() {
                    assert!(printed.contains(line), "{line}\n{printed}");
                    shown += 1;
                }
            }
            None => {
                for line in block.trim().lines() {
                    let output = typed(folder.path(), line.strip_prefix("palpate ").unwrap());
                    succeeded(&output);
                    printed = stdout(&output);
                }
            }
        }
    }
    assert_eq!(shown, 14);
}

#[test]
fn every_saved_property_is_printed_on_the_report_and_its_moduli_are_searched() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = at.join("library/press");
    std::fs::create_dir_all(&session).unwrap();
    let recorded = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/sessions/every-motion");
    std::fs::copy(Path::new(recorded).join("000.mcap"), session.join("000.mcap")).unwrap();
    let cone =
        "material library/press --indenter cone --half-angle 80 --poisson 0.49 --thickness 50000";
    let mut words = Vec::new();
    for property in ["unloading", "relaxation", "dynamic"] {
        let line = format!("{cone} --property {property} --save my-{property}");
        let text = stdout(&typed(at, &line));
        words.extend(text.lines().next().map(str::to_owned));
    }
    let relaxation = answer(&typed(at, &format!("{cone} --property relaxation --json")));
    let equilibrium = number(&relaxation, "/equilibrium_mpa/value");
    for (condition, count) in [
        (format!("equilibrium_mpa>{}", 0.9 * equilibrium), 1),
        (format!("equilibrium_mpa>{}", 1.1 * equilibrium), 0),
    ] {
        let found = answer(&crate::support::palpate(at, &["find", "--json", &condition]));
        assert_eq!(found["sessions"].as_array().unwrap().len(), count, "{condition}: {found}");
    }
    stdout(&typed(at, "report library/press --html page.html"));
    let page = std::fs::read_to_string(at.join("page.html")).unwrap();
    for words in words {
        let printed = words.replace('\'', "&apos;");
        assert!(page.contains(&printed), "{printed}");
    }
}
