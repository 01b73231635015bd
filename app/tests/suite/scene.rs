//! `palpate scene`.

use crate::emulate::start_device;
use crate::support::{
    assert_refused, json, palpate, short_run, split_words, stderr, stdout, succeeded, typed,
};

#[test]
fn a_recorded_poke_is_computed_again_and_a_changed_bit_is_found() {
    let at = tempfile::tempdir().unwrap();
    let record = ["scene", "record", "--to", "poke", "--json"];
    let printed = json(&palpate(at.path(), &record));
    assert_eq!(printed["command"], "scene-record");
    assert_eq!(printed["recorded"]["lost"], 0, "{printed}");
    assert!(printed["depth_max_mm"].as_f64().unwrap() > 5.0, "{printed}");
    assert!(printed["work"]["count"].as_u64().unwrap() > 1000, "{printed}");
    let again = json(&palpate(at.path(), &["scene", "replay", "poke", "--json"]));
    assert_eq!(again["is_identical"], true, "{again}");
    assert_eq!(again["is_whole"], true, "{again}");
    assert_eq!(again["end_hash"], printed["surface_hash"]);
    // Not over another.
    assert_eq!(palpate(at.path(), &record).status.code(), Some(2));
    // Another tissue gives other forces: exit code 1, and the first tick named.
    let settings = at.path().join("poke/settings.toml");
    let text = std::fs::read_to_string(&settings).unwrap();
    std::fs::write(&settings, text.replace("0.06", "0.06000000000000001")).unwrap();
    let other = palpate(at.path(), &["scene", "replay", "poke"]);
    assert_eq!(other.status.code(), Some(1));
    assert!(stdout(&other).contains("not as recorded"));
    let message = stderr(&other);
    assert!(message.contains("error: tick ") && message.contains("force_z_n"), "{message}");
    std::fs::write(&settings, text).unwrap();
    // A changed line is damage; a missing end is a recording that was cut off.
    let ticks = at.path().join("poke/ticks.csv");
    let lines = std::fs::read_to_string(&ticks).unwrap();
    std::fs::write(&ticks, lines.replacen("-0.5,", "-0.4,", 1)).unwrap();
    let damaged = palpate(at.path(), &["scene", "replay", "poke"]);
    assert_refused(&damaged, 2, "damaged");
    std::fs::write(&ticks, &lines[..lines.len() / 2]).unwrap();
    let cut = palpate(at.path(), &["scene", "replay", "poke"]);
    assert_eq!(cut.status.code(), Some(1), "{}", stderr(&cut));
    for message in [stdout(&cut), stderr(&cut)] {
        assert!(message.contains("cut off"), "{message}");
    }
}

#[test]
fn a_scene_file_is_shown_whole_and_run() {
    let at = tempfile::tempdir().unwrap();
    let usual = palpate(at.path(), &["scene", "show"]);
    std::fs::write(at.path().join("usual.toml"), stdout(&usual)).unwrap();
    let again = palpate(at.path(), &["scene", "show", "usual.toml"]);
    assert_eq!(stdout(&again), stdout(&usual));
    assert!(stdout(&again).contains("mu1 = 0.05333"));
    std::fs::write(
        at.path().join("fine.toml"),
        "name = \"fine\"\n[mesh]\nnodes = 401\n[loop]\nrate_hz = 500\n",
    )
    .unwrap();
    let words = ["scene", "run", "fine.toml", "--path", "taps", "--json"];
    let run = json(&palpate(at.path(), &words));
    assert_eq!(run["nodes"], 401, "{run}");
    assert_eq!(run["rate_hz"], 500.0, "{run}");
    assert_eq!(run["path"], "taps");
    assert!(run["force_max_n"].as_f64().unwrap() > 0.1, "{run}");
}

/// A box of 40 mm as a file that a person can read.
pub(crate) const BOX: &str = "v 0 0 0\nv 40 0 0\nv 0 40 0\nv 40 40 0\nv 0 0 40\nv 40 0 40\nv 0 40 40\nv 40 40 40\n\
    f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

