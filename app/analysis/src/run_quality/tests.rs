//! Each check by a recorded session that was sound, and what is done to it.

use super::force::DROP_SECS;
use super::*;
use palpate_rheology::fit::FitOptions;

fn recorded() -> Session {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
    Session::open(&sessions.join("ramp-hold-lab")).unwrap()
}

fn assess(session: &Session, usual_noise: Option<Volts>) -> Assessment {
    let source = source::of_session(session.clone(), RecordStretch::RampHold, &[]).unwrap();
    let fitted = SourceFit::of(source, &FitOptions::default());
    of_session(session, Some(&fitted), usual_noise).unwrap()
}

fn check(quality: &Assessment, name: &str) -> QualityCheck {
    let found = quality.checks.iter().find(|one| one.name == name);
    found.unwrap_or_else(|| panic!("{name}: {quality:?}")).clone()
}

/// What becomes of one check by a change of the session: it is good before and has this rank after.
fn becomes(name: &str, wanted: QualityRank, change: impl FnOnce(&mut Session)) -> QualityCheck {
    let mut session = recorded();
    let usual = Some(Volts(0.001));
    assert_eq!(check(&assess(&session, usual), name).rank, QualityRank::Good);
    change(&mut session);
    let found = assess(&session, usual);
    let one = check(&found, name);
    assert_eq!(one.rank, wanted, "{one:?}");
    assert!(found.rank() >= wanted && !found.doubts().is_empty());
    println!("{}", one.sentence);
    one
}

fn is_in(phase: Phase) -> impl Fn(&&mut SampleRow) -> bool {
    move |row| row.phase == phase
}

fn deepest(session: &Session) -> f64 {
    session.rows.iter().filter_map(|row| row.depth).fold(0.0, f64::max)
}

#[test]
fn a_sound_run_is_good_in_every_respect() {
    let quality = assess(&recorded(), Some(Volts(0.001)));
    println!("{}", quality.text());
    assert_eq!(quality.rank(), QualityRank::Good, "{quality:?}");
    assert_eq!(quality.checks.len(), 9);
    // Without a daily check the noise has nothing to be judged by.
    let alone = assess(&recorded(), None);
    assert_eq!(check(&alone, "noise").rank, QualityRank::NotJudged);
    assert_eq!(alone.rank(), QualityRank::Good);
}

#[test]
fn a_slip_is_found_where_it_is() {
    for phase in [Phase::Ramp, Phase::Hold] {
        let mut at = 0.0;
        let found = becomes("force drop", QualityRank::Bad, |session| {
            let deepest = deepest(session);
            let pressed = session.rows.iter_mut().filter(is_in(phase));
            let deep = pressed.filter(|row| row.depth.is_some_and(|depth| depth > 0.8 * deepest));
            let mut later: Vec<_> = deep.skip(400).collect();
            at = later[0].host.seconds().0;
            later.iter_mut().for_each(|row| row.force = row.force.map(|force| 0.9 * force));
        });
        let [from, to] = found.at_s.unwrap();
        assert!(from < at + DROP_SECS && at < to + DROP_SECS, "{from} {to} {at}");
    }
}

#[test]
fn a_base_under_the_tissue_is_found_by_its_stiffness() {
    let found = becomes("base", QualityRank::Doubtful, |session| {
        let base = 0.975 * deepest(session);
        for row in session.rows.iter_mut().filter(is_in(Phase::Ramp)) {
            let into_base = row.depth.map_or(0.0, |depth| (depth - base).max(0.0));
            row.force = row.force.map(|force| force + 5.0 * into_base);
        }
    });
    assert!(found.at_s.is_some_and(|[from, to]| to > from));
}

#[test]
fn a_known_thickness_bounds_the_depth() {
    let samples = source::fit_samples(&recorded(), RecordStretch::RampHold).unwrap();
    let deepest = deepest(&recorded());
    let rank = |share| base(&samples, 0.0, Some(deepest / share)).rank;
    assert_eq!(
        [0.5, 0.95, 1.01].map(rank),
        [QualityRank::Good, QualityRank::Doubtful, QualityRank::Bad]
    );
}

#[test]
fn what_went_wrong_has_its_own_check() {
    becomes("ending", QualityRank::Bad, |session| session.end = None);
    becomes("saturation", QualityRank::Bad, |session| {
        let most = session.manifest.rig.as_ref().unwrap().adc.unwrap().counts_max;
        let hold = session.rows.iter_mut().filter(is_in(Phase::Hold));
        hold.step_by(3).for_each(|row| row.counts = Some(most));
    });
    becomes("samples", QualityRank::Doubtful, |session| {
        let hold = session.rows.iter().position(|row| row.phase == Phase::Hold).unwrap();
        for entry in &mut session.entries {
            entry.after_sample -= 3 * u64::from(entry.after_sample > hold as u64 + 503);
        }
        session.rows.drain(hold + 500..hold + 503);
    });
    becomes("contact", QualityRank::Doubtful, |session| {
        let search = session.rows.iter_mut().filter(is_in(Phase::Contact));
        search.skip(5000).take(3).for_each(|row| row.force = Some(0.8));
    });
    becomes("drift", QualityRank::Doubtful, |session| {
        let slope = source::curve_of(session).unwrap().sensitivity_at(Newtons(0.0));
        let retract = session.rows.iter().rposition(|row| row.phase == Phase::Hold).unwrap();
        // 0.05 N of the 1.8 N of this run.
        for row in &mut session.rows[retract..] {
            row.volts = row.volts.map(|volts| volts + 0.05 * slope);
        }
    });
    let quiet = assess(&recorded(), Some(Volts(1e-4)));
    assert_eq!(check(&quiet, "noise").rank, QualityRank::Doubtful);
}

#[test]
fn fast_relaxation_after_a_ramp_is_no_slip() {
    // Half of 6 N relaxes with 0.1 s from the end of a ramp of 2 s: 1 N within 40 ms.
    let sample = |k: u32| {
        let t = 1e-3 * f64::from(k);
        let force = if t < 2.0 { 3.0 * t } else { 3.0 + 3.0 * (-(t - 2.0) / 0.1).exp() };
        FitSample {
            t: palpate_model::units::Seconds(t),
            depth: palpate_model::units::Depth(t.min(2.0)),
            force: Newtons(force),
            sigma: Newtons(1e-3),
        }
    };
    let samples: Vec<FitSample> = (0..5000).map(sample).collect();
    let found = force_drop(&samples, 0.0);
    assert_eq!(found.rank, QualityRank::Good, "{found:?}");
}
