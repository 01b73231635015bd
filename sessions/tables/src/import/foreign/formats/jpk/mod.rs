//! JPK force curves (`.jpk-force`): a zip archive with properties, and for each segment the whole numbers of its channels
//! with the conversions to volts, metres and newtons.
//!
//! The calibrated height of the cantilever's base falls on the way to the specimen, and its deflection lifts the tip, so
//! the tip has moved down by the first height less the height, less the deflection.

mod archive;
mod channel;

use super::super::rows::Cell;
use super::{Content, FACT_LENGTH_MAX, FACTS_MAX, Layout, Quantity, Sheet};
use archive::{Archive, Properties};
use channel::Channel;
use palpate_model::rig::Phase;

pub(super) const LAYOUT: Layout = Layout {
    name: "jpk",
    source: "a JPK force curve (.jpk-force)",
    content: Content::Sheets { is_it, read },
    words: &[(Quantity::Depth, "tip displacement")],
};

/// First bytes of a zip archive.
const ZIP: &[u8] = b"PK\x03\x04";
const HEADER: &str = "header.properties";
const SHARED: &str = "shared-data/header.properties";
const SEGMENT_HEADER: &str = "segment-header.properties";
const DEFLECTION: &str = "vDeflection";
/// Channels of the height, those of a sensor before those that a nominal piezo voltage makes.
const HEIGHTS: &[&str] =
    &["measuredHeight", "capacitiveSensorHeight", "strainGaugeHeight", "height", "head-height"];
/// Largest number of points, so that an import takes less than 64 MiB.
const POINTS_MAX: usize = 3 << 16;
/// Largest size of a number in a channel.
const NUMBER_BYTES_MAX: u64 = 8;

/// Names stand uncompressed in an archive, even in a damaged one.
fn is_it(bytes: &[u8]) -> bool {
    let name = SEGMENT_HEADER.as_bytes();
    bytes.starts_with(ZIP) && bytes.windows(name.len()).any(|window| window == name)
}

struct Segment {
    properties: Properties,
    /// Such as `segments/0/`.
    folder: String,
}

impl Segment {
    fn setting(&self, name: &str) -> Option<&str> {
        let head = "force-segment-header.settings";
        let inner = self.properties.text(&format!("{head}.segment-settings.{name}"));
        inner.or_else(|| self.properties.text(&format!("{head}.{name}")))
    }

    fn duration_s(&self) -> Result<f64, String> {
        let key = "force-segment-header.duration";
        let duration = self.properties.number(key).filter(|duration| *duration > 0.0);
        duration.ok_or_else(|| {
            format!("{}{SEGMENT_HEADER} has no {key} above zero; copy the file again from the instrument", self.folder)
        })
    }

    /// A pause before the approach or after the retraction is no hold.
    fn phase(&self, last: Option<Phase>) -> Phase {
        let is_deep = matches!(last, Some(Phase::Ramp | Phase::Hold | Phase::Creep));
        let is_force_kept =
            self.setting("type").is_some_and(|kind| kind.contains("constant-force"));
        match self.setting("style") {
            Some("extend") => Phase::Ramp,
            Some("retract") => Phase::Unload,
            Some("pause") if !is_deep => Phase::Rest,
            Some("pause") if is_force_kept => Phase::Creep,
            Some("pause") => Phase::Hold,
            _ => Phase::Imported,
        }
    }
}

fn read(bytes: &[u8]) -> Result<Vec<Sheet>, String> {
    let mut archive = Archive::open(bytes)?;
    if !archive.contains(HEADER) {
        return Err(format!(
            "the archive has no {HEADER}; copy the file again from the instrument"
        ));
    }
    let header = archive.properties(HEADER)?;
    let shared = match archive.contains(SHARED) {
        true => archive.properties(SHARED)?,
        false => Properties::default(),
    };
    let mut segments = Vec::new();
    loop {
        let folder = format!("segments/{}/", segments.len());
        if !archive.contains(&format!("{folder}{SEGMENT_HEADER}")) {
            break;
        }
        let mut properties = archive.properties(&format!("{folder}{SEGMENT_HEADER}"))?;
        properties.resolve(&shared);
        segments.push(Segment { properties, folder });
    }
    if segments.is_empty() {
        return Err("the archive has no segments/0, as a map of curves or a damaged file; save single curves in the instrument's software".into());
    }
    let height = height_of(&archive, &segments)?;
    let facts = facts(&header, &segments, height);
    let rows = rows(&mut archive, &segments, height)?;
    Ok(vec![Sheet { name: String::new(), facts, rows }])
}

