//! Where the text of a protocol comes from: built in, a file, or locked in the library with the values of its parameters.

use palpate_protocols::file::{BUILT_IN, Protocol, ProtocolProblem};
use palpate_runner::wall_now;
use palpate_sessions::document_store::{
    Document, read_document, save_document, supersede_document,
};
use palpate_sessions::journal::format_time;
use palpate_sessions::locked_protocols::{
    LOCKED_PROTOCOL_FORMAT, LockedProtocol, LockedProtocolStore, StoredLockedProtocol,
};
use palpate_sessions::text::read_if_present;
use std::collections::BTreeMap;
use std::path::Path;

/// A protocol as it is to be run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProtocolSource {
    pub text: String,
    /// Values that cannot be changed, where it is locked.
    pub locked: Option<BTreeMap<String, String>>,
}

impl ProtocolSource {
    /// A text whose parameters are free.
    #[must_use]
    pub fn free(text: String) -> Self {
        Self { text, locked: None }
    }

    fn of(document: LockedProtocol) -> Self {
        Self { text: document.text, locked: Some(document.values) }
    }

    /// The values to run with; a locked protocol takes no others.
    pub fn values(
        &self,
        name: &str,
        chosen: &BTreeMap<String, String>,
    ) -> Result<BTreeMap<String, String>, String> {
        match &self.locked {
            None => Ok(chosen.clone()),
            Some(locked) if chosen.is_empty() => Ok(locked.clone()),
            Some(_) => Err(format!(
                "the protocol '{name}' is locked, so its values cannot be changed; run it as it is, or choose another"
            )),
        }
    }
}

/// Finds a protocol by the name of a built-in one, the path of a file, or the name of a locked one; none where there is no
/// such.
pub fn find_protocol(name: &str, library: Option<&Path>) -> Result<Option<ProtocolSource>, String> {
    if let Some((_, text)) = BUILT_IN.iter().find(|(known, _)| *known == name) {
        return Ok(Some(ProtocolSource::free((*text).to_owned())));
    }
    let file = Path::new(name);
    if file.extension().is_some_and(|ending| ending == "json") && file.is_file() {
        let document = read_document(file).map_err(|err| err.to_string())?;
        return Ok(Some(ProtocolSource::of(document)));
    }
    match read_if_present(file) {
        Ok(Some(text)) => Ok(Some(ProtocolSource::free(text))),
        Ok(None) => {
            let store = library.map(LockedProtocolStore::open).unwrap_or_default();
            let is_known =
                store.documents.iter().any(|one| one.document.name() == name || one.id == name);
            match is_known {
                true => {
                    let found = store.find(name).map_err(|err| err.to_string())?;
                    Ok(Some(ProtocolSource::of(found.document.clone())))
                }
                false => Ok(None),
            }
        }
        Err(err) => Err(format!("the protocol {name} cannot be read ({err}); give a text file")),
    }
}

/// The locked protocols in force, by name.
#[must_use]
pub fn locked_protocols(library: &Path) -> (Vec<StoredLockedProtocol>, Vec<String>) {
    let store = LockedProtocolStore::open(library);
    let in_force = store.documents.iter().filter(|one| store.successor(&one.id).is_none());
    let mut found: Vec<StoredLockedProtocol> = in_force.cloned().collect();
    found.sort_by(|a, b| a.document.name.cmp(&b.document.name));
    (found, store.unreadable.iter().map(ToString::to_string).collect())
}

/// Locks a protocol with these values under a name; an earlier one of that name is superseded.
pub fn lock_protocol(
    library: &Path,
    name: &str,
    source: &ProtocolSource,
    chosen: &BTreeMap<String, String>,
    by: &str,
) -> Result<StoredLockedProtocol, String> {
    let name = name.trim();
    if BUILT_IN.iter().any(|(known, _)| *known == name) {
        return Err(format!("'{name}' is a built-in protocol; give the locked one another name"));
    }
    let values = source.values(name, chosen)?;
    let first = |problems: Vec<ProtocolProblem>| {
        problems.first().map_or_else(String::new, ToString::to_string)
    };
    Protocol::read(&source.text).and_then(|one| one.plan(&values)).map_err(first)?;
    let document = LockedProtocol {
        format: LOCKED_PROTOCOL_FORMAT,
        name: name.to_owned(),
        locked_at: format_time(wall_now()),
        by: by.to_owned(),
        text: source.text.clone(),
        values,
        supersedes: None,
    };
    let (known, _) = locked_protocols(library);
    let stored = match known.iter().find(|one| one.document.name == name) {
        Some(old) => supersede_document(library, &old.id, &document),
        None => save_document(library, &document),
    };
    stored.map_err(|err| err.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_locked_protocol_keeps_its_values_and_the_newest_of_a_name_counts() {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path();
        let free = find_protocol("ramp-hold", None).unwrap().unwrap();
        let values = |depth: &str| BTreeMap::from([("depth".to_owned(), depth.to_owned())]);
        let first = lock_protocol(library, "study 3", &free, &values("12 mm"), "Ada").unwrap();
        let second = lock_protocol(library, "study 3", &free, &values("14 mm"), "Ada").unwrap();
        assert_eq!(second.document.supersedes.as_deref(), Some(first.id.as_str()));
        let found = find_protocol("study 3", Some(library)).unwrap().unwrap();
        assert_eq!(found.values("study 3", &BTreeMap::new()), Ok(values("14 mm")));
        let refusal = found.values("study 3", &values("30 mm")).unwrap_err();
        assert!(refusal.contains("is locked"), "{refusal}");
        // By its file too, and a changed file is refused.
        let path = first.path.display().to_string();
        let by_file = find_protocol(&path, None).unwrap().unwrap();
        assert_eq!(by_file.locked, Some(values("12 mm")));
        let text = std::fs::read_to_string(&first.path).unwrap();
        std::fs::write(&first.path, text.replace("12 mm", "29 mm")).unwrap();
        let refusal = find_protocol(&path, None).unwrap_err();
        assert!(refusal.contains("was changed"), "{refusal}");
        assert_eq!(find_protocol("nothing", Some(library)), Ok(None));
        for (name, depth, words) in
            [("ramp-hold", "12 mm", "built-in"), ("other", "12 N", "is a force")]
        {
            let refusal = lock_protocol(library, name, &free, &values(depth), "").unwrap_err();
            assert!(refusal.contains(words), "{refusal}");
        }
    }
}
