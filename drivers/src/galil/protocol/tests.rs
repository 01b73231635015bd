//! Byte-exact transcripts and properties of the parser.

use super::*;
use palpate_model::random::SplitMix;

fn all(bytes: &[u8]) -> Vec<GalilMessage> {
    let mut parser = GalilParser::default();
    bytes.iter().filter_map(|byte| parser.take(*byte)).collect()
}

fn reply(text: &str, is_accepted: bool) -> GalilMessage {
    GalilMessage::Reply(GalilReply { is_accepted, bytes: text.into() })
}

type Transcript = (&'static str, &'static [u8], &'static [(&'static str, bool)]);

const TRANSCRIPTS: [Transcript; 25] = [
    // DMC-1700/1800 user manual, page 79: "the DMC-1700/1800 returns a : if the instruction was accepted".
    ("accepted", b":", &[("", true)]),
    // Page 79: "a ? if the instruction was not accepted"; page 80: TC1 gives the reason.
    (
        "refused, then TC1",
        b"?1 Unrecognized command\r\n:",
        &[("", false), ("1 Unrecognized command", true)],
    ),
    // Page 84: `TP X` with leading zeros.
    ("TP X", b"0000000000\r\n:", &[("0000000000", true)]),
    // ESRF BLISS 2.4.0, controllers/motors/galil: MG _BGA of a DMC-30010.
    ("MG _BGA", b" 0.0000\r\n:", &[(" 0.0000", true)]),
    // The same: QZ.
    ("QZ", b" 4, 52, 26, 36\r\n:", &[(" 4, 52, 26, 36", true)]),
    // ^R^V as users of the EPICS driver Galil-3-6 report it.
    (
        "^R^V",
        b"DMC4143 Rev 1.3a\r\n:",
        &[("DMC4143 Rev 1.3a", true)],
    ),
    // galil-io of TMT, github.com/tmtsoftware/galil-prototype: one prompt per command of a line.
    (
        "a=1;b=2;MG a",
        b":: 1.0000\r\n:",
        &[("", true), ("", true), (" 1.0000", true)],
    ),
    // The same with a command in the middle that is refused.
    (
        "a=1;XX;MG a",
        b":? 1.0000\r\n:",
        &[("", true), ("", false), (" 1.0000", true)],
    ),
    // DMC-1700/1800 user manual, QU: the transfer ends with control-Z.
    (
        "QU a[],0,1,1",
        b" 1.0000, 2.0000\r\n\x1a:",
        &[(" 1.0000, 2.0000", true)],
    ),
    // The same with delimiter 0: a carriage return between values.
    (
        "QU a[],0,1,0",
        b" 1.0000\r\n 2.0000\r\n\x1a:",
        &[(" 1.0000\r\n 2.0000", true)],
    ),
    // DMC-1700/1800 user manual, page 80: TC and TC0 give the number alone.
    ("refused, then TC0", b"?1\r\n:", &[("", false), ("1", true)]),
    // TC1 of a limit switch (DMC-40x0 command reference, `TC`).
    (
        "BGA, then TC1",
        b"?22 Begin not possible due to Limit Switch\r\n:",
        &[
            ("", false),
            ("22 Begin not possible due to Limit Switch", true),
        ],
    ),
    // galil-io of TMT: an empty line gives a prompt.
    ("an empty line", b":", &[("", true)]),
    // DMC-1700/1800 user manual, page 84; galil-io of TMT: several axes are parted by a comma and a blank.
    ("TP AB", b" 100, 200\r\n:", &[(" 100, 200", true)]),
    // DMC-1400 user manual, page 211: TS of an axis, with leading zeros.
    ("TS A", b"015\r\n:", &[("015", true)]),
    // ESRF BLISS 2.4.0: a program's version, in variable format.
    ("MG version", b" 0.2000\r\n:", &[(" 0.2000", true)]),
    // The same, a DMC-30010: 73422 was set, the multiple of 1024 below it comes back.
    (
        "AC 73422;MG _ACA",
        b": 72704.0000\r\n:",
        &[("", true), (" 72704.0000", true)],
    ),
    // galil-io of TMT: `MG a,b,c` gives one line.
    (
        "MG a,b,c",
        b" 1.0000 2.0000 3.0000\r\n:",
        &[(" 1.0000 2.0000 3.0000", true)],
    ),
    // `GalilController.cpp` of EPICS: WH gives the handle, or the serial port.
    ("WH, network", b"IHA\r\n:", &[("IHA", true)]),
    ("WH, serial", b"RS232\r\n:", &[("RS232", true)]),
    // The same: TH, one line for each handle.
    (
        "TH",
        b"CONTROLLER IP ADDRESS 169,254,33,110 ETHERNET ADDRESS 00-50-4C-20-6C-01\r\nIHC AVAILABLE\r\n:",
        &[(
            "CONTROLLER IP ADDRESS 169,254,33,110 ETHERNET ADDRESS 00-50-4C-20-6C-01\r\nIHC AVAILABLE",
            true,
        )],
    ),
    // The same: what begins with a limit's operand reads 1 while the switch is open.
    ("MG _LFA", b" 1.0000\r\n:", &[(" 1.0000", true)]),
    // `GalilConnector.cpp` of EPICS: a download gives a prompt for `\` and one for `DL`, and a `?` before them for
    // every line that is refused.
    ("DL", b"::", &[("", true), ("", true)]),
    (
        "DL with a wrong line",
        b"?::",
        &[("", false), ("", true), ("", true)],
    ),
    // The same: an upload ends with control-Z, some firmware with `\` before it.
    (
        "UL",
        b"#A\r\nWT 250\r\nJP #A\r\n\x1a:",
        &[("#A\r\nWT 250\r\nJP #A", true)],
    ),
];

