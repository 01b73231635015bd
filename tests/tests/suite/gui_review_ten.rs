//! Ten sessions on the review screen: the list, plots side by side, sorted parameters, and undo.
use eframe::egui::accesskit::Role;
use eframe::egui::{Key, Modifiers, OutputCommand, Rect, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::group_statistics::{GroupStatistics, mean_difference};
use palpate_analysis::report::session::session_name;
use palpate_analysis::report::text;
use palpate_analysis::source::SourceSelection;
use palpate_drivers::sim::{SimRig, SimSettings, SimStiffness};
use palpate_figures::tokens::Tokens;
use palpate_model::units::Seconds;
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::{FitOptions, FitReport};
use palpate_runner::TimeScale;
use palpate_sessions::Session;
use palpate_sessions::contacts::contacts;
use palpate_test_support::wait::Deadline;
use palpate_tests::flow::{FRAME, WindowFlow};
use palpate_tests::recorded_runs::record_specimen;
use palpate_window::shell::rail;
use palpate_window::shell::sizes::{PanelEdge, Sizes};
use std::path::PathBuf;

/// Two specimens; the stiffness of each run in percent. The fifth run of the first is far from the others.
const STIFFNESS: [&str; 10] = ["100", "103", "97", "101", "131", "72", "70", "74", "71", "69"];

/// A window that shows ten sessions, read to their ends, and their folders in the order in which they were recorded.
fn ten_sessions() -> (WindowFlow, Vec<PathBuf>) {
    let folder = tempfile::tempdir().unwrap();
    let mut paths = Vec::new();
    for (index, stiffness) in STIFFNESS.into_iter().enumerate() {
        let path = folder.path().join(format!("run {index}"));
        let stiffness: SimStiffness = stiffness.parse().unwrap();
        let settings = SimSettings { seed: index as u64 + 1, stiffness, ..SimSettings::default() };
        let rig = SimRig::new(settings);
        let (calibration, specimen) = (rig.calibration(), format!("liver {}", index / 5 + 1));
        let params = RampHold { hold: Seconds(12.0), ..RampHold::default() };
        record_specimen(Box::new(rig), calibration, params, &specimen, &path);
        paths.push(path);
    }
    let mut flow = WindowFlow::open_in(folder, TimeScale::Max);
    flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Num5);
    flow.window.run_steps(3);
    for path in &paths {
        flow.type_into("session", &path.display().to_string());
        flow.click("Add to view");
    }
    wait_until_read(&mut flow, paths.len());
    (flow, paths)
}

fn wait_until_read(flow: &mut WindowFlow, count: usize) {
    flow.wait("the sessions", |window| {
        let has = |words: &str| window.query_all_by_label_contains(words).next().is_some();
        let is_read = !has("still reading") && !has("waiting to be read");
        is_read && window.query_all_by_label_contains("remove: ").count() == count
    });
    flow.window.run_steps(3);
}

/// What follows a word in the names of controls, with their places, from above.
fn named(flow: &WindowFlow, word: &str) -> Vec<(String, Rect)> {
    let nodes = flow.window.query_all_by_label_contains(word);
    let mut found: Vec<(String, Rect)> = nodes
        .filter_map(|node| {
            let own = node.accesskit_node();
            let label = own.label().or_else(|| own.value())?;
            Some((label.strip_prefix(word)?.to_owned(), node.rect()))
        })
        .collect();
    found.sort_by(|a, b| a.1.top().total_cmp(&b.1.top()));
    found
}

