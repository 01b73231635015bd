//! Time until a large session is drawn, and cost of a frame while it is panned and zoomed, next to plain egui_plot with the
//! same samples in the same run.
//!
//! `cargo run --release -p palpate-window --example review_frames -- [SAMPLES] [SESSIONS] [SAMPLES_EACH]`
#![expect(clippy::print_stdout, reason = "a program that prints")]

use chrono::{TimeZone, Utc};
use eframe::egui::{
    Context, Event, Id, Modifiers, MouseWheelSource, MouseWheelUnit, RawInput, Rect, TouchPhase, Ui,
};
use eframe::egui::{pos2, vec2};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints};
use palpate_model::metadata::SessionMetadata;
use palpate_model::rig::{Limits, Phase, RigDescription};
use palpate_model::{MmPerS, MmPerS2, Nanos, Position, Seconds, Volts};
use palpate_sessions::{
    EndRecord, Manifest, RECORD_VERSION, RecordingPace, SampleRow, SessionFolder, SessionWriter,
    new_session_id,
};
use palpate_window::screens::review::{ReviewScreen, View};
use palpate_window::shell::frame_meter::thread_cpu_s;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Size of the plots in a window of the usual size.
const SIZE: [f32; 2] = [1360.0, 820.0];
/// Frames that are measured of each kind.
const FRAMES: usize = 60;

type Failed = Box<dyn std::error::Error>;

/// Loops of half a second down and half a second up, the force with noise and a little softer every time.
fn row(index: u64, random: &mut u64) -> SampleRow {
    *random =
        random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let noise = (*random >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let share = (index % 20_000) as f64 / 10_000.0;
    let depth = 10.0 * if share < 1.0 { share } else { 2.0 - share };
    let softer = 0.7 + 0.3 * (-(index as f64) / 2e6).exp();
    let force = softer * 0.05 * depth * depth + 0.02 * noise;
    SampleRow {
        tick: index,
        host: Nanos(index * 50_000),
        age: None,
        counts: None,
        volts: Some(0.5 + 0.2 * force),
        pulses: Some((depth / 0.015) as i64),
        status: 0,
        force: Some(force),
        depth: Some(depth),
        phase: Phase::Ramp,
        cycle: 1 + (index / 20_000) as u32,
    }
}

fn manifest(number: u32) -> Manifest {
    let started_at =
        Utc.timestamp_nanos(1_772_720_107_000_000_000 + i64::from(number) * 1_000_000_000);
    let travel = Position(150.0);
    Manifest {
        record_version: RECORD_VERSION,
        session_id: new_session_id(started_at),
        software_version: env!("CARGO_PKG_VERSION").into(),
        engine_version: 1,
        started_at,
        operator: "none".into(),
        specimen: "none".into(),
        indenter: "none".into(),
        about: SessionMetadata::default(),
        signal: None,
        imported: None,
        rig: Some(RigDescription {
            name: "speed".into(),
            identity: "no rig".into(),
            settings: [].into(),
            mm_per_pulse: 0.015,
            travel,
            tick_nanos: 50_000,
            speed_quantum: MmPerS(0.03),
            speed_max: MmPerS(50.0),
            acceleration: MmPerS2(15.36),
            adc: None,
            noise_expected: Volts(1e-3),
            pulse_lag: Seconds(0.0),
            cell_delay: Seconds(0.0),
            ticks_per_sample: 1.0,
            unseen_max: RigDescription::UNSEEN_USUAL,
            takes_targets: false,
            sensors: Default::default(),
        }),
        limits: Some(Limits::for_travel(travel)),
        calibration: serde_json::Value::Null,
        plan: serde_json::Value::Null,
        settings: serde_json::Value::Null,
        acknowledgements: Vec::new(),
        recovered: None,
    }
}

fn record(folder: &Path, number: u32, samples: u64) -> Result<PathBuf, Failed> {
    let manifest = manifest(number);
    let path = folder.join(&manifest.session_id);
    let mut random = u64::from(number) + 1;
    let folder = SessionFolder::create(&path)?;
    let mut writer = SessionWriter::start(folder, None, &manifest, RecordingPace::Virtual)?;
    for index in 0..samples {
        writer.push_row(row(index, &mut random))?;
    }
    writer.close(EndRecord {
        outcome: "finished".into(),
        reason: "done".into(),
        samples: 0,
        entries: 0,
        raw_bytes: 0,
        ended_at: Nanos(samples * 50_000),
        time_use: Vec::new(),
    })?;
    Ok(path)
}

/// A window without a screen: the cost of a frame up to the triangles, in ms of CPU.
struct FrameBench {
    ctx: Context,
    time: f64,
}

impl FrameBench {
    fn new() -> Self {
        let ctx = Context::default();
        palpate_window::theme::apply(&ctx);
        Self { ctx, time: 0.0 }
    }

    fn frame(&mut self, events: Vec<Event>, mut draw: impl FnMut(&mut Ui)) -> f64 {
        self.time += 1.0 / 60.0;
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(SIZE[0], SIZE[1]))),
            time: Some(self.time),
            events,
            ..RawInput::default()
        };
        let before = thread_cpu_s().unwrap_or(0.0);
        let mut output = self.ctx.run_ui(input, &mut draw);
        let shapes = std::mem::take(&mut output.shapes);
        let triangles = self.ctx.tessellate(shapes, output.pixels_per_point);
        let spent = thread_cpu_s().unwrap_or(0.0) - before;
        std::hint::black_box(triangles.len());
        output.drop_without_applying_deltas();
        spent * 1e3
    }

    /// Frames of a pointer that drags or turns the wheel in the middle of the window; median and highest.
    fn frames(&mut self, has_wheel: bool, mut draw: impl FnMut(&mut Ui)) -> [f64; 2] {
        let middle = pos2(0.5 * SIZE[0], 0.35 * SIZE[1]);
        let button = |pos, pressed| Event::PointerButton {
            pos,
            button: eframe::egui::PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.frame(vec![Event::PointerMoved(middle)], &mut draw);
        if !has_wheel {
            self.frame(vec![button(middle, true)], &mut draw);
        }
        let mut spent: Vec<f64> = (0..FRAMES)
            .map(|number| {
                let event = if has_wheel {
                    Event::MouseWheel {
                        unit: MouseWheelUnit::Point,
                        delta: vec2(0.0, if number < FRAMES / 2 { 12.0 } else { -12.0 }),
                        phase: TouchPhase::Move,
                        source: MouseWheelSource::Wheel,
                        modifiers: Modifiers::NONE,
                    }
                } else {
                    Event::PointerMoved(middle + vec2(4.0 * (number as f32 + 1.0), 0.0))
                };
                self.frame(vec![event], &mut draw)
            })
            .collect();
        self.frame(vec![button(middle, false)], &mut draw);
        spent.sort_by(f64::total_cmp);
        [spent[FRAMES / 2], spent[FRAMES - 1]]
    }
}

