use super::*;
use std::path::Path;

fn recorded() -> Session {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
    Session::open(&sessions.join("ramp-hold-lab")).unwrap()
}

#[test]
fn a_session_is_drawn_in_few_points_and_keeps_its_peak() {
    let session = recorded();
    let traces = Traces::of("one", &session, TimeWindow::WHOLE);
    let peak = |forces: &mut dyn Iterator<Item = f64>| forces.fold(f64::MIN, f64::max);
    let drawn = peak(&mut traces.force_time.iter().flatten().map(|point| point[1]));
    assert_eq!(drawn, peak(&mut session.rows.iter().filter_map(|row| row.force)));
    let count: usize = traces.force_time.iter().map(Vec::len).sum();
    assert!(session.rows.len() > 50_000 && count < 2000, "{count}");
    let count: usize = traces.force_depth.iter().map(Vec::len).sum();
    assert!(count > 100 && count < 20_000, "{count}");
    for drawing in [force_time(&traces), force_depth(&traces)] {
        let svg = drawing.svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
    let svg = force_time(&traces).svg();
    assert!(svg.contains(">contact<"), "{svg}");
    // 9 N would leave a force of 2 N flat; a limit in reach is drawn.
    assert!(!svg.contains("interlock at") && traces.limit_above().contains("9.0 N"));
    let low = Traces { limit: Some(Newtons(3.0)), ..traces };
    assert!(force_time(&low).svg().contains("interlock at 3.0 N") && low.limit_above().is_empty());
}

#[test]
fn a_window_leaves_the_rest_out() {
    let session = recorded();
    let ramp = Traces::of("one", &session, TimeWindow::WHOLE).ramp.unwrap();
    let window = TimeWindow { from: ramp, until: ramp + 1.0 };
    let part = Traces::of("one", &session, window);
    assert!(part.ends[0] >= ramp && part.ends[1] <= ramp + 1.0);
    assert!(part.samples[0] > 900 && part.samples[0] < 1100, "{:?}", part.samples);
    let none = Traces::of("one", &session, TimeWindow { from: 1e9, until: 2e9 });
    assert!(none.is_empty() && force_time(&none).svg().contains("no force is known"));
}

#[test]
fn sessions_over_each_other_begin_together() {
    let session = recorded();
    let one = Traces::of("one", &session, TimeWindow::WHOLE);
    let mut later = one.clone();
    later.name = "later".into();
    for point in later.force_time.iter_mut().flatten() {
        point[0] += 100.0;
    }
    later.ramp = later.ramp.map(|ramp| ramp + 100.0);
    later.contact = None;
    let ([time, _], without_origin) = overlays(&[&one, &later], TimeAlignment::Ramp);
    assert!(without_origin.is_empty());
    let svg = time.svg();
    let lines: Vec<&str> = svg.lines().filter(|line| line.starts_with("<polyline")).collect();
    let points = |ink| {
        let ink = palpate_figures::drawing::hex(ink);
        let own = lines.iter().filter(|line| line.contains(&ink) && line.len() > 200);
        own.map(|line| line.split('"').nth(1).unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert!(!points(LIGHT.sessions[0]).is_empty());
    assert_eq!(points(LIGHT.sessions[0]), points(LIGHT.sessions[1]));
    let (_, without_origin) = overlays(&[&one, &later], TimeAlignment::Contact);
    assert_eq!(without_origin, ["later"]);
}
