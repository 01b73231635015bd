//! The screens beside the run screen: which model, what accuracy costs, what happens at the extremes.
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use palpate_haptics::Flags;
use palpate_model::{Depth, Seconds};
use palpate_rheology::families::find_family;
use palpate_runner::TimeScale;
use palpate_tests::flow::{TestWindow, WindowFlow, screen_of};
use palpate_window::screens::extremes::ExtremesScreen;
use palpate_window::screens::haptics::HapticsScreen;
use palpate_window::screens::models::ModelsScreen;
use palpate_window::screens::screen::Screen;
use palpate_window::screens::trade::TradeScreen;
use std::fmt::Write;
use std::path::Path;

/// A ramp and hold of a Kelvin body with 1 % of repeatable roughness, as a table.
fn table(path: &Path, speed: f64) {
    let body = find_family("kelvin").unwrap().model(&[1.5], &[0.15, 0.6]).unwrap();
    let times = || (0..500).map(|i| 0.05 * f64::from(i));
    let forces = body.along(times().map(|t| (Seconds(t), Depth((speed * t).min(10.0))))).unwrap();
    let mut text = String::from("t_s,F_N,x_mm\n");
    for (i, (t, force)) in times().zip(forces).enumerate() {
        // A linear congruence: like noise, and the same everywhere.
        let noise = 0.02 * (((i * 7919 + 104_729) % 1009) as f64 / 1009.0 - 0.5);
        let depth = (speed * t).min(10.0);
        writeln!(text, "{t},{},{depth}", force + noise).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

fn show_screen(flow: &mut WindowFlow, key: Key) {
    flow.window.key_press_modifiers(Modifiers::COMMAND, key);
    flow.window.run_steps(3);
}

#[test]
fn models_are_compared_in_the_window() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num6);
    assert!(!flow.is_enabled("Compare models  F6"));
    assert!(flow.says("add a recording first"));
    for (name, speed) in [("slow.csv", 0.8), ("fast.csv", 4.0)] {
        let path = flow.folder.path().join(name);
        table(&path, speed);
        flow.type_into("path", &path.display().to_string());
        flow.click("Add");
    }
    flow.type_into("tolerance", "much");
    assert!(flow.says("'much' is not a tolerance"));
    assert!(!flow.is_enabled("Compare models  F6"));
    flow.type_into("tolerance", "1%");
    flow.window.check_accessibility();
    flow.click("Compare models  F6");
    let has_answer = |window: &TestWindow| screen_of::<ModelsScreen>(window).answer().is_some();
    flow.wait("the comparison", has_answer);
    flow.window.run_steps(3);
    let answer = screen_of::<ModelsScreen>(&flow.window).answer().unwrap();
    let selection = &answer.as_ref().unwrap().selection;
    assert_eq!(selection.verdict.family.as_deref(), Some("kelvin"));
    for sentence in &selection.verdict.sentences {
        assert!(flow.says(sentence), "{sentence}");
    }
    for words in ["series-3", "fast: 10.0000 mm deep", "tau_eps", "kelvin > prony-2"] {
        assert!(flow.says(words), "{words}");
    }
    flow.window.check_accessibility();
    // A source that is gone is named, and the window stays usable.
    flow.type_into("path", "/nowhere/at-all");
    flow.click("Add");
    flow.click("Compare models  F6");
    flow.wait("the refusal", |window| {
        screen_of::<ModelsScreen>(window).answer().is_some_and(Result::is_err)
    });
    flow.window.run_steps(2);
    assert!(flow.says("/nowhere/at-all"));
    flow.click("leave out nowhere/at-all");
    assert!(!flow.says("leave out nowhere"));
}

#[test]
fn a_run_goes_on_behind_another_screen_and_can_be_stopped_there() {
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    flow.click("Start  F5");
    flow.wait_for_phase(palpate_model::rig::Phase::Contact);
    show_screen(&mut flow, Key::Num8);
    assert!(flow.says("nothing tested yet"));
    flow.window.key_press(Key::F12);
    flow.wait("the axis at rest", |window| {
        let run = window.state().snapshot().run.as_ref();
        run.is_some_and(|run| run.holding.is_some())
    });
    assert!(flow.says("State: STOPPED"));
}

#[test]
fn the_trade_is_measured_in_the_window() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num7);
    flow.click("few rows, rough times");
    flow.click("Measure here  F6");
    flow.wait("the curves", |window| screen_of::<TradeScreen>(window).curves().is_some());
    flow.window.run_steps(3);
    assert!(flow.says("Recommendation") && flow.says("of the peak force"));
    for view in ["Families", "Fit", "Integrators"] {
        flow.click(view);
        flow.window.check_accessibility();
    }
    flow.type_into("tolerance", "0.0000001%");
    assert!(flow.says("none: "));
    flow.type_into("rate", "0");
    assert!(flow.says("must be above 0"));
}

