//! The corpus: small files, at least one for each parser, and what is needed to make them.

use super::kinds::{WEIGHTS, analysis, check, compliance};
use crate::foreign_damage::seeds;
use crate::support::{MemorySink, end, entries, log_bytes, manifest, put, rows, wired_log_bytes};
use crate::worker::edit;
use palpate_model::Nanos;
use palpate_model::calibration::Calibration;
use palpate_sessions::LogWriter;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus")
}

/// The files of a target, by name.
pub fn read(target: &str) -> Vec<(String, Vec<u8>)> {
    let Ok(items) = fs::read_dir(folder().join(target)) else {
        return Vec::new();
    };
    let files = items.flatten().map(|item| item.path());
    let mut files: Vec<(String, Vec<u8>)> = files
        .map(|path| {
            let bytes = fs::read(&path).expect("the corpus can be read");
            (path.display().to_string(), bytes)
        })
        .collect();
    files.sort();
    files
}

/// Targets whose files [`make`] makes; those of crashes are kept beside them.
pub fn made_targets() -> impl Iterator<Item = &'static str> {
    let mut names: Vec<&str> = super::targets::ALL.iter().map(|target| target.name).collect();
    names.sort_unstable();
    names.into_iter()
}

/// One frame: opcode, length, body.
fn frame(opcode: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![opcode];
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes
}

/// A chunk that is not compressed, with its right checksum.
fn chunk(records: &[u8]) -> Vec<u8> {
    let mut body = vec![0; 16];
    body.extend((records.len() as u64).to_le_bytes());
    body.extend(crc32fast::hash(records).to_le_bytes());
    body.extend(0u32.to_le_bytes());
    body.extend((records.len() as u64).to_le_bytes());
    body.extend(records);
    frame(6, &body)
}

/// A short session that was never finished.
fn small(samples: usize, every: usize) -> Vec<u8> {
    let rows = rows(samples, 5);
    log_bytes(&rows, &entries(&rows, every), None)
}

/// The frames of a file behind its magic: opcode and body.
fn frames(bytes: &[u8]) -> Vec<(u8, &[u8])> {
    let mut found = Vec::new();
    let mut rest = &bytes[8..];
    while rest.len() > 9 {
        let length = u64::from_le_bytes(rest[1..9].try_into().expect("eight bytes")) as usize;
        found.push((rest[0], &rest[9..9 + length]));
        rest = &rest[9 + length..];
    }
    found
}

/// The records of every chunk of a file.
fn records(bytes: &[u8]) -> Vec<Vec<u8>> {
    let chunks = frames(bytes).into_iter().filter(|(opcode, _)| *opcode == 6);
    chunks
        .map(|(_, body)| {
            // Times, size, checksum, `zstd` behind its length, compressed size.
            let size = u64::from_le_bytes(body[16..24].try_into().expect("eight bytes")) as usize;
            let packed = &body[16 + 8 + 4 + 8 + 8..];
            zstd::bulk::decompress(packed, size).expect("a sound chunk")
        })
        .collect()
}

/// The beginning of a file: magic, header, and the channels and the manifest as records.
fn beginning() -> (Vec<u8>, Vec<u8>) {
    let file = small(0, 1);
    let header = frames(&file)[0];
    let mut head = mcap::MAGIC.to_vec();
    head.extend(frame(header.0, header.1));
    (head, records(&file).swap_remove(0))
}

/// A session whose first samples and entries are these records, checksums right.
pub fn file_with_chunk(records: &[u8]) -> Vec<u8> {
    let (mut file, first) = beginning();
    file.extend(chunk(&first));
    file.extend(chunk(records));
    file
}

/// A session with these bytes as its manifest.
pub fn file_with_manifest(manifest: &[u8]) -> Vec<u8> {
    let (mut file, first) = beginning();
    let mut records = Vec::new();
    // The channels stay; the message that is the manifest goes.
    let mut padded = vec![0; 8];
    padded.extend(&first);
    for (opcode, body) in frames(&padded) {
        if opcode != 5 {
            records.extend(frame(opcode, body));
        }
    }
    records.extend(message("/manifest", 0, manifest));
    file.extend(chunk(&records));
    file
}

/// A message on a channel, by the number that its topic has in the file's beginning.
pub fn message(topic: &str, sequence: u32, data: &[u8]) -> Vec<u8> {
    let (_, first) = beginning();
    let mut padded = vec![0; 8];
    padded.extend(&first);
    let channel = frames(&padded).into_iter().find_map(|(opcode, body)| {
        // Number, schema, then the topic behind its length.
        let is_it = opcode == 4 && body[8..].starts_with(topic.as_bytes());
        is_it.then(|| [body[0], body[1]])
    });
    let mut body = channel.expect("a channel of every log").to_vec();
    body.extend(sequence.to_le_bytes());
    body.extend([0; 16]);
    body.extend(data);
    frame(5, &body)
}

/// A document of the library with its right checksum, if it is JSON.
pub fn seal_document(kind: &str, bytes: &[u8]) -> Vec<u8> {
    let Ok(document) = serde_json::from_slice::<Value>(bytes) else {
        return bytes.into();
    };
    let checksum = crc32fast::hash(document.to_string().as_bytes());
    serde_json::json!({"checksum": checksum, kind: document}).to_string().into()
}

