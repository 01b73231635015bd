use super::*;
use palpate_analysis::protocol_sources::ProtocolSource;
use palpate_drivers::sim::SimSettings;
use palpate_model::units::MmPerS;
use palpate_protocols::plans::{Hold, RampHold, Step, Unload};

fn bench() -> (RigDescription, RunSetup) {
    let settings = SimSettings::default();
    let rig = palpate_drivers::open("sim", &settings).unwrap();
    let calibration = palpate_drivers::sim::calibration(settings.profile);
    let bench = RunSetup {
        curve: calibration.curve().unwrap(),
        calibration,
        doubts: Vec::new(),
        limits: Limits::for_travel(rig.description().travel),
        to_acknowledge: Vec::new(),
    };
    (rig.description().clone(), bench)
}

/// Types into fields by name and checks.
fn type_into(form: &mut ProtocolForm, pairs: &[(&str, &str)]) {
    for (name, text) in pairs {
        let field = form.fields.iter_mut().find(|one| one.parameter.name == *name);
        match field {
            Some(field) => field.text = (*text).into(),
            None => {
                let label = form.label_fields.iter_mut().find(|one| one.key.name == *name);
                label.unwrap().text = (*text).into();
            }
        }
    }
    let (rig, bench) = bench();
    form.refresh(&rig, &bench, false);
}

fn form_with(pairs: &[(&str, &str)]) -> (ProtocolForm, RunSetup) {
    let mut form = ProtocolForm::default();
    type_into(&mut form, pairs);
    (form, bench().1)
}

#[test]
fn a_failed_daily_check_asks_for_the_box_to_be_ticked() {
    let (rig, mut bench) = bench();
    bench.to_acknowledge = vec!["the daily check failed".into()];
    let mut form = ProtocolForm::default();
    form.refresh(&rig, &bench, false);
    assert!(form.request(&bench).is_none());
    form.acknowledge(true);
    let request = form.request(&bench).unwrap();
    assert!(request.is_acknowledged);
    assert_eq!(request.to_acknowledge, bench.to_acknowledge);
}

#[test]
fn the_default_plan_is_the_ramp_and_hold_and_may_start() {
    let (form, bench) = form_with(&[]);
    assert_eq!(form.verdict(), Ok(()));
    let request = form.request(&bench).unwrap();
    assert_eq!(request.plan.steps, RampHold::default().plan().steps);
    assert_eq!(request.out, None);
    assert!(!request.is_acknowledged);
    assert_eq!(request.labels.indenter, "blunt 12 mm probe");
}

#[test]
fn wrong_fields_refuse_by_name() {
    for (name, text, word) in [
        ("speed", "fast", "correct the speed"),
        ("speed", "0.7501", "correct the speed"),
        ("speed", "", "correct the speed"),
        ("hold", "-0.1", "correct the hold"),
        ("depth", "-1", "depth"),
        ("depth", "1e4", "depth"),
        ("hold", "1e9", "correct the hold"),
        ("specimen.thickness_mm", "0", "correct the specimen.thickness_mm"),
    ] {
        let (form, bench) = form_with(&[(name, text)]);
        let reason = form.verdict().unwrap_err();
        assert!(reason.contains(word), "{name} {text}: {reason}");
        assert!(form.request(&bench).is_none());
    }
}

#[test]
fn an_empty_rule_holds_the_whole_time_and_a_wrong_one_refuses() {
    let until = |form: &ProtocolForm| {
        let plan = &form.checked().unwrap().plan;
        plan.steps.iter().find_map(|planned| match planned.step {
            Step::Hold(Hold { until, .. }) => until,
            _ => None,
        })
    };
    for (text, share) in [("", None), ("  ", None), ("tau=1.5%", Some(0.015))] {
        let (form, _) = form_with(&[("until", text)]);
        assert_eq!(until(&form).map(|rule| rule.relative), share, "{text}");
        assert_eq!(form.verdict(), Ok(()));
    }
    for text in ["tau=0%", "tau=100%", "soon"] {
        let (form, _) = form_with(&[("until", text)]);
        assert!(form.verdict().is_err(), "{text}");
    }
}

#[test]
fn an_unload_speed_adds_a_recorded_unloading() {
    let (mut form, bench) = form_with(&[("unload", "0.6")]);
    let plan = form.request(&bench).unwrap().plan;
    let has_unload = plan
        .steps
        .iter()
        .any(|planned| matches!(planned.step, Step::Unload(Unload { speed, .. }) if speed == MmPerS(0.6)));
    assert!(has_unload);
    type_into(&mut form, &[("unload", "0.601")]);
    assert!(form.verdict().unwrap_err().contains("unload"));
}

#[test]
fn an_acknowledgement_holds_for_its_words_only() {
    let (mut form, bench) = form_with(&[("depth", "45")]);
    assert!(form.verdict().unwrap_err().contains("tick the box"));
    form.acknowledge(true);
    assert_eq!(form.verdict(), Ok(()));
    assert!(form.request(&bench).unwrap().is_acknowledged);
    type_into(&mut form, &[("depth", "47")]);
    assert!(!form.is_acknowledged());
    assert!(form.verdict().is_err());
}

