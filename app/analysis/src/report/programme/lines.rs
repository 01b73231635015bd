//! Rows of the page for each run and each specimen.

use crate::edited_session::EditedSession;
use crate::source::SourceError;
use palpate_runner::programme::{FINISHED, REFUSED};
use palpate_sessions::Manifest;
use serde::Serialize;
use std::path::Path;

#[derive(Clone, Debug, Serialize)]
pub struct RunLine {
    pub task: String,
    /// Which repeat, from 1.
    pub repeat: u32,
    /// Which attempt at it, from 1.
    pub attempt: u32,
    /// Session folder relative to that of the programme.
    pub session: String,
    /// `None` if the run broke off.
    pub ending: Option<String>,
    /// Whether its session is no longer what the journal says it was; none if it is.
    #[serde(rename = "lost")]
    pub loss: Option<SessionLoss>,
    pub operator: String,
    pub specimen: String,
    /// Its data quality, with the reason where it is not valid.
    pub verdict: Option<String>,
    /// Session time in s, where the session could be read.
    pub duration_s: Option<f64>,
    /// Highest force in N, where force was known.
    pub force_peak_n: Option<f64>,
}

/// Loss of a recorded session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SessionLoss {
    Missing,
    /// The files are not as they were written.
    Damaged,
}

impl SessionLoss {
    pub(super) const fn word(self) -> &'static str {
        if matches!(self, Self::Missing) { "missing" } else { "damaged" }
    }

    /// The loss of a session and its reason. A run that broke off or was refused is not expected to have one.
    pub(super) fn of(
        opened: &Result<EditedSession, SourceError>,
        path: &Path,
        ending: Option<&str>,
    ) -> Option<(Self, String)> {
        let ending = ending.filter(|ending| *ending != REFUSED)?;
        match opened {
            Err(err) if path.exists() => Some((Self::Damaged, err.to_string())),
            Err(err) => Some((Self::Missing, err.to_string())),
            // A recording that a full disk cut short ended by abort, and has no end either.
            Ok(one) if ending == FINISHED && one.session.end.is_none() => Some((
                Self::Damaged,
                "the recording is incomplete, but the journal lists it as finished; restore it from a backup".into(),
            )),
            Ok(_) => None,
        }
    }
}

/// Metadata of one specimen from its sessions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpecimenPart {
    pub specimen: String,
    pub indenter: String,
    /// Other metadata by key, without its place in the series.
    #[serde(rename = "told")]
    pub metadata: Vec<(String, String)>,
}

impl SpecimenPart {
    pub(super) fn of(manifest: &Manifest) -> Self {
        let lines = manifest.about.lines().into_iter();
        Self {
            specimen: manifest.specimen.clone(),
            indenter: manifest.indenter.clone(),
            metadata: lines
                .filter(|(key, _)| !key.starts_with("series."))
                .map(|(key, value)| (key.to_owned(), value))
                .collect(),
        }
    }

    pub(super) fn text(&self) -> String {
        let line = |(key, value): &(String, String)| format!("  {key}: {value}");
        let metadata: Vec<String> = self.metadata.iter().map(line).collect();
        let probe = match self.indenter.as_str() {
            "" => String::new(),
            indenter => format!(", with the {indenter}"),
        };
        format!("{}{probe}\n{}", self.specimen, metadata.join("\n"))
    }
}

impl RunLine {
    pub(super) fn ended_by(&self) -> String {
        let ending = self.ending.as_deref().unwrap_or("breaking off");
        match self.loss {
            Some(loss) => format!("{ending}, now {}", loss.word()),
            None => ending.to_owned(),
        }
    }
}
