//! Sessions as a rig on wires leaves them, for `scripts/other-readers`: one as it was recorded, and the same in many
//! segments, as a recording of hours has them. Prints its raw bytes as palpate reads them, one piece a line.
//!
//! `cargo run -p palpate-tests --example wired_session -- FOLDER`
#![expect(clippy::print_stdout, reason = "a program that prints")]

use palpate_doubles::WiredRig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::rig::RawBytes;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::RampHold;
use palpate_runner::TimeScale;
use palpate_sessions::{
    FolderSegments, LogBatch, LogPart, LogWriter, RawBlock, SampleRow, Session, SessionFolder,
};
use palpate_tests::recorded_runs;
use std::error::Error;
use std::path::{Path, PathBuf};

/// Batches in a segment of the second session: enough for more than ten segments.
const BATCHES_PER_SEGMENT: u32 = 150;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("where to? name a folder")?;
    let folder = PathBuf::from(folder);
    let (wired, rotated) = (folder.join("wired"), folder.join("rotated"));
    record(&wired);
    rewrite(&wired, &rotated)?;
    Session::scan_parts(&rotated, &mut |part| {
        if let LogPart::Raw(block) = part {
            print(block);
        }
    })?;
    Ok(())
}

fn record(out: &Path) {
    let rig = SimRig::new(SimSettings::default());
    let calibration = rig.calibration();
    let plan = RampHold {
        speed: MmPerS(4.5),
        depth: Depth(5.0),
        hold: Seconds(1.0),
        ..RampHold::default()
    };
    let rig = Box::new(WiredRig::new(rig));
    let scale = TimeScale::Factor(60.0);
    recorded_runs::wait_for_end(recorded_runs::start(rig, calibration, plan.plan(), scale, out));
}

/// The same session in many segments.
fn rewrite(from: &Path, to: &Path) -> Result<(), Box<dyn Error>> {
    let mut outline = Session::scan(from, &mut |_| {})?;
    outline.manifest.session_id += "-rotated";
    let _held = SessionFolder::create(to)?;
    let source = Box::new(FolderSegments::new(to));
    let mut log = LogWriter::begin_in_segments(source, BATCHES_PER_SEGMENT, &outline.manifest)?;
    let mut outcome = Ok(());
    Session::scan_parts(from, &mut |part| {
        if outcome.is_ok() {
            outcome = put(&mut log, part);
        }
    })?;
    outcome?;
    log.append(&[], &outline.entries)?;
    log.finish(outline.end.ok_or("the run was interrupted")?)?;
    Ok(())
}

fn put<S: palpate_sessions::Sink>(
    log: &mut LogWriter<S>,
    part: LogPart<'_>,
) -> Result<(), palpate_sessions::LogError> {
    match part {
        LogPart::Samples(block) => log.append(&block.rows().collect::<Vec<SampleRow>>(), &[]),
        LogPart::Raw(block) => {
            log.append_batch(&LogBatch { raw: &pieces(block), ..LogBatch::default() })
        }
        LogPart::Health(health) => log.append_batch(&LogBatch {
            health: std::slice::from_ref(health),
            ..LogBatch::default()
        }),
    }
}

fn pieces(block: &RawBlock<'_>) -> Vec<RawBytes> {
    let pieces = block.pieces().map(|piece| RawBytes {
        at: piece.at,
        device: block.device().into(),
        is_sent: piece.is_sent,
        bytes: piece.bytes.into(),
    });
    pieces.collect()
}

/// Time in ns, device, whether it was sent, the bytes in hexadecimal.
fn print(block: &RawBlock<'_>) {
    for piece in block.pieces() {
        let hex: String = piece.bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        println!("{} {} {} {hex}", piece.at.0, block.device(), piece.is_sent);
    }
}