#[test]
fn ten_sessions_take_ten_lines_and_what_was_done_with_them_is_undone() {
    let (mut flow, paths) = ten_sessions();
    let rows = named(&flow, "remove: ");
    assert_eq!(rows.len(), 10);
    // One line below the other, all within the panel, each with its name before its button.
    let rail = rail::width(flow.window.ctx.content_rect().width());
    let left = rail..=rail + Sizes::default().get(PanelEdge::Left);
    for pair in rows.windows(2) {
        let step = pair[1].1.top() - pair[0].1.top();
        assert!((20.0..=32.0).contains(&step), "{pair:?}");
    }
    let fronts = named(&flow, "front: ");
    assert_eq!(fronts.len(), 9);
    for (name, place) in rows.iter().chain(&fronts) {
        assert!(left.contains(&place.left()) && left.contains(&place.right()), "{name} {place:?}");
    }
    // What is common is said once; the whole name is the name of the control.
    let manifest = Session::open(&paths[0]).unwrap().manifest;
    let day = manifest.started_at.format("%Y-%m-%d");
    assert!(flow.says(&format!("all 10: ramp-hold, {day}")));
    assert!(flow.says(&format!("in front: {}", session_name(&manifest))));
    flow.window.check_accessibility();
    // One comes to the front, another is removed and comes back, by button and by key.
    let order = |flow: &WindowFlow| -> Vec<String> {
        named(flow, "remove: ").into_iter().map(|(name, _)| name).collect()
    };
    let before = order(&flow);
    let [third, fifth] = [&before[2], &before[4]];
    flow.click(&format!("front: {third}"));
    assert_eq!(order(&flow)[..3], [third.clone(), before[0].clone(), before[1].clone()]);
    // To look at one is nothing that has to be undone.
    assert!(!flow.says("Undo: "));
    let moved = order(&flow);
    for by_key in [false, true] {
        flow.click(&format!("remove: {fifth}"));
        assert_eq!(order(&flow).len(), 9);
        match by_key {
            false => flow.click(&format!("Undo: remove {fifth}")),
            true => flow.window.key_press_modifiers(Modifiers::COMMAND, Key::Z),
        }
        flow.window.run_steps(3);
        wait_until_read(&mut flow, 10);
        assert_eq!(order(&flow), moved);
        assert!(!flow.says("Undo: "));
    }
    // All of them go and come back; what was added since stays.
    flow.click("Clear list");
    assert!(flow.says("no session is shown yet"));
    flow.type_into("session", &paths[7].display().to_string());
    flow.click("Add to view");
    flow.click("Undo: clear 10 sessions");
    wait_until_read(&mut flow, 10);
    assert_eq!(order(&flow), moved);
}

/// Fits all sessions shown.
fn fit_all(flow: &mut WindowFlow) {
    flow.window.key_press(Key::F6);
    flow.wait("the fits", |window| {
        let mut found = window.query_all_by_label_contains("from the profile likelihood");
        found.next().is_some()
    });
    flow.window.run_steps(3);
}

#[test]
fn sessions_side_by_side_have_one_cursor_that_reads_the_force_of_each() {
    let (mut flow, paths) = ten_sessions();
    // All ten are in sight.
    flow.window.set_size(vec2(1600.0, 1200.0));
    flow.click("contact");
    flow.click("Side by side");
    flow.window.run_steps(3);
    assert!(flow.says("liver 1") && flow.says("5 sessions"));
    // Without a pointer: cursor A at a third of what is shown.
    flow.click("Cursor A");
    flow.window.run_steps(3);
    let words = named(&flow, "cursor at ");
    let (words, _) = words.first().unwrap();
    let (t, rest) = words.split_once(" s from ").unwrap();
    assert!(rest.starts_with("contact"), "{rest}");
    let t: f64 = t.parse().unwrap();
    for path in &paths {
        let session = Session::open(path).unwrap();
        let seconds = |index: usize| {
            let ticks = session.rows[index].tick - session.rows[0].tick;
            session.manifest.time_of(ticks as i64).0
        };
        let first = contacts(&session.entries)[0].after_sample as usize;
        let at = t + seconds(first);
        // The words have three decimals, so the sample may be a neighbour. What is read is the mean of the column that has
        // it, of a power of two of samples.
        let near = (0..session.rows.len()).filter(|index| (seconds(*index) - at).abs() < 0.0025);
        let mean = |index: usize, size: usize| {
            let own = &session.rows[index / size * size..][..size];
            own.iter().filter_map(|row| row.force).sum::<f64>() / size as f64
        };
        let columns = near.flat_map(|index| (6..11).map(move |power| (index, 1 << power)));
        let forces: Vec<f64> = columns.map(|(index, size)| mean(index, size)).collect();
        let read: Vec<f64> = values_read(&flow, &session_name(&session.manifest));
        assert!(!read.is_empty() && !forces.is_empty());
        // Three decimals of a newton are read.
        let is_near = |read: &f64| forces.iter().any(|force| (force - read).abs() < 6e-4);
        assert!(read.iter().any(is_near), "{read:?} is none of {forces:?}");
    }
    // The pointer is the cursor where it is in a plot, and a click brings the session to the front.
    let third = heads(&flow)[2].clone();
    let at = third.1.center_bottom() + vec2(0.0, 30.0);
    flow.window.hover_at(at);
    flow.window.run_steps(3);
    let pointed = named(&flow, "cursor at ").remove(0).0;
    assert_ne!(&pointed, words);
    flow.window.drag_at(at);
    flow.window.drop_at(at);
    flow.window.run_steps(3);
    assert!(flow.says(&format!("in front: {}", third.0)));
    // The plots stay where they are.
    assert_eq!(heads(&flow)[2].0, third.0);
    // The view as a picture on the clipboard, drawn for paper: in the colours of the two specimens, then in those of sessions.
    copies_figure(&mut flow, 2);
    flow.click("a colour for each session");
    copies_figure(&mut flow, 10);
    // Over depth, by protocol and in one group.
    flow.click("Force over depth");
    flow.click("group by protocol");
    flow.window.run_steps(3);
    assert!(flow.says("10 sessions"));
    flow.click("group by none");
    flow.window.hover_at(at);
    flow.window.run_steps(3);
    assert!(flow.says(" mm, where each session first reaches it"));
    copies_figure(&mut flow, 10);
    flow.click("Over depth");
    copies_figure(&mut flow, 10);
    flow.window.check_accessibility();
}

