//! Byte-exact transcripts and properties of the parser.

use super::*;
use palpate_model::random::SplitMix;

fn all(bytes: &[u8]) -> Vec<GrblLine> {
    let mut parser = GrblParser::default();
    bytes.iter().filter_map(|byte| parser.take(*byte)).collect()
}

fn status(text: &str) -> GrblStatus {
    let Some(GrblLine::Status(status)) = all(text.as_bytes()).pop() else {
        panic!("{text}");
    };
    status
}

/// Texts as gnea/grbl, doc/markdown/interface.md has them, as bytes of the line.
const TRANSCRIPT: &[u8] = b"\r\nGrbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n\
    [VER:v1.1d.20161014:Some string]\r\n[OPT:VL]\r\nok\r\nerror:9\r\nALARM:1\r\n[MSG:Reset to continue]\r\n\
    $0=10\r\n$11=0.010\r\n$130=200.000\r\nok\r\n>G54G20:ok\r\n$N0=G54\r\n[PRB:0.000,0.000,0.000:0]\r\n\
    <Hold:0|MPos:0.000,-10.000,5.000|FS:0,0|Pn:XP>\r\n";

fn meaning() -> Vec<GrblLine> {
    let message = |text: &str| GrblLine::Message(text.to_owned());
    vec![
        GrblLine::Hello("1.1h".into()),
        message("MSG:'$H'|'$X' to unlock"),
        message("VER:v1.1d.20161014:Some string"),
        message("OPT:VL"),
        GrblLine::Ok,
        GrblLine::Refused(GrblCode::parse(false, "9")),
        GrblLine::Alarm(GrblCode::parse(true, "1")),
        message("MSG:Reset to continue"),
        GrblLine::Setting(0, 10.0),
        GrblLine::Setting(11, 0.01),
        GrblLine::Setting(130, 200.0),
        GrblLine::Ok,
        GrblLine::Other(">G54G20:ok".into()),
        GrblLine::Other("$N0=G54".into()),
        message("PRB:0.000,0.000,0.000:0"),
        GrblLine::Status(GrblStatus {
            state: GrblState::Hold(true),
            machine: Some(vec![0.0, -10.0, 5.0]),
            work: None,
            pins: "XP".into(),
        }),
    ]
}

#[test]
fn welcome_of_grblhal_is_recognised() {
    let lines = all(b"\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n");
    assert_eq!(lines, [GrblLine::Hello("1.1f".into())]);
}

#[test]
fn a_transcript_is_understood_split_at_every_byte() {
    assert_eq!(all(TRANSCRIPT), meaning());
    for at in 0..TRANSCRIPT.len() {
        let mut parser = GrblParser::default();
        let (first, second) = TRANSCRIPT.split_at(at);
        let mut got: Vec<GrblLine> = first.iter().filter_map(|b| parser.take(*b)).collect();
        got.extend(second.iter().filter_map(|b| parser.take(*b)));
        assert_eq!(got, meaning(), "split at {at}");
    }
}

#[test]
fn status_reports_have_fields_in_any_order() {
    // doc/markdown/interface.md, "Real-time Status reports": only state and position are always there.
    let full = status(
        "<Jog|WPos:-2.500,0.000,11.000|Ov:100,100,100|WCO:0.000,1.551,5.664|Bf:15,128|F:500>\n",
    );
    assert_eq!(full.state, GrblState::Jog);
    assert_eq!(full.work, Some(vec![-2.5, 0.0, 11.0]));
    assert!(!full.has_pin('X'));
    assert_eq!(status("<Hold:1|MPos:1,2,3,4|New>\r\n").state, GrblState::Hold(false));
    for bad in
        ["<Idle>", "<|MPos:0,0,0>", "<Idle|MPos:0,x,0>", "<Idle|MPos:0,nan,0>", "<Idle|MPos:0,0,0"]
    {
        let got = all(format!("{bad}\r\n").as_bytes());
        assert_eq!(got, [GrblLine::Other(bad.into())]);
    }
}

#[test]
fn lines_of_older_firmware_are_read() {
    let got =
        all(b"error: Bad number format\r\n$100=250.000 (x, step/mm)\r\nALARM: Hard limit\r\n");
    assert!(
        matches!(&got[0], GrblLine::Refused(refusal) if refusal.to_string().contains("Bad number"))
    );
    assert_eq!(got[1], GrblLine::Setting(100, 250.0));
    assert!(matches!(&got[2], GrblLine::Alarm(alarm) if alarm.to_string().contains("Hard limit")));
}

#[test]
fn a_jog_is_one_line_that_fits_the_buffer() {
    assert_eq!(jog('X', 12.5, 45.0), "$J=G21G90G53X12.5000F45.00\n");
    assert!(jog('Z', -1234.56789, 99_999.99).len() < 40);
}

#[test]
fn random_bytes_never_panic_and_memory_is_bounded() {
    let mut random = SplitMix::seeded(11);
    let letters = b"<>[]$|:,.-=okerrALMPosIdleJ0123456789\r\n?\xff";
    for round in 0..4_000 {
        let length = 1 + random.below(400);
        let bytes: Vec<u8> = (0..length)
            .map(|_| match round % 2 {
                0 => random.below(256) as u8,
                _ => letters[random.below(letters.len())],
            })
            .collect();
        let cut = random.below(length);
        let mut parser = GrblParser::default();
        let mut parts: Vec<GrblLine> =
            bytes[..cut].iter().filter_map(|b| parser.take(*b)).collect();
        parts.extend(bytes[cut..].iter().filter_map(|b| parser.take(*b)));
        assert!(parser.line.len() <= LINE_MAX);
        assert_eq!(parts, all(&bytes));
        for incoming in &parts {
            if let GrblLine::Refused(refusal) = incoming {
                assert!(!refusal.to_string().is_empty());
            }
        }
    }
    let mut parser = GrblParser::default();
    for _ in 0..10 * LINE_MAX {
        assert_eq!(parser.take(b'x'), None);
    }
    assert!(parser.line.len() <= LINE_MAX);
    assert_eq!(parser.take(b'\n'), Some(GrblLine::Flood));
    assert_eq!(parser.take(b'o'), None);
    assert_eq!(parser.take(b'k'), None);
    assert_eq!(parser.take(b'\n'), Some(GrblLine::Ok));
}
