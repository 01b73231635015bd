//! Recordings of a loop, tick by tick with inputs and outputs, so that a replay can recompute it.
//!
//! A recording is a folder with two text files. `settings.toml` holds the loop's settings, in the format of its owner.
//! `ticks.csv` has a line with the column names and a line per tick: integers first, then floats in the shortest decimal form
//! that reads back to the same bits. The last line is `end,` with the number of ticks, the number of lost ticks, a hash of the
//! loop's final state, and a hash of all lines. Without that line the recording was cut off and is valid to its last complete
//! line.
//!
//! [`TickRecorder::push`] neither waits nor allocates: a bounded channel takes the ticks to a thread that writes them.

use crate::atomic;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

pub const SETTINGS_FILE: &str = "settings.toml";
pub const TICKS_FILE: &str = "ticks.csv";

/// Capacity of the channel in ticks: 8 s at 1 kHz, far longer than a disk stalls.
const CAPACITY: usize = 8192;

/// Sleep of the writing thread when there is nothing to write.
const NAP: Duration = Duration::from_millis(5);

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickRow<const W: usize, const R: usize> {
    pub whole: [u64; W],
    pub real: [f64; R],
}

impl<const W: usize, const R: usize> TickRow<W, R> {
    /// Index of the first column that differs in any bit; integers come first.
    pub fn first_difference(&self, other: &Self) -> Option<usize> {
        let whole = self.whole.iter().zip(&other.whole).map(|(a, b)| a != b);
        let real = self.real.iter().zip(&other.real);
        let real = real.map(|(a, b)| a.to_bits() != b.to_bits());
        whole.chain(real).position(|is_other| is_other)
    }

    fn line(&self, line: &mut String) {
        use std::fmt::Write as _;
        line.clear();
        for (index, value) in self.whole.iter().enumerate() {
            let comma = if index > 0 { "," } else { "" };
            let _ = write!(line, "{comma}{value}");
        }
        for value in &self.real {
            // Debug uses an exponent for very large and small numbers.
            let _ = write!(line, ",{value:?}");
        }
        line.push('\n');
    }

