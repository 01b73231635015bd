//! Terminators, prompts, numbers, errors: byte for byte.

use super::bench::Bench;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::{EmulatedGalilSettings, GalilModel};

/// Where it is from, what is sent, what comes back. One controller, in this order.
const TRANSCRIPT: &[(&str, &str, &str)] = &[
    (
        "revision as quoted by users of EPICS Galil-3-6, github.com/motorapp/Galil-3-0",
        "\x12\x16\r",
        "DMC4143 Rev 1.3a\r\n:",
    ),
    ("DMC-40x0 user manual, page 61: accepted", "EO 0\r", ":"),
    ("DMC-2x00 user manual, page 65: lower case is refused", "bg\r", "?"),
    ("DMC-13x8 user manual, controller response to data", "TC1\r", "1 Unrecognized command\r\n:"),
    ("telling clears it", "TC1\r", "0\r\n:"),
    (
        "M2FS galil.py, DMC-4183: MG _HXn, a blank before each number and none between",
        "MG \"HX=\",_HX0,_HX1\r",
        "HX= 0.0000 0.0000\r\n:",
    ),
    ("ESRF BLISS 2.4.0, DMC-30010: MG _BGA gives 0.0000", "MG _BGA\r", " 0.0000\r\n:"),
    ("ESRF BLISS 2.4.0: QZ; BLISS ends commands with ; alone", "QZ;", "4, 52, 26, 36\r\n:"),
    ("EPICS GalilController.cpp: range of an analog input", "MG{Z10.0}_AQ1\r", " 2\r\n:"),
    ("EPICS: a 41x3 has no CO", "MG _CO\r", "?"),
    ("DMC-1700/1800 user manual, page 84", "TP XY\r", " 0, 0\r\n:"),
    ("the same with leading zeros, as printed there", "LZ 0;TP X;LZ 1\r", ": 0000000000\r\n::"),
    (
        "DMC-18x2 command reference, MG: formats in braces",
        "v1=10;MG \"x\",v1{F4.2},\"y\",v1{$4.0}{N}\r",
        ":x 0010.00y$000A:",
    ),
    ("M2FS galil.py: a return behind ; is one terminator more", "ST;\r", "::"),
    ("TMT galil-io: an empty line", "\r", ":"),
    ("several, the middle one wrong", "a=1;bg;MG a\r", ":? 1.0000\r\n:"),
    ("gclib.h: HX of each thread", "HX0;HX7\r", "::"),
    ("a thread that is none", "HX8;TC1\r", "?6 Number out of range\r\n:"),
    (
        "DMC-40x0 command reference, BG with the motor off",
        "PR 100;BGA;TC1\r",
        ":?20 Begin not valid with motor off\r\n:",
    ),
    (
        "BLISS: 73422 is read back as 72704",
        "ACA=73422;ACA=?;MG _ACA\r",
        ": 72704\r\n: 72704.0000\r\n:",
    ),
    ("DMC-40x0 command reference, SP: 2 counts/s at TM 1000", "SP 51.5;SP ?\r", ": 50\r\n:"),
    ("axes left out and synonyms", "SP ,,2000;SPZ=?;SP ?,,?\r", ": 2000\r\n: 50, 2000\r\n:"),
    ("limits off", "FLA=2147483647;MG _FLA\r", ": 2147483647.0000\r\n:"),
    ("one open switch each", "MG _LFA,_LRA,_HMA\r", " 1.0000 1.0000 1.0000\r\n:"),
    ("motor off, switches open", "TS A\r", " 47\r\n:"),
    ("stop codes", "SC A\r", " 1\r\n:"),
    ("a serial line", "WH\r", "RS232\r\n:"),
    ("DR is for networks (gclib.h)", "DR 2;DR 0\r", "?:"),
    ("array errors", "DM d[3];d[3]=1;TC1\r", ":?56 Array index invalid or out of range\r\n:"),
    ("array values", "d[1]=2.5;MG d[1],d[-1]\r", ": 2.5000 3.0000\r\n:"),
    (
        "DMC-1700/1800 user manual, QU: comma, then control-Z",
        "QU d[],0,2,1\r",
        " 0.0000, 2.5000, 0.0000\r\n\x1a:",
    ),
    ("QD ends with a backslash", "QD d[]\r1,2\r3\\", ":"),
    ("what it brought", "QU d[],1,2\r", " 2.0000\r\n 3.0000\r\n\x1a:"),
    ("more values than elements", "QD d[]\r1,2,3,4\\TC1\r", "?84 Too many elements\r\n:"),
    ("record errors of their own", "RC 1;TC1\r", "?81 No array or source specified\r\n:"),
    ("no such array", "RA b[];TC1\r", "?82 Undefined Array\r\n:"),
    ("a name that is not known", "MG unknown;TC1\r", "?9 Variable error\r\n:"),
    ("no such operand", "MG _GNX;TC1\r", "?58 Bad command response (i.e._GNX)\r\n:"),
    (
        "ESRF BLISS 2.4.0, get_axis_pid: eight axes asked of any board",
        "KP ?,?,?,?,?,?,?,?;TB ?\r",
        " 6.000, 6.000, 6.000, 6.000\r\n: 0\r\n:",
    ),
    (
        "DMC-40x0 command reference, SP: range of steppers and of servos",
        "SPA=6000002;SPB=22000000\r",
        "?:",
    ),
    ("a number asked for by name", "b=3;b=\r", ": 3.0000\r\n:"),
    ("a string of six characters in a number", "s=\"GOOD\";MG s{S4}\r", ":GOOD\r\n:"),
];

