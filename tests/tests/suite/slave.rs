//! What a simulated master tells of a slave, fed sample by sample with slaves of known lag and known feeling.
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_haptics::Period;
use palpate_haptics::rig::{HandPath, SimulatedHand};
use palpate_haptics::simulation::SimulationSettings;
use palpate_model::Nanos;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_runner::haptics::slave::{SlaveLeader, SlaveReport, SlaveSettings};
use palpate_runner::{LeadSource, SlaveSample};

const BODY: ModifiedKelvin = ModifiedKelvin::THESIS;

fn leader(path: HandPath) -> SlaveLeader {
    let rig = SimRig::new(SimSettings::default());
    let settings = SlaveSettings {
        master: SimulationSettings::of(BODY, Period::MILLISECOND, SimulatedHand::firm(path)),
        body: BODY,
        depth_max: Depth(20.0),
        rig: rig.description().clone(),
        is_virtual: true,
    };
    SlaveLeader::new(settings).unwrap()
}

fn felt(ms: u64, depth: f64, force: f64) -> SlaveSample {
    SlaveSample {
        at: Nanos::from_millis(ms),
        depth: Depth(depth),
        force: Newtons(force),
        sigma: Newtons(0.01),
    }
}

fn ramp(to: f64, speed: f64) -> HandPath {
    let from = 0.0;
    HandPath::RampHold { from, to, speed }
}

/// A slave that is where its master was so many milliseconds ago, and whose cell feels a share of the body.
fn late(path: HandPath, delay: usize, share: f64, ms: u64) -> SlaveReport {
    let mut leader = leader(path);
    let mut places = vec![0.0; delay];
    let mut body = KelvinState::at_rest();
    for at in 1..=ms {
        let depth: f64 = places[places.len() - delay];
        let force = body.step(&BODY, Depth(depth.max(0.0)), Seconds(1e-3));
        let place = leader.lead(&felt(at, depth, share * force.0.max(0.0)));
        places.push(place.unwrap_or(places[places.len() - 1]));
    }
    leader.report().unwrap()
}

#[test]
fn a_slave_that_is_late_by_so_much_lags_by_so_much() {
    for delay in [40, 150] {
        let summary = late(ramp(100.0, 5.0), delay, 1.0, 3000);
        let lag = summary.lag_ms.unwrap();
        // The master's place is of the sample, the slave's of one more before; places are whole pulses of 3 ms each.
        assert!((lag.median - delay as f64).abs() <= 4.0, "{delay} {summary:?}");
        assert!(lag.worst <= delay as f64 + 40.0, "{delay} {summary:?}");
        // The hand goes at 5 mm/s, its master slower: the body pushes back.
        let share = summary.lag_mm.median / (5e-3 * lag.median);
        assert!((0.75..1.0).contains(&share), "{share} {summary:?}");
        // All of the body is felt, and so there is no difference but that of the lag.
        assert!(summary.model_less_cell.worst_n < 1e-9, "{summary:?}");
        assert!(summary.handle_less_cell.worst_n > 0.01, "{summary:?}");
        assert_eq!(summary.contact_changes, 1);
    }
}

#[test]
fn a_specimen_that_is_softer_than_the_body_shows() {
    let summary = late(ramp(10.0, 5.0), 1, 0.8, 6000);
    let share = summary.cell_max_n / summary.model_max_n;
    assert!((share - 0.8).abs() < 1e-9, "{summary:?}");
    let share = summary.model_less_cell.worst_n / summary.model_max_n;
    assert!((share - 0.2).abs() < 1e-9, "{summary:?}");
}

#[test]
fn a_master_that_hears_nothing_of_its_slave_lets_go() {
    // Pressed and at rest, how far the handle goes in while its slave is silent for so long, ten times over.
    let yields = |silent: u64| {
        let mut leader = leader(ramp(30.0, 30.0));
        let mut place = 0.0;
        for at in 1..=6000 {
            place = leader.lead(&felt(at, place, 1.0)).unwrap();
        }
        let before = place;
        for one in 1..=10 {
            place = leader.lead(&felt(6000 + one * silent, place, 1.0)).unwrap();
        }
        place - before
    };
    // The tissue under the force gives way a little.
    let held = yields(150);
    let let_go = yields(900);
    assert!(held.abs() < 0.4, "{held}");
    // About 3 N at the handle, of which friction keeps 0.8, on the 0.8 N/mm of the hand.
    assert!(let_go > 3.0, "{let_go}");
}

#[test]
fn a_master_that_stands_still_leads_nobody() {
    let mut leader = leader(HandPath::Still { at: 0.0 });
    assert!(leader.lead(&felt(1, 0.0, 0.0)).is_some());
    // No time, no tick.
    assert_eq!(leader.lead(&felt(1, 0.0, 0.0)), None);
    assert!(leader.lead(&felt(2, 0.0, 0.0)).is_some());
    // A clock that goes back gives none either.
    assert_eq!(leader.lead(&felt(1, 0.0, 0.0)), None);
}