#[test]
fn a_mesh_is_touched_recorded_and_computed_again() {
    let at = tempfile::tempdir().unwrap();
    std::fs::write(at.path().join("box.obj"), BOX).unwrap();
    std::fs::write(at.path().join("box.toml"), "[mesh]\nfile = \"box.obj\"\n").unwrap();
    let run = json(&palpate(at.path(), &["scene", "record", "box.toml", "--to", "poke", "--json"]));
    assert_eq!(run["mesh"]["triangles"], 12, "{run}");
    assert!(run.get("nodes").is_none(), "{run}");
    assert!(run["depth_max_mm"].as_f64().unwrap() > 5.0, "{run}");
    let again = json(&palpate(at.path(), &["scene", "replay", "poke", "--json"]));
    assert_eq!(again["is_identical"], true, "{again}");
    let shown = stdout(&palpate(at.path(), &["scene", "show", "box.toml"]));
    assert!(shown.contains("sha256 = \"") && shown.contains("reach_mm = 20.0"), "{shown}");
    std::fs::write(at.path().join("box.obj"), BOX.replace("40", "41")).unwrap();
    assert_refused(&palpate(at.path(), &["scene", "replay", "poke"]), 2, "another file");
    let bench = palpate(at.path(), &["scene", "bench", "box.toml"]);
    assert_refused(&bench, 2, "mesh.file");
}

#[test]
fn a_mesh_is_touched_through_a_device_and_computed_again() {
    let at = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| std::fs::write(at.path().join(name), text).unwrap();
    put("box.obj", BOX);
    put("box.toml", "[mesh]\nfile = \"box.obj\"\nstart_mm = [12, 30, 41]\n");
    let (_service, ready) = start_device("inverse", &[]);
    let service = ready["at"].as_str().unwrap();
    let line = format!(
        "scene record box.toml --device inverse --service {service} --seconds 2 --to touched --json"
    );
    let touched = json(&palpate(at.path(), &split_words(&line)));
    assert_eq!((&touched["path"], &touched["mesh"]["triangles"]), (&"device".into(), &12.into()));
    assert!(touched["device"]["reports"].as_u64().unwrap() > 0, "{touched}");
    let again = json(&palpate(at.path(), &["scene", "replay", "touched", "--json"]));
    assert_eq!((&again["is_identical"], &again["is_whole"]), (&true.into(), &true.into()));
    // The middle of its reach is at the place of the surface: the hand swings by 3 and 8 mm, along x and z, and a force moves it on.
    let ticks = std::fs::read_to_string(at.path().join("touched/ticks.csv")).unwrap();
    let sensed = ticks.lines().filter_map(|line| {
        let places = line.split(',').skip(3).take(3).map(|one| one.parse().ok());
        places.collect::<Option<Vec<f64>>>().filter(|one| one.len() == 3 && one[0].is_finite())
    });
    let mut count = 0;
    for place in sensed {
        let apart =
            [12.0, 30.0, 40.0].iter().zip(&place).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        assert!(apart.sqrt() < 25.0, "{place:?}");
        count += 1;
    }
    assert!(count > 0, "{ticks}");
}