/// What the driver writes while it records, byte for byte: DMC-1700/1800 user manual, page 159, gives the arguments.
#[test]
fn a_record_question_and_its_answer_belong_together() {
    use crate::galil::recording::{RecordingStatus, question};
    use crate::galil::settings::tests::thesis;
    let text = question(&thesis());
    assert_eq!(text, "MG @AN[1]{F2.4},_TDA,_RPA,_TSA,_SCA,_RD,TIME");
    // With a stop before it, it still is a line.
    assert!(format!("STA;{text}\r").len() <= LINE_MAX);
    let answer = all(b" 0.3051 120 121 143 0 17 5000\r\n:");
    let [GalilMessage::Reply(reply)] = answer.as_slice() else {
        panic!("{answer:?}");
    };
    let status = RecordingStatus::read(&reply.numbers().unwrap()).unwrap();
    assert_eq!((status.time, status.next), (5000, 17));
    assert_eq!(status.poll, [0.3051, 120.0, 121.0, 143.0, 0.0, 5000.0]);
}

#[test]
fn transcripts_are_understood_split_at_every_byte() {
    for (name, bytes, meaning) in TRANSCRIPTS {
        let expected: Vec<GalilMessage> = meaning.iter().map(|(t, ok)| reply(t, *ok)).collect();
        for at in 0..=bytes.len() {
            let mut parser = GalilParser::default();
            let (first, second) = bytes.split_at(at);
            let mut got: Vec<GalilMessage> = first.iter().filter_map(|b| parser.take(*b)).collect();
            got.extend(second.iter().filter_map(|b| parser.take(*b)));
            assert_eq!(got, expected, "{name}, split at {at}");
        }
    }
}

#[test]
fn unsolicited_text_is_separated_byte_by_byte() {
    // DMC-41x3 user manual, page 45: with CW 1 the top bit of unsolicited characters is set.
    let marked = |text: &str| text.bytes().map(|byte| byte | 0x80).collect::<Vec<u8>>();
    let bytes =
        [&b" 1.00"[..], &marked("?55 i=v"), &b"00\r"[..], &marked("ar\r\n"), &b"\n:"[..]].concat();
    assert_eq!(
        all(&bytes),
        [GalilMessage::Unsolicited("?55 i=var".into()), reply(" 1.0000", true)]
    );
}

