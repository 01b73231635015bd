//! Motion: profiles, pulses, switches, limits, stop codes.

use super::bench::Bench;
use palpate_emulators::galil::GalilModel;
use palpate_model::rig::MotionProfile;
use palpate_model::{MmPerS, MmPerS2, Position, Seconds};

const SAMPLE: f64 = 1.0 / 1024.0;

fn ready() -> Bench {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    bench.tell("SHA;ACA=4096;DCA=4096;SPA=1332;DPA=0");
    bench
}

#[test]
fn a_move_follows_its_trapezoid_and_pulses_come_later() {
    let mut bench = ready();
    bench.tell("PRA=3000");
    bench.tell("BGA");
    // In counts: 1 count stands for 1 mm.
    let exact =
        MotionProfile::to_rest(Position(0.0), Position(3000.0), MmPerS(1332.0), MmPerS2(4096.0));
    let mut ended_before_pulses = false;
    let mut is_moving = true;
    let mut at = 0;
    while is_moving {
        bench.sample();
        at += 1;
        let line = bench.ask("MG _RPA,_TDA,_BGA,_SCA");
        let printed: Vec<f64> = line
            .trim_end_matches("\r\n:")
            .split_whitespace()
            .map(|number| number.parse().unwrap())
            .collect();
        let [rp, td, bg, sc] = printed[..] else { panic!("{line}") };
        let place = exact.position(Seconds(f64::from(at) * SAMPLE)).0;
        // Whole counts below the place, and a corner of the trapezoid within a sample.
        assert!(rp <= place + 0.01 && rp >= place - 1.01, "{at}: {rp} {place}");
        // KS 1.313: behind by at most four samples of 1332 counts/s, and a count.
        assert!((-0.01..=6.2).contains(&(rp - td)), "{at}: {rp} {td}");
        assert_eq!(sc, if bg == 1.0 { 0.0 } else { 1.0 });
        ended_before_pulses |= bg == 0.0 && td < rp;
        is_moving = bg == 1.0 || td < rp;
        assert!(at < 5000);
    }
    assert!(ended_before_pulses);
    let duration = exact.duration().0 / SAMPLE;
    assert!((f64::from(at) - duration).abs() < 40.0, "{at} {duration}");
    assert_eq!(bench.number("_TDA"), 3000.0);
    assert_eq!(bench.number("_TPA"), 0.0);
}

#[test]
fn a_relative_move_is_made_again_and_an_absolute_one_is_not() {
    let mut bench = ready();
    bench.tell("PRA=100");
    for place in [100.0, 200.0] {
        bench.tell("BGA");
        bench.settle();
        assert_eq!(bench.number("_RPA"), place);
    }
    bench.tell("PAA=50");
    for _ in 0..2 {
        bench.tell("BGA");
        bench.settle();
        assert_eq!((bench.number("_RPA"), bench.number("_SCA")), (50.0, 1.0));
    }
    bench.tell("PRA=2147483647;MG 1");
    assert_eq!(bench.ask("BGA;TC1"), "?6 Number out of range\r\n:");
}

#[test]
fn the_clock_counts_976_microseconds() {
    let mut bench = ready();
    let start = bench.number("TIME");
    bench.wait(10.0);
    assert_eq!(bench.number("TIME") - start, 10_240.0);
    bench.tell("TM 500");
    let start = bench.number("TIME");
    bench.wait(10.0);
    assert_eq!(bench.number("TIME") - start, 20_480.0);
    assert_eq!(bench.ask("TM 100"), "?");
    assert_eq!(bench.ask("SPA=1331;SPA=?"), ": 1328\r\n:");
}

