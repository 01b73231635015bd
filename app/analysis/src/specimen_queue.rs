//! The queue of specimens: read from a table, shown, and its runs judged together with their sessions.

use crate::protocol_sources::find_protocol;
use crate::session_actions::{Attribution, set_data_quality};
use palpate_model::metadata::{MetadataError, SessionLabels, find_key};
use palpate_protocols::file::BUILT_IN;
use palpate_runner::wall_now;
use palpate_sessions::DataQuality;
use palpate_sessions::specimen_queue::{
    QueueChange, QueueItem, QueueRefusal, QueueVerdict, QueuedSpecimen, SpecimenQueue,
    SpecimenState,
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
pub fn read_specimens(
    library: &Path,
    file: &Path,
    protocol: &str,
) -> Result<Vec<QueuedSpecimen>, String> {
    let text = palpate_sessions::text::read(file)?;
    let folder = file.parent().unwrap_or(Path::new("."));
    let found = parse_specimens(&text, protocol, folder, library);
    found.map_err(|reason| format!("{}: {reason}", file.display()))
}

fn parse_specimens(
    text: &str,
    protocol: &str,
    folder: &Path,
    library: &Path,
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
            protocol: protocol_of(cell(PROTOCOL).unwrap_or(protocol), folder, library)
                .map_err(|reason| format!("line {number}: {reason}"))?,
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

/// A name as it is, a file by its whole path.
fn protocol_of(name: &str, folder: &Path, library: &Path) -> Result<String, String> {
    let file = folder.join(name);
    let is_file = file.is_file() && !BUILT_IN.iter().any(|(known, _)| *known == name);
    if is_file {
        return Ok(std::path::absolute(&file).unwrap_or(file).display().to_string());
    }
    match find_protocol(name, Some(library))? {
        Some(_) => Ok(name.to_owned()),
        None => Err(format!(
            "'{name}' is neither a built-in protocol nor a file nor a locked protocol; give the name or the path of one"
        )),
    }
}

/// Specimens by their names alone.
pub fn named_specimens(
    library: &Path,
    names: &[String],
    protocol: &str,
) -> Result<Vec<QueuedSpecimen>, String> {
    let protocol = protocol_of(protocol, Path::new("."), library)?;
    let one = |name: &String| QueuedSpecimen {
        specimen: name.trim().to_owned(),
        protocol: protocol.clone(),
        labels: BTreeMap::new(),
    };
    Ok(names.iter().map(one).collect())
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

/// Judges the run of the queue that has no verdict: the verdict becomes the data quality of its session, then the queue
/// goes on.
pub fn judge_run(
    library: &Path,
    verdict: QueueVerdict,
    who: &Attribution,
) -> Result<SpecimenQueue, String> {
    let queue = read(library)?;
    let open = queue.open_run().ok_or("no run waits for a verdict")?;
    let session = open.sessions.last().map(|last| library.join(last));
    // A crash may have come before the folder; then only the queue goes on.
    if let Some(session) = session.filter(|session| session.exists()) {
        judge_data(&session, verdict, who)?;
    }
    change(library, who, QueueChange::Judged { number: open.number, verdict })
}

/// Judges a session, and its run where that is the one of the queue without a verdict.
pub fn judge_session(
    library: Option<&Path>,
    session: &Path,
    verdict: QueueVerdict,
    who: &Attribution,
) -> Result<SpecimenQueue, String> {
    let Some(library) = library else {
        judge_data(session, verdict, who)?;
        return Ok(SpecimenQueue::default());
    };
    let queue = read(library)?;
    if queue.open_run_of(library, session).is_some() {
        return judge_run(library, verdict, who);
    }
    judge_data(session, verdict, who)?;
    Ok(queue)
}

fn judge_data(session: &Path, verdict: QueueVerdict, who: &Attribution) -> Result<(), String> {
    let (quality, usual) = match verdict {
        QueueVerdict::Accept => (DataQuality::Valid, "accepted after the run"),
        QueueVerdict::Reject | QueueVerdict::Repeat => (DataQuality::Rejected, ""),
    };
    let reason = if who.reason.trim().is_empty() { usual } else { &who.reason };
    if reason.is_empty() {
        return Err(QueueRefusal::NoReason.to_string());
    }
    let who = Attribution { by: who.by.clone(), reason: reason.to_owned() };
    set_data_quality(session, quality, &who).map(|_| ()).map_err(|err| err.to_string())
}

fn read(library: &Path) -> Result<SpecimenQueue, String> {
    SpecimenQueue::read(library).map_err(|err| err.to_string())
}

/// Seed of the present moment, which no one chose.
#[must_use]
pub fn drawn_seed() -> u64 {
    let since = wall_now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |since| u64::from(since.subsec_nanos()))
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
        let read = |text: &str| parse_specimens(text, "ramp-hold", folder.path(), folder.path());
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
            ("specimen,protocol\na,ramp-hold\nc\n", "line 3 has 1 cells"),
            ("specimen,protocol\na,b\n", "line 2: 'b' is neither a built-in protocol nor a file"),
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
        let mut specimens =
            named_specimens(library, &["a", "b", "c"].map(str::to_owned), "ramp-hold").unwrap();
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