/// Copies the view and finds so many inks of sessions in the picture, and no other.
fn copies_figure(flow: &mut WindowFlow, inks: usize) {
    flow.click("Copy figure");
    let mut copied = None;
    let end = Deadline::new();
    while copied.is_none() {
        assert!(!end.is_over(), "nothing is copied");
        flow.window.step();
        let commands = &flow.window.output().platform_output.commands;
        copied = commands.iter().find_map(|command| match command {
            OutputCommand::CopyImage(image) => Some(image.clone()),
            _ => None,
        });
        std::thread::sleep(FRAME);
    }
    let picture = copied.unwrap();
    assert_eq!(picture.size[0], 1920);
    let sessions = Tokens::of(false).sessions;
    let counts = sessions.map(|ink| picture.pixels.iter().filter(|pixel| **pixel == ink).count());
    for (number, count) in counts.into_iter().enumerate() {
        // More than the line of a legend: 40 px of 2 px, twice as fine. One of the inks is close to that of text.
        let is_drawn = count > 400;
        assert!(is_drawn == (number < inks) || number == 5, "{number}: {count}");
    }
}

/// Forces in N that the lines above the plots of sessions of a name say.
fn values_read(flow: &WindowFlow, name: &str) -> Vec<f64> {
    let found = named(flow, name).into_iter();
    let read = found.filter_map(|(words, _)| {
        // Sessions that began in one minute are numbered.
        let (_, force) = words.rsplit_once(": ")?;
        force.strip_suffix(" N")?.parse().ok()
    });
    read.collect()
}

/// Names and places of the lines above the plots, row by row.
fn heads(flow: &WindowFlow) -> Vec<(String, Rect)> {
    let mut found: Vec<(String, Rect)> = named(flow, "liver ")
        .into_iter()
        .filter_map(|(words, place)| {
            let (name, _) = words.rsplit_once(": ").filter(|(_, force)| force.ends_with(" N"))?;
            Some((format!("liver {name}"), place))
        })
        .collect();
    found.sort_by_key(|(_, place)| (place.top() as i32, place.left() as i32));
    found
}