#[test]
fn answers_are_those_of_manuals_and_captures() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    for (source, sent, answered) in TRANSCRIPT {
        let answer = bench.raw(0, sent.as_bytes());
        let answer = String::from_utf8_lossy(&answer).into_owned();
        assert_eq!(answer, *answered, "{sent:?}: {source}");
        bench.sample();
    }
}

#[test]
fn it_does_not_matter_how_bytes_are_split_or_lines_end() {
    let whole = ["a=1", "bg", "MG a", "ACA=73422", "ACA=?", "QZ"];
    for end in ["\r", "\r\n", ";", ";\r", "\r\r\n"] {
        let sent: String = whole.iter().map(|line| format!("{line}{end}")).collect();
        let extra = if matches!(end, ";\r" | "\r\r\n") { ":" } else { "" };
        let answered: String = [":", "?", " 1.0000\r\n:", ":", " 72704\r\n:", "4, 52, 26, 36\r\n:"]
            .iter()
            .map(|answer| format!("{answer}{extra}"))
            .collect();
        for at in 0..=sent.len() {
            let mut bench = Bench::serial(GalilModel::Dmc4143);
            let mut answer = bench.raw(0, &sent.as_bytes()[..at]);
            bench.wait(0.01);
            answer.extend(bench.raw(0, &sent.as_bytes()[at..]));
            assert_eq!(String::from_utf8_lossy(&answer), answered, "{end:?} at {at}");
        }
    }
}

/// What EPICS Galil-3-6, ESRF BLISS, TMT galil-io and small clients send when they connect and look around.
#[test]
fn what_clients_send_is_accepted() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    let words = "WH|QZ|DR 0|IHT=>-3|TH|ID|\x12\x16|CF I|CF S|CW 1|CW 2|EO 0|HX0|HX7|TC|TC0|TC1|TB|TI|TB ?|TI ?|TM ?|IA?\
        |TL ?|SC|TS|TT|TV|TE|CN -1,-1|SB 1|CB 1|AO 1,0.5|AQ 1,2|AGA=0|LCA=1|YAA=2|YBA=200|OEA=0|ERA=1000|KSA=2|MTA=-2.5\
        |LDA=0|DEA=5|FEB|HMB|STB|ABC|SHA|MOA|x=1|IT*=1|VF 10.4|PF 10.0|LV|LA|LL";
    for line in words.split('|').map(str::trim) {
        let answer = bench.ask(line);
        // `ABC` is a variable's name to a client, and to the controller `AB` with an axis.
        assert_eq!(answer.ends_with(':'), line != "ABC", "{line}: {answer}");
    }
    let operands = "_BGA _MOA _TPA _RPA _TDA _TEA _TVA _SCA _LFA _LRA _HMA _MTA _KSA _YAA _LDA _OEA _ERA _AQ1 _DQ0 _CN0 \
        _CA _TM _TC _XQ0 _NO _BN _AB TIME @AN[1] @IN[1] @OUT[1] _PAA _PRA _JGA _SPA _ACA _FLA _BLA _HX0 _ED _DM _BGS";
    for operand in operands.split_whitespace() {
        bench.number(operand);
    }
}

