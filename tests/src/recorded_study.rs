//! A small study on the simulated rig: four animals, two of them treated, two specimens of each and two presses on each.

use crate::recorded_runs::record_labelled;
use palpate_drivers::sim::{SimRig, SimSettings, SimStiffness};
use palpate_model::metadata::SessionLabels;
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_protocols::plans::RampHold;
use std::path::Path;

/// Name, treatment and stiffness of both specimens of each animal, in percent.
pub const ANIMALS: [(&str, &str, [&str; 2]); 4] = [
    ("pig 1", "control", ["70", "77"]),
    ("pig 2", "enzyme", ["110", "121"]),
    ("pig 3", "control", ["85", "92"]),
    ("pig 4", "enzyme", ["140", "150"]),
];

/// Records all sessions into a folder.
///
/// # Panics
/// If a run is not started or says nothing for minutes.
pub fn record_study(folder: &Path) {
    let mut seed = 0;
    for (animal, treatment, stiffness) in ANIMALS {
        for (lobe, percent) in stiffness.into_iter().enumerate() {
            // The simulated rig draws other tissue for another seed.
            seed += 1;
            for repeat in 1..=2 {
                let stiffness: SimStiffness = percent.parse().expect("a percentage");
                let rig =
                    SimRig::new(SimSettings { seed, stiffness, repeat, ..SimSettings::default() });
                let calibration = rig.calibration();
                let params = RampHold {
                    speed: MmPerS(3.0),
                    depth: Depth(6.0),
                    hold: Seconds(1.0),
                    ..RampHold::default()
                };
                let specimen = format!("{animal} lobe {}", lobe + 1);
                let out = folder.join(format!("{specimen} press {repeat}"));
                let mut labels = SessionLabels { specimen, ..SessionLabels::default() };
                let about = [("animal.name", animal), ("animal.treatment", treatment)];
                for (entry, value) in about {
                    labels.set(entry, value).expect("an entry that is known");
                }
                record_labelled(Box::new(rig), calibration, params, labels, &out);
            }
        }
    }
}
