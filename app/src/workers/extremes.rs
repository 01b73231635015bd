//! Every case at the extremes, as the command line and the window both run them.

use palpate_model::extremes::{Extent, Row, Verdict, parts};
use palpate_model::families::UnknownFamily;
use std::ops::ControlFlow;

/// Runs everything, or what concerns one family. `progress` hears how many thousandths are done and what is
/// under way, and may end the whole between two parts: then there is no answer.
pub fn survey(
    extent: Extent,
    family: Option<&str>,
    progress: &dyn Fn(usize, usize, &str) -> ControlFlow<()>,
) -> Result<Option<Vec<Row>>, UnknownFamily> {
    let parts = parts(extent, family)?;
    let of = 1000 * parts.len();
    let mut rows = Vec::new();
    for (index, part) in parts.iter().enumerate() {
        let what = format!("{}: {}", part.group, part.subject);
        let tell = |share: f64| progress(1000 * index + (1000.0 * share) as usize, of, &what);
        if tell(0.0).is_break() {
            return Ok(None);
        }
        rows.extend(part.rows(|share| {
            // Within a part only the next one can be left out.
            let _ = tell(share);
        }));
    }
    Ok(Some(rows))
}

/// One group of cases in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupFacts {
    /// The group.
    pub group: &'static str,
    /// Cases that were answered rightly, refused, flagged, wrong.
    pub counts: [usize; 4],
    /// The right answer that lies nearest to its tolerance.
    pub worst: Option<Row>,
}

/// Verdicts in the order of [`GroupFacts::counts`].
pub const VERDICTS: [Verdict; 4] = [
    Verdict::Right,
    Verdict::Refused,
    Verdict::Flagged,
    Verdict::Wrong,
];

/// What became of each group, in the order they were run.
#[must_use]
pub fn by_group(rows: &[Row]) -> Vec<GroupFacts> {
    let mut groups: Vec<GroupFacts> = Vec::new();
    let used = |row: &Row| row.relative_error.unwrap_or(0.0) / row.tolerance;
    for row in rows {
        let index = groups
            .iter()
            .position(|one| one.group == row.group)
            .unwrap_or_else(|| {
                groups.push(GroupFacts {
                    group: row.group,
                    counts: [0; 4],
                    worst: None,
                });
                groups.len() - 1
            });
        let facts = &mut groups[index];
        for (count, verdict) in facts.counts.iter_mut().zip(VERDICTS) {
            *count += usize::from(row.verdict == verdict);
        }
        let is_worst = row.verdict == Verdict::Right
            && facts
                .worst
                .as_ref()
                .is_none_or(|worst| used(row) > used(worst));
        if is_worst {
            facts.worst = Some(row.clone());
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_count_their_verdicts_and_name_the_nearest_to_its_tolerance() {
        let row = |group, verdict, error: f64| Row {
            group,
            case: format!("{error}"),
            subject: "kelvin".into(),
            verdict,
            relative_error: Some(error),
            tolerance: 1e-13,
            sentence: String::new(),
        };
        let rows = [
            row("a", Verdict::Right, 1e-15),
            row("b", Verdict::Wrong, 1.0),
            row("a", Verdict::Right, 9e-14),
            row("a", Verdict::Refused, 2.0),
        ];
        let groups = by_group(&rows);
        assert_eq!(groups.len(), 2);
        assert_eq!((groups[0].group, groups[0].counts), ("a", [2, 1, 0, 0]));
        assert_eq!(groups[0].worst.as_ref().unwrap().case, "0.00000000000009");
        assert_eq!((groups[1].counts, &groups[1].worst), ([0, 0, 0, 1], &None));
    }
}