#[test]
fn a_scene_on_a_mesh_begins_where_its_file_says() {
    let at = tempfile::tempdir().unwrap();
    std::fs::write(at.path().join("box.obj"), BOX).unwrap();
    let put = |start: &str| {
        let text = format!("[mesh]\nfile = \"box.obj\"\n{start}\n");
        std::fs::write(at.path().join("box.toml"), text).unwrap();
    };
    // On the lower side: the path comes from below and goes up.
    put("start_mm = [10.0, 15.0, -4.0]");
    let shown = stdout(&palpate(at.path(), &["scene", "show", "box.toml"]));
    assert!(shown.contains("start_mm = [10.0, 15.0, -4.0]"), "{shown}");
    let line = split_words("scene record box.toml --to poke --json");
    let run = json(&palpate(at.path(), &line));
    assert!(run["depth_max_mm"].as_f64().unwrap() > 5.0, "{run}");
    let ticks = std::fs::read_to_string(at.path().join("poke/ticks.csv")).unwrap();
    let first: Vec<f64> =
        ticks.lines().nth(1).unwrap().split(',').filter_map(|one| one.parse().ok()).collect();
    let hand = &first[first.len() - 10..][..3];
    // The hand has moved for a tick at most by 0.1 mm.
    for (part, expected) in hand.iter().zip([10.0, 15.0, -10.0]) {
        assert!((part - expected).abs() < 0.1, "{first:?}");
    }
    let again = json(&palpate(at.path(), &["scene", "replay", "poke", "--json"]));
    assert_eq!(again["is_identical"], true, "{again}");
    put("start_vertex = 7");
    succeeded(&palpate(at.path(), &["scene", "run", "box.toml"]));
    for (start, reason) in [
        ("start_vertex = 8", "begins at vertex 8, but the file of the mesh has 8"),
        ("start_mm = [0, 0, 99]", "more than 30 mm from the surface"),
        ("start_mm = 7", "box.toml, line 3: mesh.start_mm: give 3 numbers"),
    ] {
        put(start);
        assert_refused(&palpate(at.path(), &["scene", "run", "box.toml"]), 2, reason);
    }
}

#[test]
fn what_is_impossible_is_refused_in_words() {
    let at = tempfile::tempdir().unwrap();
    std::fs::write(at.path().join("bad.toml"), "[tissue]\nsidemm = 3\n").unwrap();
    std::fs::write(at.path().join("gone.toml"), "[tissue]\nsource = \"gone\"\n").unwrap();
    for (words, reason) in [
        (&["run", "bad.toml"][..], "bad.toml, line 2: 'tissue.sidemm'"),
        (&["run", "gone.toml"], "gone"),
        (&["run", "nowhere.toml"], "cannot read nowhere.toml"),
        (&["run", "--path", "pork"], "taps"),
        (&["run", "--seconds", "0"], "--seconds 0"),
        (&["replay", "nowhere"], "nowhere"),
        (&["record", "--to", "no/folder"], "folder no"),
    ] {
        let out = palpate(at.path(), &[&["scene"], words].concat());
        assert_eq!(out.status.code(), Some(2), "{words:?}");
        assert!(stderr(&out).contains(reason), "{words:?}: {}", stderr(&out));
    }
}

#[test]
fn a_mesh_is_planned_from_what_is_measured() {
    let at = tempfile::tempdir().unwrap();
    let coarse =
        "[mesh]\nauto = true\n[tolerances]\nshape_mm = 5\nforce_percent = 100\ntick_us = 100000\n";
    std::fs::write(at.path().join("coarse.toml"), coarse).unwrap();
    let run = json(&typed(at.path(), "scene run coarse.toml --json"));
    assert_eq!(run["nodes"], run["plan"]["mesh"]["nodes"], "{run}");
    assert!(run["plan"]["shape_error_mm"].as_f64() <= Some(5.0), "{run}");
    assert_eq!(run["plan"]["inert"][0][0], "MinDist", "{run}");
    // Nothing measured is as exact as this.
    std::fs::write(
        at.path().join("exact.toml"),
        coarse.replace("shape_mm = 5", "shape_mm = 0.000001"),
    )
    .unwrap();
    let none = palpate(at.path(), &["scene", "run", "exact.toml"]);
    assert_refused(&none, 1, "no measured scene keeps");
    let bench = json(&typed(at.path(), "scene bench coarse.toml --json"));
    assert_eq!(bench["command"], "scene-bench");
    let meshes = bench["curves"]["meshes"].as_array().unwrap();
    let counts: Vec<u64> = meshes.iter().filter_map(|mesh| mesh["nodes"].as_u64()).collect();
    assert_eq!(counts, [51, 101, 201], "{bench}");
    // On a busy machine a fine mesh can take less than a coarse one, so the cheapest is looked up. Every error is
    // within 5 mm together with any cut.
    let cost = |mesh: &&serde_json::Value| mesh["cost_us"].as_f64().unwrap();
    let cheapest = meshes.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap();
    assert_eq!(bench["plan"]["mesh"]["nodes"], cheapest["nodes"], "{bench}");
    // How much faster the closed form is, `scripts/measure surface` tells.
    let methods = bench["methods"].as_array().unwrap();
    let names: Vec<&str> = methods.iter().filter_map(|one| one["method"].as_str()).collect();
    assert_eq!(names[..2], ["closed form", "first moved first"], "{bench}");
    let mut speeds = methods.iter().map(|one| one["nodes_per_ms"].as_f64());
    assert!(speeds.all(|speed| speed > Some(0.0)), "{bench}");
}

