//! Replay of the recording of any loop.

use palpate_sessions::ticks::{TickCounts, TickEnd, TickRecording, TickRow};
use serde::Serialize;

/// A finished recording with the hash of the loop's last state; `None` without a recording, or
/// where the loop failed and cut it off.
pub type FinishedRecording = Option<Result<(TickCounts, u64), String>>;

#[must_use]
pub fn describe_finished((recorded, left): (TickCounts, u64)) -> String {
    let words = RecordedTicks::from(recorded).words();
    format!("{words}; hash at the end {left:016x}")
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct RecordedTicks {
    pub ticks: u64,
    /// Ticks that were dropped because the disk was too slow.
    pub lost: u64,
}

impl From<TickCounts> for RecordedTicks {
    fn from(TickCounts { ticks, lost_ticks: lost }: TickCounts) -> Self {
        Self { ticks, lost }
    }
}

impl RecordedTicks {
    pub fn words(&self) -> String {
        match self.lost {
            0 => format!("{} ticks recorded, none lost", self.ticks),
            lost => format!(
                "{} ticks recorded, {lost} lost because the disk was too slow; the recording cannot be replayed",
                self.ticks
            ),
        }
    }
}

/// Result of a replay.
#[derive(Clone, Debug, Serialize)]
pub struct ReplayResult {
    pub name: String,
    pub ticks: u64,
    /// Whether every computed number has the recorded bits.
    pub is_identical: bool,
    pub first: Option<TickDifference>,
    /// Whether the recording has its end; without, it was cut off after the last tick compared.
    pub is_whole: bool,
    /// Ticks dropped while recording.
    pub lost: u64,
    /// Hash of the state at the end.
    pub end_hash: String,
}

/// A number that has other bits than the recorded one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TickDifference {
    pub tick: u64,
    pub column: &'static str,
    pub recorded: String,
    pub computed: String,
}

impl ReplayResult {
    pub fn words(&self) -> String {
        let how = match (self.is_identical, self.is_whole) {
            (true, true) => "every number bit for bit as recorded",
            (true, false) => "every remaining number bit for bit as recorded",
            (false, _) => "not as recorded",
        };
        let mut lines = vec![format!("{}: {} ticks replayed, {how}", self.name, self.ticks)];
        if !self.is_whole {
            lines.push(
                "the recording was cut off; the replay compared it up to its last complete tick"
                    .to_owned(),
            );
        }
        lines.push(format!("hash at the end {}", self.end_hash));
        lines.join("\n")
    }

    /// Difference from the recording, or that it was cut off.
    pub fn failure(&self) -> Option<String> {
        let Some(first) = &self.first else {
            let cut_off = format!(
                "the recording has no end: it was cut off after tick {}, and later ticks are unknown",
                self.ticks
            );
            return (!self.is_whole).then_some(cut_off);
        };
        let why = match self.lost {
            0 => "the program, its settings or the recording changed".to_owned(),
            lost => format!("the recording lost {lost} ticks"),
        };
        Some(format!(
            "tick {}: {} is {} now but {} in the recording; {why}",
            first.tick, first.column, first.computed, first.recorded
        ))
    }
}

/// A loop that can be replayed.
pub trait Replayable<const W: usize, const R: usize> {
    /// The tick of the recorded inputs of `row`.
    fn tick(&mut self, row: &TickRow<W, R>) -> TickRow<W, R>;

    /// Hash of the state.
    fn state_hash(&self) -> u64;
}

/// Computes every tick of a recording again, to the first that differs. `is_going` hears the share done and ends it early.
pub fn replay_ticks<const W: usize, const R: usize>(
    name: &str,
    found: &TickRecording<W, R>,
    (whole, real): ([&'static str; W], [&'static str; R]),
    replay: &mut impl Replayable<W, R>,
    is_going: &mut dyn FnMut(f64) -> bool,
) -> Result<ReplayResult, String> {
    let mut first = None;
    let mut ticks = 0;
    for (index, row) in found.rows.iter().enumerate() {
        let computed = replay.tick(row);
        ticks = row.whole[0];
        if let Some(column) = row.first_difference(&computed) {
            let text = |row: &TickRow<W, R>| match column.checked_sub(W) {
                None => row.whole[column].to_string(),
                Some(real) => format!("{:?}", row.real[real]),
            };
            first = Some(TickDifference {
                tick: ticks,
                column: whole.iter().chain(&real).copied().nth(column).unwrap_or(""),
                recorded: text(row),
                computed: text(&computed),
            });
            break;
        }
        if index.is_multiple_of(1000) && !is_going(index as f64 / found.rows.len() as f64) {
            return Err("the replay was cancelled".to_owned());
        }
    }
    let hash = replay.state_hash();
    let (is_whole, lost) = match found.end {
        TickEnd::CutOff => (false, 0),
        TickEnd::Whole { lost_ticks, state_hash: left } => {
            if first.is_none() && left != hash {
                first = Some(TickDifference {
                    tick: ticks,
                    column: "hash at the end",
                    recorded: format!("{left:016x}"),
                    computed: format!("{hash:016x}"),
                });
            }
            (true, lost_ticks)
        }
    };
    Ok(ReplayResult {
        name: name.to_owned(),
        ticks,
        is_identical: first.is_none(),
        first,
        is_whole,
        lost,
        end_hash: format!("{hash:016x}"),
    })
}
