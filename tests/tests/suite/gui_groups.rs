//! The population of a study in the window, against the use case that it is an adapter of.
use palpate_analysis::compliance::ComplianceCorrections;
use palpate_analysis::population::{
    PopulationMethod, PopulationReport, PopulationRequest, population, study_recipe,
};
use palpate_analysis::progress::NoProgress;
use palpate_runner::TimeScale;
use palpate_tests::flow::{WindowFlow, screen_of};
use palpate_tests::recorded_study::record_study;
use palpate_window::screens::groups::{GroupsScreen, SCREEN};
use palpate_window::screens::screen::Screen;
use std::path::{Path, PathBuf};

fn expected(study: PathBuf) -> PopulationReport {
    let recipe = study_recipe(Some("series-1".into()), ComplianceCorrections::none(None)).unwrap();
    let request = PopulationRequest {
        paths: &[study],
        recipe: &recipe,
        parameters: &[],
        levels: &[],
        effects: &["animal.treatment".into()],
        method: PopulationMethod::Curves,
        is_drawn: false,
        is_influence_wanted: true,
        wanted_percent: None,
        jobs: 2,
    };
    population(&request, &NoProgress).unwrap().report
}

fn find(flow: &mut WindowFlow) {
    flow.click("Find population  F6");
    flow.wait("the population or its refusal", |window| {
        !screen_of::<GroupsScreen>(window).is_busy()
    });
    flow.window.run_steps(3);
}

#[test]
fn a_study_has_its_population_figures_and_files_in_the_window() {
    let mut flow = WindowFlow::open(TimeScale::Max);
    let study = flow.folder.path().join("study");
    record_study(&study);
    flow.show(&SCREEN);
    assert!(flow.says("choose a folder of sessions first") && flow.says("no population yet"));
    assert!(!flow.is_enabled("Find population  F6"));
    flow.type_into("sessions", &study.display().to_string());
    flow.type_into("effects", "animal.weather");
    find(&mut flow);
    assert!(flow.says("there is no entry 'animal.weather' that may be an effect"));
    flow.type_into("effects", "animal.treatment");
    find(&mut flow);
    let shown = screen_of::<GroupsScreen>(&flow.window).found().unwrap().population.report.clone();
    let expected = expected(study.clone());
    assert_eq!(shown, expected);
    for line in expected.parameter_lines() {
        for (name, words) in line.facts {
            assert!(flow.says(&name) && flow.says(&words), "{name}: {words}");
        }
    }
    assert!(expected.remarks().iter().all(|words| flow.says(words)));
    for [group, ..] in expected.influence_rows() {
        assert!(flow.says(&group), "{group}");
    }
    flow.window.check_accessibility();
    let results = flow.folder.path().join("results");
    flow.type_into("folder", &results.display().to_string());
    let write = |flow: &mut WindowFlow| {
        flow.click("Write results");
        flow.wait("the files", |window| !screen_of::<GroupsScreen>(window).is_busy());
        flow.window.run_steps(3);
    };
    write(&mut flow);
    assert!(flow.says("wrote ") && is_written(&results));
    // A second time there is such a folder already.
    write(&mut flow);
    assert!(flow.says("type a folder that does not exist yet"));
}

/// With all parameters of the family the curves are drawn too.
fn is_written(results: &Path) -> bool {
    ["population.html", "curves.svg", "effects.csv", "paragraph.txt"]
        .iter()
        .all(|name| results.join(name).is_file())
}
