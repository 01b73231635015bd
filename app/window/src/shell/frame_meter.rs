//! Measures frames, start-up and how a run kept pace for those who ask with `PALPATE_FRAME_REPORT=path`.

use palpate_runner::RunView;
use serde::Serialize;
use std::path::PathBuf;

/// Frames kept for the median; at 30 a second an hour fits. Later frames still count and still
/// set the maximum.
const FRAMES_KEPT: usize = 108_000;

/// CPU time and frame times of one window.
#[derive(Debug, Default)]
pub struct FrameMeter {
    report_path: Option<PathBuf>,
    frame_started_cpu_s: Option<f64>,
    frames: u64,
    ui_cpu_ms: Times,
    frame_cpu_ms: Times,
    frame_ms: Times,
    run: RunTimes,
}

/// The part of the report that is written as it is measured.
#[derive(Clone, Debug, Default, Serialize)]
struct RunTimes {
    /// CPU seconds of all threads, graphics driver included, until the first frame was painted.
    first_frame_cpu_s: Option<f64>,
    /// CPU seconds of the window's own thread until then.
    first_frame_main_thread_cpu_s: Option<f64>,
    /// The most of a run's session time that was not in its log at a frame.
    unsaved_s_max: f64,
    /// The furthest that the last run was behind the wall clock, and how much it gave up.
    late_worst_s: Option<f64>,
    late_given_up_s: Option<f64>,
}

#[derive(Serialize)]
struct FrameReport {
    frames: u64,
    /// Wall time of whole frames as eframe gives it: logic, layout, tessellation and painting
    /// without the wait for the screen.
    frame_ms_max: f64,
    frame_ms_median: f64,
    /// CPU time of the window's thread from frame to frame: logic, layout, tessellation, and the
    /// submission to the graphics driver.
    frame_cpu_ms_max: f64,
    frame_cpu_ms_median: f64,
    /// CPU time of logic and layout alone.
    ui_cpu_ms_max: f64,
    ui_cpu_ms_median: f64,
    /// 99 of 100 frames took less.
    ui_cpu_ms_percentile_99: f64,
    #[serde(flatten)]
    run: RunTimes,
}

/// Milliseconds of many frames.
#[derive(Debug, Default)]
struct Times {
    kept: Vec<f64>,
    max: f64,
}

impl Times {
    fn push(&mut self, ms: f64) {
        self.max = self.max.max(ms);
        if self.kept.len() < FRAMES_KEPT {
            self.kept.push(ms);
        }
    }

    fn median(&self) -> f64 {
        self.below(0.5)
    }

    /// The time that a share of the frames took less than.
    fn below(&self, share: f64) -> f64 {
        let mut sorted = self.kept.clone();
        sorted.sort_by(f64::total_cmp);
        let place = (share * sorted.len() as f64) as usize;
        sorted.get(place).or(sorted.last()).copied().unwrap_or(0.0)
    }
}

impl FrameMeter {
    /// A meter that reports at the end if `PALPATE_FRAME_REPORT` names a file.
    #[must_use]
    pub fn from_environment() -> Self {
        Self {
            report_path: std::env::var_os("PALPATE_FRAME_REPORT").map(PathBuf::from),
            ..Self::default()
        }
    }

    /// A frame begins; `last_frame_secs` is what eframe measured for the one before.
    pub fn begin(&mut self, last_frame_secs: Option<f32>) {
        if self.report_path.is_none() {
            return;
        }
        let now = thread_cpu_s();
        if self.frames == 1 {
            self.run.first_frame_cpu_s = cpu_s(Clock::Process);
            self.run.first_frame_main_thread_cpu_s = now;
        }
        // The first frame compiles shaders and lays out fonts: it counts towards the start.
        if self.frames > 1 {
            if let Some(secs) = last_frame_secs {
                self.frame_ms.push(f64::from(secs) * 1e3);
            }
            if let (Some(started), Some(now)) = (self.frame_started_cpu_s, now) {
                self.frame_cpu_ms.push((now - started) * 1e3);
            }
        }
        self.frame_started_cpu_s = now;
    }

