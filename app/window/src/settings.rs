//! Settings of the window, a small JSON file in the library that is written when the window closes.

use palpate_analysis::window_requests::SETTINGS_VERSION;
use palpate_sessions::atomic;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// A longer file is not one of settings.
const BYTES_MAX: usize = 64 * 1024;

/// Zoom factors of text and everything else.
pub const ZOOM: std::ops::RangeInclusive<f32> = 0.5..=2.5;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WindowSettings {
    /// [`SETTINGS_VERSION`] of the program that wrote them.
    pub settings_version: u32,
    pub is_dark: bool,
    /// Size of text and everything else; 1 is the usual one.
    pub zoom: f32,
    /// The same by monitor; each keeps its own.
    pub zooms: BTreeMap<String, f32>,
    /// Name of the screen shown last.
    pub screen: String,
    /// Widths of the panels left and right of the middle, and height of the event log, in points; none for the usual sizes.
    pub left: Option<f32>,
    pub right: Option<f32>,
    pub log: Option<f32>,
    /// What screens keep, such as how their parts are arranged, by the names of the screens.
    pub layouts: BTreeMap<String, Value>,
    /// Of the last run.
    pub operator: String,
    /// Folder for new sessions; empty for the library.
    pub sessions: String,
    /// The tour was taken or ended.
    pub is_tour_over: bool,
    /// Keys of a later palpate, which are kept.
    #[serde(flatten)]
    pub unknown: Map<String, Value>,
}

impl Default for WindowSettings {
    fn default() -> Self {
        Self {
            settings_version: SETTINGS_VERSION,
            is_dark: false,
            zoom: 1.0,
            zooms: BTreeMap::new(),
            screen: String::new(),
            left: None,
            right: None,
            log: None,
            layouts: BTreeMap::new(),
            operator: String::new(),
            sessions: String::new(),
            is_tour_over: false,
            unknown: Map::new(),
        }
    }
}

impl WindowSettings {
    /// Those of a file; the usual ones where there is none.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(err) if err.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            Err(err) => return Err(unreadable(path, &err.to_string())),
        };
        if text.len() > BYTES_MAX {
            return Err(unreadable(path, "it is too long"));
        }
        let value: Value =
            serde_json::from_str(&text).map_err(|err| unreadable(path, &err.to_string()))?;
        // The version comes first, because the rest of newer settings may not parse.
        if value["settings_version"].as_u64().is_some_and(|it| it > u64::from(SETTINGS_VERSION)) {
            return Err(newer(path));
        }
        let read: Self =
            serde_json::from_value(value).map_err(|err| unreadable(path, &err.to_string()))?;
        let possible = |zoom: f32| {
            let zoom = if zoom.is_finite() { zoom } else { 1.0 };
            zoom.clamp(*ZOOM.start(), *ZOOM.end())
        };
        let zooms = read.zooms.into_iter().map(|(monitor, zoom)| (monitor, possible(zoom)));
        Ok(Self { zoom: possible(read.zoom), zooms: zooms.collect(), ..read })
    }

    /// The zoom factor of a monitor; of one that is new, that of the last one.
    #[must_use]
    pub fn zoom_of(&self, monitor: &str) -> f32 {
        self.zooms.get(monitor).copied().unwrap_or(self.zoom)
    }

    /// Keeps the zoom factor, and for which monitor, where that is known.
    pub fn keep_zoom(&mut self, monitor: Option<&str>, zoom: f32) {
        self.zoom = zoom;
        if let Some(monitor) = monitor.filter(|monitor| self.zooms.get(*monitor) != Some(&zoom)) {
            self.zooms.insert(monitor.to_owned(), zoom);
        }
    }

    /// Writes them; the file is replaced as a whole.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let unwritable = |err: &dyn std::fmt::Display| {
            format!("the window's settings cannot be written to {} ({err})", path.display())
        };
        let text = serde_json::to_string_pretty(self).map_err(|err| unwritable(&err))?;
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|err| unwritable(&err))?;
        }
        atomic::replace(path, (text + "\n").as_bytes()).map_err(|err| unwritable(&err))
    }
}

