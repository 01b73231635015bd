//! What the order of steps must keep, on any rig: the motor is on, the axis is homed, the cell is tared and the
//! surface is found before they are needed, and the probe is outside where it has to be.

use super::problem::{Problems, ProtocolProblem};
use super::procedure::PlacedStep;
use crate::steps::Preconditions;
use std::collections::BTreeSet;

pub(super) fn check(steps: &[PlacedStep], problems: &mut Problems) {
    let mut known = Preconditions::default();
    let mut warned = BTreeSet::new();
    for placed in steps {
        let step = placed.planned.step.kind();
        let name = step.facts().word;
        for need in step.needs() {
            if !known.has(*need) {
                problems.error(placed.line, format!("'{name}' {}", need.message()));
                known.assume(*need);
            }
        }
        step.pass(&mut known);
        if let Some(warning) = step.warning(&known)
            && warned.insert(placed.line)
        {
            problems.push(ProtocolProblem::warning(placed.line, warning));
        }
        let checkpoint = placed.planned.checkpoint.as_ref();
        if let Some(checkpoint) =
            checkpoint.filter(|_| known.is_inside && warned.insert(placed.line))
        {
            problems.push(ProtocolProblem::warning(
                placed.line,
                format!("the probe is in the tissue at checkpoint '{checkpoint}', and the tissue continues to relax during a pause; put the checkpoint after a retract or unload if this matters"),
            ));
        }
    }
    if let Some(last) = steps.last().filter(|_| known.is_inside) {
        problems.push(ProtocolProblem::warning(
            last.line,
            "the protocol ends with the probe in the tissue; add { do = \"retract\" } at the end unless this is intended",
        ));
    }
}