/// Lines of JSON as a file that belongs to `name`, with their right checksums.
pub fn seal_lines(name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut before = crc32fast::hash(name.as_bytes());
    let mut sealed = Vec::new();
    for line in bytes.split(|byte| *byte == b'\n') {
        let Ok(body) = serde_json::from_slice::<Value>(line) else {
            continue;
        };
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&before.to_le_bytes());
        hasher.update(body.to_string().as_bytes());
        before = hasher.finalize();
        let line = serde_json::json!({"body": body, "checksum": before});
        sealed.extend(format!("{line}\n").bytes());
    }
    sealed
}

fn bodies() -> String {
    let lines = [
        serde_json::to_string(&edit(1)),
        serde_json::to_string(&edit(2)),
        serde_json::to_string(&analysis(1)),
        serde_json::to_string(&analysis(2)),
        serde_json::to_string(&check(1)),
    ];
    let lines = lines.map(|line| line.expect("JSON") + "\n");
    lines.concat()
}

/// Makes the corpus in a folder; returns the targets it has files for, in order.
pub fn make(folder: &Path) -> Vec<String> {
    let mut made = Vec::new();
    let mut add = |target: &str, name: &str, bytes: &[u8]| {
        put(&folder.join(target).join(name), bytes);
        made.push(target.to_owned());
    };
    let short_rows = rows(25, 5);
    let ending = || Some(end(Nanos::from_millis(25)));
    let finished = log_bytes(&short_rows, &entries(&short_rows, 9), ending());
    // The index alone is larger than the rest.
    let unfinished = small(60, 20);
    add("mcap-file", "finished.mcap", &finished);
    add("mcap-file", "unfinished.mcap", &unfinished);
    add("mcap-segments", "unfinished.mcap", &unfinished);
    let mut rewrite = MemorySink::default();
    let mut log = LogWriter::begin(rewrite.clone(), "memory", &manifest()).expect("a log");
    log.append(&short_rows, &[]).expect("a log");
    add("mcap-file", "one-batch.mcap", &rewrite.bytes());
    rewrite = MemorySink::default();
    drop(LogWriter::begin(rewrite.clone(), "memory", &manifest()).expect("a log"));
    add("mcap-file", "manifest-only.mcap", &rewrite.bytes());
    for (number, records) in records(&unfinished).iter().enumerate().skip(1) {
        add("mcap-records", &format!("batch-{number}"), records);
    }
    let end_record = serde_json::to_vec(&end(Nanos(1))).expect("JSON");
    add("mcap-records", "end", &message("/end", 0, &end_record));
    let mut rewritten = message("/rewrite", 0, b"{\"reason\":\"\",\"samples\":0,\"entries\":0}");
    rewritten.extend(records(&unfinished).swap_remove(1));
    add("mcap-records", "rewrite", &rewritten);
    let mut blocks = Vec::new();
    let mut padded = vec![0; 8];
    padded.extend(records(&unfinished).swap_remove(1));
    for (opcode, body) in frames(&padded) {
        // The first two messages are the halves of a block.
        if opcode == 5 && blocks.len() < 2 {
            blocks.push(body[22..].to_vec());
        }
    }
    let longest = blocks[0].len().max(blocks[1].len());
    // Padded with a field that is passed over, so that the middle parts them.
    for block in &mut blocks {
        while block.len() < longest {
            let rest = longest - block.len();
            match rest {
                1 => block.extend([0]),
                _ => block.extend([0x78, 0]),
            }
        }
    }
    add("block", "pair", &blocks.concat());
    add("block", "empty", &[]);
    let wired = wired_log_bytes(&short_rows, &[], None);
    let mut padded = vec![0; 8];
    padded.extend(records(&wired).swap_remove(1));
    let found = frames(&padded).into_iter();
    let found = found.filter(|(opcode, _)| *opcode == 5).take(2);
    for ((_, body), name) in found.zip(["controller", "cell"]) {
        // Raw bytes are the first messages, a device each.
        add("raw-block", name, &body[22..]);
    }
    add("mcap-records", "raw", &records(&wired).swap_remove(1));
    add("health", "state", br#"{"now_ns":5,"kind":"state","lateness_s":0.001,"queue_share":0.5,"sync_s":1e-3,"free_bytes":7,"missed_readings":0}"#);
    add("health", "anchor", br#"{"now_ns":5,"kind":"anchor","why":"jump","wall":"2026-03-05T14:15:07.5Z","shift_s":-1.5}"#);
    add("health", "event", br#"{"now_ns":5,"kind":"event","text":"so"}"#);
    let json = serde_json::to_vec(&manifest()).expect("JSON");
    add("manifest", "manifest.json", &json);
    let thesis = serde_json::to_vec(&Calibration::thesis()).expect("JSON");
    add("calibration", "thesis.json", &thesis);
    let bench = serde_json::to_vec(&compliance()).expect("JSON");
    add("compliance", "bench.json", &bench);
    add("lines", "edits.jsonl", &seal_lines("one", bodies().as_bytes()));
    add("lines", "plain.jsonl", bodies().as_bytes());
    add("sealed-lines", "bodies.jsonl", bodies().as_bytes());
    let sums = br#"{"events_crc32":1,"samples_crc32":2,"sessions_crc32":3}"#;
    add("lake", "checksums.json", sums);
    add("trade", "curves.json", br#"{"checksum":1,"curves":{"format":1}}"#);
    add("table", "weights.csv", WEIGHTS.as_bytes());
    for (name, bytes) in seeds() {
        add("foreign", name, &bytes);
        if name == "table" {
            add("table", "table.csv", b"t_s,x_mm,F_N\n0,0.1,0.2\n0.1,0.2,0.4\n0.2,0.3,0.6\n");
        }
    }
    made.sort();
    made.dedup();
    made
}
