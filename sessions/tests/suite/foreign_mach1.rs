//! Presses in files of a Mach-1: contact and stress relaxation as one measurement, and what is left of a damaged file.

use palpate_model::rig::Phase;
use palpate_tables::import::{ForeignFile, ForeignPart, ImportOptions, parse_foreign};
use std::fmt::Write;

const COLUMNS: &str = "Time, s\tPosition (z), mm\tFz, N";

/// A block that begins at this time of the day.
fn block(name: &str, clock: &str, facts: &str, rows: &[(f64, f64, f64)]) -> String {
    let mut text = format!(
        "<INFO>\r\nTime:\t{clock}\r\nLoad Cell Name:\tGSO25g\r\nLoad Cell Calibration Date:\t2023-10-05\r\n<END INFO>\r\n\
         <{name}>\r\n{facts}"
    );
    if rows.is_empty() {
        return text;
    }
    write!(text, "<DATA>\r\n{COLUMNS}\r\n").unwrap();
    for (t, z, force) in rows {
        write!(text, "{t:.6}\t{z:.6}\t{force:.6}\r\n").unwrap();
    }
    text + "<END DATA>\r\n"
}

/// Down to the contact at 2.5 mm within 0.4 s.
fn contact(facts: &str) -> String {
    let rows: Vec<_> = (0..5).map(|i| 0.1 * f64::from(i)).map(|t| (t, 2.1 + t, 0.01 * t)).collect();
    block("Find Contact", "23:59:58.500", facts, &rows)
}

/// From the contact by 0.5 mm within 0.5 s, then a force that relaxes.
fn relaxation_rows() -> Vec<(f64, f64, f64)> {
    let row = |i: i32| {
        let t = 0.1 * f64::from(i);
        let z = 2.5 + t.min(0.5);
        (t, z, if t < 0.55 { 4.0 * t } else { 2.5 - t })
    };
    (0..10).map(row).collect()
}

fn relaxation() -> String {
    block("Stress Relaxation", "00:00:01.250", "Velocity, mm/s:\t1.0\r\n", &relaxation_rows())
}

fn file(blocks: &[String]) -> String {
    format!("<Mach-1 File>\r\n{}", blocks.concat())
}

fn whole() -> String {
    let zero = block("Zero Load", "00:00:00.000", "", &[]);
    let wait = block("Wait", "00:00:00.100", "", &[(0.0, 2.5, 0.0), (0.5, 2.5, 0.0)]);
    let lift = block("Move Absolute", "00:00:09.000", "", &[(0.0, 3.0, 1.0), (0.1, 1.0, 0.0)]);
    file(&[contact("Stage Repositioning:\tNone\r\n"), zero, wait, relaxation(), lift])
}

fn read_with(text: &str, options: &ImportOptions) -> ForeignFile {
    let read = parse_foreign("gel.txt", text.as_bytes().to_vec(), options);
    read.unwrap_or_else(|reason| panic!("{reason}\n{text}"))
}

fn read(text: &str) -> ForeignFile {
    read_with(text, &ImportOptions::default())
}

fn names(read: &ForeignFile) -> Vec<&str> {
    read.parts.iter().map(|part| part.imported.part.as_str()).collect()
}

fn part(text: &str, name: &str) -> ForeignPart {
    let options = ImportOptions { parts: vec![name.into()], ..ImportOptions::default() };
    read_with(text, &options).parts.remove(0)
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
}

#[test]
fn contact_and_relaxation_become_one_part_with_phases() {
    let read = read(&whole());
    assert_eq!(names(&read), ["Press 1", "Move Absolute 1"]);
    let in_press = |reason: &&String| reason.contains("'Press 1'");
    assert_eq!(read.left_out.iter().filter(in_press).count(), 3, "{:?}", read.left_out);
    let press = &read.parts[0];
    let count = |phase| press.samples.iter().filter(|one| one.phase == phase).count();
    let phases = [Phase::Contact, Phase::Rest, Phase::Ramp, Phase::Hold];
    assert_eq!(phases.map(count), [5, 2, 6, 4]);
    // The clock gives the time between the blocks, past midnight; depth counts from the contact.
    for (index, t, depth, force) in [
        (0, 0.0, -0.4, 0.0),
        (4, 0.4, 0.0, 0.004),
        (5, 1.6, 0.0, 0.0),
        (7, 2.75, 0.0, 0.0),
        (12, 3.25, 0.5, 2.0),
        (16, 3.65, 0.5, 1.6),
    ] {
        let sample = &press.samples[index];
        assert_near(sample.t, t);
        assert_near(sample.depth.unwrap(), depth);
        assert_near(sample.force.unwrap(), force);
    }
    for (key, value) in [
        ("Load Cell Name", "GSO25g"),
        ("Load Cell Calibration Date", "2023-10-05"),
        ("Velocity, mm/s", "1.0"),
        ("Find Contact, Time", "23:59:58.500"),
        ("Blocks", "Find Contact 1, Stress Relaxation 1"),
    ] {
        let fact = (key.into(), value.into());
        assert!(press.imported.facts.contains(&fact), "{key}: {:?}", press.imported.facts);
    }
    let zero = press.imported.readings.iter().find(|one| one.what == "depth zero").unwrap();
    assert!(zero.found.starts_with("line 15, "), "{}", zero.found);
}

