//! Protocols as files: the built-in ones, typical mistakes, and random texts.

use palpate_model::calibration::Calibration;
use palpate_model::rig::{Limits, RigDescription};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::file::{BUILT_IN, Protocol, ProtocolProblem, built_in, reference};
use palpate_protocols::plans::{BodyParameter, FindContact, HoldUntil, Plan, RampHold, Step};
use palpate_protocols::preview::preview;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn protocol(name: &str) -> Protocol {
    match built_in(name).expect("there is such a protocol") {
        Ok(protocol) => protocol,
        Err(problems) => panic!("{name}: {}", sentences(&problems)),
    }
}

fn sentences(problems: &[ProtocolProblem]) -> String {
    let lines: Vec<String> = problems.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

fn values(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
    let owned = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
    pairs.iter().map(owned).collect()
}

fn plan(name: &str, pairs: &[(&str, &str)]) -> Plan {
    protocol(name)
        .plan(&values(pairs))
        .unwrap_or_else(|problems| panic!("{name}: {}", sentences(&problems)))
}

fn bench() -> (RigDescription, Limits, Calibration) {
    let settings = palpate_drivers::sim::SimSettings::default();
    let rig = palpate_drivers::open("sim", &settings).expect("the simulated rig opens");
    let rig = rig.description().clone();
    let limits = Limits::for_travel(rig.travel);
    (rig, limits, palpate_drivers::sim::calibration(settings.profile))
}

#[test]
fn every_built_in_protocol_is_named_like_its_file_and_runs_on_the_simulated_rig() {
    let (rig, limits, calibration) = bench();
    let curve = calibration.curve().unwrap();
    for (name, _) in BUILT_IN {
        let protocol = protocol(name);
        assert_eq!(protocol.name, *name);
        for parameter in &protocol.parameters {
            assert!(!parameter.about.is_empty(), "{name}: {}", parameter.name);
        }
        let written = protocol.write_out(&BTreeMap::new()).unwrap();
        assert_eq!(written.warnings, [], "{name}");
        assert_eq!(written.lines.len(), written.plan.steps.len());
        let preview = preview(&written.plan, &rig, &limits, &curve, false);
        assert_eq!(preview.refusals, [] as [String; 0], "{name}");
    }
    let folder = fs::read_dir(workspace().join("protocols/builtin")).unwrap();
    assert_eq!(folder.count(), BUILT_IN.len(), "a file is not in the list");
}

#[test]
fn ramp_hold_protocol_gives_the_ramp_hold_plan() {
    let until = HoldUntil::new(BodyParameter::TauEps, 0.01);
    let cases = [
        (RampHold::default(), vec![]),
        (
            RampHold {
                speed: MmPerS(1.5),
                depth: Depth(20.0),
                hold: Seconds(600.0),
                until: Some(until),
                unload: Some(MmPerS(0.3)),
            },
            vec![
                ("speed", "1.5 mm/s"),
                ("depth", "2 cm"),
                ("hold", "10 min"),
                ("until", "tau=1%"),
                ("unload", "0.3 mm/s"),
            ],
        ),
    ];
    for (params, pairs) in cases {
        let mut from_file = plan("ramp-hold", &pairs);
        let source = from_file.source.take().unwrap();
        assert_eq!(from_file, params.plan());
        assert_eq!(source.values["speed"], pairs.first().map_or("0.75 mm/s", |pair| pair.1));
        assert_eq!(source.crc32.len(), 8);
    }
}

#[test]
fn a_search_for_contact_without_keys_is_the_usual_one() {
    let plan = plan("zeroing", &[]);
    let searches = plan.steps.iter().filter_map(|planned| match planned.step {
        Step::FindContact(search) => Some(search),
        _ => None,
    });
    let searches: Vec<FindContact> = searches.collect();
    assert_eq!(searches, [FindContact::default()]);
}

#[test]
fn cycles_are_numbered_and_end_at_checkpoints() {
    let plan = plan("preconditioning", &[("cycles", "3"), ("rest", "1 min")]);
    let cycles: Vec<u32> = plan.steps.iter().map(|planned| planned.cycle).collect();
    assert_eq!(cycles, [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 0]);
    let checkpoints: Vec<(usize, &str)> = plan.checkpoints_from(0).collect();
    assert_eq!(checkpoints, [(6, "after cycle 1"), (9, "after cycle 2"), (12, "after cycle 3")]);
    // Two speeds and two depths are four repeats of the measurement, not twice two.
    let series = self::plan("validation-series", &[]);
    let last = series.steps.iter().map(|planned| planned.cycle).max();
    assert_eq!(last, Some(4));
    let name = series.checkpoints_from(0).last().unwrap().1;
    assert_eq!(name, "after 30 mm at 1.5 mm/s");
}

#[test]
fn a_calibration_goes_up_and_down_over_every_mass() {
    let plan = plan("load-cell-calibration", &[("repeats", "1")]);
    let readings: Vec<(f64, bool)> = plan
        .steps
        .iter()
        .filter_map(|planned| match &planned.step {
            Step::Weigh(weigh) => Some((weigh.mass_g, weigh.is_loading)),
            _ => None,
        })
        .collect();
    let up = [0, 140, 240, 340, 440, 540, 640, 740, 840, 940, 1040];
    let mut wanted: Vec<(f64, bool)> = up.iter().map(|mass| (f64::from(*mass), true)).collect();
    wanted.extend(up.iter().rev().skip(1).map(|mass| (f64::from(*mass), false)));
    assert_eq!(readings, wanted);
}

#[test]
fn values_that_are_typed_are_checked_by_name() {
    for (name, pairs, words) in [
        ("ramp-hold", [("speed", "30 mm")], "parameter 'speed': "),
        ("ramp-hold", [("sped", "1 mm/s")], "'sped'; did you mean 'speed'?"),
        ("ramp-hold", [("hold", "-1 s")], "0 s or more"),
        ("ramp-hold", [("depth", "none")], "none is"),
        ("ramp-hold", [("until", "tau")], "'hold': 'tau'"),
        ("preconditioning", [("cycles", "0")], "1 or more"),
        ("preconditioning", [("cycles", "2.5")], "not a whole number"),
        ("validation-series", [("speeds", "1 mm/s, 2")], "2 has no unit"),
        ("zeroing", [("thickness", "yes")], "true or false"),
    ] {
        let problems = protocol(name).plan(&values(&pairs)).unwrap_err();
        assert!(sentences(&problems).contains(words), "{}", sentences(&problems));
    }
}

/// Every file ends with the sentences it must get, one a line: `#: line 14: ...`, and may get no other.
#[test]
fn typical_mistakes_get_a_sentence_to_act_on() {
    let folder = workspace().join("tests/protocols/mistakes");
    let mut count = 0;
    for entry in fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        let wanted: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("#: ")).collect();
        assert!(!wanted.is_empty(), "{}", path.display());
        let found = match Protocol::read(&text) {
            Err(problems) => problems,
            Ok(protocol) => protocol.write_out(&BTreeMap::new()).unwrap().warnings,
        };
        assert_eq!(sentences(&found), wanted.join("\n"), "{}", path.display());
        count += 1;
    }
    assert!(count >= 10, "{count} files in {}", folder.display());
}