#[test]
fn the_extremes_are_tested_in_the_window() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num8);
    flow.click("Test the extremes  F6");
    flow.wait("progress", |window| screen_of::<ExtremesScreen>(window).rows().is_none());
    flow.wait("the rows", |window| screen_of::<ExtremesScreen>(window).rows().is_some());
    flow.window.run_steps(3);
    assert!(flow.says("every case gives a correct result or an error message with the reason"));
    assert!(screen_of::<ExtremesScreen>(&flow.window).rows().unwrap().len() > 100);
    flow.window.check_accessibility();
}

/// The device of the guide's example: it buzzes without its guards.
fn type_buzz(flow: &mut WindowFlow) {
    flow.click("current");
    for (name, text) in [("damping", "0.5"), ("friction", "0"), ("delay", "2")] {
        flow.type_into(name, text);
    }
}

fn check_haptics(flow: &mut WindowFlow) {
    flow.click("Check  F6");
    flow.wait("the check", |window| {
        let haptics = screen_of::<HapticsScreen>(window);
        haptics.check_result().is_some() && !haptics.is_busy()
    });
    flow.window.run_steps(3);
}

#[test]
fn a_device_is_checked_before_play_and_every_change_asks_for_it_again() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num9);
    assert!(flow.says("nothing checked yet") && flow.says("check this setting first"));
    assert!(!flow.is_enabled("Start the loop"));
    flow.window.check_accessibility();
    flow.type_into("rate", "100");
    assert!(flow.says("choose from 250 Hz to 10000 Hz"));
    assert!(!flow.is_enabled("Check  F6"));
    flow.type_into("rate", "1000");
    type_buzz(&mut flow);
    check_haptics(&mut flow);
    let looked = screen_of::<HapticsScreen>(&flow.window).check_result().unwrap();
    let checked = &looked.as_ref().unwrap().checked;
    // The source thesis's body: the model returns more energy than it takes below 0.712 mm.
    assert!((checked.margin.cycles[0].to.0 - 0.712).abs() < 1e-3);
    assert!(checked.trials[0].buzz_share > 0.5);
    let sentences = checked.sentences.clone();
    for sentence in &sentences {
        assert!(flow.says(sentence), "{sentence}");
    }
    for words in [
        "relaxation of the model",
        "the device has 0.50 N s/m",
        "the model returns more energy than it takes",
        "without guards: limit cycle",
        "with guards: ",
    ] {
        assert!(flow.says(words), "{words}");
    }
    flow.window.check_accessibility();
    assert!(flow.is_enabled("Start the loop"));
    // Another device is another check.
    flow.type_into("delay", "3");
    assert!(!flow.is_enabled("Start the loop"));
    flow.type_into("delay", "2");
    assert!(flow.is_enabled("Start the loop"));
    // A body that is not there is named.
    flow.type_into("body", "/nowhere/at-all");
    check_haptics(&mut flow);
    assert!(flow.says("/nowhere/at-all"));
    assert!(!flow.is_enabled("Start the loop"));
}

/// Depth of the slave and force commanded, as the screen has them.
fn felt(window: &TestWindow) -> [f64; 2] {
    let feel = screen_of::<HapticsScreen>(window).live_loop();
    feel.map_or([0.0; 2], |feel| {
        let seen = &feel.last().snapshot;
        [seen.depth.0, seen.force.0]
    })
}

