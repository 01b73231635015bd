//! The window of a replay, driven by accessible name: no display, no pixels.
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use palpate_analysis::source::calibration_of;
use palpate_analysis::window_requests::PlaybackRequest;
use palpate_model::units::Newtons;
use palpate_protocols::engine::EndingKind;
use palpate_runner::replay::Player;
use palpate_runner::{RunView, TimeScale};
use palpate_sessions::Session;
use palpate_test_support::wait::Deadline;
use palpate_tests::workspace;
use palpate_window::playback::PlaybackApp;
use std::time::Duration;

type Window = Harness<'static, PlaybackApp>;

fn open(scale: TimeScale) -> Window {
    let folder = workspace().join("tests/sessions/ramp-hold-lab");
    let session = Session::open(&folder).unwrap();
    let options = PlaybackRequest {
        calibration: calibration_of(&session).unwrap(),
        player: Player::new(session, folder).unwrap(),
        force_max: Newtons(9.0),
        name: "ramp-hold-lab".into(),
        scale,
    };
    Harness::builder()
        .with_size((1280.0, 800.0))
        .build_eframe(|cc| PlaybackApp::new(options, &cc.egui_ctx).unwrap())
}

fn run(window: &Window) -> RunView {
    window.state().snapshot().run.clone().unwrap()
}

/// Draws frames until the run is so. A busy machine may take long; nothing new in so many frames is a failure.
const STILL_MAX: usize = 12_000;

fn wait(window: &mut Window, what: &str, is_so: impl Fn(&RunView) -> bool) {
    let (mut still, mut before) = (0, None);
    while still < STILL_MAX {
        window.step();
        let run = run(window);
        if is_so(&run) {
            return;
        }
        still = if before == Some(run.now) { still + 1 } else { 0 };
        before = Some(run.now);
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("{what} did not come; the session stands at {}", run(window).now);
}

fn click(window: &mut Window, name: &str) {
    window.get_by_label(name).click_accesskit();
    window.run_steps(2);
}

#[test]
fn a_session_plays_to_its_end_and_any_moment_can_be_gone_to() {
    let mut window = open(TimeScale::Max);
    wait(&mut window, "the end", |run| run.outcome.is_some());
    let end = run(&window);
    assert_eq!(end.outcome.as_ref().unwrap().ending, EndingKind::Finish);
    assert!(window.query_by_label_contains("Replay of ramp-hold-lab").is_some());
    // It stays at the end, though that is no round number.
    for _ in 0..20 {
        window.step();
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(run(&window).now, end.now);
    // Nothing here can start, stop or close anything on a rig.
    for name in ["Stop motion  F12", "Halt  F11", "Close session"] {
        assert!(window.query_by_label(name).is_none(), "{name}");
    }
    // The slider, to the middle of the session: everything as it was known then.
    window.run_steps(2);
    let middle = end.now.seconds().0 / 2.0;
    window.get_all_by_label("session time").next().unwrap().set_value_accesskit(middle);
    let near = move |run: &RunView| (run.now.seconds().0 - middle).abs() < 0.2;
    wait(&mut window, "the middle", near);
    let then = run(&window);
    assert!(then.outcome.is_none() && then.samples < end.samples);
    assert!(window.query_by_label("Play").is_some());
    click(&mut window, "Back 10 s");
    wait(&mut window, "ten seconds before", |run| {
        (run.now.seconds().0 - middle + 10.0).abs() < 0.4
    });
    // At ten times it goes on from there.
    click(&mut window, "10x");
    click(&mut window, "Play");
    wait(&mut window, "what comes after", |run| run.now.seconds().0 > middle + 5.0);
    click(&mut window, "Pause");
    // What was asked for before is still shown, and then nothing moves any more.
    let (mut paused, mut still) = (run(&window).now, 0);
    let patience = Deadline::new();
    while still < 20 {
        assert!(!patience.is_over(), "it goes on at {paused}");
        std::thread::sleep(Duration::from_millis(50));
        window.step();
        let now = run(&window).now;
        still = if now == paused { still + 1 } else { 0 };
        paused = now;
    }
    assert!(paused < end.now, "{paused}");
}
