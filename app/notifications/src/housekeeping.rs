//! What the notifications' thread does beside sending, because a disk may keep whoever asks waiting: it reads how much
//! space is left, and keeps which calibrations were announced.

use crate::notifier::{lock, unless_closing};
use crate::rules::AnnouncedCalibrations;
use palpate_sessions::folder::free_bytes;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::{Notify, watch};

/// A disk that fills fastest, at 20 000 samples a second, loses 18 MB meanwhile.
const LOOK_EVERY: Duration = Duration::from_secs(30);

/// Name of the file in the library.
pub const ANNOUNCED_FILE: &str = "notifications-announced.json";

/// Version of that file.
pub const ANNOUNCED_VERSION: u32 = 1;

/// Entries of that file. A laboratory takes a calibration a year for each of its cells.
const ANNOUNCED_MAX: usize = 200;

#[derive(Serialize, Deserialize)]
struct AnnouncedFile {
    version: u32,
    calibrations: AnnouncedCalibrations,
}

#[derive(Default)]
pub(crate) struct Housekeeping {
    state: Mutex<State>,
    news: Notify,
}

#[derive(Default)]
struct State {
    /// Whose disk is looked at.
    folder: Option<PathBuf>,
    free_bytes: Option<u64>,
    /// What is to be written where.
    to_write: Option<(PathBuf, AnnouncedCalibrations)>,
}

/// What was announced before; nothing where the file is missing or of another version.
pub(crate) fn read_announced(library: &Path) -> AnnouncedCalibrations {
    let text = std::fs::read_to_string(library.join(ANNOUNCED_FILE)).unwrap_or_default();
    let file: Option<AnnouncedFile> = serde_json::from_str(&text).ok();
    file.filter(|file| file.version == ANNOUNCED_VERSION)
        .map(|file| file.calibrations)
        .unwrap_or_default()
}

fn write_announced(path: &Path, calibrations: AnnouncedCalibrations) {
    let excess = calibrations.len().saturating_sub(ANNOUNCED_MAX);
    let calibrations = calibrations.into_iter().skip(excess).collect();
    let file = AnnouncedFile { version: ANNOUNCED_VERSION, calibrations };
    let text = serde_json::to_string_pretty(&file).unwrap_or_default();
    if let Err(err) = palpate_sessions::text::write(path, &text) {
        tracing::warn!("the next run announces the calibration once more: {err}");
    }
}

impl Housekeeping {
    /// Free space on the disk of a folder, as it was last read. Another folder is looked at at once.
    pub fn free_bytes(&self, folder: &Path) -> Option<u64> {
        let mut state = lock(&self.state);
        if state.folder.as_deref() != Some(folder) {
            state.folder = Some(folder.to_owned());
            state.free_bytes = None;
            self.news.notify_one();
        }
        state.free_bytes
    }

    /// Keeps what was announced for the next program.
    pub fn keep_announced(&self, library: &Path, calibrations: AnnouncedCalibrations) {
        lock(&self.state).to_write = Some((library.join(ANNOUNCED_FILE), calibrations));
        self.news.notify_one();
    }

    pub async fn serve(self: Arc<Self>, mut closing: watch::Receiver<bool>) {
        loop {
            let is_last = *closing.borrow();
            let (folder, to_write) = {
                let mut state = lock(&self.state);
                (state.folder.clone(), state.to_write.take())
            };
            let looked = tokio::task::spawn_blocking(move || {
                if let Some((path, calibrations)) = to_write {
                    write_announced(&path, calibrations);
                }
                folder.map(|folder| (free_bytes(&folder).ok(), folder))
            });
            if let Ok(Some((free, folder))) = looked.await {
                let mut state = lock(&self.state);
                if state.folder.as_deref() == Some(&folder) {
                    state.free_bytes = free;
                }
            }
            if is_last {
                return;
            }
            let news = async {
                let _ = tokio::time::timeout(LOOK_EVERY, self.news.notified()).await;
            };
            unless_closing(news, &mut closing).await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_announced_is_known_to_the_next_program() {
        let library = tempfile::tempdir().unwrap();
        assert_eq!(read_announced(library.path()), AnnouncedCalibrations::default());
        let announced =
            AnnouncedCalibrations::from([("cell 7, 2026-03-01".into(), false), ("b".into(), true)]);
        let path = library.path().join(ANNOUNCED_FILE);
        write_announced(&path, announced.clone());
        assert_eq!(read_announced(library.path()), announced);
        std::fs::write(&path, "{\"version\": 2, \"calibrations\": []}").unwrap();
        assert!(read_announced(library.path()).is_empty());
    }
}
