//! A scene in real time, its recording, and the recording computed again.

use super::haptics::{Paced, body_of};
use palpate_model::scene::{Scene, ScenePath, WhyNoForce};
use palpate_protocols::haptics::SceneLoop;
use palpate_protocols::haptics::scene::{COLUMNS, SceneRecorder, scene_input, scene_row};
use palpate_protocols::haptics::scene_file::SceneFile;
use palpate_sessions::ticks::{End, Recorded, Recording};
use serde::Serialize;
use std::path::Path;
use std::time::Duration;

/// Between two looks at a scene that runs: half a frame.
const LOOK: Duration = Duration::from_millis(8);

/// A scene file with its body, and what is to be known of that; without a file the scene that is built in.
pub fn scene_of(file: Option<&Path>) -> Result<(SceneFile, Vec<String>), String> {
    let Some(path) = file else {
        return Ok((SceneFile::default(), Vec::new()));
    };
    let called = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|err| format!("cannot read {called} ({err}); give a scene file"))?;
    let mut scene = SceneFile::parse(&called, &text)?;
    let mut notes = Vec::new();
    if let Some(source) = scene.source.take() {
        // A source is named from where its file is.
        let folder = path.parent().unwrap_or(Path::new(""));
        let found = body_of(&folder.join(&source))?;
        scene.body = found.body;
        notes = found.notes;
    }
    Ok((scene, notes))
}

/// What a scene did in real time.
#[derive(Clone, Debug, Serialize)]
pub struct Played {
    /// Its name.
    pub name: String,
    /// The hand's path.
    pub path: &'static str,
    /// Nodes along a side.
    pub nodes: usize,
    /// Ticks that the scene made.
    pub ticks: u64,
    /// Greatest depth of a frame in mm.
    pub depth_max_mm: f64,
    /// Largest force of a frame in N.
    pub force_max_n: f64,
    /// What took force away, with its share of the frames.
    pub why: Vec<(&'static str, f64)>,
    /// Hash of the surface at the end.
    pub surface_hash: String,
    /// The budget of a tick in microseconds, and whether 999 ticks in a thousand kept to it.
    pub tick_us: f64,
    /// See [`Self::tick_us`].
    pub is_within_budget: bool,
    /// What was recorded.
    pub recorded: Option<RecordedTicks>,
    /// How the loop kept its time.
    #[serde(flatten)]
    pub paced: Paced,
}

/// What of a run was recorded.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RecordedTicks {
    /// Ticks written.
    pub ticks: u64,
    /// Ticks for which there was no room.
    pub lost: u64,
}

/// Runs a scene in real time along a path, `laps` times, and records it in a new folder if one is given.
pub fn play(
    file: &SceneFile,
    planned_nodes: usize,
    (path, laps): (ScenePath, u32),
    record: Option<&Path>,
    progress: &mut dyn FnMut(f64),
) -> Result<Played, String> {
    let scene = file.scene(planned_nodes)?;
    let settings = *scene.settings();
    let recorder = record.map(|folder| {
        let made_of = SceneFile {
            nodes: Some(settings.nodes),
            ..file.clone()
        };
        SceneRecorder::start(folder, &made_of.text(), COLUMNS)
    });
    let mut live = SceneLoop::start_laps(scene, (Some(path), laps), recorder.transpose()?)?;
    let priority = live.granted().to_string();
    let whole = path.seconds() * f64::from(laps);
    let (mut depth_max_mm, mut force_max_n) = (0.0_f64, 0.0_f64);
    let mut seen: Vec<(WhyNoForce, u64)> = Vec::new();
    while !live.is_over() && live.is_alive() {
        std::thread::sleep(LOOK);
        let tick = live.view().tick;
        depth_max_mm = depth_max_mm.max(tick.depth);
        let [x, y, z] = tick.force;
        force_max_n = force_max_n.max(x.hypot(y).hypot(z));
        match seen.iter_mut().find(|(why, _)| *why == tick.why) {
            Some((_, count)) => *count += 1,
            None => seen.push((tick.why, 1)),
        }
        progress(settings.period.time_of(tick.tick).seconds().0 / whole);
    }
    let end = live
        .stop()
        .ok_or("the scene's loop failed; this is a mistake in palpate")?;
    let recorded: Option<Recorded> = end.recorded.transpose()?;
    seen.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let frames = seen.iter().map(|(_, count)| *count).sum::<u64>().max(1) as f64;
    let tick_us = file.tolerances.tick_us;
    Ok(Played {
        name: file.name.clone(),
        path: path.name(),
        nodes: settings.nodes,
        ticks: end.scene.ticks(),
        depth_max_mm,
        force_max_n,
        why: seen
            .iter()
            .map(|(why, count)| (why.words(), *count as f64 / frames))
            .collect(),
        surface_hash: format!("{:016x}", end.scene.hash()),
        tick_us,
        is_within_budget: 1e6 * end.kept.work.p99_9.0 <= tick_us,
        recorded: recorded.map(|one| RecordedTicks {
            ticks: one.ticks,
            lost: one.lost,
        }),
        paced: Paced {
            rate_hz: settings.period.hz(),
            busy_threads: 0,
            priority,
            kept: end.kept,
        },
    })
}

