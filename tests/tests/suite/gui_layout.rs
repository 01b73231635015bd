//! Every screen at several sizes: no word and no control reaches over the edge of its panel.
//!
//! Larger text is a smaller window in points: text at 1.5 on 1920 x 1080 pixels is laid out as on 1280 x 720.

use eframe::egui::accesskit::Role;
use eframe::egui::{Modifiers, Rect, Vec2, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_runner::TimeScale;
use palpate_tests::flow::{TestWindow, WindowFlow};
use palpate_window::screens::table::screens;
use palpate_window::shell::rail;
use palpate_window::shell::sizes::{PanelEdge, Sizes};

/// In points: frames of neighbours may touch.
const SEEN: f32 = 2.0;

/// A tablet upright, a small screen, larger text, and what laboratories have.
const SIZES: [[u16; 2]; 7] =
    [[800, 1280], [1024, 768], [1180, 640], [1280, 720], [1440, 900], [1920, 1080], [3840, 2160]];

/// Columns of the library's list.
const COLUMNS: [&str; 2] = ["health", "folder"];

/// From this width on, panels stand on both sides of the middle.
const BOTH_SIDES: f32 = 1180.0;

/// Where the state at the top ends and the events at the bottom begin.
const TOP: f32 = 66.0;
const BOTTOM: f32 = 50.0;

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

#[test]
fn no_word_and_no_control_reaches_over_the_edge_of_its_panel() {
    let mut faults = Vec::new();
    for [width, height] in SIZES {
        let size = vec2(f32::from(width), f32::from(height));
        let mut flow = WindowFlow::open(TimeScale::Max);
        flow.window.set_size(size);
        // With results, where that is narrow.
        if width < 1300 {
            for (name, text) in [("speed", "3"), ("depth", "6"), ("hold", "1")] {
                flow.type_into(name, text);
            }
            flow.click("Start  F5");
            flow.wait("the end of the run and its checks", |window| {
                window.query_by_label("Accept").is_some()
            });
        }
        for screen in screens() {
            let Some(key) = screen.key else { continue };
            flow.window.key_press_modifiers(Modifiers::COMMAND, key);
            flow.window.run_steps(6);
            let edges = edges(screen.name, size);
            for (name, rect) in drawn(&flow.window) {
                // The columns of the library's list, which scrolls sideways.
                let is_scrolled = name.starts_with("sort by ") || rect.left() >= size.x;
                let is_scrolled = is_scrolled || COLUMNS.contains(&name.as_str());
                let is_between = rect.top() >= TOP && rect.bottom() <= size.y - BOTTOM;
                let own = edges.iter().find(|edge| **edge > rect.left());
                if !is_scrolled && is_between && own.is_none_or(|edge| rect.right() > edge + SEEN) {
                    faults.push(format!("{width} x {height}, {}: '{name}' {rect:?}", screen.name));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}