#[test]
fn numbers_are_read_as_any_firmware_writes_them() {
    let cases: [(&str, Option<&[f64]>); 12] = [
        (" 0.0000", Some(&[0.0])),
        ("0000000000", Some(&[0.0])),
        ("015", Some(&[15.0])),
        (" 100, 200", Some(&[100.0, 200.0])),
        (" 1.2500-340.0000 12.0000", Some(&[1.25, -340.0, 12.0])),
        ("-1.5000", Some(&[-1.5])),
        (" 4, 52, 26, 36", Some(&[4.0, 52.0, 26.0, 36.0])),
        ("", None),
        ("DMC4143 Rev 1.3a", None),
        ("nan", None),
        ("1e999", None),
        ("- 5", None),
    ];
    for (text, expected) in cases {
        assert_eq!(numbers(text).as_deref(), expected, "{text:?}");
    }
}

#[test]
fn lines_hold_eighty_characters() {
    let commands: Vec<String> = (0..40).map(|i| format!("SPA={i}")).collect();
    let lines = pack_lines(&commands);
    assert!(lines.len() > 1 && lines.iter().all(|line| line.len() <= LINE_MAX));
    let joined: Vec<&str> = lines.iter().flat_map(|line| line.trim_end().split(';')).collect();
    assert_eq!(joined, commands);
    let one = pack_lines(&["BGA".into(), "MG _BGA".into()]);
    assert_eq!(one, ["BGA;MG _BGA\r"]);
}

#[test]
fn refusal_has_a_remedy() {
    let err = parse_error(&GalilReply {
        is_accepted: true,
        bytes: b"22 Begin not possible due to Limit Switch".to_vec(),
    })
    .unwrap();
    assert_eq!(err.code, 22);
    assert!(err.to_string().contains("move the axis the other way"), "{err}");
    let number = parse_error(&GalilReply { is_accepted: true, bytes: b" 6".to_vec() });
    assert_eq!(number.map(|err| err.code), Some(6));
    assert_eq!(parse_error(&GalilReply { is_accepted: true, bytes: b"what".to_vec() }), None);
}

#[test]
fn random_bytes_never_panic_and_memory_is_bounded() {
    let streams = std::env::var("PALPATE_STREAMS").ok();
    let streams = streams.and_then(|text| text.parse().ok()).unwrap_or(2_000);
    let mut random = SplitMix::seeded(7);
    for _ in 0..streams {
        let mut parser = GalilParser::default();
        let length = 1 + random.below(300);
        let bytes: Vec<u8> = (0..length).map(|_| random.below(256) as u8).collect();
        let mut whole = parser.clone();
        let got: Vec<GalilMessage> = bytes.iter().filter_map(|b| whole.take(*b)).collect();
        // Any split gives the same.
        let cut = random.below(length);
        let mut parts: Vec<GalilMessage> =
            bytes[..cut].iter().filter_map(|b| parser.take(*b)).collect();
        parts.extend(bytes[cut..].iter().filter_map(|b| parser.take(*b)));
        assert_eq!(got, parts);
        for incoming in got {
            if let GalilMessage::Reply(reply) = incoming {
                let numbers = reply.numbers().unwrap_or_default();
                assert!(numbers.iter().all(|number| number.is_finite()));
                let _ = (reply.text(), parse_error(&reply));
            }
        }
    }
    let mut parser = GalilParser::default();
    let mut floods = 0;
    for byte in std::iter::repeat_n(b'x', 3 * REPLY_MAX) {
        floods += usize::from(parser.take(byte) == Some(GalilMessage::Flood));
        assert!(parser.reply.len() <= REPLY_MAX);
    }
    assert_eq!(floods, 2);
    for byte in std::iter::repeat_n(b'x' | 0x80, 3 * REPLY_MAX) {
        assert_eq!(parser.take(byte), None);
    }
    assert!(parser.unsolicited.len() <= UNSOLICITED_MAX);
}

#[test]
fn signal_with_a_lost_digit_is_refused() {
    let is_whole = |text: &str| {
        let reply = GalilReply { is_accepted: true, bytes: text.into() };
        reply.begins_with_volts()
    };
    for whole in [" 0.3050 120 120", "-0.3050-120", "10.0000,1", " 00.3050 1", "\r\n 1.2345"] {
        assert!(is_whole(whole), "{whole}");
    }
    for spoilt in [
        " .2345 120",
        " 1.245 120",
        " 1.23455 120",
        " 12345 120",
        " 112.2345 1",
        "",
        "-",
        "--1.2345",
        " 1,2345",
    ] {
        assert!(!is_whole(spoilt), "{spoilt}");
    }
}
