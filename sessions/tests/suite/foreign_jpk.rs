//! JPK force curves: archives of the structure that `docs/guide/import.md` cites, with numbers known by construction.

use palpate_model::rig::Phase;
use palpate_tables::import::{ForeignPart, ImportOptions, parse_foreign};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

/// The files of an archive by name.
type Files = BTreeMap<String, Vec<u8>>;

/// Points of a segment.
const POINTS: i16 = 4;

fn zipped(files: &Files) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    for (name, bytes) in files {
        archive.start_file(name.as_str(), options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// Conversions of the deflection (50 nm/V, 0.25 N/m) and of the height, which falls by 1 µm a volt.
fn conversions(deflection: &str, height: &str) -> String {
    let mut text = String::new();
    for (channel, slot, from, multiplier, offset, unit) in [
        (deflection, "distance", "volts", "5.0E-8", "0.0", "m"),
        (deflection, "force", "distance", "0.25", "0.0", "N"),
        (height, "nominal", "volts", "-1.0E-6", "1.0E-4", "m"),
    ] {
        let head = format!("{channel}.conversion-set.conversion.{slot}");
        writeln!(
            text,
            "{channel}.conversion-set.conversions.base=volts\n{head}.base-calibration-slot={from}\n\
             {head}.scaling.style=offsetmultiplier\n{head}.scaling.multiplier={multiplier}\n\
             {head}.scaling.offset={offset}\n{head}.scaling.unit.unit={unit}"
        )
        .unwrap();
    }
    text + &format!("{height}.conversion-set.conversions.default=nominal\n")
}

fn encoder(channel: &str, kind: &str, multiplier: f64, offset: f64) -> String {
    format!(
        "{channel}.encoder.type={kind}\n{channel}.encoder.scaling.style=offsetmultiplier\n\
         {channel}.encoder.scaling.multiplier={multiplier}\n{channel}.encoder.scaling.offset={offset}\n"
    )
}

/// An approach, a pause and a retraction; the height in steps of a volt and the deflection in steps of half a volt.
fn curve() -> Files {
    let mut files = Files::new();
    let header = "jpk-data-file=spm-forcefile\ntype=force-scan-series\n\
        force-scan-series.description.instrument=JPK00001\nforce-scan-series.description.probe=bead 10 \\u00b5m\n";
    files.insert("header.properties".into(), header.into());
    let channels = ["lcd-info.0", "lcd-info.1"];
    let shared = conversions(channels[0], channels[1])
        + &encoder(channels[0], "signedinteger", 0.5, 0.25)
        + &encoder(channels[1], "signedshort", 1.0, 10.0);
    files.insert("shared-data/header.properties".into(), shared.into());
    let styles = [
        ("extend", "z-extend-force"),
        ("pause", "constant-height-pause"),
        ("retract", "z-retract-height"),
    ];
    for (segment, (style, kind)) in styles.into_iter().enumerate() {
        let folder = format!("segments/{segment}");
        let settings = "force-segment-header.settings";
        let properties = format!(
            "force-segment-header.duration=2.0\nforce-segment-header.time-stamp=2026-03-05 17\\:51\\:14.543 +0200\n\
             {settings}.style={style}\n{settings}.segment-settings.type={kind}\n\
             {settings}.segment-settings.setpoint=1.5\nchannel.vDeflection.lcd-info.*=0\n\
             channel.vDeflection.data.file.name=channels/vDeflection.dat\nchannel.measuredHeight.lcd-info.*=1\n\
             channel.measuredHeight.data.file.name=channels/measuredHeight.dat\n"
        );
        files.insert(format!("{folder}/segment-header.properties"), properties.into());
        let numbers = (0..POINTS).map(|point| POINTS * segment as i16 + point);
        let deflection = numbers.clone().flat_map(|number| i32::from(number).to_be_bytes());
        files.insert(format!("{folder}/channels/vDeflection.dat"), deflection.collect());
        let height = numbers.flat_map(i16::to_be_bytes);
        files.insert(format!("{folder}/channels/measuredHeight.dat"), height.collect());
    }
    files
}

fn read(files: &Files) -> Result<ForeignPart, String> {
    let read = parse_foreign("curve.jpk-force", zipped(files), &ImportOptions::default());
    read.map(|mut read| read.parts.remove(0))
}

fn refused(files: &Files) -> String {
    read(files).map(|part| part.samples.len()).unwrap_err()
}

/// Replaces a piece of text in one of the files.
fn replaced(name: &str, from: &str, to: &str) -> Files {
    let mut files = curve();
    let text = String::from_utf8(files[name].clone()).unwrap();
    assert!(text.contains(from), "{from}: {text}");
    files.insert(name.into(), text.replace(from, to).into());
    files
}

fn assert_curve(part: &ForeignPart) {
    assert_eq!(part.samples.len(), 3 * POINTS as usize);
    for (index, sample) in part.samples.iter().enumerate() {
        let n = index as f64;
        // Two seconds a segment; a step lowers the base by 1 µm and bends the cantilever up by 25 nm.
        let expected = [0.5 * n, 1e-3 * n - 25e-6 * n, 0.25 * 50e-9 * (0.25 + 0.5 * n)];
        let found = [sample.t, sample.depth.unwrap(), sample.force.unwrap()];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{index}: {found} {expected}");
        }
        let phase = [Phase::Ramp, Phase::Hold, Phase::Unload][index / POINTS as usize];
        assert_eq!(sample.phase, phase, "{index}");
    }
}

#[test]
fn curve_has_tip_displacement_force_phases_and_facts() {
    let part = read(&curve()).unwrap();
    assert_curve(&part);
    assert_eq!(part.imported.format, "jpk");
    for (key, value) in [
        ("instrument", "JPK00001"),
        ("probe", "bead 10 µm"),
        ("Spring constant (N/m)", "0.25"),
        ("Sensitivity (m/V)", "5e-8"),
        ("Height channel", "measuredHeight"),
        ("Time stamp of segment 0", "2026-03-05 17:51:14.543 +0200"),
        ("Segments", "extend, pause, retract"),
        ("Segment 1 type", "constant-height-pause"),
        ("Segment 2 setpoint", "1.5"),
    ] {
        assert!(
            part.imported.facts.contains(&(key.into(), value.into())),
            "{key}: {:?}",
            part.imported.facts
        );
    }
}

/// Before version 2.0 of the format every segment has the properties of its channels, and no shared data.
#[test]
fn curve_of_the_old_format_gives_the_same_numbers() {
    let mut files = curve();
    files.remove("shared-data/header.properties");
    let channels = ["channel.vDeflection", "channel.measuredHeight"];
    let own = conversions(channels[0], channels[1])
        + &encoder("channel.vDeflection.data", "signedinteger", 0.5, 0.25)
        + &encoder("channel.measuredHeight.data", "signedshort", 1.0, 10.0);
    for (name, bytes) in &mut files {
        if name.ends_with("segment-header.properties") {
            bytes.extend_from_slice(own.as_bytes());
        }
    }
    assert_curve(&read(&files).unwrap());
}

#[test]
fn pauses_are_hold_creep_or_rest() {
    let header = "segments/1/segment-header.properties";
    let creep = replaced(header, "constant-height-pause", "constant-force-pause");
    assert_eq!(read(&creep).unwrap().samples[POINTS as usize].phase, Phase::Creep);
    let first = replaced("segments/0/segment-header.properties", "style=extend", "style=pause");
    assert_eq!(read(&first).unwrap().samples[0].phase, Phase::Rest);
    let other = replaced(header, "style=pause", "style=modulation");
    assert_eq!(read(&other).unwrap().samples[POINTS as usize].phase, Phase::Imported);
}

#[test]
fn broken_curves_are_refused_with_a_reason() {
    let shared = "shared-data/header.properties";
    let header = "segments/1/segment-header.properties";
    for (name, from, to, expected) in [
        (shared, "conversion.force.base", "conversion.fill.base", "no conversion 'force'"),
        (
            shared,
            "base-calibration-slot=distance",
            "base-calibration-slot=force",
            "no conversion 'force'",
        ),
        (shared, "multiplier=0.25", "multiplier=NaN", "force.scaling.multiplier is missing"),
        (shared, "offsetmultiplier", "cubic", "is 'cubic'"),
        (shared, "unit.unit=N", "unit.unit=lbf", "is in 'lbf', not 'N'"),
        (shared, "signedinteger", "float-data", "the encoder 'float-data'"),
        (shared, "signedinteger", "signedlong", "points of vDeflection"),
        (header, "duration=2.0", "duration=0.0", "force-segment-header.duration"),
        (header, "channels/measuredHeight", "channels/other", "no channel of the height"),
        (header, "channels/vDeflection", "channels/other", "channels/other.dat"),
    ] {
        let reason = refused(&replaced(name, from, to));
        assert!(reason.contains(expected) && reason.contains("; "), "{expected}: {reason}");
    }
    let mut odd = curve();
    odd.get_mut("segments/0/channels/vDeflection.dat").unwrap().pop();
    assert!(refused(&odd).contains("ends within a number"));
    for (missing, expected) in [
        ("header.properties", "no header.properties"),
        ("segments/0/segment-header.properties", "no segments/0"),
    ] {
        let mut files = curve();
        files.remove(missing);
        let reason = refused(&files);
        assert!(reason.contains(expected), "{missing}: {reason}");
    }
}

#[test]
fn archive_that_unpacks_to_too_much_is_refused() {
    let zeros = vec![0; 40 << 20];
    for (name, expected) in [
        ("segments/1/channels/vDeflection.dat", "unpacks to more than"),
        ("shared-data/header.properties", "unpacks to more than 1048576 bytes"),
    ] {
        let mut files = curve();
        files.insert(name.into(), zeros.clone());
        let reason = refused(&files);
        assert!(reason.contains(expected), "{name}: {reason}");
    }
    let mut long = curve();
    let numbers = vec![0; 2 << 18];
    for name in ["segments/0/channels/vDeflection.dat", "segments/0/channels/measuredHeight.dat"] {
        long.insert(name.into(), numbers.clone());
    }
    let text = String::from_utf8(long["shared-data/header.properties"].clone()).unwrap();
    long.insert(
        "shared-data/header.properties".into(),
        text.replace("signedinteger", "signedshort").into(),
    );
    assert!(refused(&long).contains("more than 196608 points"));
}

#[test]
fn curve_cut_off_after_any_byte_is_refused() {
    let whole = zipped(&curve());
    for length in 1..whole.len() {
        let cut = whole[..length].to_vec();
        let read = parse_foreign("curve.jpk-force", cut, &ImportOptions::default());
        assert!(read.is_err(), "{length} of {} bytes", whole.len());
    }
}

/// A sound curve, for damage at random.
pub fn seed() -> Vec<u8> {
    zipped(&curve())
}
