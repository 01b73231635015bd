use super::*;
use serde_json::json;
use std::fs;

fn three(path: &Path) {
    for (number, word) in [(1, "one"), (2, "two"), (3, "three")] {
        append(path, "session", &json!({"word": word, "depth": 0.1 * f64::from(number)})).unwrap();
    }
}

#[test]
fn lines_read_back_and_every_change_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/lines.jsonl");
    assert!(read(&path, "session").unwrap().bodies.is_empty());
    three(&path);
    let chain = read(&path, "session").unwrap();
    assert_eq!(chain.bodies.len(), 3);
    assert_eq!(chain.bodies[2], json!({"word": "three", "depth": 0.1 * 3.0}));
    assert!(!chain.is_torn);
    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let joined = |lines: &[&str]| lines.join("\n") + "\n";
    for (changed, line) in [
        (text.replacen("two", "tvo", 1), 2),
        (text.replacen("three", "thr", 1), 3),
        (joined(&[lines[0], lines[2]]), 2),
        (joined(&[lines[1], lines[2]]), 1),
        (joined(&[lines[1], lines[0], lines[2]]), 1),
        (joined(&[lines[0], lines[0], lines[1]]), 2),
        (joined(&[lines[0], "", lines[1]]), 2),
    ] {
        fs::write(&path, changed).unwrap();
        let refusal = read(&path, "session").unwrap_err().to_string();
        assert!(refusal.starts_with(&format!("line {line} of ")), "{refusal}");
        // Nothing is added to what was changed.
        assert!(append(&path, "session", &json!({})).is_err());
    }
    // The file of another session, whole as it is.
    fs::write(&path, text).unwrap();
    assert!(read(&path, "other").is_err());
}

#[test]
fn lines_cut_off_the_end_are_noticed_by_the_head() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lines.jsonl");
    three(&path);
    let (head_file, text) = (ChainHead::file_of(&path), fs::read_to_string(&path).unwrap());
    let head = fs::read(&head_file).unwrap();
    let known = read(&path, "session").unwrap().head();
    assert_eq!(known.lines, 3);
    for count in 0..3 {
        let lines: Vec<&str> = text.split_inclusive('\n').take(count).collect();
        fs::write(&path, lines.concat()).unwrap();
        let counts = |read: Result<Chain, ChainError>| match read {
            Err(ChainError::Shortened { found, written, .. }) => Some((found, written)),
            _ => None,
        };
        assert_eq!(counts(read(&path, "session")), Some((count as u64, 3)));
        // Nothing is added that would hide it.
        assert!(append(&path, "session", &json!({})).is_err());
        // Without the head's file only a remembered head reveals it.
        fs::remove_file(&head_file).unwrap();
        assert_eq!(read(&path, "session").unwrap().bodies.len(), count);
        assert_eq!(counts(read_since(&path, "session", known)), Some((count as u64, 3)));
        fs::write(&head_file, &head).unwrap();
    }
    fs::remove_file(&path).unwrap();
    assert!(read(&path, "session").is_err());
    // As many lines, of which the last is another.
    let two: Vec<&str> = text.split_inclusive('\n').take(2).collect();
    fs::write(&path, two.concat()).unwrap();
    fs::remove_file(&head_file).unwrap();
    append(&path, "session", &json!({"word": "four"})).unwrap();
    assert_eq!(read(&path, "session").unwrap().head().lines, 3);
    assert!(read_since(&path, "session", known).is_err());
    for bad in ["", "{}", "{\"head_version\":\"2\",\"lines\":1,\"checksum\":1}"] {
        fs::write(&head_file, bad).unwrap();
        let refused = read(&path, "session");
        assert!(matches!(refused, Err(ChainError::BadHead { .. })), "{bad}");
    }
    // A newer head may have other fields.
    fs::write(&head_file, "{\"head_version\":2,\"entries\":[1]}").unwrap();
    for refused in [read(&path, "session").map(|_| ()), append(&path, "session", &json!(1))] {
        assert!(matches!(refused, Err(ChainError::Newer { version: 2, .. })), "{refused:?}");
    }
}

#[test]
fn head_behind_its_lines_is_accepted_after_a_crash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lines.jsonl");
    let heads: Vec<Vec<u8>> = (0..3)
        .map(|number| {
            append(&path, "session", &json!(number)).unwrap();
            fs::read(ChainHead::file_of(&path)).unwrap()
        })
        .collect();
    for head in heads {
        fs::write(ChainHead::file_of(&path), head).unwrap();
        assert_eq!(read(&path, "session").unwrap().bodies.len(), 3);
    }
}

#[test]
fn flipped_bit_of_a_line_never_changes_a_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lines.jsonl");
    three(&path);
    let whole = read(&path, "session").unwrap().bodies;
    let bytes = fs::read(&path).unwrap();
    for at in 0..bytes.len() - 1 {
        let mut changed = bytes.clone();
        changed[at] ^= 1;
        fs::write(&path, &changed).unwrap();
        if let Ok(chain) = read(&path, "session") {
            // An ignored key may differ; the body may not.
            assert_eq!(chain.bodies, whole, "bit 0 of byte {at}");
        }
    }
}

#[test]
fn incomplete_line_moves_to_torn_file_before_the_next_append() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lines.jsonl");
    three(&path);
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
    // A crash comes before the head.
    fs::remove_file(ChainHead::file_of(&path)).unwrap();
    let torn = read(&path, "session").unwrap();
    assert!(torn.is_torn && torn.bodies.len() == 2);
    append(&path, "session", &json!({"word": "four"})).unwrap();
    let chain = read(&path, "session").unwrap();
    assert_eq!(chain.bodies[2], json!({"word": "four"}));
    let torn_file = fs::read(folder.path().join("lines.jsonl.torn")).unwrap();
    let line = bytes[..bytes.len() - 1].rsplit(|byte| *byte == b'\n').next();
    let torn = &line.unwrap()[..line.unwrap().len() - 8];
    assert_eq!(torn_file, [torn, b"\n"].concat());
    assert!(!chain.is_torn);
}
