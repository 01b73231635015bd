//! Measures frames and start-up for those who ask with `PALPATE_FRAME_REPORT=path`.
#![expect(
    clippy::disallowed_methods,
    reason = "measures frames, decides nothing"
)]

use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Frames kept for the median; at 30 a second an hour fits. Later frames still count and still
/// set the maximum.
const FRAMES_KEPT: usize = 108_000;

/// CPU time and frame times of one window.
#[derive(Debug, Default)]
pub struct FrameMeter {
    report_path: Option<PathBuf>,
    ui_started: Option<Instant>,
    frames: u64,
    ui_ms: Vec<f32>,
    frame_ms: Vec<f32>,
    ui_ms_max: f32,
    frame_ms_max: f32,
    first_frame_cpu_s: Option<f64>,
    first_frame_main_thread_cpu_s: Option<f64>,
}

#[derive(Serialize)]
struct Report {
    /// CPU seconds of all threads, graphics driver included, until the first frame was painted.
    first_frame_cpu_s: Option<f64>,
    /// CPU seconds of the window's own thread until then.
    first_frame_main_thread_cpu_s: Option<f64>,
    frames: u64,
    /// Whole frames as eframe times them: logic, layout, tessellation and painting without the
    /// wait for the screen.
    frame_ms_max: f32,
    frame_ms_median: f32,
    /// Logic and layout alone.
    ui_ms_max: f32,
    ui_ms_median: f32,
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
        if self.frames == 1 && self.report_path.is_some() && self.first_frame_cpu_s.is_none() {
            self.first_frame_cpu_s = process_cpu_s();
            self.first_frame_main_thread_cpu_s = main_thread_cpu_s();
        }
        if let Some(secs) = last_frame_secs {
            note(
                &mut self.frame_ms,
                &mut self.frame_ms_max,
                secs * 1e3,
                self.frames,
            );
        }
        self.ui_started = Some(Instant::now());
    }

    /// The frame's logic and layout are done.
    pub fn end(&mut self) {
        if let Some(started) = self.ui_started.take() {
            let ms = started.elapsed().as_secs_f32() * 1e3;
            note(&mut self.ui_ms, &mut self.ui_ms_max, ms, self.frames + 1);
        }
        self.frames += 1;
    }

    /// Writes the report, if one was asked for. A report that cannot be written is no reason to
    /// keep a window open, so the failure is only returned.
    pub fn write_report(&self) -> std::io::Result<()> {
        let Some(path) = &self.report_path else {
            return Ok(());
        };
        let report = Report {
            first_frame_cpu_s: self.first_frame_cpu_s,
            first_frame_main_thread_cpu_s: self.first_frame_main_thread_cpu_s,
            frames: self.frames,
            frame_ms_max: self.frame_ms_max,
            frame_ms_median: median(&self.frame_ms),
            ui_ms_max: self.ui_ms_max,
            ui_ms_median: median(&self.ui_ms),
        };
        let text = serde_json::to_string_pretty(&report).map_err(std::io::Error::other)?;
        std::fs::write(path, text)
    }
}

/// Keeps a frame time. The first frame compiles shaders and lays out fonts, so it counts towards
/// the start, not towards the run.
fn note(kept: &mut Vec<f32>, max: &mut f32, ms: f32, frame: u64) {
    if frame <= 1 {
        return;
    }
    *max = max.max(ms);
    if kept.len() < FRAMES_KEPT {
        kept.push(ms);
    }
}

fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// CPU seconds of this process, user and system, from fields 14 and 15 of `/proc/self/stat`
/// (proc(5); counted in hundredths on every Linux we support). `None` elsewhere.
fn process_cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The program's name stands in parentheses and may contain anything.
    let after_name = stat.rsplit_once(')')?.1;
    let mut fields = after_name.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / 100.0)
}

/// CPU seconds of this thread from `/proc/thread-self/schedstat`. `None` elsewhere.
fn main_thread_cpu_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanos: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanos * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_holds_what_was_measured() {
        let folder = std::env::temp_dir().join(format!("palpate-meter-{}", std::process::id()));
        let mut meter = FrameMeter {
            report_path: Some(folder.clone()),
            ..FrameMeter::default()
        };
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
        assert!(report["ui_ms_median"].as_f64().unwrap() >= 0.0);
    }

    #[test]
    fn nothing_is_written_unasked() {
        assert!(FrameMeter::default().write_report().is_ok());
    }
}
