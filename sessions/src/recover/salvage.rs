//! Goes through a session's files and keeps everything that is whole.

use super::{Gap, Missing, Wound};
use crate::log::ReadError;
use crate::log::content::Content;
use crate::log::frames::{ChunkReader, FRAME_HEADER_BYTES};
use crate::log::reader::{NOT_BEGUN, check_beginning, damaged, find_files, name_of, refused};
use crate::log::source::Source;
use crate::log::walk::next_chunk;
use crate::manifest::Manifest;
use crate::record::{Block, EndRecord, Entry};
use mcap::records::op;
use std::io;
use std::path::Path;

/// What is left of a session, its samples apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Salvage {
    /// What the session says about itself.
    pub manifest: Manifest,
    /// Samples that are left.
    pub samples: u64,
    /// Entries that are left, by `order`. Their `after_sample` counts the samples that were recorded.
    pub entries: Vec<Entry>,
    /// How the session ended, if that is left.
    pub end: Option<EndRecord>,
    /// What is not.
    pub missing: Missing,
}

/// Hands out every block of samples that is whole, in order, and tells what is missing.
pub fn salvage(path: &Path, visit: &mut dyn FnMut(&Block)) -> Result<Salvage, ReadError> {
    let files = find_files(path)?;
    let failed = |source| ReadError::Io {
        path: path.into(),
        source,
    };
    let mut chunks = ChunkReader::new().map_err(failed)?;
    let mut kept = 0;
    let mut last_s = 0.0;
    let mut gaps = Vec::new();
    let mut expected = 0;
    let mut note = |block: &Block| {
        let from = block
            .rows()
            .next()
            .map_or(last_s, |row| row.host.seconds().0);
        if block.first_sample() > expected {
            gaps.push(Gap {
                after_sample: kept,
                samples: block.first_sample() - expected,
                from_s: last_s,
                to_s: Some(from),
            });
        }
        expected = block.first_sample() + block.len() as u64;
        kept += block.len() as u64;
        last_s = block.last_time().map_or(last_s, |time| time.seconds().0);
        visit(block);
    };
    let mut content = Content::new(!path.is_dir(), &mut note);
    content.allow_gaps();
    let mut wounds = Vec::new();
    for file in &files {
        let wound = |offset: u64, reason: &str| Wound {
            file: name_of(file),
            offset,
            reason: reason.into(),
        };
        if !file.is_file() {
            wounds.push(wound(0, "this segment is missing"));
            continue;
        }
        let source = Source::open(file).map_err(failed)?;
        let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
        if !is_ours && content.manifest.is_none() {
            check_beginning(file, &source, is_ours)?;
        }
        content.begin_segment();
        let found = go_through(&source, &mut chunks, &mut content, wound).map_err(failed)?;
        if let Some(refusal) = content.refusal.take() {
            // A first file that is another's is refused; a later one is left out.
            if content.manifest.is_none() {
                return Err(refused(file, refusal));
            }
            wounds.push(wound(0, "this segment is of another recording"));
        }
        wounds.extend(found);
    }
    let (lost_entries, later) = (content.lost_entries, content.is_later_part);
    let entries = std::mem::take(&mut content.entries);
    let (manifest, end) = (content.manifest.take(), content.end.take());
    drop(content);
    let Some(manifest) = manifest else {
        return Err(damaged(path, 0, NOT_BEGUN));
    };
    if let Some(end) = &end
        && end.samples > expected
    {
        gaps.push(Gap {
            after_sample: kept,
            samples: end.samples - expected,
            from_s: last_s,
            to_s: None,
        });
    }
    // The first sample of a later part is not its first.
    if later {
        gaps.retain(|gap| gap.after_sample > 0);
    }
    Ok(Salvage {
        missing: Missing {
            gaps,
            entries: lost_entries,
            is_end_lost: end.is_none(),
            wounds,
        },
        manifest,
        samples: kept,
        entries,
        end,
    })
}

/// Reads what is whole of one file; returns what is not.
fn go_through(
    source: &Source,
    chunks: &mut ChunkReader,
    content: &mut Content<'_>,
    wound: impl Fn(u64, &str) -> Wound,
) -> io::Result<Vec<Wound>> {
    let mut wounds = Vec::new();
    let mut bytes = Vec::new();
    let mut offset = mcap::MAGIC.len() as u64;
    while offset < source.length() && content.refusal.is_none() {
        let frame = source.frame_at(offset, &mut bytes)?;
        let body = bytes.get(FRAME_HEADER_BYTES..).unwrap_or_default();
        let (reason, next) = match frame {
            Err(_) => ("a record's length is wrong".to_owned(), None),
            Ok(frame) => match frame.opcode {
                op::HEADER if offset == mcap::MAGIC.len() as u64 => {
                    content.take_header(body);
                    offset = frame.next;
                    continue;
                }
                op::CHUNK => match chunks
                    .open(body)
                    .and_then(|records| content.take_chunk(records))
                {
                    Ok(()) => {
                        offset = frame.next;
                        continue;
                    }
                    Err(reason) => (reason, Some(frame.next)),
                },
                op::DATA_END | op::FOOTER => break,
                op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA | 0x80.. => {
                    offset = frame.next;
                    continue;
                }
                _ => ("a record is of an unexpected kind".to_owned(), None),
            },
        };
        // The damaged record's length may be right, or may lead anywhere: what lies at its end tells.
        let resumed = match next {
            Some(next) if is_record(source, next)? => Some(next),
            _ => next_chunk(source, offset, chunks)?,
        };
        let is_torn = resumed.is_none() && !source.has_footer()?;
        if !is_torn {
            wounds.push(wound(offset, &reason));
        }
        let Some(place) = resumed else { break };
        offset = place;
    }
    Ok(wounds)
}

/// Whether a record that follows a chunk, or the end, is at a place.
fn is_record(source: &Source, offset: u64) -> io::Result<bool> {
    Ok(source
        .head_at(offset)?
        .is_ok_and(|head| matches!(head.opcode, op::CHUNK | op::MESSAGE_INDEX | op::DATA_END)))
}
