//! `palpate haptics`.

use crate::support::{
    assert_prints, assert_refused, assert_says, json, palpate, split_words, stderr, stdout, typed,
};

#[test]
fn the_thesis_body_is_reported_where_it_returns_energy_and_what_a_device_needs() {
    let at = tempfile::tempdir().unwrap();
    let with = palpate(at.path(), &["haptics", "check", "thesis", "--json"]);
    let with = json(&with);
    // The bands of the source's body, which its parameters imply: 0.712 mm and 1.430 mm.
    let ends = |name: &str| with["margin"][name][0]["to"].as_f64().unwrap();
    assert!((ends("cycles") - 0.712).abs() < 1e-3, "{with}");
    assert!((ends("pokes") - 1.430).abs() < 1e-3, "{with}");
    let sentences = with["sentences"].as_array().unwrap();
    assert!(sentences.len() >= 3, "{with}");
    // The back-EMF of a voltage drive calms what a current drive without friction lets buzz.
    let calm = &with["tried"][0];
    assert_eq!(calm["buzz_share"], 0.0, "{with}");
    let weak =
        split_words("haptics check thesis --drive current --damping 0.5 --friction 0 --delay 2");
    let words = palpate(at.path(), &weak);
    let printed = stdout(&words);
    assert!(printed.contains("damping"), "{printed}");
    let both = json(&palpate(at.path(), &[&weak[..], &["--json"]].concat()));
    let [without, with] = [0, 1].map(|i| &both["tried"][i]);
    assert!(without["buzz_share"].as_f64().unwrap() > 0.5, "{both}");
    assert!(without["swing_mm"].as_f64().unwrap() > 0.1, "{both}");
    // With guards what begins as the hand arrives is over at once.
    let last = |tried: &serde_json::Value| tried["buzz_until_s"].as_f64().unwrap_or(0.0);
    assert!(last(without) > 2.5 && last(with) < 0.5, "{both}");
    let swing = |tried: &serde_json::Value| tried["swing_mm"].as_f64().unwrap();
    assert!(swing(with) < 0.2 * swing(without), "{both}");
}

#[test]
fn a_loop_tells_how_it_kept_its_time_and_what_is_impossible_is_refused() {
    let at = tempfile::tempdir().unwrap();
    let run = json(&typed(at.path(), "haptics run thesis --seconds 1 --json"));
    assert!(run["work"]["count"].as_u64().unwrap() > 100, "{run}");
    assert!(run["work"]["p50_s"].as_f64().unwrap() > 0.0, "{run}");
    assert!(!run["priority"].as_str().unwrap().is_empty());
    // A stroke beyond what was measured is extrapolated, with a note.
    let session = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/sessions/ramp-hold-lab");
    let far = palpate(at.path(), &["haptics", "check", session]);
    assert_says(&far, "extrapolated");
    let near = palpate(at.path(), &["haptics", "check", session, "--depth", "10"]);
    assert!(!stderr(&near).contains("extrapolated"), "{}", stderr(&near));
    for (words, reason) in [
        (&["check", "thesis", "--rate", "20"][..], "250 Hz to 10000 Hz"),
        (&["check", "thesis", "--damping", "-1"], "--damping -1"),
        (&["check", "nowhere"], "nowhere"),
        (&["run", "thesis", "--seconds", "0"], "--seconds 0"),
    ] {
        let out = palpate(at.path(), &[&["haptics"], words].concat());
        assert_eq!(out.status.code(), Some(2), "{words:?}");
        assert!(stderr(&out).contains(reason), "{words:?}: {}", stderr(&out));
    }
}

#[test]
fn the_check_of_the_source_follows_and_its_table_is_fitted() {
    let at = tempfile::tempdir().unwrap();
    let words = split_words("haptics follow thesis --plot follow.svg --table follow.csv --json");
    let found = json(&palpate(at.path(), &words));
    let number = |name: &str| found[name].as_f64().unwrap();
    // 6.396 N is the source's peak at 30 mm; the slider gives way, and so the master is a tenth of a millimetre less deep.
    assert!((number("peak_commanded_n") - 6.396).abs() < 0.15, "{found}");
    assert!((number("offset_n") - 0.81).abs() < 0.1, "{found}");
    assert!(number("scatter_n") < 0.05, "{found}");
    // What the motor's constants say: 33.6 mN m/A over 0.64 ohm and 10 mm.
    let slope = found["calibration"]["slope"].as_f64().unwrap();
    assert!((slope - 5.25).abs() < 0.1, "{found}");
    let fitted = json(&palpate(at.path(), &["fit", "follow.csv", "--json"]));
    assert!(fitted["r2"].as_f64().is_some_and(|r2| r2 > 0.98), "{fitted}");
    let picture = std::fs::read_to_string(at.path().join("follow.svg")).unwrap();
    assert!(picture.contains("torque (N mm)"));
    // Nothing is written over.
    assert_eq!(palpate(at.path(), &words).status.code(), Some(2));
}

