//! Which sessions a library holds, and what would show that one has changed.

use crate::folder::{LOCK_FILE, SPARE_FILE, segment_number};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// A session folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// Below the library, with `/` between; a name that is no Unicode has replacement characters in it.
    pub name: String,
    /// The folder itself.
    pub path: PathBuf,
    /// Name, size and time of change of every file of the session. Taken before the session is read, so
    /// that a change meanwhile is noticed the next time.
    pub fingerprint: String,
}

/// Every session below a library, by name, and sentences about folders that could not be looked into.
///
/// Links are not followed, so no walk is endless and nothing counts twice; hidden folders are left alone.
pub(super) fn walk(library: &Path) -> (Vec<Place>, Vec<String>) {
    let (mut places, mut remarks) = (Vec::new(), Vec::new());
    below(library, "", &mut places, &mut remarks);
    places.sort_by(|a, b| a.name.cmp(&b.name));
    (places, remarks)
}

fn below(folder: &Path, name: &str, places: &mut Vec<Place>, remarks: &mut Vec<String>) {
    let content = match Content::of(folder) {
        Ok(content) => content,
        Err(err) => {
            remarks.push(format!(
                "{} cannot be looked into ({err}); sessions in it are not in the catalog",
                folder.display()
            ));
            return;
        }
    };
    if content.is_session() {
        places.push(Place {
            name: name.to_owned(),
            path: folder.to_owned(),
            fingerprint: content.fingerprint(folder),
        });
        return;
    }
    for inner in content.folders {
        let path = folder.join(&inner);
        let own = inner.to_string_lossy();
        if own.starts_with('.') {
            continue;
        }
        let name = match name {
            "" => own.into_owned(),
            outer => format!("{outer}/{own}"),
        };
        below(&path, &name, places, remarks);
    }
}

/// What is in a folder.
#[derive(Default)]
struct Content {
    folders: Vec<std::ffi::OsString>,
    files: Vec<std::ffi::OsString>,
}

impl Content {
    fn of(folder: &Path) -> io::Result<Self> {
        let mut content = Self::default();
        for item in fs::read_dir(folder)? {
            let item = item?;
            if item.file_type()?.is_dir() {
                content.folders.push(item.file_name());
            } else {
                content.files.push(item.file_name());
            }
        }
        content.files.sort();
        Ok(content)
    }

    fn is_session(&self) -> bool {
        let is_segment =
            |name: &std::ffi::OsString| name.to_str().and_then(segment_number).is_some();
        self.files.iter().any(is_segment)
    }

    fn fingerprint(&self, folder: &Path) -> String {
        let mut text = String::new();
        for name in self.files.iter().filter(|name| *name != LOCK_FILE) {
            text += &stamp(&folder.join(name), &name.to_string_lossy());
            if name == SPARE_FILE
                && let Ok(spare) = fs::read_to_string(folder.join(name))
                && let Ok(content) = Self::of(Path::new(&spare))
            {
                for name in &content.files {
                    text += &stamp(&Path::new(&spare).join(name), &name.to_string_lossy());
                }
            }
        }
        text
    }
}

/// One file: its name, bytes, and nanoseconds of its last change.
fn stamp(path: &Path, name: &str) -> String {
    let Ok(facts) = fs::metadata(path) else {
        return format!("{name} gone;");
    };
    let changed = facts.modified().ok();
    let nanos = changed.and_then(|at| at.duration_since(UNIX_EPOCH).ok());
    let nanos = nanos.map_or(0, |since| since.as_nanos());
    format!("{name} {} {nanos};", facts.len())
}