#[test]
fn parameters_are_sorted_and_an_outlier_is_named() {
    let (mut flow, paths) = ten_sessions();
    // Room for groups and sessions.
    flow.window.set_size(vec2(1600.0, 1200.0));
    fit_all(&mut flow);
    flow.click("Parameters");
    flow.window.run_steps(3);
    // As the command line has them.
    let recipe = FitRecipe::new(FitOptions::default(), SourceSelection::default());
    let report = |path: &PathBuf| recipe.fit(path).unwrap().result.unwrap();
    let reports: Vec<FitReport> = paths.iter().map(report).collect();
    let cell = |report: &FitReport| text::cell(report.parameter("mu1").unwrap());
    let mut wanted: Vec<(f64, String)> =
        reports.iter().map(|one| (one.parameter("mu1").unwrap().value, cell(one))).collect();
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let head = text::parameter_head(reports[0].parameter("mu1").unwrap());
    let all_rows = |flow: &WindowFlow| -> Vec<String> {
        let rows = flow.window.query_all_by(|node| {
            node.role() == Role::ListBoxOption && node.label().is_some_and(|it| it.contains(&head))
        });
        let mut rows: Vec<(String, Rect)> =
            rows.map(|row| (row.accesskit_node().label().unwrap(), row.rect())).collect();
        rows.sort_by(|a, b| a.1.top().total_cmp(&b.1.top()));
        rows.into_iter().map(|(words, _)| words).collect()
    };
    // Groups come first, whatever the order of sessions: mean and standard deviation of each, and their difference.
    let is_of_groups = |words: &String| {
        [", mean of 5", ", SD", "difference, "].iter().any(|what| words.contains(what))
    };
    let own = |from: usize| -> Vec<f64> {
        let values = reports[from..from + 5].iter();
        values.map(|one| one.parameter("mu1").unwrap().value).collect()
    };
    let [first, second] = [0, 5].map(|from| GroupStatistics::of(&own(from)).unwrap());
    let difference = mean_difference(&first, &second).unwrap();
    let stated = [
        ("liver 1, mean of 5", first.mean),
        ("liver 1, SD", first.std_dev.unwrap()),
        ("liver 2, mean of 5", second.mean),
        ("liver 2, SD", second.std_dev.unwrap()),
        ("difference, liver 2 \u{2212} liver 1", difference.value),
        ("difference, ± 95 %", difference.half_width),
        ("difference, % of liver 1", 100.0 * difference.value / first.mean),
    ];
    for (row, (words, value)) in all_rows(&flow).iter().zip(stated) {
        let number = row.split(&format!("{head} ")).nth(1).and_then(|rest| rest.split(';').next());
        let read: f64 = number.and_then(|number| number.parse().ok()).expect(row);
        // The table has at least five decimals of this parameter, and one of percents.
        let digits = if words.contains('%') && !words.contains('±') { 0.051 } else { 1e-5 };
        assert!(row.starts_with(words) && (read - value).abs() < digits, "{row}: {words} {value}");
    }
    let sorted = |flow: &WindowFlow| -> Vec<String> {
        all_rows(flow).into_iter().filter(|words| !is_of_groups(words)).collect()
    };
    let click = format!("sort by {head}");
    // By key: the heading has the focus.
    flow.window.get_by_label(&click).focus();
    flow.window.key_press(Key::Enter);
    flow.window.run_steps(3);
    let rows = sorted(&flow);
    assert!(rows.len() > 3, "{rows:?}");
    for (row, (_, cell)) in rows.iter().zip(&wanted) {
        assert!(row.contains(cell), "{row}: {cell}");
    }
    flow.click(&click);
    for (row, (_, cell)) in sorted(&flow).iter().zip(wanted.iter().rev()) {
        assert!(row.contains(cell), "{row}: {cell}");
    }
    // The fifth run of the first specimen is far from the other four; its dot says so, and brings it to the front.
    let outlier = format!("{head} of ");
    let dots = flow.window.query_all_by_label_contains(&outlier);
    let dots: Vec<String> = dots.filter_map(|dot| dot.accesskit_node().label()).collect();
    assert_eq!(dots.len(), 10);
    let far = format!("{}, ", cell(&reports[4]));
    let dot = dots.iter().find(|words| words.contains(&far)).expect("an outlier");
    assert!(dot.contains("robust standard deviations above the median"), "{dot}");
    let name = dot.strip_prefix(&outlier).unwrap().split(": ").next().unwrap().to_owned();
    let dot = dot.clone();
    flow.window.get_by_label(&dot).click();
    flow.window.run_steps(3);
    assert!(flow.says(&format!("in front: {name}")));
    flow.window.check_accessibility();
}

/// Views beside each other, by the buttons of the tabs; the panels on both sides make room for them.
#[test]
fn two_views_are_seen_at_once_and_the_panels_fold_away() {
    let (mut flow, _) = ten_sessions();
    flow.window.set_size(vec2(1600.0, 1000.0));
    let (plots, table) = ("phases and events: ", "none of the sessions shown is fitted yet");
    let sees = |flow: &WindowFlow| [plots, table].map(|words| flow.says(words));
    assert_eq!(sees(&flow), [true, false]);
    flow.click("Parameters");
    flow.window.run_steps(3);
    assert_eq!(sees(&flow), [false, true]);
    flow.click("Over time");
    flow.click("Parameters");
    flow.click("Split off");
    flow.window.run_steps(3);
    assert_eq!(sees(&flow), [true, true]);
    flow.window.check_accessibility();
    assert!(flow.says("Time zero at") && flow.says("Session in front"));
    flow.click("Whole width");
    flow.window.run_steps(3);
    assert!(!flow.says("Time zero at") && !flow.says("Session in front"));
    assert_eq!(sees(&flow), [true, true]);
    flow.click("One view");
    flow.window.run_steps(3);
    assert_eq!(sees(&flow), [false, true], "the view that was split off");
    flow.click("Whole width");
    flow.window.run_steps(3);
    assert!(flow.says("Time zero at"));
}