#[test]
fn labels_that_a_protocol_requires_must_be_filled_in() {
    let mut form = ProtocolForm::default();
    form.choose_built_in("preconditioning");
    type_into(&mut form, &[("operator", "Ada")]);
    let reason = form.verdict().unwrap_err();
    assert_eq!(reason, "fill in specimen, specimen.source first");
    type_into(&mut form, &[("specimen", "S-1"), ("specimen.source", "pig"), ("cycles", "2")]);
    assert_eq!(form.verdict(), Ok(()));
    let request = form.request(&bench().1).unwrap();
    let cycles = request.plan.steps.iter().map(|planned| planned.cycle).max();
    assert_eq!(cycles, Some(2));
    assert!(request.labels.is_set("specimen.source"));
    assert!(form.checked().unwrap().deepest_mm() > 19.9);
}

#[test]
fn a_file_with_mistakes_names_their_lines_and_does_not_start() {
    let mut form = ProtocolForm::default();
    let text = "palpate = 1\nname = \"x\"\nversion = 1\ntitle = \"X\"\nabout = \"x\"\n[procedure]\nsteps = [\n  { do = \"rmap\" },\n]\n";
    form.choose_file(Path::new("x.toml"), Ok(ProtocolSource::free(text.into())));
    type_into(&mut form, &[]);
    let words: Vec<String> = form.problems().iter().map(ProtocolProblem::to_string).collect();
    assert!(words.iter().any(|one| one.starts_with("line 8: ")), "{words:?}");
    assert!(form.verdict().unwrap_err().contains("correct the protocol file"));
    form.choose_built_in("ramp-hold");
    type_into(&mut form, &[]);
    assert_eq!(form.verdict(), Ok(()));
}

#[test]
fn what_is_wrong_with_a_value_stands_at_its_field_without_lines_of_a_file() {
    for (text, words) in [
        ("1200", "1200 mm is beyond the travel of rig sim, which ends at 150"),
        ("-3", "-3 mm is out of range"),
    ] {
        let (form, _) = form_with(&[("depth", text)]);
        let field = form.fields.iter().find(|one| one.parameter.name == "depth").unwrap();
        let reason = field.value.as_ref().err().or(field.objection.as_ref()).unwrap();
        assert!(reason.contains(words) && !reason.contains("line"), "{text}: {reason}");
        assert_eq!(form.verdict().unwrap_err(), "correct the depth first");
    }
    let (form, _) = form_with(&[("depth", "20")]);
    assert!(form.fields.iter().all(|field| field.objection.is_none()));
    assert_eq!(form.verdict(), Ok(()));
}

#[test]
fn a_weight_that_the_calibration_cannot_tell_is_refused_before_the_check() {
    let (rig, bench) = bench();
    let mut form = ProtocolForm::default();
    form.choose_built_in(DAILY_CHECK);
    for (mass, is_possible) in [("200", false), ("840", true)] {
        type_into(&mut form, &[("operator", "Ada"), ("mass", mass)]);
        form.refresh(&rig, &bench, true);
        assert_eq!(form.verdict().is_ok(), is_possible, "{mass} g: {:?}", form.verdict());
    }
}

#[test]
fn a_check_takes_the_place_of_what_one_before_said_and_of_nothing_else() {
    let (_, mut bench) = bench();
    let yesterday =
        "rig sim failed its daily check today (the way home is blocked); repair the rig";
    bench.to_acknowledge = vec!["the calibration is 400 d old".into(), yesterday.into()];
    bench.take_gate(vec!["rig sim had no daily check today".into()]);
    bench.take_gate(Vec::new());
    assert_eq!(bench.to_acknowledge, ["the calibration is 400 d old"]);
}

#[test]
fn specimens_are_not_added_with_a_protocol_that_touches_none() {
    let mut form = ProtocolForm::default();
    let (rig, bench) = bench();
    for (name, wanted) in [
        ("daily-check", FIRST),
        ("load-cell-calibration", FIRST),
        ("preconditioning", "preconditioning"),
    ] {
        form.choose_built_in(name);
        form.refresh(&rig, &bench, true);
        assert_eq!(form.specimen_protocol(), wanted, "{name}");
    }
}

#[test]
fn a_chosen_folder_gets_numbered_sessions() {
    let folder = std::env::temp_dir().join(format!("palpate-form-{}", std::process::id()));
    let (mut form, bench) = form_with(&[]);
    form.folder = folder.display().to_string();
    let first = form.request(&bench).unwrap().out.unwrap();
    assert_eq!(first, folder.join("session-0001"));
    std::fs::create_dir_all(&first).unwrap();
    let second = form.request(&bench).unwrap().out.unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(second, folder.join("session-0002"));
}

#[test]
fn the_next_specimen_has_no_label_of_the_one_before() {
    let own = [
        ("specimen.site", "left lobe"),
        ("series.order", "2"),
        ("animal.name", "pig-3"),
        ("animal.treatment", "control"),
    ];
    let (mut form, _) = form_with(&own);
    type_into(&mut form, &[("operator", "Ada"), ("indenter.diameter_mm", "12")]);
    let wanted = QueuedSpecimen {
        specimen: "liver 2".into(),
        protocol: FIRST.into(),
        labels: [("animal.name".to_owned(), "pig-4".to_owned())].into(),
    };
    form.take_labels(&wanted, false);
    assert_eq!((form.specimen(), form.label_text("animal.name")), ("liver 2", "pig-4"));
    for name in ["specimen.site", "series.order", "animal.treatment"] {
        assert_eq!(form.label_text(name), "", "{name}");
    }
    assert_eq!(form.label_text("operator"), "Ada");
    assert_eq!(form.label_text("indenter.diameter_mm"), "12");
}
