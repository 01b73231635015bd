//! The parsers, each as a function of bytes. What is behind a checksum gets bytes whose checksum is right, for
//! an attacker can make one.

use super::corpus::{file_with_chunk, message, seal_document, seal_lines};
use super::kinds::{check_foreign, check_table, check_weights};
use crate::support::put;
use palpate_analysis::trade::stored::read_trade;
use palpate_model::calibration::Calibration;
use palpate_model::rig::RigCompliance;
use palpate_sessions::checks::read_checks;
use palpate_sessions::document_store;
use palpate_sessions::journal::{JOURNAL_FILE, Journal};
use palpate_sessions::recover::{examine_session, salvage};
use palpate_sessions::{
    ANALYSES_FILE, Analyses, EDITS_FILE, Edits, LOG_FILE, LogPart, Session, SessionSummary,
};
use palpate_tables::lake;
use std::path::Path;

pub struct Target {
    pub name: &'static str,
    /// What means something to the parser.
    pub words: &'static [&'static [u8]],
    /// Reads bytes, with a folder to put them in.
    pub run: fn(&[u8], &Path),
}

pub const ALL: &[Target] = &[
    Target {
        name: "mcap-file",
        words: MCAP_WORDS,
        run: |bytes, folder| {
            put(&folder.join(LOG_FILE), bytes);
            read_log(&folder.join(LOG_FILE));
        },
    },
    Target {
        name: "mcap-segments",
        words: MCAP_WORDS,
        run: |bytes, folder| {
            // Two files that begin alike, the second cut from the first.
            let session = folder.join("session");
            put(&session.join("000.mcap"), bytes);
            put(&session.join("001.mcap"), &bytes[..bytes.len() / 2]);
            read_log(&session);
        },
    },
    Target {
        name: "mcap-records",
        words: MCAP_WORDS,
        run: |bytes, folder| {
            put(&folder.join(LOG_FILE), &file_with_chunk(bytes));
            read_log(&folder.join(LOG_FILE));
        },
    },
    Target {
        name: "block",
        words: &[&[0x12], &[0x1a, 0x80, 0x80, 0x04], &[0xff; 10], &[0x3a, 0x7f]],
        run: |bytes, folder| {
            // The first half is taken for raw samples, the second for what was made of them.
            let (raw, derived) = bytes.split_at(bytes.len() / 2);
            let mut records = message("/daq/block", 0, raw);
            records.extend(message("/derived/block", 0, derived));
            put(&folder.join(LOG_FILE), &file_with_chunk(&records));
            read_log(&folder.join(LOG_FILE));
        },
    },
    Target {
        name: "raw-block",
        words: &[&[0x12], &[0x2a, 0x80, 0x80, 0x04], &[0xff; 10], &[0x32]],
        run: |bytes, folder| {
            put(&folder.join(LOG_FILE), &file_with_chunk(&message("/raw", 0, bytes)));
            read_log(&folder.join(LOG_FILE));
        },
    },
    Target {
        name: "health",
        words: JSON_WORDS,
        run: |bytes, folder| {
            put(&folder.join(LOG_FILE), &file_with_chunk(&message("/health", 0, bytes)));
            read_log(&folder.join(LOG_FILE));
        },
    },
    Target {
        name: "manifest",
        words: JSON_WORDS,
        run: |bytes, folder| {
            put(&folder.join(LOG_FILE), &super::corpus::file_with_manifest(bytes));
            read_log(&folder.join(LOG_FILE));
        },
    },
    Target {
        name: "calibration",
        words: JSON_WORDS,
        run: |bytes, folder| {
            let path = folder.join("one.json");
            for bytes in [bytes, &seal_document("calibration", bytes)] {
                put(&path, bytes);
                if let Ok(calibration) = document_store::read_document::<Calibration>(&path) {
                    assert!(calibration.curve().is_ok());
                }
            }
        },
    },
    Target {
        name: "compliance",
        words: JSON_WORDS,
        run: |bytes, folder| {
            let path = folder.join("one.json");
            put(&path, &seal_document("compliance", bytes));
            if let Ok(compliance) = document_store::read_document::<RigCompliance>(&path) {
                assert!(compliance.mm_per_n.is_finite());
            }
        },
    },
    Target { name: "lines", words: JSON_WORDS, run: read_lines },
    Target {
        name: "sealed-lines",
        words: JSON_WORDS,
        run: |bytes, folder| {
            for name in ["one", JOURNAL_FILE, "bench"] {
                read_lines(&seal_lines(name, bytes), folder);
            }
        },
    },
    Target {
        name: "lake",
        words: JSON_WORDS,
        run: |bytes, folder| {
            let place = "v1/checksums/rig=sim/month=2026-03/20260305T141507Z-0badcafe.json";
            let path = folder.join(place);
            if !path.exists() {
                super::kinds::lake_of(folder, 20);
            }
            put(&path, bytes);
            for one in lake::list_sessions(folder).expect("a lake") {
                drop(lake::read_session(folder, &one));
            }
        },
    },
    Target {
        name: "trade",
        words: JSON_WORDS,
        run: |bytes, folder| {
            put(&folder.join("curves.json"), bytes);
            drop(read_trade(&folder.join("curves.json")));
        },
    },
    Target {
        name: "table",
        words: TABLE_WORDS,
        run: |bytes, _| {
            let text = String::from_utf8_lossy(bytes);
            check_table(&text);
            check_weights(bytes);
        },
    },
    Target {
        name: "foreign",
        words: TABLE_WORDS,
        run: |bytes, _| {
            check_foreign("input", bytes);
        },
    },
];