/// What a recording gives when it is computed again.
#[derive(Clone, Debug, Serialize)]
pub struct Replayed {
    /// The scene's name.
    pub name: String,
    /// Ticks computed.
    pub ticks: u64,
    /// Whether every number has the recorded bits.
    pub is_identical: bool,
    /// Where that is not so first.
    pub first: Option<Different>,
    /// Whether the recording has its end; without, it was cut off after the last tick compared.
    pub is_whole: bool,
    /// Ticks that were lost while it was recorded.
    pub lost: u64,
    /// Hash of the surface at the end.
    pub surface_hash: String,
}

/// A number that has other bits than the recorded one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Different {
    /// The tick.
    pub tick: u64,
    /// Which number.
    pub column: &'static str,
    /// As it was recorded.
    pub recorded: String,
    /// As it was computed.
    pub computed: String,
}

/// Computes every tick of a recording again from its inputs.
pub fn replay(folder: &Path, progress: &mut dyn FnMut(f64)) -> Result<Replayed, String> {
    let found = Recording::read(folder, COLUMNS)?;
    let called = folder.join(palpate_sessions::ticks::SETTINGS);
    let file = SceneFile::parse(&called.display().to_string(), &found.settings)?;
    let Some(nodes) = file.nodes else {
        return Err(format!(
            "{} leaves its mesh open; a recording names its nodes",
            called.display()
        ));
    };
    let mut scene: Scene = file.scene(nodes)?;
    let mut first = None;
    let count = found.rows.len().max(1) as f64;
    for (index, row) in found.rows.iter().enumerate() {
        let (hand, elapsed) = scene_input(row);
        let told = scene.tick_after(hand, elapsed);
        let computed = scene_row(hand, elapsed, &told);
        if let Some(column) = row.differs(&computed) {
            let text = |row: &palpate_sessions::ticks::Row<3, 10>| match column.checked_sub(3) {
                None => row.whole[column].to_string(),
                Some(real) => format!("{:?}", row.real[real]),
            };
            let names = COLUMNS.0.iter().chain(&COLUMNS.1);
            first = Some(Different {
                tick: row.whole[0],
                column: names.copied().nth(column).unwrap_or("?"),
                recorded: text(row),
                computed: text(&computed),
            });
            break;
        }
        if index.is_multiple_of(1000) {
            progress(index as f64 / count);
        }
    }
    let (is_whole, lost, left) = match found.end {
        End::Whole { lost, left } => (true, lost, Some(left)),
        End::CutOff => (false, 0, None),
    };
    let hash = scene.hash();
    if first.is_none() && left.is_some_and(|left| left != hash) {
        first = Some(Different {
            tick: scene.ticks(),
            column: "surface",
            recorded: left.map_or(String::new(), |left| format!("{left:016x}")),
            computed: format!("{hash:016x}"),
        });
    }
    Ok(Replayed {
        name: file.name,
        ticks: scene.ticks(),
        is_identical: first.is_none(),
        first,
        is_whole,
        lost,
        surface_hash: format!("{hash:016x}"),
    })
}
