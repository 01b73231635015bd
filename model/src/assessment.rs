//! Checks of a measurement: each a rank and a sentence with its numbers, never a single figure.

use serde::Serialize;

crate::named! {
    /// How something stands in one respect, from best to worst.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum QualityRank {
        /// What the check needs was not recorded.
        NotJudged = "not judged",
        Good = "good",
        /// Worth a look before the result is used.
        Doubtful = "doubtful",
        Bad = "bad",
    }
}

impl Serialize for QualityRank {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// One check of a run or a calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualityCheck {
    pub name: &'static str,
    pub rank: QualityRank,
    pub sentence: String,
    /// Where in a run it shows, from and to in s of session time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<[f64; 2]>,
}

impl QualityCheck {
    #[must_use]
    pub fn new(name: &'static str, rank: QualityRank, sentence: impl Into<String>) -> Self {
        Self { name, rank, sentence: sentence.into(), at_s: None }
    }

    #[must_use]
    pub fn at(mut self, from: f64, to: f64) -> Self {
        self.at_s = Some([from, to]);
        self
    }
}

/// All checks of a run or a calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Assessment {
    pub checks: Vec<QualityCheck>,
}

impl Assessment {
    /// The worst rank of all checks.
    #[must_use]
    pub fn rank(&self) -> QualityRank {
        self.checks.iter().map(|one| one.rank).max().unwrap_or(QualityRank::NotJudged)
    }

    /// The check that stands worst, the first of several; `None` where none was made.
    #[must_use]
    pub fn worst(&self) -> Option<&QualityCheck> {
        let rank = self.rank();
        self.checks.iter().find(|one| one.rank == rank)
    }

    /// The worst rank, then a line for each check.
    #[must_use]
    pub fn text(&self) -> String {
        let lines = self.checks.iter().map(|one| {
            let place = one.at_s.map_or_else(String::new, |[from, to]| match to - from < 0.1 {
                true => format!(" (at {from:.2} s)"),
                false => format!(" (from {from:.2} to {to:.2} s)"),
            });
            format!("{:<11} {:<10}  {}{place}", one.name, one.rank.name(), one.sentence)
        });
        let first = format!("{:<11} {}", "quality", self.rank());
        std::iter::once(first).chain(lines).collect::<Vec<_>>().join("\n")
    }

    /// The checks that somebody should look at, the worst first.
    #[must_use]
    pub fn doubts(&self) -> Vec<&QualityCheck> {
        let is_doubt = |one: &&QualityCheck| one.rank >= QualityRank::Doubtful;
        let mut doubts: Vec<&QualityCheck> = self.checks.iter().filter(is_doubt).collect();
        doubts.sort_by_key(|one| std::cmp::Reverse(one.rank));
        doubts
    }
}

/// Good up to one limit, bad beyond the other.
#[must_use]
pub fn rank_of(value: f64, doubtful: f64, bad: f64) -> QualityRank {
    match value {
        value if value > bad => QualityRank::Bad,
        value if value > doubtful => QualityRank::Doubtful,
        _ => QualityRank::Good,
    }
}
