//! The margin before play with the device's own delay and steps.

use palpate_haptic_devices::{DeviceFigures, RoundTrip, WorkspaceFit};
use palpate_haptics::Period;
use palpate_haptics::margin::{LoopDevice, MarginReport, MarginSettings};
use palpate_haptics::scene::{DeviceSettings, SceneSettings};
use palpate_model::Nanos;
use palpate_model::units::{Depth, MmPerS};
use palpate_rheology::integrators::SeriesBody;

fn assess(device: LoopDevice) -> MarginReport {
    let scene = SceneSettings::default();
    let margin = MarginSettings {
        body: SeriesBody::from(scene.body).padded(),
        scheme: scene.scheme,
        period: Period::MILLISECOND,
        device,
    };
    margin.assess_stroke(Depth(8.0), MmPerS(50.0))
}

fn loop_device(step_mm: f64, millis: f64, scale: f64) -> LoopDevice {
    let usual = DeviceFigures::inverse3();
    let figures = DeviceFigures { device: DeviceSettings { step_mm, ..usual.device }, ..usual };
    let round_trip = RoundTrip::of(vec![Nanos((millis * 1e6) as u64); 100]);
    let fit = WorkspaceFit { scale, ..WorkspaceFit::default() };
    let settings = fit.scene_settings(&figures.device);
    figures.loop_device(&settings, &round_trip, Period::MILLISECOND)
}

#[test]
fn more_delay_and_coarser_steps_never_enlarge_the_margin() {
    let delays = [0.0, 0.1, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0];
    let mut before = f64::NEG_INFINITY;
    for millis in delays {
        let report = assess(loop_device(0.05, millis, 1.0));
        // The needed damping is the largest over frequencies of a grid: equal but for a rounding, or more.
        assert!(report.worst.needed >= before - 1e-12, "{millis} ms: {}", report.worst.needed);
        before = report.worst.needed;
    }
    let mut before = 0.0;
    for step_mm in [0.001, 0.005, 0.02, 0.05, 0.1, 0.5] {
        let report = assess(loop_device(step_mm, 0.3, 1.0));
        assert!(report.loudest.friction_needed.0 > before, "{step_mm} mm");
        before = report.loudest.friction_needed.0;
    }
}

#[test]
fn margin_with_the_device_is_less_than_with_an_ideal_one() {
    let real = loop_device(0.05, 0.3, 1.0);
    let ideal = assess(LoopDevice { delay_ticks: 0.0, count_mm: 1e-6, ..real });
    let own = assess(real);
    assert!(own.worst.needed > ideal.worst.needed);
    assert!(own.loudest.friction_needed.0 > ideal.loudest.friction_needed.0);
    // 1 tick of the loop, 0.3 ms of the wire and 1 ms that no message sees.
    assert!((real.delay_ticks - 2.3).abs() < 1e-9);
}

#[test]
fn larger_scale_leaves_less_margin() {
    // At a scale of 2 the hand feels twice the stiffness, and the device brings the same damping.
    let (one, two) = (loop_device(0.05, 0.3, 1.0), loop_device(0.05, 0.3, 2.0));
    assert!((two.damping - 0.5 * one.damping).abs() < 1e-15);
    assert!((two.count_mm - 2.0 * one.count_mm).abs() < 1e-15);
    let headroom = |report: &MarginReport| report.worst.has - report.worst.needed;
    assert!(headroom(&assess(two)) < headroom(&assess(one)));
}

#[test]
fn round_trips_are_summed_up_by_rank() {
    let times = (1..=1000).rev().map(Nanos).collect();
    let found = RoundTrip::of(times);
    let expected = RoundTrip { count: 1000, median: Nanos(500), p99: Nanos(990), max: Nanos(1000) };
    assert_eq!(found, expected);
    assert_eq!(RoundTrip::of(Vec::new()), RoundTrip::default());
}
