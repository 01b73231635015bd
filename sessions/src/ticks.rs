//! Recordings of a loop, tick by tick: what it was told and what it answered, so that it can be computed again.
//!
//! A recording is a folder with two texts. `settings.toml` holds what the loop was made of, as its owner writes it. `ticks.csv`
//! has a line with the names of the columns, a line for each tick with whole numbers first, every other number in
//! the shortest decimal form that reads back to the same bits, and at its end `end,` with the count of ticks, those lost, a hash of
//! what the loop left and a hash of all lines. Without that line the recording was cut off, and is good to its last whole line.
//!
//! [`Recorder::push`] neither waits nor allocates: ticks go through a ring, and a thread writes them.

use crate::atomic;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// What the loop was made of.
pub const SETTINGS: &str = "settings.toml";
/// Its ticks.
pub const TICKS: &str = "ticks.csv";

/// Ticks for which the ring has room: eight seconds at 1 kHz, far longer than a disk is away.
const ROOM: usize = 8192;

/// How long the writing thread sleeps when there is nothing to write.
const NAP: Duration = Duration::from_millis(5);

/// A tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<const W: usize, const R: usize> {
    /// Whole numbers.
    pub whole: [u64; W],
    /// Other numbers.
    pub real: [f64; R],
}

impl<const W: usize, const R: usize> Row<W, R> {
    /// The column where this differs from another in any bit; whole numbers come first.
    pub fn differs(&self, other: &Self) -> Option<usize> {
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
            // Debug has an exponent where plain digits would be long.
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

/// What was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// Ticks written.
    pub ticks: u64,
    /// Ticks for which there was no room: after the first of them nothing can be computed again.
    pub lost: u64,
}

/// Writes ticks while a loop goes on.
#[derive(Debug)]
pub struct Recorder<const W: usize, const R: usize> {
    ring: SyncSender<Row<W, R>>,
    lost: Arc<AtomicU64>,
    thread: JoinHandle<io::Result<Lines>>,
    file: PathBuf,
}

/// A file of lines and the hash of what is in it.
#[derive(Debug)]
struct Lines {
    to: BufWriter<File>,
    hash: u64,
    ticks: u64,
}

impl Lines {
    fn put(&mut self, line: &str) -> io::Result<()> {
        self.hash = hashed(self.hash, line.as_bytes());
        self.to.write_all(line.as_bytes())
    }
}

/// FNV-1a: the basis, and one with more bytes.
const BASIS: u64 = 0xcbf2_9ce4_8422_2325;

fn hashed(hash: u64, bytes: &[u8]) -> u64 {
    let mix = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(hash, mix)
}

impl<const W: usize, const R: usize> Recorder<W, R> {
    /// Begins a recording in a new folder.
    pub fn start(
        folder: &Path,
        settings: &str,
        (whole, real): ([&str; W], [&str; R]),
    ) -> Result<Self, String> {
        let file = folder.join(TICKS);
        let told = |err: io::Error| {
            format!(
                "cannot record in {} ({err}); give a new folder that may be written",
                folder.display()
            )
        };
        std::fs::create_dir(folder).map_err(told)?;
        atomic::create(&folder.join(SETTINGS), settings.as_bytes()).map_err(told)?;
        let mut lines = Lines {
            to: BufWriter::new(File::create_new(&file).map_err(told)?),
            hash: BASIS,
            ticks: 0,
        };
        let names: Vec<&str> = whole.into_iter().chain(real).collect();
        lines.put(&(names.join(",") + "\n")).map_err(told)?;
        let (ring, rows) = sync_channel(ROOM);
        let thread = std::thread::Builder::new()
            .name("tick-writer".into())
            .spawn(move || write(lines, &rows))
            .map_err(told)?;
        Ok(Self { ring, lost: Arc::new(AtomicU64::new(0)), thread, file })
    }

