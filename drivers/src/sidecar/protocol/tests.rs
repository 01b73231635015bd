use super::*;

fn items(parser: &mut SidecarParser, bytes: &[u8]) -> Vec<ReceivedItem> {
    let mut all = Vec::new();
    for byte in bytes {
        all.extend(parser.take(*byte));
        while let Some(item) = parser.next_ready() {
            all.push(item);
        }
    }
    all
}

fn sample(ticks: u32) -> SidecarSample {
    let (counts, pulses) = (Some(-152_034), Some(1_200));
    SidecarSample { ticks, counts, pulses, status: 33, values: Vec::new() }
}

fn is_sample(item: &ReceivedItem, wanted: &SidecarSample) -> bool {
    matches!(item, ReceivedItem::Message(SidecarMessage::Sample(found)) if found == wanted)
}

#[test]
fn lines_of_the_host_are_those_of_the_page_and_are_read_back() {
    let beat = HostMessage::Beat.line(9, false);
    assert_eq!(String::from_utf8(beat).unwrap(), "{\"n\":9,\"do\":\"beat\"}\n");
    let (speed, acceleration) = (MmPerS(0.000_012_5), MmPerS2(50.0));
    let all = [
        HostMessage::Hello,
        HostMessage::Start { is_binary: true },
        HostMessage::Beat,
        HostMessage::Enable,
        HostMessage::Move { to: -1_234_567, speed, acceleration },
        HostMessage::Sine { amplitude: -40, period: 1_000, cycles: 3, acceleration },
        HostMessage::Stop,
        HostMessage::Halt,
        HostMessage::Bye,
    ];
    for message in all {
        for has_checksum in [false, true] {
            let line = message.line(u64::from(u32::MAX), has_checksum);
            assert!(line.len() <= HOST_LINE_MAX);
            let text = String::from_utf8(line).unwrap();
            assert!(!text.contains("e-"), "an exponent in {text}");
            let found = HostMessage::parse(text.trim_end(), has_checksum);
            assert_eq!(found, Ok((u64::from(u32::MAX), message)), "{text}");
        }
    }
    for wrong in [
        "",
        "{}",
        "hello",
        r#"{"n":1,"do":"dance"}"#,
        r#"{"n":1,"do":"move","to":5}"#,
        r#"{"n":1,"do":"move","to":5.5,"speed":1,"acceleration":1}"#,
        r#"{"n":1,"do":"move","to":5,"speed":-1,"acceleration":1}"#,
        r#"{"n":1,"do":"move","to":5,"speed":1e999,"acceleration":1}"#,
        r#"{"n":1,"do":"hello","version":2}"#,
    ] {
        assert!(HostMessage::parse(wrong, false).is_err(), "{wrong}");
    }
    assert!(HostMessage::parse(r#"{"n":1,"do":"stop"}"#, true).is_err());
}

#[test]
fn lines_of_a_sidecar_are_understood() {
    let of = |line: &str| SidecarMessage::parse(line);
    assert_eq!(of(r#"{"ok": 5}"#), Some(SidecarMessage::Ok { number: 5, ticks: None }));
    assert_eq!(of(r#"{"ok":5,"t":7}"#), Some(SidecarMessage::Ok { number: 5, ticks: Some(7) }));
    let why = || "hot\u{b0}".to_owned();
    assert_eq!(
        of(r#"{"no":5,"why":"hot\u00b0\u001b"}"#),
        Some(SidecarMessage::No { number: Some(5), why: why() })
    );
    assert_eq!(
        of(r#"{"no":null,"why":"hot\u00b0"}"#),
        Some(SidecarMessage::No { number: None, why: why() })
    );
    assert_eq!(of(r#"{"boot":3,"later":[1]}"#), Some(SidecarMessage::Boot(3)));
    let Some(SidecarMessage::Sample(found)) = of(r#"{"t":1,"c":-5,"p":6,"s":33,"v":[21.5,null]}"#)
    else {
        panic!("no sample");
    };
    assert_eq!((found.counts, found.pulses, found.status), (Some(-5), Some(6), 33));
    assert_eq!(found.values, [Some(21.5), None]);
    for garbled in [
        r#"{"t":-1}"#,
        r#"{"t":4294967296}"#,
        r#"{"t":1,"c":NaN}"#,
        r#"{"t":1,"c":1.5}"#,
        r#"{"t":1,"v":[1e999]}"#,
        r#"{"t":1,"p":1,"s":64}"#,
        r#"{"c":1}"#,
        r#"{"ok":-1}"#,
        r#"{"no":1.5}"#,
        "{}",
        "[]",
        "1",
        "",
    ] {
        assert_eq!(of(garbled), None, "{garbled}");
    }
}

#[test]
fn samples_are_read_back_from_lines_and_frames() {
    for (has_checksum, has_frames) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut parser = SidecarParser::new(has_checksum, has_frames);
        let mut bytes = Vec::new();
        for ticks in [0, 5, u32::MAX] {
            let sample = sample(ticks);
            bytes.extend(if has_frames { sample.frame() } else { sample.line(has_checksum) });
            bytes.extend(finish_line(r#"{"ok":1}"#, has_checksum));
        }
        let found = items(&mut parser, &bytes);
        assert_eq!(found.len(), 6, "{found:?}");
        assert!(is_sample(&found[4], &sample(u32::MAX)), "{found:?}");
    }
    let values = vec![Some(21.5), None];
    let with_values = SidecarSample { values, ..sample(3) };
    let found = items(&mut SidecarParser::default(), &with_values.line(false));
    assert!(is_sample(&found[0], &with_values));
    assert_eq!(sample(1).frame().len(), 17);
}

#[test]
fn no_changed_byte_of_a_frame_is_a_sample_and_the_next_is_whole() {
    let frames = [sample(100).frame(), sample(101).frame(), sample(102).frame()].concat();
    for at in 0..17 {
        for other in 0..=255_u8 {
            let mut changed = frames.clone();
            if std::mem::replace(&mut changed[at], other) == other {
                continue;
            }
            let mut parser = SidecarParser::new(false, true);
            let found = items(&mut parser, &changed);
            assert!(!found.iter().any(|item| is_sample(item, &sample(100))), "{at} {other}");
            // The second may be searched through for a beginning, the third is found.
            assert!(
                found.iter().any(|item| is_sample(item, &sample(102))),
                "{at} {other}: {found:?}"
            );
        }
        let mut shorter = frames.clone();
        shorter.remove(at);
        let found = items(&mut SidecarParser::new(false, true), &shorter);
        assert!(found.iter().any(|item| is_sample(item, &sample(102))), "{at}: {found:?}");
    }
}

#[test]
fn a_line_that_is_too_long_or_garbled_is_one_item() {
    let long = [vec![b'x'; 3 * LINE_MAX], b"\n{\"boot\":1}\r\n\n".to_vec()].concat();
    let found = items(&mut SidecarParser::default(), &long);
    let boot = ReceivedItem::Message(SidecarMessage::Boot(1));
    assert_eq!(found, [ReceivedItem::Garbled, boot.clone()]);
    let found = items(&mut SidecarParser::default(), b"{\"boot\":\xff1}\n{\"boot\":1}\n");
    assert_eq!(found, [ReceivedItem::Garbled, boot]);
    // With checksum no changed character is a message.
    let whole = sample(77).line(true);
    for at in 0..whole.len() - 1 {
        let mut changed = whole.clone();
        changed[at] ^= 1;
        let found = items(&mut SidecarParser::new(true, false), &changed);
        let is_garbled = |item: &ReceivedItem| *item == ReceivedItem::Garbled;
        assert!(found.iter().all(is_garbled), "{at} {found:?}");
    }
}