#[test]
fn a_recorded_run_is_computed_again_bit_by_bit() {
    let at = tempfile::tempdir().unwrap();
    let words = split_words(
        "haptics run thesis --seconds 1 --drive current --friction 0.1 --record run --json",
    );
    let printed = json(&palpate(at.path(), &words));
    assert_eq!(printed["recorded"]["lost"], 0, "{printed}");
    assert!(printed["recorded"]["ticks"].as_u64().unwrap() > 100, "{printed}");
    let again = json(&palpate(at.path(), &["haptics", "replay", "run", "--json"]));
    assert_eq!(again["is_identical"], true, "{again}");
    assert_eq!(again["is_whole"], true, "{again}");
    // Not over another; and another friction is another run.
    assert_eq!(palpate(at.path(), &words).status.code(), Some(2));
    let settings = at.path().join("run/settings.toml");
    let text = std::fs::read_to_string(&settings).unwrap();
    std::fs::write(&settings, text.replace("friction_n = 0.1", "friction_n = 0.3")).unwrap();
    let other = palpate(at.path(), &["haptics", "replay", "run"]);
    assert_refused(&other, 1, "error: tick ");
    // Without its end the rest is unknown, however alike the ticks before are.
    std::fs::write(&settings, text).unwrap();
    let ticks = at.path().join("run/ticks.csv");
    let lines = std::fs::read_to_string(&ticks).unwrap();
    let end = lines.rfind("end,").unwrap();
    std::fs::write(&ticks, &lines[..end]).unwrap();
    let cut = palpate(at.path(), &["haptics", "replay", "run"]);
    assert_refused(&cut, 1, "cut off");
}

#[test]
fn the_check_of_the_source_is_a_session_whose_fit_is_the_body_and_its_friction() {
    let at = tempfile::tempdir().unwrap();
    let follow = |words: &[&str]| palpate(at.path(), &[&["haptics", "follow"], words].concat());
    let found = json(&follow(&["thesis", "--out", "followed", "--json"]));
    let value = |fit: &serde_json::Value, name: &str| {
        let all = fit["parameters"].as_array().unwrap().iter();
        let one = all.clone().find(|one| one["name"] == name).unwrap();
        (one["value"].as_f64().unwrap(), one["std_error"].as_f64().unwrap())
    };
    // What the motor's constants say: 8.1 mN m over 10 mm, and 17.6 N s/m at 0.75 mm/s.
    let [friction, drag] = ["friction_n", "drag_n"].map(|name| found[name].as_f64().unwrap());
    assert!((friction - 0.81).abs() < 1e-3 && (drag - 0.0132).abs() < 1e-4, "{found}");
    for (name, body) in [("mu1", 0.05333), ("mu3", 4.345e-4), ("tau_sig", 0.06), ("tau_eps", 1.023)]
    {
        for fit in ["fit", "fit_commanded"] {
            let (found, error) = value(&found[fit], name);
            // The slave is where whole pulses put it, so that a fit is a few per cent off.
            assert!((found - body).abs() < 6.0 * error, "{fit} {name}: {found} ± {error}");
        }
    }
    // Friction is all that the two fits differ in.
    let (commanded, _) = value(&found["fit_commanded"], "f_offset");
    let (measured, _) = value(&found["fit"], "f_offset");
    assert!((measured - commanded - friction).abs() < 0.02, "{measured} {commanded}");

    // The session is one like any other, says that it is simulated and has that fit.
    let info = json(&palpate(at.path(), &["info", "followed", "--json"]));
    assert_eq!(info["samples"], 1800);
    assert_eq!(info["imported"]["file"], "follow.csv");
    let notes = info["notes"].to_string();
    assert!(notes.contains("simulated"), "{info}");
    let fitted = json(&palpate(at.path(), &["fit", "followed", "--json"]));
    for name in ["mu1", "mu2", "mu3", "tau_sig", "tau_eps", "f_offset"] {
        let (a, b) = (value(&fitted, name).0, value(&found["fit"], name).0);
        assert!((a / b - 1.0).abs() < 1e-6, "{name}: {a} {b}");
    }
    let exported = palpate(at.path(), &["export", "followed", "--format", "csv"]);
    assert!(exported.status.success(), "{}", stderr(&exported));
    // No engine decided anything, so there is nothing to replay; that is the only message.
    let replayed = palpate(at.path(), &["replay", "followed"]);
    assert!(stderr(&replayed).contains("no decisions"));
    // It can be followed in its turn, and words explain the difference.
    let again = stdout(&follow(&["followed", "--help-friction", "50"]));
    assert!(again.contains("commanded") && again.contains("relaxation"), "{again}");
    let taken = follow(&["thesis", "--out", "followed"]);
    assert_refused(&taken, 2, "followed exists already");
}