#[test]
fn a_recorded_specimen_is_touched_by_the_simulated_hand_and_through_a_device() {
    let at = tempfile::tempdir().unwrap();
    succeeded(&short_run(at.path(), "pad", &[]));
    std::fs::write(at.path().join("pad.toml"), "name = \"pad\"\n[tissue]\nsource = \"pad\"\n")
        .unwrap();
    let by_hand = json(&palpate(at.path(), &["scene", "run", "pad.toml", "--json"]));
    assert_eq!(by_hand["path"], "poke");
    assert!(by_hand["device"].is_null());
    assert!(by_hand["force_max_n"].as_f64().unwrap() > 0.0, "{by_hand}");
    let (_service, ready) = start_device("inverse", &[]);
    let service = ready["at"].as_str().unwrap();
    let line = format!(
        "scene record pad.toml --device inverse --service {service} --seconds 2 --to touched --json"
    );
    let touched = palpate(at.path(), &split_words(&line));
    assert!(stderr(&touched).contains("a round trip takes"), "{}", stderr(&touched));
    let touched = json(&touched);
    assert_eq!((&touched["name"], &touched["path"]), (&"pad".into(), &"device".into()));
    // How many there were, and whether the force came up, depends on how busy the computer is.
    assert!(touched["device"]["reports"].as_u64().unwrap() > 0, "{touched}");
    let again = json(&palpate(at.path(), &["scene", "replay", "touched", "--json"]));
    assert_eq!((&again["is_identical"], &again["is_whole"]), (&true.into(), &true.into()));
    let (_board, ready) = start_device("hapi", &[]);
    let board = ready["at"].as_str().unwrap();
    let line = format!("scene run pad.toml --device hapi:{board} --seconds 1 --json");
    let felt = palpate(at.path(), &split_words(&line));
    assert!(stderr(&felt).contains("home position"), "{}", stderr(&felt));
    assert!(json(&felt)["device"]["reports"].as_u64().unwrap() > 0);
    // The file's largest force holds on a real device too, and what a device cannot be used with is refused.
    let put = |name: &str, text: &str| std::fs::write(at.path().join(name), text).unwrap();
    put("soft.toml", "[mesh]\nnodes = 51\n[device]\nforce_max_n = 0.5\n");
    let line = format!(
        "scene record soft.toml --device inverse --service {service} --seconds 1 --to soft --json"
    );
    let soft = json(&palpate(at.path(), &split_words(&line)));
    assert!(soft["force_max_n"].as_f64().unwrap() <= 0.5, "{soft}");
    let used = std::fs::read_to_string(at.path().join("soft/settings.toml")).unwrap();
    assert!(used.contains("force_max_n = 0.5\n"), "{used}");
    put("open.toml", "[mesh]\nnodes = 51\n[loop]\nguards = false\n");
    put("slow.toml", "[mesh]\nnodes = 51\n[loop]\nrate_hz = 400.0\n");
    for (file, words) in [("open.toml", "no guards"), ("slow.toml", "too slow")] {
        let line = format!("scene run {file} --device inverse --service {service}");
        assert_refused(&palpate(at.path(), &split_words(&line)), 1, words);
    }
    // Another is not there.
    let line = format!("scene run --device inverse:left --service {service}");
    assert_refused(&palpate(at.path(), &split_words(&line)), 1, "left");
    assert_refused(&palpate(at.path(), &["scene", "run", "--device", "omni"]), 2, "inverse:NAME");
}