#[test]
fn blocks_of_a_press_are_read_alone_on_request() {
    let text = whole();
    for name in ["Stress Relaxation 1", "3"] {
        let alone = part(&text, name);
        assert_eq!(alone.samples.len(), 10, "{name}");
        for (sample, (t, z, _)) in alone.samples.iter().zip(relaxation_rows()) {
            assert_eq!(sample.phase, Phase::Imported);
            assert_near(sample.t, t);
            assert_near(sample.depth.unwrap(), z);
        }
    }
    let stated = ImportOptions {
        parts: vec!["press 1".into()],
        zeros: vec!["depth=2".parse().unwrap()],
        ..ImportOptions::default()
    };
    assert_near(read_with(&text, &stated).parts[0].samples[4].depth.unwrap(), 0.5);
}

#[test]
fn ramps_whose_times_go_on_belong_to_the_press() {
    let mut rows = relaxation_rows();
    rows.extend((0..10).map(|i| 0.1 * f64::from(i)).map(|t| (1.0 + t, 3.0 + t.min(0.2), 3.0)));
    let two = block("Stress Relaxation", "00:00:01.250", "", &rows);
    let row = "1.000000\t3.000000";
    let goes_on = two
        .replace(row, &format!("<divider>\r\n{row}"))
        .replace("<END DATA", "<divider>\r\n<END DATA");
    let press = part(&file(&[contact(""), goes_on.clone()]), "Press 1");
    let phases: Vec<Phase> = press.samples.iter().skip(5).map(|one| one.phase).collect();
    let expected = [(Phase::Ramp, 6), (Phase::Hold, 4), (Phase::Ramp, 3), (Phase::Hold, 7)];
    let expected: Vec<Phase> =
        expected.iter().flat_map(|(phase, count)| std::iter::repeat_n(*phase, *count)).collect();
    assert_eq!(phases, expected);
    // Times that begin again do not say how long the pause before them was.
    let begins_again = goes_on.replace("1.000000\t3.0", "0.000000\t3.0");
    let read = read(&file(&[contact(""), begins_again]));
    assert_eq!(names(&read), ["Press 1", "Stress Relaxation 1 ramp 2"]);
    assert_eq!(read.parts[0].samples.len(), 15);
}

#[test]
fn blocks_that_do_not_fit_together_stay_apart() {
    let (contact, relaxation) = (contact(""), relaxation());
    let moved = contact.replace("<DATA>", "Stage Repositioning:\tLimit\r\n<DATA>");
    let other = relaxation.replace(COLUMNS, "Time, s\tPosition (z), mm\tFz, gf");
    for (blocks, expected) in [
        ([moved, relaxation.clone()], "Stage Repositioning: Limit"),
        ([contact.clone(), other], "has other columns"),
        ([contact.replace("23:59:58.500", "noon"), relaxation.clone()], "'noon'"),
    ] {
        let read = read(&file(&blocks));
        assert_eq!(names(&read), ["Find Contact 1", "Stress Relaxation 1"], "{expected}");
        let remarks = &read.parts[1].imported.remarks;
        assert!(remarks.iter().any(|remark| remark.contains(expected)), "{expected}: {remarks:?}");
    }
    let lift = block("Move Relative", "00:00:01.000", "", &[(0.0, 2.5, 0.0), (0.1, 1.0, 0.0)]);
    let apart = read(&file(&[contact, lift, relaxation]));
    assert_eq!(names(&apart), ["Find Contact 1", "Move Relative 1", "Stress Relaxation 1"]);
}

#[test]
fn last_block_without_its_end_is_read_with_a_remark() {
    let text = file(&[contact(""), relaxation()]);
    let open = text.strip_suffix("<END DATA>\r\n").unwrap();
    let (open, closed) = (read(open), read(&text));
    assert_eq!(open.parts[0].samples, closed.parts[0].samples);
    let has_remark = |read: &ForeignFile| {
        read.parts[0].imported.remarks.iter().any(|remark| remark.contains("has no <END DATA>"))
    };
    assert!(has_remark(&open) && !has_remark(&closed));
    let without_first_end = text.replacen("<END DATA>\r\n", "", 1);
    let reason = parse_foreign("gel.txt", without_first_end.into(), &ImportOptions::default());
    let reason = reason.unwrap_err();
    assert!(reason.contains("'<INFO>' comes before the <END DATA>"), "{reason}");
}

/// What is read of a file that was cut off is what the whole file has, but for the last row; and a block that lost its end
/// says so.
#[test]
fn file_cut_off_after_any_byte_is_refused_or_has_the_first_rows() {
    let text = whole();
    let whole_press = part(&text, "Press 1");
    for length in 1..text.len() {
        let cut = text.as_bytes()[..length].to_vec();
        let Ok(read) = parse_foreign("gel.txt", cut, &ImportOptions::default()) else { continue };
        let Some(press) = read.parts.iter().find(|part| part.imported.part == "Press 1") else {
            continue;
        };
        let count = press.samples.len() - 1;
        for (found, expected) in press.samples[..count].iter().zip(&whole_press.samples) {
            assert_eq!(
                (found.t, found.depth, found.force),
                (expected.t, expected.depth, expected.force),
                "{length}"
            );
        }
        let is_short = count + 1 < whole_press.samples.len();
        let remarks = &press.imported.remarks;
        let says_so = remarks.iter().any(|remark| remark.contains("has no <END DATA>"));
        assert!(!is_short || says_so, "{length}: {remarks:?}");
    }
}