#[test]
fn a_slave_on_a_rig_is_led_and_its_session_is_an_ordinary_one() {
    let at = tempfile::tempdir().unwrap();
    let words = |out| {
        [
            "haptics",
            "slave",
            "thesis",
            "--seconds",
            "12",
            "--depth",
            "6",
            "--profile",
            "ideal",
            "--time-scale",
            "max",
            "--out",
            out,
            "--json",
        ]
    };
    let printed = json(&palpate(at.path(), &words("one")));
    assert_eq!(printed["command"], "haptics-slave", "{printed}");
    assert_eq!(printed["ending"], "finish", "{printed}");
    assert_eq!(printed["verdict"], "valid", "{printed}");
    let slave = &printed["slave"];
    let number = |name: &str| slave[name].as_f64().unwrap_or(f64::NAN);
    assert!(number("depth_max_mm") > 2.0 && number("depth_max_mm") < 6.0 + 1e-9, "{printed}");
    assert!(number("cell_max_n") > 0.05, "{printed}");
    assert!(slave["lag_ms"]["median"].as_f64().unwrap() > 20.0, "{printed}");
    // The same again is the same, but for the folder.
    let again = json(&palpate(at.path(), &words("two")));
    assert_eq!(again["slave"], printed["slave"]);
    let replayed = palpate(at.path(), &["replay", "one"]);
    assert_eq!(replayed.status.code(), Some(0), "{}", stderr(&replayed));
    let fitted = json(&palpate(at.path(), &["fit", "one", "--json"]));
    assert!(fitted["r2"].as_f64().is_some_and(|r2| r2 > 0.8), "{fitted}");
    // The preview moves nothing and names the bounds.
    let preview = typed(at.path(), "haptics slave thesis --depth 6 --preview");
    assert_prints(&preview, "down to a depth of 6");
    for bad in [
        ["--depth", "0"],
        ["--depth", "500"],
        ["--speed", "nan"],
        ["--speed", "21"],
        ["--seconds", "4000"],
        ["--rig", "nowhere"],
    ] {
        let out = palpate(at.path(), &[&["haptics", "slave", "thesis"], &bad[..]].concat());
        assert_eq!(out.status.code(), Some(2), "{bad:?} {}", stderr(&out));
    }
    let out = palpate(at.path(), &["haptics", "slave", "nothing-there"]);
    assert_eq!(out.status.code(), Some(2), "{}", stderr(&out));
}

#[test]
fn a_protocol_that_follows_is_led_by_haptics_slave_and_refused_by_run() {
    let at = tempfile::tempdir().unwrap();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/protocols/follow.toml");
    let text = std::fs::read_to_string(file).unwrap();
    std::fs::write(at.path().join("follow.toml"), &text).unwrap();
    assert_prints(&typed(at.path(), "protocol check follow.toml"), "follow");
    let preview = typed(at.path(), "protocol preview follow.toml");
    assert_prints(&preview, "down to a depth of 5");
    let words = "haptics slave thesis --protocol follow.toml --set for=8s --depth 6 --profile ideal \
                 --time-scale max --out led --json";
    let printed = json(&typed(at.path(), words));
    assert_eq!(printed["ending"], "finish", "{printed}");
    // The hand goes to 6 mm, the slave no deeper than the protocol says.
    let deepest = printed["slave"]["depth_max_mm"].as_f64().unwrap();
    assert!(deepest > 2.0 && deepest <= 5.0 + 1e-9, "{printed}");
    let replayed = typed(at.path(), "replay led");
    assert_eq!(replayed.status.code(), Some(0), "{}", stderr(&replayed));
    // Without a master nothing moves, and nothing is recorded.
    let alone = typed(at.path(), "run follow.toml --time-scale max --out alone");
    assert_refused(&alone, 2, "palpate haptics slave");
    assert!(!at.path().join("alone").exists());
    // A master without a slave is no run either.
    let step = "{ do = \"follow\", for = \"$for\", speed = \"6 mm/s\", depth_max = \"5 mm\" }";
    let ramp = "{ do = \"ramp\", speed = \"3 mm/s\", depth = \"3 mm\" },\n  { do = \"hold\", for = \"$for\" }";
    std::fs::write(at.path().join("ramp.toml"), text.replace(step, ramp)).unwrap();
    let useless = typed(at.path(), "haptics slave thesis --protocol ramp.toml --time-scale max");
    assert_refused(&useless, 2, "no step 'follow'");
    let both = typed(at.path(), "haptics slave thesis --protocol follow.toml --seconds 3");
    assert_eq!(both.status.code(), Some(2), "{}", stderr(&both));
    let set = typed(at.path(), "haptics slave thesis --set for=3s");
    assert_refused(&set, 2, "--protocol");
    // The reference and its mistakes: a limit is needed, and a speed within the rig's.
    let open = text.replace(", depth_max = \"5 mm\"", "");
    std::fs::write(at.path().join("open.toml"), open).unwrap();
    assert_refused(&typed(at.path(), "run open.toml"), 2, "depth_max");
    let fast = text.replace("6 mm/s", "60 mm/s");
    std::fs::write(at.path().join("fast.toml"), fast).unwrap();
    assert_refused(&typed(at.path(), "run fast.toml"), 2, "60");
}