fn newer(path: &Path) -> String {
    format!(
        "a newer version of palpate wrote the window's settings in {}; the window opens with the default settings, and the file stays unchanged until palpate is updated",
        path.display()
    )
}

fn unreadable(path: &Path, reason: &str) -> String {
    format!(
        "the window's settings in {} cannot be read ({reason}); the window opens with the default settings, and the file stays unchanged until you correct or delete it",
        path.display()
    )
}

/// The settings and their file, if there is one.
#[derive(Debug, Default)]
pub struct SettingsFile {
    pub now: WindowSettings,
    /// As the file has them.
    stored: WindowSettings,
    path: Option<PathBuf>,
    /// There is no file yet.
    is_new: bool,
}

impl SettingsFile {
    /// Reads the file. An unreadable one gives the usual settings and a sentence, and is never written.
    pub fn open(path: Option<PathBuf>) -> (Self, Option<String>) {
        let Some(path) = path else {
            return (Self::default(), None);
        };
        match WindowSettings::read(&path) {
            Ok(read) => {
                let is_new = !path.exists();
                (Self { now: read.clone(), stored: read, path: Some(path), is_new }, None)
            }
            Err(reason) => (Self::default(), Some(reason)),
        }
    }

    pub fn has_file(&self) -> bool {
        self.path.is_some()
    }

    /// Whether the file is still to be made.
    pub fn is_new(&self) -> bool {
        self.is_new
    }

    pub fn store(&mut self) -> Result<(), String> {
        match &self.path {
            Some(path) if self.is_new || self.now != self.stored => {
                self.now.write(path)?;
                self.stored = self.now.clone();
                self.is_new = false;
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_analysis::window_requests::SETTINGS_FILE;

    #[test]
    fn every_monitor_keeps_its_text_size_and_a_new_one_has_that_of_the_last() {
        let mut settings = WindowSettings::default();
        settings.keep_zoom(Some("laptop"), 1.0);
        settings.keep_zoom(Some("bench"), 1.5);
        settings.keep_zoom(None, 2.0);
        let found = ["laptop", "bench", "new"].map(|monitor| settings.zoom_of(monitor));
        assert_eq!(found, [1.0, 1.5, 2.0]);
    }

    #[test]
    fn what_was_stored_is_read_and_what_is_broken_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sub").join(SETTINGS_FILE);
        let (mut file, refusal) = SettingsFile::open(Some(path.clone()));
        assert_eq!((&file.now, refusal), (&WindowSettings::default(), None));
        file.now.zoom = 1.5;
        file.now.operator = "Ada \"L\"".into();
        file.store().unwrap();
        let (again, _) = SettingsFile::open(Some(path.clone()));
        assert_eq!(again.now, file.now);
        for broken in ["{", "[1]", "{\"zoom\": \"large\"}"] {
            std::fs::write(&path, broken).unwrap();
            let (mut file, refusal) = SettingsFile::open(Some(path.clone()));
            assert!(refusal.unwrap().contains("cannot be read"), "{broken}");
            file.now.zoom = 2.0;
            file.store().unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), broken);
        }
        // A newer palpate may store more, which is kept; a size that is out of range is not taken.
        std::fs::write(&path, "{\"zoom\": 99.0, \"from_the_future\": [1]}").unwrap();
        let (mut file, _) = SettingsFile::open(Some(path.clone()));
        assert_eq!(file.now.zoom, *ZOOM.end());
        file.now.is_dark = true;
        file.store().unwrap();
        let stored: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!((&stored["from_the_future"][0], &stored["is_dark"]), (&1.into(), &true.into()));
        // One that changed the meaning of a key raises the version.
        let newer = format!("{{\"settings_version\": {}, \"zoom\": \"x\"}}", SETTINGS_VERSION + 1);
        std::fs::write(&path, &newer).unwrap();
        let (mut file, refusal) = SettingsFile::open(Some(path.clone()));
        assert!(refusal.unwrap().contains("a newer version"));
        file.now.zoom = 2.0;
        file.store().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), newer);
    }
}
