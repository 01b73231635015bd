//! What is said of a scene's run and of its recording.

use super::haptics::run_text;
use crate::workers::scene::{Played, Replayed};

/// A run in words.
#[must_use]
pub fn played_text(played: &Played) -> String {
    let mut lines = vec![format!(
        "scene '{}', {} x {} nodes, path {}: {} ticks, as deep as {:.2} mm, up to {:.2} N",
        played.name,
        played.nodes,
        played.nodes,
        played.path,
        played.ticks,
        played.depth_max_mm,
        played.force_max_n
    )];
    for (why, share) in &played.why {
        lines.push(format!("{:>4.0} %  {why}", 100.0 * share));
    }
    lines.push(run_text(&played.paced));
    let work = 1e6 * played.paced.kept.work.p99_9.0;
    lines.push(if played.is_within_budget {
        format!(
            "999 ticks in a thousand take {work:.0} us or less, within the budget of {} us",
            played.tick_us
        )
    } else {
        format!(
            "one tick in a thousand takes more than {work:.0} us, and the budget is {} us; take fewer nodes, or end other programs",
            played.tick_us
        )
    });
    if let Some(recorded) = &played.recorded {
        lines.push(match recorded.lost {
            0 => format!("{} ticks recorded, none lost", recorded.ticks),
            lost => format!(
                "{} ticks recorded, {lost} lost because the disk was too slow; the recording cannot be computed again",
                recorded.ticks
            ),
        });
    }
    lines.push(format!("surface {}", played.surface_hash));
    lines.join("\n")
}

/// A replay in words.
#[must_use]
pub fn replayed_text(replayed: &Replayed) -> String {
    let mut lines = vec![format!(
        "scene '{}': {} ticks computed again, {}",
        replayed.name,
        replayed.ticks,
        if replayed.is_identical {
            "every number bit for bit as recorded"
        } else {
            "not as recorded"
        }
    )];
    if !replayed.is_whole {
        lines.push("the recording was cut off; it was compared to its last whole tick".to_owned());
    }
    lines.push(format!("surface {}", replayed.surface_hash));
    lines.join("\n")
}
