//! The queue of specimens: read from a table, shown, and its runs judged together with their sessions.

use crate::session_actions::{Attribution, set_data_quality};
use palpate_model::metadata::{MetadataError, SessionLabels, find_key};
use palpate_protocols::file::BUILT_IN;
use palpate_runner::wall_now;
use palpate_sessions::DataQuality;
use palpate_sessions::specimen_queue::{
    QueueChange, QueueItem, QueueVerdict, QueuedSpecimen, SpecimenQueue, SpecimenState,
};
use palpate_tables::import::cells::{delimiter_of, split};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const SPECIMEN: &str = "specimen";
const PROTOCOL: &str = "protocol";

/// Reads specimens from a table with a header: `specimen`, `protocol` and further labels of a session, separated by
/// comma, semicolon or tab. `protocol` is for rows that name none.
///
/// Protocol files are sought from the folder of the table.
pub fn read_specimens(file: &Path, protocol: &str) -> Result<Vec<QueuedSpecimen>, String> {
    let text = palpate_sessions::text::read(file)?;
    let folder = file.parent().unwrap_or(Path::new("."));
    let found = parse_specimens(&text, protocol, folder);
    found.map_err(|reason| format!("{}: {reason}", file.display()))
}

fn parse_specimens(
    text: &str,
    protocol: &str,
    folder: &Path,
) -> Result<Vec<QueuedSpecimen>, String> {
    // A byte order mark, as spreadsheets write it.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (_, head) = lines.next().ok_or("the table is empty; give a header and a row a specimen")?;
    // A table of one column has no delimiter.
    let delimiter = delimiter_of(head).unwrap_or(',');
    let columns = split(head, delimiter, 1)?;
    let place = columns.iter().position(|name| name == SPECIMEN);
    let place = place.ok_or("the header has no column 'specimen'; add one")?;
    for name in columns.iter().filter(|name| *name != PROTOCOL) {
        find_key(name).map_err(|err| format!("the header: {err}"))?;
    }
    let mut specimens = Vec::new();
    for (index, line) in lines {
        let number = index + 1;
        let cells = split(line, delimiter, number)?;
        if cells.len() != columns.len() {
            return Err(format!(
                "line {number} has {} cells, but the header has {}; give a cell for each column",
                cells.len(),
                columns.len()
            ));
        }
        let cell = |name: &str| {
            let at = columns.iter().position(|column| column == name)?;
            Some(cells[at].as_str()).filter(|text| !text.is_empty())
        };
        let labels = columns
            .iter()
            .zip(&cells)
            .filter(|(name, text)| !text.is_empty() && *name != SPECIMEN && *name != PROTOCOL);
        let labels = labels.map(|(name, text)| (name.clone(), text.clone()));
        let one = QueuedSpecimen {
            specimen: cells[place].clone(),
            protocol: protocol_of(cell(PROTOCOL).unwrap_or(protocol), folder),
            labels: labels.collect(),
        };
        labels_of(&one).map_err(|err| format!("line {number}: {err}"))?;
        specimens.push(one);
    }
    if specimens.is_empty() {
        return Err("the table has no specimen; give a row for each".into());
    }
    Ok(specimens)
}

/// A built-in name as it is, a file by its whole path.
fn protocol_of(name: &str, folder: &Path) -> String {
    let file = folder.join(name);
    let is_built_in = BUILT_IN.iter().any(|(known, _)| *known == name);
    match !is_built_in && file.is_file() {
        true => std::path::absolute(&file).unwrap_or(file).display().to_string(),
        false => name.to_owned(),
    }
}

/// Specimens by their names alone.
#[must_use]
pub fn named_specimens(names: &[String], protocol: &str) -> Vec<QueuedSpecimen> {
    let protocol = protocol_of(protocol, Path::new("."));
    let one = |name: &String| QueuedSpecimen {
        specimen: name.trim().to_owned(),
        protocol: protocol.clone(),
        labels: BTreeMap::new(),
    };
    names.iter().map(one).collect()
}

/// The labels of a specimen's sessions.
pub fn labels_of(wanted: &QueuedSpecimen) -> Result<SessionLabels, MetadataError> {
    let mut labels =
        SessionLabels { specimen: wanted.specimen.clone(), ..SessionLabels::default() };
    for (name, text) in &wanted.labels {
        labels.set(name, text)?;
    }
    labels.check()?;
    Ok(labels)
}

/// The path of a session in the queue's journal: from the library where it is inside.
#[must_use]
pub fn session_path(library: &Path, session: &Path) -> PathBuf {
    session.strip_prefix(library).unwrap_or(session).to_owned()
}