    /// The run that the frame shows.
    pub fn run(&mut self, run: &RunView) {
        if self.report_path.is_none() {
            return;
        }
        let unsaved = run.now.since(run.saved_through).seconds().0;
        self.run.unsaved_s_max = self.run.unsaved_s_max.max(unsaved);
        self.run.late_worst_s = run.lateness.map(|late| late.worst.0);
        self.run.late_given_up_s = run.lateness.map(|late| late.given_up.0);
    }

    /// The frame's logic and layout are done.
    pub fn end(&mut self) {
        self.frames += 1;
        if let (Some(started), Some(now)) = (self.frame_started_cpu_s, thread_cpu_s())
            && self.frames > 1
        {
            self.ui_cpu_ms.push((now - started) * 1e3);
        }
    }

    /// Writes the report, if one was asked for. A report that cannot be written is no reason to
    /// keep a window open, so the failure is only returned.
    pub fn write_report(&self) -> std::io::Result<()> {
        let Some(path) = &self.report_path else {
            return Ok(());
        };
        let report = FrameReport {
            frames: self.frames,
            frame_ms_max: self.frame_ms.max,
            frame_ms_median: self.frame_ms.median(),
            frame_cpu_ms_max: self.frame_cpu_ms.max,
            frame_cpu_ms_median: self.frame_cpu_ms.median(),
            ui_cpu_ms_max: self.ui_cpu_ms.max,
            ui_cpu_ms_median: self.ui_cpu_ms.median(),
            ui_cpu_ms_percentile_99: self.ui_cpu_ms.below(0.99),
            run: self.run.clone(),
        };
        let text = serde_json::to_string_pretty(&report).map_err(std::io::Error::other)?;
        palpate_sessions::atomic::replace(path, text.as_bytes())
    }
}

#[derive(Clone, Copy)]
enum Clock {
    Process,
    Thread,
}

/// CPU seconds the calling thread has used; `None` where the system does not tell.
#[must_use]
pub fn thread_cpu_s() -> Option<f64> {
    cpu_s(Clock::Thread)
}

/// CPU seconds used so far (`clock_gettime`, POSIX.1-2008).
#[cfg(unix)]
fn cpu_s(clock: Clock) -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match clock {
        Clock::Process => ClockId::ProcessCPUTime,
        Clock::Thread => ClockId::ThreadCPUTime,
    });
    Some(time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9)
}

#[cfg(not(unix))]
fn cpu_s(_clock: Clock) -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_holds_what_was_measured() {
        let folder = std::env::temp_dir().join(format!("palpate-meter-{}", std::process::id()));
        let mut meter = FrameMeter { report_path: Some(folder.clone()), ..FrameMeter::default() };
        for last in [None, Some(0.5), Some(0.004), Some(0.002), Some(0.003)] {
            meter.begin(last);
            meter.end();
        }
        meter.write_report().unwrap();
        let text = std::fs::read_to_string(&folder).unwrap();
        std::fs::remove_file(&folder).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(report["frames"], 5);
        // The first frame's half second belongs to the start.
        assert!((report["frame_ms_max"].as_f64().unwrap() - 4.0).abs() < 1e-3);
        assert!((report["frame_ms_median"].as_f64().unwrap() - 3.0).abs() < 1e-3);
        assert!(report["ui_cpu_ms_median"].as_f64().unwrap() >= 0.0);
    }

    #[test]
    fn shares_of_frames_are_counted_from_the_fastest() {
        let mut times = Times::default();
        assert_eq!(times.below(0.99), 0.0);
        (1..=100).rev().for_each(|ms| times.push(f64::from(ms)));
        assert_eq!((times.median(), times.below(0.99), times.max), (51.0, 100.0, 100.0));
    }

    #[test]
    fn nothing_is_written_unasked() {
        assert!(FrameMeter::default().write_report().is_ok());
    }
}
