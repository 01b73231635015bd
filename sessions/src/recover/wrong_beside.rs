//! What stands beside a log: edits, analyses, the file that was imported.

use crate::analyses::Analyses;
use crate::edits::Edits;
use crate::imported::{Imported, ORIGINAL_FOLDER};
use crate::manifest::Manifest;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// What of it is not as it was written, one sentence each.
pub(super) fn wrong_beside(path: &Path, manifest: &Manifest) -> Vec<String> {
    let id = &manifest.session_id;
    let edits = Edits::read(path, id).err().map(|err| err.to_string());
    let analyses = Analyses::read(path, id).err().map(|err| err.to_string());
    // A file stands for the folder it is in.
    let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
    let original = manifest.imported.as_ref().and_then(|from| wrong_original(folder, from));
    [edits, analyses, original].into_iter().flatten().collect()
}

/// The file is read piece by piece, and only if it is a file of the size that was imported: neither a damaged name nor what
/// somebody put there leads elsewhere or takes memory.
fn wrong_original(folder: &Path, from: &Imported) -> Option<String> {
    const KEPT: &str =
        "put back the file that was imported, or go on without it: the samples are in the log";
    let name = Path::new(&from.file);
    if name.file_name() != Some(name.as_os_str()) {
        return Some(format!(
            "the imported file is called {:?}, which is no name of a file; {KEPT}",
            from.file
        ));
    }
    let path = folder.join(ORIGINAL_FOLDER).join(name);
    let shown = path.display();
    let is_there = std::fs::symlink_metadata(&path)
        .is_ok_and(|found| found.is_file() && found.len() == from.bytes);
    if !is_there {
        return Some(format!(
            "the imported file {shown} is not there with its {} bytes; {KEPT}",
            from.bytes
        ));
    }
    match checksum_of(&path) {
        Err(err) => Some(format!("the imported file {shown} cannot be read ({err}); {KEPT}")),
        Ok(checksum) if checksum != from.checksum => {
            Some(format!("the imported file {shown} is not as it was; {KEPT}"))
        }
        Ok(_) => None,
    }
}

fn checksum_of(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut sum = crc32fast::Hasher::new();
    let mut piece = [0; 1 << 16];
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(format!("{:08x}", sum.finalize())),
            count => sum.update(&piece[..count]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_leads_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let original = folder.path().join(ORIGINAL_FOLDER);
        std::fs::create_dir(&original).unwrap();
        std::fs::write(original.join("table.csv"), b"t_s").unwrap();
        // Outside the folder, with the right size and checksum.
        std::fs::write(folder.path().join("secret"), b"t_s").unwrap();
        let of = |file: &str| Imported {
            file: file.into(),
            bytes: 3,
            checksum: format!("{:08x}", crc32fast::hash(b"t_s")),
            format: String::new(),
            part: String::new(),
            first_time_s: 0.0,
            readings: Vec::new(),
            facts: Vec::new(),
            remarks: Vec::new(),
        };
        assert_eq!(wrong_original(folder.path(), &of("table.csv")), None);
        let outside = folder.path().join("secret");
        for file in ["../secret", outside.to_str().unwrap(), "", "..", "gone.csv"] {
            assert!(wrong_original(folder.path(), &of(file)).is_some(), "{file}");
        }
        std::os::unix::fs::symlink("/dev/zero", original.join("endless")).unwrap();
        assert!(wrong_original(folder.path(), &of("endless")).is_some());
        std::fs::write(original.join("table.csv"), b"t_m").unwrap();
        assert!(wrong_original(folder.path(), &of("table.csv")).is_some());
    }
}