#[test]
fn stops_brake_and_aborts_do_not() {
    let mut bench = ready();
    bench.tell("JGA=1332;BGA");
    assert_eq!(bench.ask("BGA;TC1"), "?21 Begin not valid while running\r\n:");
    assert_eq!(bench.ask("DPA=0;TC1"), "?7 Command not valid while running\r\n:");
    bench.wait(1.0);
    let from = bench.number("_RPA");
    bench.tell("STA");
    bench.settle();
    let way = bench.number("_RPA") - from;
    // v^2 / 2a, to the next count and with the half sample in which it was sent.
    assert!((way - 1332.0 * 1332.0 / 8192.0).abs() < 2.4, "{way}");
    assert_eq!(bench.number("_SCA"), 4.0);
    bench.tell("JGA=-1332;BGA");
    bench.wait(1.0);
    let from = bench.number("_RPA");
    bench.tell("AB");
    bench.wait(0.1);
    assert_eq!(bench.number("_RPA"), from);
    assert_eq!((bench.number("_SCA"), bench.number("_BGA")), (7.0, 0.0));
}

#[test]
fn home_is_found_and_becomes_zero() {
    let mut bench = ready();
    assert_eq!(bench.number("_HMA"), 1.0);
    // Slowly: the way to brake has to be shorter than the 2 mm between the home and the limit switch.
    bench.tell("SPA=400;HMA;BGA");
    bench.settle();
    assert_eq!((bench.number("_SCA"), bench.number("_RPA")), (10.0, 0.0));
    // The edge is within a few pulses: 256 counts/s and the filter's four samples.
    assert!(bench.emulator.plant().axis().0.abs() < 0.06);
    bench.tell("PA 1000;BGA");
    bench.settle();
    assert!((bench.emulator.plant().axis().0 - 15.0).abs() < 0.06);
    bench.tell("FEA;BGA");
    bench.settle();
    assert_eq!(bench.number("_SCA"), 9.0);
    // It braked behind the edge, 400^2 / 8192 counts; the filter saw the edge four samples late, 1.6 counts.
    let behind = bench.emulator.plant().axis().0;
    assert!((behind + 21.1 * 0.015).abs() < 0.03, "{behind}");
}

#[test]
fn switches_end_a_move_and_let_it_go_back() {
    let mut bench = ready();
    bench.tell("SDA=102400;JGA=-1332;BGA");
    bench.settle();
    assert_eq!((bench.number("_SCA"), bench.number("_LRA")), (3.0, 0.0));
    let at = bench.emulator.plant().axis().0;
    // 2 mm behind home, and 1332^2 / 204800 counts to brake.
    assert!((-2.4..=-2.0).contains(&at), "{at}");
    assert_eq!(bench.ask("BGA;TC1"), "?22 Begin not possible due to Limit Switch\r\n:");
    bench.tell("PRA=1000;BGA");
    bench.settle();
    assert_eq!((bench.number("_SCA"), bench.number("_LRA")), (1.0, 1.0));
    // A switch taken for one that opens when it is met is met already.
    bench.tell("CN 1");
    assert_eq!(bench.ask("PRA=10;BGA"), ":?");
}

#[test]
fn software_limits_are_met_one_count_behind() {
    let mut bench = ready();
    bench.tell("FLA=500;SDA=1073740800;PAA=2000;BGA");
    bench.settle();
    assert_eq!(bench.number("_SCA"), 2.0);
    let at = bench.number("_RPA");
    assert!((500.0..=503.0).contains(&at), "{at}");
    assert_eq!(bench.ask("BGA"), "?");
    bench.tell("PAA=0;BGA");
    bench.settle();
    assert_eq!(bench.number("_RPA"), 0.0);
}

#[test]
fn a_contour_is_followed_from_a_full_buffer() {
    let mut bench = ready();
    bench.tell("CMA;DT 2");
    assert_eq!(bench.ask("BGA;TC1"), "?18 Command not valid when contouring\r\n:");
    // 4 cycles of 200 segments: a sine of 100 counts, whole increments of which nothing is lost.
    let place = |segment: u32| 100.0 * (f64::from(segment) * std::f64::consts::TAU / 200.0).sin();
    let mut sent = 0_u32;
    let mut furthest: f64 = 0.0;
    while sent < 800 || bench.number("_CM") < 511.0 {
        while sent < 800 && bench.number("_CM") > 400.0 {
            let by = place(sent + 1).round() - place(sent).round();
            bench.tell(&format!("CD {by}"));
            sent += 1;
        }
        bench.wait(0.05);
        furthest = furthest.max(bench.number("_RPA"));
        assert_eq!(bench.number("_SCA"), 50.0);
    }
    bench.tell("CD 0=0");
    bench.wait(0.1);
    assert!((99.0..=100.0).contains(&furthest), "{furthest}");
    assert_eq!(bench.number("_RPA"), 0.0);
    assert_eq!((bench.number("_SCA"), bench.number("_BGA")), (51.0, 0.0));
}

