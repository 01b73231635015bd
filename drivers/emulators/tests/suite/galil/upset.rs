//! Faults of the controller itself.

use super::bench::Bench;
use palpate_emulators::galil::GalilModel;
use palpate_emulators::{DeviceFault, EmulatedDevice};

fn moving() -> Bench {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    bench.tell("SHA;JGA=500;BGA");
    bench.wait(0.5);
    bench
}

#[test]
fn a_reset_in_the_middle_of_a_move_ends_it_where_the_slide_is() {
    let mut bench = moving();
    let before = bench.emulator.plant().axis().0;
    bench.emulator.apply_fault(bench.now, DeviceFault::Reset, true);
    bench.wait(1.0);
    bench.emulator.transmit(0);
    assert_eq!(bench.emulator.plant().axis().0, before);
    assert_eq!((bench.number("_RPA"), bench.number("_MOA")), (0.0, 1.0));
    assert_eq!(bench.ask("BGA"), "?");
}

#[test]
fn a_cell_may_stick_or_saturate_and_come_back() {
    let mut bench = moving();
    bench.emulator.apply_fault(bench.now, DeviceFault::Stuck, true);
    let stuck = bench.number("@AN[1]");
    for _ in 0..50 {
        bench.sample();
        assert_eq!(bench.number("@AN[1]"), stuck);
    }
    bench.emulator.apply_fault(bench.now, DeviceFault::Stuck, false);
    bench.emulator.apply_fault(bench.now, DeviceFault::Saturated, true);
    bench.sample();
    // The last of 65536 counts.
    assert!((bench.number("@AN[1]") - 10.0).abs() < 0.001);
    bench.emulator.apply_fault(bench.now, DeviceFault::Saturated, false);
    bench.sample();
    assert!((bench.number("@AN[1]") - stuck).abs() < 0.02);
    assert_eq!(bench.number("_BGA"), 1.0);
}

#[test]
fn another_controller_has_another_name_and_number() {
    let mut bench = moving();
    let number = bench.number("_BN");
    bench.emulator.apply_fault(bench.now, DeviceFault::WrongDevice, true);
    assert_eq!(bench.ask("\x12\x16"), "RIO47120 Rev 1.1b\r\n:");
    assert_ne!(bench.number("_BN"), number);
    bench.emulator.apply_fault(bench.now, DeviceFault::WrongDevice, false);
    assert_eq!(bench.ask("\x12\x16"), "DMC4143 Rev 1.3a\r\n:");
}

#[test]
fn equal_bytes_at_equal_times_give_equal_answers() {
    let run = || {
        let mut bench = moving();
        bench.tell("DM f[200];RA f[];RD _AFX;RC 1");
        bench.wait(1.0);
        bench.ask("QU f[]")
    };
    assert_eq!(run(), run());
}