    /// Hands over a tick; where there is no room it is lost, and counted.
    pub fn push(&self, row: Row<W, R>) {
        if self.ring.try_send(row).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Writes what is still to be written, and the end with a hash of what the loop left.
    pub fn finish(self, left: u64) -> Result<Recorded, String> {
        let Self { ring, lost, thread, file } = self;
        drop(ring);
        let lost = lost.load(Ordering::Relaxed);
        let written =
            thread.join().unwrap_or_else(|_| Err(io::Error::other("the writing thread failed")));
        let ended = written.and_then(|mut lines| {
            let end = format!("end,{},{lost},{left:016x},", lines.ticks);
            let hash = hashed(lines.hash, end.as_bytes());
            lines.put(&format!("{end}{hash:016x}\n"))?;
            lines.to.flush()?;
            Ok(Recorded { ticks: lines.ticks, lost })
        });
        ended.map_err(|err| {
            format!(
                "cannot write {} ({err}); look for room on the disk and record again",
                file.display()
            )
        })
    }
}

/// Writes until nobody sends any more. It looks now and then instead of waiting, so that nobody has to wake it.
fn write<const W: usize, const R: usize>(
    mut lines: Lines,
    rows: &Receiver<Row<W, R>>,
) -> io::Result<Lines> {
    let mut line = String::new();
    loop {
        match rows.try_recv() {
            Ok(row) => {
                row.line(&mut line);
                lines.put(&line)?;
                lines.ticks += 1;
            }
            Err(TryRecvError::Empty) => {
                // After a crash everything but the last moment is there.
                lines.to.flush()?;
                std::thread::sleep(NAP);
            }
            Err(TryRecvError::Disconnected) => return Ok(lines),
        }
    }
}

/// How a recording ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// As it should.
    Whole {
        /// Ticks that were lost.
        lost: u64,
        /// Hash of what the loop left.
        left: u64,
    },
    /// Without its last line.
    CutOff,
}

/// A recording as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording<const W: usize, const R: usize> {
    /// What the loop was made of.
    pub settings: String,
    /// Its ticks.
    pub rows: Vec<Row<W, R>>,
    /// How it ends.
    pub end: End,
}

/// What the loop of a recording was made of, of which its owner knows what kind it is.
pub fn read_settings(folder: &Path) -> Result<String, String> {
    text(&folder.join(SETTINGS))
}

/// Whether the ticks of a recording have these columns.
pub fn has_columns(folder: &Path, whole: &[&str], real: &[&str]) -> Result<bool, String> {
    let file = folder.join(TICKS);
    let mut head = String::new();
    let read = File::open(&file).and_then(|ticks| BufReader::new(ticks).read_line(&mut head));
    read.map_err(|err| unread(&file, &err))?;
    Ok(head.trim_end() == [whole, real].concat().join(","))
}

fn text(file: &Path) -> Result<String, String> {
    std::fs::read_to_string(file).map_err(|err| unread(file, &err))
}

fn unread(file: &Path, err: &std::io::Error) -> String {
    let called = file.display();
    format!("cannot read {called} ({err}); give the folder of a recording")
}

impl<const W: usize, const R: usize> Recording<W, R> {
    /// Reads a recording with these columns.
    pub fn read(folder: &Path, (whole, real): ([&str; W], [&str; R])) -> Result<Self, String> {
        let settings = read_settings(folder)?;
        let file = folder.join(TICKS);
        let all = text(&file)?;
        let damaged = |line: usize, what: &str| {
            format!(
                "{}, line {line}: {what}; the recording is damaged, take a copy that is not",
                file.display()
            )
        };
        let names: Vec<&str> = whole.into_iter().chain(real).collect();
        let mut lines = all.split_inclusive('\n').enumerate();
        let head = lines.next().map_or("", |(_, line)| line);
        if head.trim_end() != names.join(",") {
            return Err(damaged(1, "these are not the columns of such a recording"));
        }
        let mut hash = hashed(BASIS, head.as_bytes());
        let mut rows = Vec::new();
        while let Some((index, line)) = lines.next() {
            let number = index + 1;
            let Some(content) = line.strip_suffix('\n') else {
                // Its writer was stopped here.
                break;
            };
            if content.starts_with("end,") {
                let end = ended(content, hash, rows.len());
                let end = end.ok_or_else(|| damaged(number, "the lines are not those written"))?;
                if lines.next().is_some() {
                    return Err(damaged(number + 1, "something follows the end"));
                }
                return Ok(Self { settings, rows, end });
            }
            hash = hashed(hash, line.as_bytes());
            rows.push(Row::of(content).ok_or_else(|| damaged(number, "this is no tick"))?);
        }
        Ok(Self { settings, rows, end: End::CutOff })
    }
}