#[test]
fn a_body_is_felt_through_the_loop_and_the_screen_says_why_there_is_no_force() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num9);
    check_haptics(&mut flow);
    flow.click("Start the loop");
    flow.wait("the loop", |window| {
        let feel = screen_of::<HapticsScreen>(window).live_loop();
        feel.is_some_and(|feel| feel.kept().work.count > 0)
    });
    // Above the surface there is none, and the screen says so.
    flow.click("Lift off");
    flow.wait("the words", |window| {
        screen_of::<HapticsScreen>(window).live_loop().is_some_and(|feel| {
            let flags = feel.flags();
            flags.has_any(Flags::NO_CONTACT | Flags::ABOVE_SURFACE)
        })
    });
    flow.window.run_steps(2);
    assert!(flow.says("Why no force?") && flow.says("the force is zero"));
    for words in ["force commanded", "p99.9", "ticks a second", "priority", "no limit cycle"] {
        assert!(flow.says(words), "{words}");
    }
    flow.window.check_accessibility();
    // What was checked is what runs: it cannot be changed meanwhile.
    assert!(!flow.is_enabled("Check  F6"));
    flow.click("Ramp and hold");
    flow.wait("a force", |window| felt(window)[1] > 1.0);
    flow.click("Lift off");
    flow.wait("none", |window| felt(window)[1] == 0.0);
    // The slider leads the hand as the buttons do.
    let at_hand =
        |flow: &WindowFlow| screen_of::<HapticsScreen>(&flow.window).live_loop().unwrap().place();
    let before = at_hand(&flow);
    flow.window.get_all_by_label("hand").next().unwrap().focus();
    flow.window.run_steps(2);
    for _ in 0..3 {
        flow.window.key_press(Key::ArrowRight);
        flow.window.run_steps(2);
    }
    assert!(at_hand(&flow) > before, "{before} {}", at_hand(&flow));
    // The key that stops a rig stops this too, and what was seen stays.
    flow.window.key_press(Key::F12);
    flow.window.run_steps(2);
    assert!(!screen_of::<HapticsScreen>(&flow.window).is_running());
    assert!(flow.says("the loop is not running") && flow.says("force commanded"));
}

#[test]
fn a_scene_is_measured_and_planned_in_the_window() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num7);
    flow.click("Scene: mesh");
    assert!(flow.says("nothing measured on this machine yet") && flow.says("measure first"));
    flow.click("few rows, rough times");
    flow.type_into("tolerance", "50%");
    flow.type_into("shape", "5");
    flow.type_into("budget", "100000");
    flow.click("Measure here  F6");
    flow.wait("the curves", |window| screen_of::<TradeScreen>(window).scene_curves().is_some());
    flow.window.run_steps(3);
    // So much is tolerated that every mesh does: the one that was measured as the cheapest is planned, on a quiet computer the
    // coarsest, and what a coarser mesh than the finest leaves out is listed.
    let measured = screen_of::<TradeScreen>(&flow.window).scene_curves().unwrap().meshes.clone();
    let cheapest = measured.iter().min_by(|one, other| one.cost_us.total_cmp(&other.cost_us));
    let (cheapest, finest) =
        (cheapest.unwrap().nodes, measured.iter().map(|one| one.nodes).max().unwrap());
    let planned = format!("{cheapest} x {cheapest} nodes (planned)");
    for words in ["the cheapest plan that meets both", &planned, "MinDist has no effect"] {
        assert!(flow.says(words), "{words}");
    }
    assert_eq!(
        flow.says(&format!("left out: a mesh of {finest} nodes")),
        cheapest != finest,
        "{cheapest}"
    );
    for view in ["Scene: influence", "Scene: step", "Scene: mesh"] {
        flow.click(view);
        assert!(flow.says("(planned)"), "{view}");
        flow.window.check_accessibility();
    }
    // Nothing holds a shape so well: the nearest is named.
    flow.type_into("shape", "0.0001");
    assert!(flow.says("no plan: ") && flow.says("Nearest within the budget"));
    flow.type_into("budget", "0");
    assert!(flow.says("must be above 0") && flow.says("correct the entry on the left"));
}

#[test]
fn a_hand_led_from_the_window_is_recorded_and_computed_again_bit_by_bit() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    show_screen(&mut flow, Key::Num9);
    check_haptics(&mut flow);
    let folder = flow.folder.path().join("felt");
    flow.type_into("record to", &folder.display().to_string());
    flow.click("Start the loop");
    flow.click("Ramp and hold");
    flow.wait("a force", |window| felt(window)[1] > 1.0);
    flow.click("Lift off");
    flow.wait("none", |window| felt(window)[1] == 0.0);
    flow.window.key_press(Key::Escape);
    flow.wait_for_words("ticks recorded, none lost");
    flow.click("Replay recording");
    flow.wait("the replay", |window| screen_of::<HapticsScreen>(window).replayed().is_some());
    let replayed = screen_of::<HapticsScreen>(&flow.window).replayed().unwrap();
    let replayed = replayed.as_ref().unwrap();
    assert!(replayed.is_identical && replayed.ticks > 100, "{replayed:?}");
    assert!(replayed.name.contains("led by hand"));
    // Where the hand was led is what it is computed from.
    let ticks = std::fs::read_to_string(folder.join("ticks.csv")).unwrap();
    let mut places: Vec<&str> = ticks.lines().filter_map(|line| line.split(',').nth(3)).collect();
    places.dedup();
    assert!(places.contains(&"30.0") && places.contains(&"-2.0"), "{places:?}");
}
