//! Every screen at several sizes: no word and no control reaches over the edge of its panel, or over another.
//!
//! Larger text is a smaller window in points: text at 1.5 on 1920 x 1080 pixels is laid out as on 1280 x 720.

use eframe::egui::accesskit::Role;
use eframe::egui::{Rect, Vec2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_runner::TimeScale;
use palpate_tests::flow::{TestWindow, WindowFlow, screen_of};
use palpate_window::screens::material::MaterialScreen;
use palpate_window::screens::table::screens;
use palpate_window::shell::rail;
use palpate_window::shell::sizes::{PanelEdge, Sizes};

/// In points: frames of neighbours may touch.
const SEEN: f32 = 2.0;

/// A tablet upright, a small screen, larger text, and what laboratories have.
const SIZES: [[u16; 2]; 8] = [
    [768, 600],
    [800, 1280],
    [1024, 768],
    [1180, 640],
    [1280, 720],
    [1440, 900],
    [1920, 1080],
    [3840, 2160],
];

/// Columns of the library's list.
const COLUMNS: [&str; 2] = ["health", "folder"];

/// From this width on, panels stand on both sides of the middle.
const BOTH_SIDES: f32 = 1180.0;

/// Where the state at the top ends and the events at the bottom begin.
const TOP: f32 = 66.0;
const BOTTOM: f32 = 50.0;
/// Where the controls of a run end at the latest.
const STRIP: f32 = 150.0;

/// Screens without a panel on the right.
const WITHOUT_RIGHT: [&str; 1] = ["Rig"];

/// Words and controls that are drawn, with their places.
fn drawn(window: &TestWindow) -> Vec<(String, Rect)> {
    let roles = [
        Role::Label,
        Role::Button,
        Role::CheckBox,
        Role::RadioButton,
        Role::TextInput,
        Role::ComboBox,
    ];
    let nodes = window.query_all_by(|node| roles.contains(&node.role()));
    let nodes = nodes.map(|node| {
        let own = node.accesskit_node();
        (own.label().or_else(|| own.value()).unwrap_or_default(), node.rect())
    });
    nodes.collect()
}

/// The right edges of rail, left panel, middle and right panel.
fn edges(screen: &str, size: Vec2) -> Vec<f32> {
    let sizes = Sizes::default();
    let rail = rail::width(size.x);
    let left = rail + sizes.get(PanelEdge::Left);
    let mut edges = vec![rail, left];
    if !WITHOUT_RIGHT.contains(&screen) && size.x >= BOTH_SIDES {
        edges.push(size.x - sizes.get(PanelEdge::Right));
    }
    edges.push(size.x);
    edges
}

/// What is drawn between the state at the top and the events at the bottom, without the columns of the library's list, which
/// scrolls sideways.
fn shown(window: &TestWindow, size: Vec2) -> Vec<(String, Rect)> {
    let mut all = drawn(window);
    all.retain(|(name, rect)| {
        let is_scrolled = name.starts_with("sort by ") || COLUMNS.contains(&name.as_str());
        let is_between = rect.top() >= TOP && rect.bottom() <= size.y - BOTTOM;
        is_between && !is_scrolled && rect.left() < size.x
    });
    all
}

/// Words and controls that reach over the edge of their panel.
fn over_edges(all: &[(String, Rect)], edges: &[f32]) -> Vec<String> {
    let is_over = |rect: &Rect| {
        let own = edges.iter().find(|edge| **edge > rect.left());
        own.is_none_or(|edge| rect.right() > edge + SEEN)
    };
    let over = all.iter().filter(|(_, rect)| is_over(rect));
    over.map(|(name, rect)| format!("'{name}' {rect:?}")).collect()
}

/// Words and controls that cover each other.
fn overlaps(all: &[(String, Rect)]) -> Vec<String> {
    let mut found = Vec::new();
    for (index, (name, rect)) in all.iter().enumerate() {
        for (other_name, other) in &all[index + 1..] {
            let common = rect.intersect(*other);
            // The strip of the start stands over what scrolls behind it.
            let is_strip = [name, other_name].contains(&&"Start  F5".to_owned());
            if common.width() > SEEN && common.height() > SEEN && !is_strip {
                found.push(format!("'{name}' {rect:?} and '{other_name}' {other:?}"));
            }
        }
    }
    found
}

/// Fits the modulus of the session that was recorded, where there is one.
fn fit_modulus(flow: &mut WindowFlow) {
    let Some(session) = flow.sessions().into_iter().find(|folder| folder.join("000.mcap").exists())
    else {
        return;
    };
    flow.click("a part of the loading only");
    let session = session.display().to_string();
    for (name, text) in [
        ("session", session.as_str()),
        ("radius", "6"),
        ("thickness", "60"),
        ("Poisson", "0.5"),
        ("depth", "0.9"),
    ] {
        flow.type_into(name, text);
    }
    flow.click("Fit modulus  F6");
    flow.wait("the modulus", |window| screen_of::<MaterialScreen>(window).fitted().is_some());
    flow.window.run_steps(5);
}

#[test]
fn nothing_reaches_over_the_edge_of_its_panel_or_over_its_neighbour() {
    let mut found = Vec::new();
    for [width, height] in SIZES {
        let size = vec2(f32::from(width), f32::from(height));
        let mut flow = WindowFlow::open(TimeScale::Max);
        flow.window.set_size(size);
        // In a run and with its result, where that is narrow.
        if width < 1300 {
            for (name, text) in [("speed", "3"), ("depth", "6"), ("hold", "1")] {
                flow.type_into(name, text);
            }
            flow.click("Start  F5");
            flow.wait("the controls of the run", |window| {
                window.query_by_label("Pause  F7").is_some()
            });
            let mut strip = shown(&flow.window, size);
            strip.retain(|(_, rect)| rect.top() < STRIP);
            let words = overlaps(&strip);
            found.extend(words.iter().map(|one| format!("{size}, run in progress: {one}")));
            flow.wait("the end of the run and its checks", |window| {
                window.query_by_label("Accept").is_some()
            });
        }
        for screen in screens().filter(|screen| screen.key.is_some()) {
            flow.show(screen);
            // What comes from the disk is part of the page; it has its place a few frames after it came.
            flow.wait("what is read", |window| {
                window.query_all_by_label_contains("reading the").next().is_none()
            });
            flow.window.run_steps(5);
            if screen.name == "Material" {
                fit_modulus(&mut flow);
            }
            let all = shown(&flow.window, size);
            let mut words = over_edges(&all, &edges(screen.name, size));
            words.extend(overlaps(&all));
            found.extend(words.iter().map(|one| format!("{size}, {}: {one}", screen.name)));
        }
    }
    assert!(found.is_empty(), "{} faults:\n{}", found.len(), found.join("\n"));
}
