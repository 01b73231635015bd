//! `palpate material --property master-curve` on sweeps of the simulated rig.

use crate::support::{answer, assert_refused, stdout, succeeded, typed};
use palpate_model::metadata::SessionLabels;
use palpate_sessions::{FileSink, LogPart, LogWriter, Session, SessionFolder};
use serde_json::Value;
use std::path::Path;

const PRESS: &str = "--property master-curve --indenter cone --half-angle 70.0±0.2 --poisson 0.49±0.01 --law sneddon --thickness 10000";
const SWEEP: &str = "--set depth=9mm --set amplitude=0.1mm --set speed=3mm/s --set settle=10s --set pause=5s --set cycles=3 --operator Ada --specimen one --about specimen.source=simulated --time-scale max";
/// Ten in a decade, so that the moduli of one relaxation time are a smooth curve between them.
const FREQUENCIES: &str = "0.05Hz,0.063Hz,0.08Hz,0.1Hz,0.125Hz,0.16Hz,0.2Hz,0.25Hz,0.32Hz,0.4Hz";

fn number(object: &Value, path: &str) -> f64 {
    object.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {object}"))
}

/// A sweep of one specimen of the simulated tissue, which knows no temperature, with noise, drift and start of its own.
fn record(at: &Path, name: &str, repeat: u32, frequencies: &str, more: &str) {
    let line = format!(
        "run frequency-sweep {SWEEP} --set frequencies={frequencies} --seed 3 --repeat {repeat} --out {name} {more}"
    );
    succeeded(&typed(at, line.trim()));
}

/// `a_T` of 50 kJ/mol to 20 °C.
fn shift_factor(temperature_c: f64) -> f64 {
    (50.0 / 8.314_462_618e-3 * (1.0 / (temperature_c + 273.15) - 1.0 / 293.15)).exp()
}

/// The same session as of a tissue whose every time is `share` as long, at a temperature: the controller's tick is.
fn retime(at: &Path, from: &str, to: &str, share: f64, temperature_c: f64) {
    let from = at.join(from);
    let mut outline = Session::scan(&from, &mut |_| {}).unwrap();
    let mut labels = SessionLabels::default();
    labels.set("specimen.temperature_c", &temperature_c.to_string()).unwrap();
    outline.manifest.about = labels.about;
    outline.manifest.session_id += to;
    let rig = outline.manifest.rig.as_mut().unwrap();
    rig.tick_nanos = (share * rig.tick_nanos as f64).round() as u64;
    let folder = at.join(to);
    let _held = SessionFolder::create(&folder).unwrap();
    let file = folder.join("000.mcap");
    let sink = FileSink::create(&file).unwrap();
    let mut log = LogWriter::begin(sink, "000.mcap", &outline.manifest).unwrap();
    Session::scan_parts(&from, &mut |part| {
        if let LogPart::Samples(block) = part {
            log.append(&block.rows().collect::<Vec<_>>(), &[]).unwrap();
        }
    })
    .unwrap();
    log.append(&[], &outline.entries).unwrap();
    log.finish(outline.end.unwrap()).unwrap();
}

/// Sessions of the same specimen whose times follow Arrhenius' law.
#[test]
fn shift_factors_of_retimed_sessions_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (repeat, temperature_c) in [(0, 10.0), (1, 20.0), (2, 37.0)] {
        record(at, &format!("recorded-{repeat}"), repeat, FREQUENCIES, "");
        let (from, to) = (format!("recorded-{repeat}"), format!("at-{temperature_c}"));
        retime(at, &from, &to, shift_factor(temperature_c), temperature_c);
    }
    let line = format!("material at-37 at-10 at-20 {PRESS}");
    let found = answer(&typed(at, &format!("{line} --json")));
    assert_eq!(found["reference_temperature_c"], 20.0);
    assert_eq!(found["sweeps"].as_array().unwrap().len(), 3);
    for sweep in found["sweeps"].as_array().unwrap() {
        let exact = shift_factor(number(sweep, "/temperature_c")).log10();
        let off = (number(sweep, "/log10_shift_factor/value") - exact).abs();
        let error = number(sweep, "/log10_shift_factor/standard_uncertainty");
        assert!(off <= 3.5 * error && error < 0.05, "{exact} {off} {error}: {found}");
    }
    let energy = |name: &str| number(&found, &format!("/activation_energy_kj_per_mol/{name}"));
    assert!((energy("value") - 50.0).abs() < 3.5 * energy("standard_uncertainty"), "{found}");
    let curve = found["curve"].as_array().unwrap();
    assert_eq!(curve.len(), 30);
    let reduced: Vec<f64> =
        curve.iter().map(|point| number(point, "/reduced_frequency_hz")).collect();
    assert!(reduced.is_sorted() && reduced[29] / reduced[0] > 7.0, "{reduced:?}");
    let text = stdout(&typed(at, &line));
    for words in ["reference        20 °C", "one curve        10 and 20 °C", "activation energy"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
    // At another of their temperatures the curve is as wide.
    let moved = answer(&typed(at, &format!("{line} --reference-temperature 37 --json")));
    let moved = moved["curve"].as_array().unwrap();
    let ratio =
        number(&moved[29], "/reduced_frequency_hz") / number(&moved[0], "/reduced_frequency_hz");
    assert!((ratio * reduced[0] / reduced[29] - 1.0).abs() < 1e-9, "{ratio}");
    let other = typed(at, &format!("{line} --reference-temperature 25"));
    assert_refused(
        &other,
        2,
        "no session is at 25 °C; choose the reference from 10 °C, 20 °C, 37 °C",
    );
}

#[test]
fn sessions_that_are_not_one_curve_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let at_20 = "--about specimen.temperature_c=20";
    let at_37 = "--about specimen.temperature_c=37";
    let [low, high] = ["0.05Hz,0.063Hz,0.08Hz,0.1Hz", "0.25Hz,0.32Hz,0.4Hz"];
    let wide = "0.05Hz,0.1Hz,0.16Hz,0.25Hz,0.4Hz";
    record(at, "low", 0, low, at_20);
    record(at, "wide", 0, wide, at_20);
    record(at, "high", 1, high, at_37);
    record(at, "stiff", 2, wide, &format!("{at_37} --stiffness 150"));
    record(at, "unknown", 3, high, "");
    for (sources, code, reason) in [
        ("low high", 1, "the sweeps at 20 and 37 °C do not overlap"),
        ("wide stiff", 1, "the sweeps at 20 and 37 °C are not one curve"),
        ("high stiff", 1, "all sweeps are at 37 °C"),
        ("low unknown", 2, "unknown has no temperature of its specimen"),
        ("low", 2, "at two or more temperatures, not one"),
        ("low low", 2, "low is given twice"),
    ] {
        assert_refused(&typed(at, &format!("material {sources} {PRESS}")), code, reason);
    }
    let dynamic = PRESS.replace("master-curve", "dynamic");
    let several = typed(at, &format!("material low high {dynamic}"));
    assert_refused(&several, 2, "only a master curve takes several sources");
    let reference = typed(at, &format!("material low {dynamic} --reference-temperature 20"));
    assert_refused(&reference, 2, "--reference-temperature belongs to a master curve");
}