#[test]
fn echo_sends_back_what_came() {
    let mut bench =
        Bench::new(EmulatedGalilSettings { has_echo: true, ..EmulatedGalilSettings::default() });
    assert_eq!(bench.ask("MG 1"), "MG 1\r 1.0000\r\n:");
    assert_eq!(bench.ask("EO 0"), "EO 0\r:");
    assert_eq!(bench.ask("MG 1"), " 1.0000\r\n:");
    assert_eq!(bench.number("_TB"), 0.0);
}

#[test]
fn a_line_beyond_eighty_characters_is_refused_from_there_on() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    let line = format!("a=1;{};b=2;c=3", "MG a;".repeat(15));
    assert!(line.len() > 80);
    let answer = bench.ask(&line);
    assert!(answer.starts_with(": 1.0000\r\n:"), "{answer}");
    assert!(answer.ends_with('?'), "{answer}");
    assert_eq!(bench.ask("TC1"), "5 Input buffer full\r\n:");
    assert_eq!(bench.ask("MG c"), "?");
}

#[test]
fn analog_inputs_are_there_or_not() {
    let mut without = Bench::serial(GalilModel::Dmc2143);
    assert_eq!(without.ask("MG @AN[1]"), "?");
    assert_eq!(without.ask("TC1"), "132 Analog inputs not present\r\n:");
    assert_eq!(without.ask("QZ"), "4, 24, 16, 28\r\n:");
    let mut with = Bench::serial(GalilModel::Dmc4143);
    with.wait(0.1);
    // The thesis's cell without load.
    assert!((with.number("@AN[1]") - 1.28).abs() < 0.02);
    assert_eq!(with.number("@AN[2]"), 0.0);
    assert_eq!(with.ask("MG @AN[9]"), "?");
}

#[test]
fn a_burn_takes_two_seconds_and_a_reset_forgets() {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    assert_eq!(bench.ask("a=1;BN;MG a"), ":");
    bench.wait(1.9);
    assert_eq!(bench.emulator.transmit(0), b"");
    bench.wait(0.2);
    assert_eq!(bench.emulator.transmit(0), b": 1.0000\r\n:");
    assert_eq!(bench.ask("RS"), "");
    assert_eq!(bench.ask("MG a"), "");
    bench.wait(0.4);
    assert_eq!(bench.emulator.transmit(0), b":");
    assert_eq!(bench.ask("MG a"), "?");
    assert!(bench.number("TIME") < 500.0);
}

#[test]
fn eight_clients_each_have_a_line_of_their_own() {
    let mut bench =
        Bench::new(EmulatedGalilSettings { is_serial: false, ..EmulatedGalilSettings::default() });
    assert_eq!(bench.emulator.channels(), 8);
    for channel in 0..8 {
        bench.emulator.connect(bench.now, channel);
    }
    assert_eq!(bench.raw(1, b"MG 1"), b"");
    assert_eq!(bench.raw(0, b"WH\r"), b"IHA\r\n:");
    assert_eq!(bench.raw(1, b"1\r"), b" 11.0000\r\n:");
    // EPICS closes all others when it connects.
    assert_eq!(bench.raw(2, b"IHT=>-3\r"), b":");
    for channel in 0..8 {
        assert_eq!(bench.emulator.take_hang_up(channel), channel != 2);
    }
    let handles = String::from_utf8(bench.raw(2, b"TH\r")).unwrap();
    assert_eq!(handles.matches("AVAILABLE").count(), 7, "{handles}");
    bench.raw(2, b"RS\r");
    assert!(bench.emulator.take_hang_up(2));
}
