//! Programs: download, threads, automatic subroutines, a watchdog, unsolicited text.

use super::bench::Bench;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::GalilModel;

fn with(program: &str) -> Bench {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    // Nothing until the end, then two prompts (galil-io of TMT, GalilConnector.cpp of EPICS).
    assert_eq!(bench.raw(0, b"DL\r"), b"");
    let lines = program.replace('\n', "\r");
    assert_eq!(bench.raw(0, lines.as_bytes()), b"");
    assert_eq!(bench.raw(0, b"\\"), b"::");
    bench
}

#[test]
fn a_program_comes_back_as_it_was_sent() {
    let mut bench = with("#A;a=1\nMG \"x;y\",a\nEN\n");
    assert_eq!(bench.raw(0, b"UL\r"), b"#A;a=1\r\nMG \"x;y\",a\r\nEN\r\n\x1a:");
    assert_eq!(bench.ask("LL"), "#A=0\r\n:");
    bench.tell("XQ #A,1");
    assert_eq!(bench.ask("DL;TC1").chars().next(), Some('?'));
    bench.sample();
    assert_eq!(bench.emulator.transmit(0), b"x;y 1.0000\r\n");
    assert_eq!(bench.number("_XQ1"), -1.0);
    assert_eq!(bench.ask("XQ #B;TC1"), "?10 Empty program line or undefined label\r\n:");
    // A refused line is answered at once.
    assert_eq!(bench.raw(0, b"DL\r"), b"");
    let long = format!("{}\rEN\r", "a".repeat(81));
    assert_eq!(bench.raw(0, long.as_bytes()), b"?");
    assert_eq!(bench.raw(0, b"\\"), b"::");
}

#[test]
fn a_watchdog_stops_the_axis_when_nobody_calls() {
    let mut bench = with(
        "#DOG\nold=beat\n#LOOP\nWT 200\nIF (beat=old)&(_BGA=1)\nAB 1\nENDIF\nold=beat\nJP #LOOP\n",
    );
    bench.tell("beat=0;XQ #DOG,7;SHA;JGA=500;BGA");
    for beat in 1..=20 {
        bench.wait(0.1);
        bench.tell(&format!("beat={beat}"));
    }
    assert_eq!(bench.number("_BGA"), 1.0);
    let from = bench.number("_TDA");
    bench.wait(0.5);
    assert_eq!((bench.number("_BGA"), bench.number("_SCA")), (0.0, 7.0));
    // Two periods of 200 ms at 500 counts/s at the most.
    assert!(bench.number("_TDA") - from <= 0.4 * 500.0 + 5.0);
    // AB 1 leaves the program running, AB does not, nor does ST without axes.
    assert_eq!(bench.number("_HX7"), 1.0);
    bench.tell("ST");
    assert_eq!(bench.number("_HX7"), 0.0);
}

#[test]
fn branches_loops_and_subroutines_run() {
    let mut bench = with(
        "#MAIN;n=0;s=0\n#NEXT;n=n+1\nJS #ADD,n<>3\nIF n>4\nr=1\nELSE\nr=2\nENDIF\nJP #NEXT,n<5\nMG \"s\",s{F3.0},r{F1.0};EN\n#ADD;s=s+n;EN\n",
    );
    bench.tell("XQ #MAIN");
    bench.wait(0.1);
    assert_eq!(bench.emulator.transmit(0), b"s 012 1\r\n");
    assert_eq!(bench.number("_NO"), 0.0);
}

#[test]
fn waits_are_in_samples_of_976_microseconds() {
    let mut bench = with("#A;t=TIME;WT 100;u=TIME-t;WT 50,1;v=TIME-t;PRA=10;BGA;AM A;w=_BGA;EN\n");
    bench.tell("SHA;XQ #A");
    bench.wait(1.0);
    assert_eq!((bench.number("u"), bench.number("v")), (100.0, 150.0));
    assert_eq!(bench.number("w"), 0.0);
    assert_eq!(bench.ask("WT 10;TC1"), "?2 Command only valid from program\r\n:");
}

#[test]
fn a_limit_runs_its_subroutine_and_returns() {
    let mut bench = with("#A;WT 1000;JP #A\n#LIMSWI;hit=hit+1;RE\n");
    bench.tell("hit=0;XQ #A;SHA;FLA=100;PAA=500;BGA");
    bench.settle();
    assert_eq!((bench.number("hit"), bench.number("_HX0")), (1.0, 1.0));
    assert_eq!(bench.number("_SCA"), 2.0);
}

#[test]
fn errors_run_cmderr_or_are_reported_with_their_line() {
    let mut bench = with("#A\ni=var\nEN\n");
    bench.tell("XQ #A,2");
    bench.sample();
    // gclib.h shows `?55 i=var` for line 55.
    assert_eq!(bench.emulator.transmit(0), b"?1 i=var\r\n");
    assert_eq!((bench.number("_TC"), bench.number("_HX2")), (9.0, 0.0));
    // M2FS galil.py: what the routine of a DMC-4183 tells.
    let mut bench =
        with("#A\nBAD\nEN\n#CMDERR;MG \"CMDERR:ERR\",_TC{F4.0},\" line\",_ED{F3.0};EN\n");
    bench.tell("XQ #A,2");
    bench.sample();
    bench.sample();
    assert_eq!(bench.emulator.transmit(0), b"CMDERR:ERR 0001 line 001\r\n");
}

#[test]
fn unsolicited_text_is_marked_and_routed() {
    let mut bench = with("#A;MG \"hello\";EN\n");
    bench.tell("CW 1;XQ #A");
    bench.sample();
    let marked: Vec<u8> = b"hello\r\n".iter().map(|byte| byte | 0x80).collect();
    assert_eq!(bench.emulator.transmit(0), marked);
    // What is asked for is never marked.
    assert_eq!(bench.ask("MG 1"), " 1.0000\r\n:");
    bench.tell("CW 2;XQ #A");
    bench.sample();
    assert_eq!(bench.emulator.transmit(0), b"hello\r\n");
}

#[test]
fn a_burned_program_runs_after_a_reset() {
    let mut bench = with("#AUTO;up=1;EN\n");
    bench.ask("BP");
    bench.wait(2.1);
    assert_eq!(bench.emulator.transmit(0), b":");
    bench.ask("RS");
    bench.wait(0.5);
    bench.emulator.transmit(0);
    assert_eq!(bench.number("up"), 1.0);
}