const MCAP_WORDS: &[&[u8]] = &[
    b"\x89MCAP0\r\n",
    b"\x04\0\0\0zstd",
    b"\x06\0\0\0\0\0\0\0\0",
    b"\x05\x16\0\0\0\0\0\0\0",
    b"/daq/block",
    b"/derived/block",
    b"/rewrite",
    b"/end",
    b"/manifest",
    b"{\"order\":1,\"after_sample\":1,\"now_ns\":1,\"body\":null}",
];

const JSON_WORDS: &[&[u8]] = &[
    b"null",
    b"1e999",
    b"-1",
    b"[[[[[[[[",
    b"{\"a\":",
    b"\"\\u0000\"",
    b"18446744073709551615",
    b"\n",
    b"{}",
    b"0.1e-320",
    b"\xff",
];

const TABLE_WORDS: &[&[u8]] = &[
    b";",
    b",",
    b"\t",
    b"\"",
    b"\n\n",
    b"1e999",
    b"nan",
    b"inf",
    b"1.234,5",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"-0",
    b"Time, s",
    b"<DATA>",
    b"[step]",
    b"s\tmm\tN",
    b"#",
    b"0x10",
];

fn read_log(path: &Path) {
    if let Ok(session) = Session::open(path) {
        let numbers = session.rows.iter().flat_map(|row| [row.volts, row.force, row.depth]);
        assert!(numbers.flatten().all(f64::is_finite));
    }
    let mut raw = 0;
    let scanned = Session::scan_parts(path, &mut |part| {
        if let LogPart::Raw(block) = part {
            raw += block.pieces().map(|piece| piece.bytes.len()).sum::<usize>();
        }
    });
    if let Ok(outline) = scanned {
        assert_eq!(outline.auxiliary.raw_bytes, raw as u64);
    }
    if let Ok(left) = salvage(path, &mut |block| assert_eq!(block.rows().count(), block.len())) {
        assert!(!left.missing.sentences().iter().any(String::is_empty));
    }
    drop(SessionSummary::read(path));
    assert!(!examine_session(path).findings.iter().any(String::is_empty));
}

fn read_lines(bytes: &[u8], folder: &Path) {
    put(&folder.join(EDITS_FILE), bytes);
    put(&folder.join(ANALYSES_FILE), bytes);
    put(&folder.join(JOURNAL_FILE), bytes);
    put(&folder.join("checks/bench.jsonl"), bytes);
    if let Ok(edits) = Edits::read(folder, "one") {
        drop((edits.tags(), edits.verdict(), edits.review(&[])));
    }
    if let Ok(analyses) = Analyses::read(folder, "one") {
        drop((analyses.active().count(), analyses.input()));
    }
    drop(read_checks(folder, "bench"));
    drop(Journal::open::<serde_json::Value>(folder));
}