#[test]
fn the_probe_feels_the_tissue_on_analog_input_one() {
    let mut bench = ready();
    bench.tell("SPA=400;HMA;BGA");
    bench.settle();
    let free = bench.number("@AN[1]");
    // 50 mm, well behind the surface.
    bench.tell("PAA=3333;BGA");
    bench.settle();
    assert!(bench.emulator.plant().force().0 > 0.3);
    assert!(bench.number("@AN[1]") > free + 0.02);
}

/// The closed form of an axis under way whose target changes, in counts: to the end of the brake, then from rest.
#[test]
fn new_target_on_the_way_is_gone_to_by_the_closed_form() {
    let mut bench = ready();
    bench.tell("PTA=1");
    assert_eq!(bench.number("_PTA"), 1.0);
    bench.tell("PAA=3000");
    for _ in 0..1024 {
        bench.sample();
    }
    // After a second at 4096 counts/s^2 it goes at 1332 counts/s; a target behind it makes it brake and come back.
    let accelerating = 1332.0 / 4096.0;
    let turned_at = 1332.0 * (1.0 - 0.5 * accelerating);
    assert!((bench.number("_RPA") - turned_at).abs() <= 3.0);
    bench.tell("PAA=1000");
    let turn = turned_at + 0.5 * 1332.0 * accelerating;
    let back =
        MotionProfile::to_rest(Position(turn), Position(1000.0), MmPerS(1332.0), MmPerS2(4096.0));
    let mut furthest = 0.0_f64;
    for at in 1..3000 {
        bench.sample();
        let place = bench.number("_RPA");
        furthest = furthest.max(place);
        let passed = f64::from(at) * SAMPLE;
        if passed > accelerating + 2.0 * SAMPLE {
            let exact = back.position(Seconds(passed - accelerating)).0;
            // A sample at full speed is 1.3 counts, and counts are whole.
            assert!((place - exact).abs() <= 3.0, "{at}: {place} {exact}");
        }
    }
    assert!((furthest - turn).abs() <= 2.0, "{furthest} {turn}");
    assert_eq!(bench.number("_TDA"), 1000.0);
    // A target further on the same way is gone to without a pause.
    bench.tell("PAA=2000");
    bench.wait(0.4);
    bench.tell("PAA=5000");
    bench.wait(0.6);
    assert_eq!(bench.number("_TVA").abs(), 1332.0);
}

#[test]
fn stop_ends_tracking_and_an_older_model_has_none() {
    let mut bench = ready();
    bench.tell("PTA=1");
    bench.tell("PAA=3000");
    bench.wait(0.5);
    assert!(bench.ask("PRA=10").contains('?') && bench.ask("BGA").contains('?'));
    bench.tell("STA");
    bench.settle();
    assert_eq!((bench.number("_PTA"), bench.number("_SCA")), (0.0, 4.0));
    // A target waits for its begin again.
    let here = bench.number("_TDA");
    bench.tell("PAA=0");
    bench.wait(0.5);
    assert_eq!(bench.number("_TDA"), here);
    // A software limit is met on the way, and stands before any target.
    bench.tell(&format!("FLA={};PTA=1;PAA=100000", here + 500.0));
    bench.settle();
    let beyond = bench.number("_TDA") - here - 500.0;
    // The brake of 1332 counts/s, and a count.
    assert!((0.0..=218.0).contains(&beyond), "{beyond}");
    assert!(bench.ask("PTA=1;PAA=100000").ends_with('?'));
    let mut older = Bench::serial(GalilModel::Dmc2143);
    assert!(older.ask("PTA=1").contains('?') && older.ask("MG _PTA").contains('?'));
}