    fn of(line: &str) -> Option<Self> {
        let mut cells = line.split(',');
        let mut row = Self { whole: [0; W], real: [0.0; R] };
        for value in &mut row.whole {
            *value = cells.next()?.parse().ok()?;
        }
        for value in &mut row.real {
            *value = cells.next()?.parse().ok()?;
        }
        cells.next().is_none().then_some(row)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickCounts {
    pub ticks: u64,
    /// Ticks dropped because the channel was full; a replay ends at the first of them.
    pub lost_ticks: u64,
}

/// Writes ticks while a loop runs.
#[derive(Debug)]
pub struct TickRecorder<const W: usize, const R: usize> {
    ring: SyncSender<TickRow<W, R>>,
    dropped: Arc<AtomicU64>,
    thread: JoinHandle<io::Result<TickFile>>,
    file: PathBuf,
}

/// The file of ticks and the hash of its content.
#[derive(Debug)]
struct TickFile {
    to: BufWriter<File>,
    hash: u64,
    ticks: u64,
}

impl TickFile {
    fn put(&mut self, line: &str) -> io::Result<()> {
        self.hash = extend_hash(self.hash, line.as_bytes());
        self.to.write_all(line.as_bytes())
    }
}

/// Offset basis of FNV-1a.
const BASIS: u64 = 0xcbf2_9ce4_8422_2325;

fn extend_hash(hash: u64, bytes: &[u8]) -> u64 {
    let mix = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(hash, mix)
}

impl<const W: usize, const R: usize> TickRecorder<W, R> {
    /// Begins a recording in a new folder.
    pub fn start(
        folder: &Path,
        settings: &str,
        (whole, real): ([&str; W], [&str; R]),
    ) -> Result<Self, String> {
        let file = folder.join(TICKS_FILE);
        let failed = |err: io::Error| {
            format!(
                "cannot record in {} ({err}); give a new folder in a writable place",
                folder.display()
            )
        };
        std::fs::create_dir(folder).map_err(failed)?;
        atomic::create(&folder.join(SETTINGS_FILE), settings.as_bytes()).map_err(failed)?;
        let mut lines = TickFile {
            to: BufWriter::new(File::create_new(&file).map_err(failed)?),
            hash: BASIS,
            ticks: 0,
        };
        let names: Vec<&str> = whole.into_iter().chain(real).collect();
        lines.put(&(names.join(",") + "\n")).map_err(failed)?;
        let (ring, rows) = sync_channel(CAPACITY);
        let thread = std::thread::Builder::new()
            .name("tick-writer".into())
            .spawn(move || write(lines, &rows))
            .map_err(failed)?;
        Ok(Self { ring, dropped: Arc::new(AtomicU64::new(0)), thread, file })
    }

    /// Sends a tick; if the channel is full, drops and counts it.
    pub fn push(&self, row: TickRow<W, R>) {
        if self.ring.try_send(row).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Writes the remaining ticks and the end, with a hash of the loop's final state.
    pub fn finish(self, state_hash: u64) -> Result<TickCounts, String> {
        let Self { ring, dropped, thread, file } = self;
        drop(ring);
        let lost = dropped.load(Ordering::Relaxed);
        let written =
            thread.join().unwrap_or_else(|_| Err(io::Error::other("the writing thread failed")));
        let ended = written.and_then(|mut lines| {
            let end = format!("end,{},{lost},{state_hash:016x},", lines.ticks);
            let hash = extend_hash(lines.hash, end.as_bytes());
            lines.put(&format!("{end}{hash:016x}\n"))?;
            lines.to.flush()?;
            Ok(TickCounts { ticks: lines.ticks, lost_ticks: lost })
        });
        ended.map_err(|err| {
            format!(
                "cannot write {} ({err}); free space on the disk and record again",
                file.display()
            )
        })
    }
}

/// Writes until the sender is dropped. It polls, so that the sender never spends time on waking it.
fn write<const W: usize, const R: usize>(
    mut lines: TickFile,
    rows: &Receiver<TickRow<W, R>>,
) -> io::Result<TickFile> {
    let mut line = String::new();
    loop {
        match rows.try_recv() {
            Ok(row) => {
                row.line(&mut line);
                lines.put(&line)?;
                lines.ticks += 1;
            }
            Err(TryRecvError::Empty) => {
                // A crash loses only the last moment.
                lines.to.flush()?;
                std::thread::sleep(NAP);
            }
            Err(TryRecvError::Disconnected) => return Ok(lines),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TickEnd {
    Whole {
        lost_ticks: u64,
        /// Hash of the loop's final state.
        state_hash: u64,
    },
    CutOff,
}

#[derive(Clone, Debug, PartialEq)]
pub struct TickRecording<const W: usize, const R: usize> {
    pub settings: String,
    pub rows: Vec<TickRow<W, R>>,
    pub end: TickEnd,
}

/// The settings of a recording, whose owner knows their format.
pub fn read_settings(folder: &Path) -> Result<String, String> {
    read_text(&folder.join(SETTINGS_FILE))
}

/// Whether the ticks of a recording have these columns.
pub fn has_columns(folder: &Path, whole: &[&str], real: &[&str]) -> Result<bool, String> {
    let file = folder.join(TICKS_FILE);
    let mut head = String::new();
    let read = File::open(&file).and_then(|ticks| BufReader::new(ticks).read_line(&mut head));
    read.map_err(|err| unreadable(&file, &err))?;
    Ok(head.trim_end() == [whole, real].concat().join(","))
}

fn read_text(file: &Path) -> Result<String, String> {
    std::fs::read_to_string(file).map_err(|err| unreadable(file, &err))
}

fn unreadable(file: &Path, err: &io::Error) -> String {
    format!("cannot read {} ({err}); give the folder of a recording", file.display())
}

impl<const W: usize, const R: usize> TickRecording<W, R> {
    /// Reads a recording with these columns.
    pub fn read(folder: &Path, (whole, real): ([&str; W], [&str; R])) -> Result<Self, String> {
        let settings = read_settings(folder)?;
        let file = folder.join(TICKS_FILE);
        let all = read_text(&file)?;
        let damaged = |line: usize, what: &str| {
            format!(
                "{}, line {line}: {what}; the recording is damaged, so use an undamaged copy",
                file.display()
            )
        };
        let names: Vec<&str> = whole.into_iter().chain(real).collect();
        let mut lines = all.split_inclusive('\n').enumerate();
        let head = lines.next().map_or("", |(_, line)| line);
        if head.trim_end() != names.join(",") {
            return Err(damaged(1, "the columns do not fit this kind of recording"));
        }
        let mut hash = extend_hash(BASIS, head.as_bytes());
        let mut rows = Vec::new();
        while let Some((index, line)) = lines.next() {
            let number = index + 1;
            let Some(content) = line.strip_suffix('\n') else {
                // The recording was cut off here.
                break;
            };
            if content.starts_with("end,") {
                let end = parse_end(content, hash, rows.len());
                let end = end.ok_or_else(|| damaged(number, "the lines were changed"))?;
                if lines.next().is_some() {
                    return Err(damaged(number + 1, "a line follows the end"));
                }
                return Ok(Self { settings, rows, end });
            }
            hash = extend_hash(hash, line.as_bytes());
            rows.push(
                TickRow::of(content)
                    .ok_or_else(|| damaged(number, "this line is not a valid tick"))?,
            );
        }
        Ok(Self { settings, rows, end: TickEnd::CutOff })
    }
}

/// Parses the last line; `None` if its count or hash is wrong.
fn parse_end(content: &str, hash: u64, count: usize) -> Option<TickEnd> {
    let (counts, written) = content.rsplit_once(',')?;
    let mut parts = counts.strip_prefix("end,")?.split(',');
    let ticks: usize = parts.next()?.parse().ok()?;
    let lost = parts.next()?.parse().ok()?;
    let left = u64::from_str_radix(parts.next()?, 16).ok()?;
    let hash = extend_hash(hash, format!("{counts},").as_bytes());
    let is_right = ticks == count && u64::from_str_radix(written, 16).ok()? == hash;
    is_right.then_some(TickEnd::Whole { lost_ticks: lost, state_hash: left })
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: ([&str; 1], [&str; 2]) = (["tick"], ["x", "y"]);

    fn row(tick: u64, x: f64) -> TickRow<1, 2> {
        TickRow { whole: [tick], real: [x, -1.0 / x] }
    }

    fn recorded(at: &Path, values: &[f64]) -> TickCounts {
        let recorder = TickRecorder::start(at, "a = 1\n", COLUMNS).unwrap();
        for (tick, x) in values.iter().enumerate() {
            recorder.push(row(tick as u64, *x));
        }
        recorder.finish(77).unwrap()
    }

    #[test]
    fn recording_reads_back_bit_for_bit() {
        let at = tempfile::tempdir().unwrap();
        let folder = at.path().join("one");
        let values = [0.1, 1e-310, f64::MAX, -0.0, f64::INFINITY, 1.0 / 3.0];
        let counts = recorded(&folder, &values);
        assert_eq!(counts, TickCounts { ticks: 6, lost_ticks: 0 });
        let found = TickRecording::read(&folder, COLUMNS).unwrap();
        assert_eq!(found.settings, "a = 1\n");
        assert_eq!(found.end, TickEnd::Whole { lost_ticks: 0, state_hash: 77 });
        for (tick, (found, x)) in found.rows.iter().zip(values).enumerate() {
            assert_eq!(found.first_difference(&row(tick as u64, x)), None);
        }
        assert_eq!(row(0, 0.0).first_difference(&row(0, -0.0)), Some(1));
        // An existing recording is never overwritten.
        assert!(TickRecorder::start(&folder, "", COLUMNS).is_err());
    }

    #[test]
    fn truncated_recording_is_read_to_its_last_line_and_a_change_is_found() {
        let at = tempfile::tempdir().unwrap();
        let folder = at.path().join("one");
        recorded(&folder, &[0.1, 0.2, 0.3]);
        let file = folder.join(TICKS_FILE);
        let whole = std::fs::read_to_string(&file).unwrap();
        let head = whole.find('\n').unwrap() + 1;
        for length in head..whole.len() {
            std::fs::write(&file, &whole[..length]).unwrap();
            let found = TickRecording::<1, 2>::read(&folder, COLUMNS).unwrap();
            assert_eq!(found.end, TickEnd::CutOff, "{length}");
            let lines = whole[..length].matches('\n').count();
            assert_eq!(found.rows.len(), lines - 1, "{length}");
        }
        for (from, to) in [("0.2", "0.4"), ("end,3", "end,2"), ("end,3,0,", "end,3,1,")] {
            std::fs::write(&file, whole.replacen(from, to, 1)).unwrap();
            let reason = TickRecording::<1, 2>::read(&folder, COLUMNS).unwrap_err();
            assert!(reason.contains("line 5") && reason.contains("damaged"), "{reason}");
        }
        std::fs::write(&file, format!("{whole}3,0.4,-2.5")).unwrap();
        let reason = TickRecording::<1, 2>::read(&folder, COLUMNS).unwrap_err();
        assert!(reason.contains("line 6: a line follows"), "{reason}");
        std::fs::write(&file, whole.replacen("0.2", "x", 1)).unwrap();
        let reason = TickRecording::<1, 2>::read(&folder, COLUMNS).unwrap_err();
        assert!(reason.contains("line 3"), "{reason}");
    }

    #[test]
    fn dropped_ticks_are_counted_and_push_never_waits() {
        let (ring, rows) = sync_channel(CAPACITY);
        let at = tempfile::tempdir().unwrap();
        let file = at.path().join(TICKS_FILE);
        let lines = TickFile {
            to: BufWriter::new(File::create_new(&file).unwrap()),
            hash: BASIS,
            ticks: 0,
        };
        let (go, gone) = sync_channel::<()>(1);
        let thread = std::thread::Builder::new()
            .spawn(move || {
                let _ = gone.recv();
                write::<1, 2>(lines, &rows)
            })
            .unwrap();
        let recorder = TickRecorder { ring, dropped: Arc::default(), thread, file };
        for tick in 0..CAPACITY as u64 + 10 {
            recorder.push(row(tick, 1.0));
        }
        go.send(()).unwrap();
        let counts = recorder.finish(0).unwrap();
        let ticks = CAPACITY as u64;
        assert_eq!(counts, TickCounts { ticks, lost_ticks: 10 });
    }
}
