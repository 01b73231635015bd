use super::*;
use palpate_model::random::SplitMix;

fn session(name: &str, pairs: &[&str]) -> (String, Manifest) {
    let mut labels = SessionLabels::default();
    pairs.iter().for_each(|pair| labels.set_pair(pair).unwrap());
    let mut manifest = Manifest { session_id: name.into(), ..Manifest::default() };
    manifest.set_labels(labels);
    (name.to_owned(), manifest)
}

/// Two animals of two specimens of two repeats.
fn whole() -> Vec<(String, Manifest)> {
    let mut sessions = Vec::new();
    for (animal, sex) in [("a", "female"), ("b", "male")] {
        for specimen in 1..3 {
            for repeat in 1..3 {
                sessions.push(session(
                    &format!("{animal}{specimen}{repeat}"),
                    &[
                        &format!("animal.name={animal}"),
                        &format!("animal.sex={sex}"),
                        &format!("specimen={animal}-{specimen}"),
                        &format!("series.repeat={repeat}"),
                    ],
                ));
            }
        }
    }
    sessions
}

#[test]
fn a_balanced_study_has_no_problem_and_one_order_whatever_the_order_of_reading() {
    let sessions = whole();
    let table = StudyTable::of(&sessions);
    assert_eq!(table.problems, []);
    let names: Vec<&str> = table.rows.iter().map(|row| row.session.as_str()).collect();
    assert_eq!(names, ["a11", "a12", "a21", "a22", "b11", "b12", "b21", "b22"]);
    assert_eq!(table.rows[4].covariates["animal.sex"], "male");
    assert!(table.rows[4].covariates["animal.age_days"].is_null());
    let mut random = SplitMix::seeded(1);
    for _ in 0..20 {
        let mut mixed = sessions.clone();
        for last in (1..mixed.len()).rev() {
            mixed.swap(last, random.below(last + 1));
        }
        assert_eq!(StudyTable::of(&mixed), table);
    }
}

#[test]
fn contradictions_name_both_sessions() {
    let mut sessions = whole();
    sessions.push(session("c", &["animal.name=c", "specimen=a-1"]));
    sessions.push(session("d", &["animal.name=b", "specimen=b-3", "animal.sex=female"]));
    let found = StudyTable::of(&sessions).problems;
    let contradictions: Vec<String> =
        found.iter().filter(|one| one.is_contradiction()).map(ToString::to_string).collect();
    assert_eq!(contradictions.len(), 2, "{found:?}");
    assert!(
        contradictions[0]
            .starts_with("specimen 'a-1' belongs to animal 'a' in a11 and to 'c' in c;")
    );
    assert!(
        contradictions[1]
            .starts_with("animal.sex of animal 'b' is 'male' in b11 and 'female' in d;")
    );
}

#[test]
fn sessions_that_lack_what_others_have_are_named() {
    let mut sessions = whole();
    sessions.push(session("x", &["specimen=a-1", "specimen.temperature_c=21"]));
    let found = StudyTable::of(&sessions).problems;
    let lacking = |name: &str| {
        found.iter().find_map(|one| match one {
            StudyProblem::Missing { entry, sessions, of: 9 } if *entry == name => {
                Some(sessions.len())
            }
            _ => None,
        })
    };
    assert_eq!(lacking(ANIMAL), Some(1));
    assert_eq!(lacking("animal.sex"), Some(1));
    assert_eq!(lacking("specimen.temperature_c"), Some(8));
    // An entry that no session has is no level and no covariate of this study.
    assert_eq!(lacking(SITE), None);
    assert_eq!(lacking("animal.age_days"), None);
    let words =
        found.iter().map(ToString::to_string).find(|it| it.contains("temperature")).unwrap();
    assert!(words.contains("a11, a12, a21, a22, b11 and 3 more"), "{words}");
}

#[test]
fn levels_without_members_and_constant_entries_are_named() {
    let one = session("s", &["animal.name=a", "specimen=1", "animal.sex=female"]);
    let two = session("t", &["animal.name=b", "specimen=2", "animal.sex=female"]);
    let found = StudyTable::of(&[one.clone(), two]).problems;
    let expected = [
        StudyProblem::NothingNested { group: "animal", members: "specimens" },
        StudyProblem::NothingNested { group: "specimen", members: "sessions" },
        StudyProblem::Constant { entry: "animal.sex", value: "female".into() },
    ];
    assert_eq!(found, expected);
    let again = session("u", &["animal.name=a", "specimen=1", "animal.sex=female"]);
    let found = StudyTable::of(&[one, again]).problems;
    assert!(found.contains(&StudyProblem::OneAnimal { animal: "a".into() }), "{found:?}");
    let sites = ["left", "right"].map(|site| {
        session(site, &["animal.name=a", "specimen=1", &format!("specimen.site={site}")])
    });
    let found = StudyTable::of(&sites).problems;
    assert!(found.contains(&StudyProblem::NothingNested { group: "site", members: "sessions" }));
    assert!(!found.contains(&StudyProblem::NothingNested { group: "specimen", members: "sites" }));
}

#[test]
fn a_repeat_counts_once_for_each_series_and_site() {
    let pairs = |more: &'static str| {
        ["animal.name=a", "specimen=1", "series.repeat=1", more].map(str::to_owned)
    };
    let of = |names: [(&str, &'static str); 2]| {
        let sessions = names.map(|(name, more)| {
            let pairs = pairs(more);
            session(name, &pairs.each_ref().map(String::as_str))
        });
        let found = StudyTable::of(&sessions).problems;
        found.iter().any(|one| matches!(one, StudyProblem::RepeatTwice { repeat: 1, .. }))
    };
    assert!(of([("s", "operator=Ada"), ("t", "operator=Grace")]));
    assert!(!of([("s", "series.id=slow"), ("t", "series.id=fast")]));
    assert!(!of([("s", "specimen.site=left"), ("t", "specimen.site=right")]));
}