/// The same quantities of the same samples as lines of plain egui_plot.
fn plain(ui: &mut Ui, all: &[[Vec<PlotPoint>; 3]]) {
    let height = ui.available_height() / 3.0;
    for number in 0..3 {
        let plot = Plot::new(("plain", number)).height(height);
        plot.link_axis(Id::unique("plain"), [true, false]).show(ui, |plot_ui| {
            for (session, columns) in all.iter().enumerate() {
                let points = PlotPoints::Borrowed(&columns[number]);
                plot_ui.line(Line::new("plain", points).id((session, number)));
            }
        });
    }
}

#[expect(clippy::disallowed_methods, reason = "this program measures time")]
fn case(name: &str, sessions: &[PathBuf], samples: u64) -> Result<(), Failed> {
    let mut bench = FrameBench::new();
    let mut screen = ReviewScreen::new(Err("no library".into()));
    let start = Instant::now();
    let draw = |screen: &mut ReviewScreen, ui: &mut Ui| {
        screen.fetch(&ui.ctx().clone());
        screen.draw_middle(ui);
    };
    screen.open(sessions.to_vec(), &bench.ctx);
    let (mut first, mut worst) = (None, 0.0f64);
    // The first frame lays out fonts, and belongs to the start of the window.
    bench.frame(Vec::new(), |ui| draw(&mut screen, ui));
    loop {
        worst = worst.max(bench.frame(Vec::new(), |ui| draw(&mut screen, ui)));
        if first.is_none() && screen.has_samples() {
            first = Some(start.elapsed().as_secs_f64());
        }
        if screen.is_settled() {
            break;
        }
        if start.elapsed() > Duration::from_secs(600) {
            return Err("the sessions were not read in ten minutes".into());
        }
        std::thread::sleep(Duration::from_millis(4));
    }
    println!(
        "{name}: first picture after {:.3} s, all of it after {:.2} s, dearest frame meanwhile {worst:.2} ms",
        first.unwrap_or(f64::NAN),
        start.elapsed().as_secs_f64()
    );
    println!("{:<28} {:>12} {:>12}", "ms of CPU per frame", "median", "highest");
    let print = |what: &str, [median, highest]: [f64; 2]| {
        println!("{what:<28} {median:>12.2} {highest:>12.2}");
    };
    print("moved", bench.frames(false, |ui| draw(&mut screen, ui)));
    print("zoomed", bench.frames(true, |ui| draw(&mut screen, ui)));
    screen.show(View::OverDepth);
    let start = Instant::now();
    bench.frame(Vec::new(), |ui| draw(&mut screen, ui));
    bench.frame(Vec::new(), |ui| draw(&mut screen, ui));
    while !screen.is_settled() {
        std::thread::sleep(Duration::from_millis(4));
        bench.frame(Vec::new(), |ui| draw(&mut screen, ui));
    }
    println!("loops over depth found after {:.2} s", start.elapsed().as_secs_f64());
    print("over depth, moved", bench.frames(false, |ui| draw(&mut screen, ui)));
    drop(screen);
    // Both copies at once may not fit into memory, so the same samples are made again.
    let points: Vec<[Vec<PlotPoint>; 3]> = (0..sessions.len())
        .map(|number| {
            let mut random = number as u64 + 1;
            let mut columns = [Vec::new(), Vec::new(), Vec::new()];
            for index in 0..samples {
                let row = row(index, &mut random);
                let t = index as f64 * 5e-5;
                for (column, value) in columns.iter_mut().zip([row.force, row.depth, row.volts]) {
                    column.push(PlotPoint::new(t, value.unwrap_or(f64::NAN)));
                }
            }
            columns
        })
        .collect();
    let mut bench = FrameBench::new();
    bench.frame(Vec::new(), |ui| plain(ui, &points));
    print("plain egui_plot, moved", bench.frames(false, |ui| plain(ui, &points)));
    Ok(())
}

fn main() -> Result<(), Failed> {
    let mut numbers = [10_000_000, 20, 1_000_000];
    for (number, word) in numbers.iter_mut().zip(std::env::args().skip(1)) {
        *number = word.parse()?;
    }
    let [samples, count, each] = numbers;
    let folder = tempfile::tempdir()?;
    let one = vec![record(folder.path(), 0, samples)?];
    case(&format!("one session of {samples} samples"), &one, samples)?;
    let several = (0..count as u32)
        .map(|number| record(folder.path(), 1 + number, each))
        .collect::<Result<Vec<_>, _>>()?;
    case(&format!("{count} sessions of {each} samples"), &several, each)
}