/// A generator that is the same everywhere (Steele, Lea and Flood 2014, SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }
}

/// Spoils a text: letters, words, whole lines, or pieces of another protocol.
fn spoilt(text: &str, other: &str, random: &mut Random) -> String {
    const PIECES: [&str; 16] = [
        "\"",
        "[",
        "]",
        "{",
        "}",
        "=",
        "$",
        "$x",
        "{",
        "\n",
        "1e308",
        "-1",
        "nan",
        "µ",
        "99999999999",
        "\"none\"",
    ];
    let mut letters: Vec<char> = text.chars().collect();
    for _ in 0..=random.below(4) {
        let at = random.below(letters.len());
        match random.below(5) {
            0 => {
                letters.remove(at);
            }
            1 => {
                let piece = PIECES[random.below(PIECES.len())];
                letters.splice(at..at, piece.chars());
            }
            2 => {
                let end = (at + random.below(60)).min(letters.len());
                letters.drain(at..end);
            }
            3 => {
                let lines: Vec<&str> = other.lines().collect();
                let line = format!("\n{}\n", lines[random.below(lines.len())]);
                letters.splice(at..at, line.chars());
            }
            _ => {
                let number = random.below(100_000).to_string();
                let digit = (at..letters.len()).find(|i| letters[*i].is_ascii_digit());
                if let Some(digit) = digit {
                    letters.splice(digit..=digit, number.chars());
                }
            }
        }
        if letters.is_empty() {
            break;
        }
    }
    letters.into_iter().collect()
}

#[test]
fn random_texts_never_panic_and_every_problem_has_its_line() {
    let (rig, limits, calibration) = bench();
    let curve = calibration.curve().unwrap();
    let mut random = Random(5);
    let (mut read, mut refused) = (0, 0);
    for round in 0..60 {
        for (name, text) in BUILT_IN {
            let (_, other) = BUILT_IN[random.below(BUILT_IN.len())];
            let text = spoilt(text, other, &mut random);
            let lines = text.lines().count() as u32;
            match Protocol::read(&text) {
                Ok(protocol) => {
                    read += 1;
                    let plan = protocol.plan(&BTreeMap::new()).unwrap();
                    let preview = preview(&plan, &rig, &limits, &curve, false);
                    assert!(preview.longest.0.is_finite(), "{name}, round {round}");
                }
                Err(problems) => {
                    refused += 1;
                    assert!(!problems.is_empty() && problems.len() <= 21);
                    for problem in problems {
                        assert!(problem.line <= lines + 1, "{problem}");
                        assert!(!problem.message.is_empty());
                    }
                }
            }
        }
    }
    // Both ways are taken, or the edits test nothing.
    assert!(read > 50 && refused > 200, "{read} read, {refused} refused");
}

#[test]
fn a_protocol_cannot_be_made_endless() {
    let head = "palpate = 1\nname = \"x\"\nversion = 1\ntitle = \"x\"\nabout = \"x\"\nsource = \"x\"\n[procedure]\n";
    let rest = "{ do = \"rest\", for = \"1 s\" }";
    let nested = (0..5)
        .fold(rest.to_owned(), |inner, _| format!("{{ repeat = 9000, steps = [ {inner} ] }}"));
    let hollow =
        (0..5).fold(String::new(), |inner, _| format!("{{ repeat = 9000, steps = [ {inner} ] }}"));
    let deep =
        (0..7).fold(rest.to_owned(), |inner, _| format!("{{ repeat = 1, steps = [ {inner} ] }}"));
    let brackets = "[".repeat(100_000);
    for (steps, words) in [
        (nested, "more than 10000 steps"),
        (hollow, "steps"),
        (deep, "6 levels deep"),
        (brackets, "not TOML"),
    ] {
        let problems = Protocol::read(&format!("{head}steps = [ {steps} ]\n")).unwrap_err();
        assert!(sentences(&problems).contains(words), "{}", sentences(&problems));
    }
}

#[test]
fn docs_page_ends_with_the_printed_reference() {
    let page = fs::read_to_string(workspace().join("docs/protocols.md")).unwrap();
    assert!(
        page.ends_with(&reference()),
        "the end of docs/protocols.md is not what 'palpate protocol words' prints; replace it"
    );
}