/// The last line, if its count and hash are those of what was read.
fn ended(content: &str, hash: u64, count: usize) -> Option<End> {
    let (said, written) = content.rsplit_once(',')?;
    let mut parts = said.strip_prefix("end,")?.split(',');
    let ticks: usize = parts.next()?.parse().ok()?;
    let lost = parts.next()?.parse().ok()?;
    let left = u64::from_str_radix(parts.next()?, 16).ok()?;
    let hash = hashed(hash, format!("{said},").as_bytes());
    let is_right = ticks == count && u64::from_str_radix(written, 16).ok()? == hash;
    is_right.then_some(End::Whole { lost, left })
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: ([&str; 1], [&str; 2]) = (["tick"], ["x", "y"]);

    fn row(tick: u64, x: f64) -> Row<1, 2> {
        Row { whole: [tick], real: [x, -1.0 / x] }
    }

    fn recorded(at: &Path, values: &[f64]) -> Recorded {
        let recorder = Recorder::start(at, "a = 1\n", COLUMNS).unwrap();
        for (tick, x) in values.iter().enumerate() {
            recorder.push(row(tick as u64, *x));
        }
        recorder.finish(77).unwrap()
    }

    #[test]
    fn what_is_read_has_the_bits_that_were_written() {
        let at = tempfile::tempdir().unwrap();
        let folder = at.path().join("one");
        let values = [0.1, 1e-310, f64::MAX, -0.0, f64::INFINITY, 1.0 / 3.0];
        let told = recorded(&folder, &values);
        assert_eq!(told, Recorded { ticks: 6, lost: 0 });
        let found = Recording::read(&folder, COLUMNS).unwrap();
        assert_eq!(found.settings, "a = 1\n");
        assert_eq!(found.end, End::Whole { lost: 0, left: 77 });
        for (tick, (found, x)) in found.rows.iter().zip(values).enumerate() {
            assert_eq!(found.differs(&row(tick as u64, x)), None);
        }
        assert_eq!(row(0, 0.0).differs(&row(0, -0.0)), Some(1));
        // Not over another.
        assert!(Recorder::start(&folder, "", COLUMNS).is_err());
    }

    #[test]
    fn a_recording_cut_off_anywhere_is_read_to_its_last_whole_line_and_a_change_is_found() {
        let at = tempfile::tempdir().unwrap();
        let folder = at.path().join("one");
        recorded(&folder, &[0.1, 0.2, 0.3]);
        let file = folder.join(TICKS);
        let whole = std::fs::read_to_string(&file).unwrap();
        let head = whole.find('\n').unwrap() + 1;
        for length in head..whole.len() {
            std::fs::write(&file, &whole[..length]).unwrap();
            let found = Recording::<1, 2>::read(&folder, COLUMNS).unwrap();
            assert_eq!(found.end, End::CutOff, "{length}");
            let lines = whole[..length].matches('\n').count();
            assert_eq!(found.rows.len(), lines - 1, "{length}");
        }
        for (from, to) in [("0.2", "0.4"), ("end,3", "end,2"), ("end,3,0,", "end,3,1,")] {
            std::fs::write(&file, whole.replacen(from, to, 1)).unwrap();
            let said = Recording::<1, 2>::read(&folder, COLUMNS).unwrap_err();
            assert!(said.contains("line 5") && said.contains("damaged"), "{said}");
        }
        std::fs::write(&file, format!("{whole}3,0.4,-2.5")).unwrap();
        let said = Recording::<1, 2>::read(&folder, COLUMNS).unwrap_err();
        assert!(said.contains("line 6: something follows"), "{said}");
        std::fs::write(&file, whole.replacen("0.2", "x", 1)).unwrap();
        let said = Recording::<1, 2>::read(&folder, COLUMNS).unwrap_err();
        assert!(said.contains("line 3"), "{said}");
    }

    #[test]
    fn ticks_without_room_are_counted_and_a_push_never_waits() {
        let (ring, rows) = sync_channel(ROOM);
        let at = tempfile::tempdir().unwrap();
        let file = at.path().join(TICKS);
        let lines =
            Lines { to: BufWriter::new(File::create_new(&file).unwrap()), hash: BASIS, ticks: 0 };
        let (go, gone) = sync_channel::<()>(1);
        let thread = std::thread::Builder::new()
            .spawn(move || {
                let _ = gone.recv();
                write::<1, 2>(lines, &rows)
            })
            .unwrap();
        let recorder = Recorder { ring, lost: Arc::default(), thread, file };
        for tick in 0..ROOM as u64 + 10 {
            recorder.push(row(tick, 1.0));
        }
        go.send(()).unwrap();
        let told = recorder.finish(0).unwrap();
        let ticks = ROOM as u64;
        assert_eq!(told, Recorded { ticks, lost: 10 });
    }
}
