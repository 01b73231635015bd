//! How long a search takes in the window, from the text typed to the frame that shows what was found, in a library of many
//! sessions; and what a frame of the list costs. No display is needed.
//!
//! `cargo run -p palpate-tests --example library_speed -- [SESSIONS]`
#![expect(clippy::print_stdout, reason = "a program that prints")]

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_runner::{Stopwatch, TimeScale};
use palpate_tests::flow::{TestWindow, WindowFlow};
use palpate_tests::sample_library::{read_original, write};
use std::time::Duration;

/// Times each search is made.
const TIMES: usize = 5;

/// What the heading of the list says.
fn heading(window: &TestWindow) -> Option<String> {
    let found = window.query_all_by_label_contains("found in").next()?;
    let node = found.accesskit_node();
    node.value().or_else(|| node.label()).map(|text| text.to_owned())
}

/// Draws until the heading tells of so many sessions; tells the time since `watch` began in ms, and the heading.
fn until(flow: &mut WindowFlow, count: &str, watch: &Stopwatch) -> (f64, String) {
    loop {
        flow.window.step();
        if let Some(text) = heading(&flow.window).filter(|text| text.starts_with(count)) {
            return (watch.seconds() * 1e3, text);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count = std::env::args().nth(1);
    let count: usize = count.map_or(Ok(10_000), |text| text.parse())?;
    let folder = tempfile::tempdir()?;
    let (original, watch) = (read_original(), Stopwatch::start());
    for number in 0..count {
        write(folder.path(), &original, number);
    }
    println!("{count} sessions written: {:.1} s", watch.seconds());
    let mut flow = WindowFlow::open_in(folder, TimeScale::Max);
    let watch = Stopwatch::start();
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num4);
    let all = format!("{count} sessions");
    let (ms, _) = until(&mut flow, &all, &watch);
    println!("opened, all of them read for the first time: {:.2} s", ms / 1e3);
    let with = |is_so: &dyn Fn(usize) -> bool| (0..count).filter(|&number| is_so(number)).count();
    for (line, found) in [
        ("pig fund ada", with(&|number| number % 4 == 0)),
        ("depth>=28mm", with(&|number| number % 30 >= 28)),
        (
            "stomach grace depth>=10mm specimen.thickness_mm<8",
            with(&|number| number % 4 == 1 && number % 30 >= 10 && number % 100 < 30),
        ),
        ("20260101T000000Z 00000007", with(&|number| number == 7)),
    ] {
        let mut times = Vec::new();
        for _ in 0..TIMES {
            let watch = Stopwatch::start();
            flow.type_into("find", line);
            times.push(until(&mut flow, &format!("{found} session"), &watch));
            let watch = Stopwatch::start();
            flow.type_into("find", "");
            until(&mut flow, &all, &watch);
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (median, most) = (&times[TIMES / 2], times[TIMES - 1].0);
        println!(
            "'{line}': shown {:.0} ms after it was typed, {most:.0} at most; \"{}\"",
            median.0, median.1
        );
    }
    let mut frames = Vec::new();
    for _ in 0..200 {
        flow.window.key_press(Key::PageDown);
        let watch = Stopwatch::start();
        flow.window.step();
        frames.push(watch.seconds() * 1e3);
    }
    frames.sort_by(f64::total_cmp);
    println!(
        "a frame while paging through the list, laid out: {:.1} ms median, {:.1} ms at most",
        frames[frames.len() / 2],
        frames[frames.len() - 1]
    );
    Ok(())
}