/// The channel of the height that every segment has.
fn height_of(archive: &Archive<'_>, segments: &[Segment]) -> Result<&'static str, String> {
    let is_recorded = |segment: &Segment, name: &str| {
        let path = Channel::new(&segment.properties, name).path();
        archive.contains(&format!("{}{path}", segment.folder))
    };
    let in_all = |name: &&&str| segments.iter().all(|segment| is_recorded(segment, name));
    HEIGHTS.iter().find(in_all).copied().ok_or_else(|| {
        format!(
            "no channel of the height is in every segment ({}); copy the file again from the instrument",
            HEIGHTS.join(", ")
        )
    })
}

/// A row for each point: time, displacement of the tip, force and phase.
fn rows(
    archive: &mut Archive<'_>,
    segments: &[Segment],
    height: &str,
) -> Result<Vec<(usize, Vec<Cell>)>, String> {
    let names = ["Time [s]", "Tip displacement [m]", "Force [N]", "phase"];
    let mut rows = vec![(1, names.map(|name| Cell::Text(name.into())).to_vec())];
    let (mut start_s, mut phase, mut first_m) = (0.0, None, None);
    for segment in segments {
        let room = (POINTS_MAX + 1 - rows.len()) as u64 * NUMBER_BYTES_MAX;
        let mut channel = |name: &str, slots: &[(&str, &str)]| -> Result<Vec<Vec<f64>>, String> {
            let channel = Channel::new(&segment.properties, name);
            let bytes = archive.read(&format!("{}{}", segment.folder, channel.path()), room)?;
            slots.iter().map(|(slot, unit)| channel.values(&bytes, slot, unit)).collect()
        };
        let bent = channel(DEFLECTION, &[("distance", "m"), ("force", "N")])?;
        let slot = Channel::new(&segment.properties, height).default_slot().unwrap_or("nominal");
        let heights_m = channel(height, &[(slot, "m")])?.swap_remove(0);
        let [deflections_m, forces_newtons] = [&bent[0], &bent[1]];
        let count = deflections_m.len();
        if heights_m.len() != count {
            return Err(format!(
                "{} has {count} points of {DEFLECTION} but {} of {height}; copy the file again from the instrument",
                segment.folder.trim_end_matches('/'),
                heights_m.len()
            ));
        }
        if rows.len() + count > POINTS_MAX {
            return Err(format!("the curve has more than {POINTS_MAX} points; export it as text"));
        }
        let duration_s = segment.duration_s()?;
        let name = segment.phase(phase);
        phase = Some(name);
        for (index, height_m) in heights_m.iter().enumerate() {
            let tip_m = height_m + deflections_m[index];
            let moved_m = *first_m.get_or_insert(tip_m) - tip_m;
            let t_s = start_s + duration_s * index as f64 / count as f64;
            let numbers = [t_s, moved_m, forces_newtons[index]].map(Cell::Number);
            let cells = numbers.into_iter().chain([Cell::Text(name.name().into())]);
            rows.push((rows.len() + 1, cells.collect()));
        }
        start_s += duration_s;
    }
    Ok(rows)
}

/// What the archive says of instrument, probe and curve.
fn facts(header: &Properties, segments: &[Segment], height: &str) -> Vec<(String, String)> {
    let kind = header.text("type").unwrap_or_default();
    let prefix = format!("{kind}.description.");
    let described = header.with_prefix(&prefix).map(|(key, value)| (key.to_owned(), value));
    let mut facts: Vec<(String, String)> =
        described.map(|(key, value)| (key, value.to_owned())).collect();
    let first = &segments[0].properties;
    let deflection = Channel::new(first, DEFLECTION);
    let spring_constant = deflection.multiplier("force").map(|one| one.to_string());
    let sensitivity = deflection.multiplier("distance").map(|one| format!("{one:e}"));
    let calibrated = format!("channel.{height}.conversion-set.conversion.calibrated.comment");
    let styles: Vec<&str> =
        segments.iter().map(|one| one.setting("style").unwrap_or("unknown")).collect();
    let stated = [
        ("Spring constant (N/m)", spring_constant),
        ("Sensitivity (m/V)", sensitivity),
        ("Height channel", Some(height.to_owned())),
        ("Height calibration", first.text(&calibrated).map(str::to_owned)),
        (
            "Time stamp of segment 0",
            first.text("force-segment-header.time-stamp").map(str::to_owned),
        ),
        ("Segments", Some(styles.join(", "))),
    ];
    facts.extend(stated.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?))));
    for (index, segment) in segments.iter().enumerate() {
        let settings = "force-segment-header.settings.segment-settings.";
        let all = segment.properties.with_prefix(settings);
        let wanted = all.filter(|(key, _)| SETTINGS.contains(key));
        facts.extend(
            wanted.map(|(key, value)| (format!("Segment {index} {key}"), value.to_owned())),
        );
    }
    facts.retain(|(_, value)| !value.is_empty() && value != "NaN");
    facts.truncate(FACTS_MAX);
    for (_, value) in &mut facts {
        *value = value.chars().take(FACT_LENGTH_MAX).collect();
    }
    facts
}

/// Settings of a segment that are kept: the set point in V, the places in m and the time in s.
const SETTINGS: &[&str] = &["type", "setpoint", "z-start", "z-end", "duration"];