/// What whoever measures may see: of a blinded queue no labels, and no specimen behind the next.
#[must_use]
pub fn visible_items(queue: &SpecimenQueue) -> Vec<QueueItem> {
    let next = queue.next().map(|item| item.number);
    let is_visible = |item: &&QueueItem| {
        !queue.is_blinded || item.state != SpecimenState::Waiting || Some(item.number) == next
    };
    let mut items: Vec<QueueItem> = queue.items.iter().filter(is_visible).cloned().collect();
    if queue.is_blinded {
        items.iter_mut().for_each(|item| item.wanted.labels.clear());
    }
    items
}

/// Judges the run of a specimen: the verdict becomes the data quality of its session, then the queue goes on.
pub fn judge_run(
    library: &Path,
    number: u32,
    verdict: QueueVerdict,
    who: &Attribution,
) -> Result<SpecimenQueue, String> {
    let queue = SpecimenQueue::read(library).map_err(|err| err.to_string())?;
    let item = queue.open_run().filter(|item| item.number == number);
    let session = item.and_then(|item| item.sessions.last()).map(|last| library.join(last));
    // A crash may have come before the folder; then only the queue goes on.
    if let Some(session) = session.filter(|session| session.exists()) {
        let quality = match verdict {
            QueueVerdict::Accept => DataQuality::Valid,
            QueueVerdict::Reject | QueueVerdict::Repeat => DataQuality::Rejected,
        };
        if who.reason.trim().is_empty() && quality == DataQuality::Rejected {
            return Err("give a reason in a few words; the session keeps it".into());
        }
        let reason = match who.reason.trim() {
            "" => "accepted after the run".to_owned(),
            reason => reason.to_owned(),
        };
        set_data_quality(&session, quality, &Attribution { by: who.by.clone(), reason })
            .map_err(|err| err.to_string())?;
    }
    change(library, who, QueueChange::Judged { number, verdict })
}

/// Changes the queue of a library now.
pub fn change(
    library: &Path,
    who: &Attribution,
    change: QueueChange,
) -> Result<SpecimenQueue, String> {
    SpecimenQueue::change(library, wall_now(), &who.by, &who.reason, change)
        .map_err(|err| err.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_spreadsheets_are_read_and_mistakes_name_their_line() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("own.toml"), "").unwrap();
        let read = |text: &str| parse_specimens(text, "ramp-hold", folder.path());
        let found = read(
            "\u{feff}specimen;protocol;specimen.thickness_mm;specimen.source\r\n\"pig; 7\";;12;pig stomach\r\npig 8;own.toml;;\r\n\r\n",
        )
        .unwrap();
        let [first, second] = found.as_slice() else { panic!("{found:?}") };
        assert_eq!((first.specimen.as_str(), first.protocol.as_str()), ("pig; 7", "ramp-hold"));
        assert_eq!(first.labels.len(), 2);
        assert!(Path::new(&second.protocol).is_absolute() && second.labels.is_empty());
        let labels = labels_of(first).unwrap();
        assert_eq!(labels.about.get("specimen.thickness_mm").unwrap(), 12.0);
        assert_eq!(read("specimen\na\nb\n").unwrap().len(), 2);
        for (text, words) in [
            ("", "the table is empty"),
            ("specimen\n", "no specimen"),
            ("name\na\n", "no column 'specimen'"),
            ("specimen,colour\na,b\n", "'colour' is not a metadata entry"),
            (
                "specimen,specimen.thickness_mm\na,0\n",
                "line 2: specimen.thickness_mm cannot be '0'",
            ),
            ("specimen,protocol\na,b\nc\n", "line 3 has 1 cells"),
            ("specimen,protocol\n\"a,b\n", "line 2: a quote is not closed"),
        ] {
            let refusal = read(text).unwrap_err();
            assert!(refusal.contains(words), "{refusal}");
        }
    }

    #[test]
    fn of_a_blinded_queue_only_the_next_specimen_is_seen_and_no_label() {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path();
        let who = Attribution { by: "Ada".into(), reason: "a reason".into() };
        let started = palpate_sessions::specimen_queue::start("pilot", true);
        change(library, &who, started).unwrap();
        let mut specimens = named_specimens(&["a", "b", "c"].map(str::to_owned), "ramp-hold");
        for one in &mut specimens {
            one.labels.insert("series.id".into(), "treated".into());
        }
        let queue = change(library, &who, QueueChange::Added { specimens }).unwrap();
        let queue = change(library, &who, queue.shuffle(3)).unwrap();
        let seen = visible_items(&queue);
        assert_eq!(seen.len(), 1);
        assert_eq!(seen[0].number, queue.next().unwrap().number);
        assert!(seen[0].wanted.labels.is_empty());
        // The session still has them.
        assert!(!queue.next().unwrap().wanted.labels.is_empty());
    }
}
