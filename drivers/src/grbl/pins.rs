//! The switches on the board's pins as states of the axis.

use super::protocol::GrblStatus;
use super::settings::{GrblSettings, HomeSwitch};
use crate::rig::axis_status;
use palpate_model::rig::AxisStatus;

/// Where both ends share a pin, a switch that closes so near to one end belongs to it. In the search for home the
/// engine leaves a switch by 8 mm.
const NEAR_MM: f64 = 10.0;

#[derive(Debug, Default)]
pub struct EndSwitches {
    is_outwards: bool,
    /// Where home and the far limit were last seen closed, in pulses from the board's zero.
    home: Option<i64>,
    far: Option<i64>,
}

impl EndSwitches {
    pub fn begin_motion(&mut self, is_outwards: bool) {
        self.is_outwards = is_outwards;
    }

    /// The switches that a status shows closed, at `pulses` from the board's zero; `known` before it.
    pub fn inputs(
        &mut self,
        settings: &GrblSettings,
        status: &GrblStatus,
        known: AxisStatus,
        pulses: i64,
    ) -> AxisStatus {
        let is_limit = status.has_pin(settings.axis);
        let is_probe = status.has_pin('P');
        let (is_home, is_forward, is_reverse) = match settings.home {
            HomeSwitch::Probe => (is_probe, is_limit && !is_probe, is_limit && is_probe),
            HomeSwitch::Limit => {
                let near = NEAR_MM.min(0.5 * settings.travel.0) / settings.mm_per_pulse;
                let is_near =
                    |end: Option<i64>| end.is_some_and(|end| ((pulses - end) as f64).abs() < near);
                // A switch that bounces, or that a motion has just not reached, is not at the other end.
                let is_far = is_limit
                    && !known.has(AxisStatus::HOME)
                    && (self.is_outwards
                        || known.has(AxisStatus::FORWARD_LIMIT)
                        || is_near(self.far));
                if is_limit && !is_far {
                    self.home = Some(pulses);
                } else if is_far && !is_near(self.home) {
                    self.far = Some(pulses);
                }
                (is_limit && !is_far, is_far, false)
            }
        };
        axis_status([
            (is_home, AxisStatus::HOME),
            (is_forward, AxisStatus::FORWARD_LIMIT),
            (is_reverse, AxisStatus::REVERSE_LIMIT),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{MmPerS, MmPerS2, Position};

    fn shared() -> GrblSettings {
        GrblSettings {
            name: "slide".into(),
            axis: 'X',
            mm_per_pulse: 0.0025,
            is_reversed: false,
            travel: Position(150.0),
            speed_max: MmPerS(20.0),
            acceleration: MmPerS2(60.0),
            unseen: Position(0.3),
            home: HomeSwitch::Limit,
            is_closed_home: false,
            build_info: None,
            is_unlocking: false,
        }
    }

    /// What a way shows: for each report the place in mm and whether the pin is closed.
    fn seen(
        ends: &mut EndSwitches,
        known: &mut AxisStatus,
        way: &[(f64, bool)],
    ) -> Vec<AxisStatus> {
        let settings = shared();
        way.iter()
            .map(|(mm, is_closed)| {
                let text = format!(
                    "Jog|MPos:{mm:.3},0.000,0.000|FS:0,0{}",
                    if *is_closed { "|Pn:X" } else { "" }
                );
                let status = GrblStatus::parse(&text).expect("a status");
                let pulses = (mm / settings.mm_per_pulse).round() as i64;
                *known = ends.inputs(&settings, &status, *known, pulses);
                *known
            })
            .collect()
    }

    #[test]
    fn a_far_limit_that_bounces_never_becomes_home() {
        let (far, home, none) = (AxisStatus::FORWARD_LIMIT, AxisStatus::HOME, AxisStatus(0));
        let (mut ends, mut known) = (EndSwitches::default(), none);
        ends.begin_motion(true);
        assert_eq!(seen(&mut ends, &mut known, &[(151.0, false), (152.0, true)]), [none, far]);
        // Back from it: open for a report, closed again, then really open.
        ends.begin_motion(false);
        let way = [(152.0, true), (151.9, false), (151.8, true), (150.0, false)];
        assert_eq!(seen(&mut ends, &mut known, &way), [far, none, far, none]);
        // The other end, and back over its edge.
        let way = [(5.0, false), (0.0, true), (0.1, false), (0.0, true)];
        assert_eq!(seen(&mut ends, &mut known, &way), [none, home, none, home]);
        // Left again, over an edge that bounces: a stop at worst, and home is where it was.
        ends.begin_motion(true);
        let way = [(0.1, false), (0.2, true), (0.5, false)];
        assert_eq!(seen(&mut ends, &mut known, &way), [none, far, none]);
        ends.begin_motion(false);
        assert_eq!(seen(&mut ends, &mut known, &[(0.0, true)]), [home]);
    }

    #[test]
    fn a_pin_that_closes_after_a_motion_outwards_is_the_far_limit() {
        let (mut ends, mut known) = (EndSwitches::default(), AxisStatus(0));
        ends.begin_motion(true);
        let way = [(151.9, false), (152.0, true)];
        assert_eq!(seen(&mut ends, &mut known, &way)[1], AxisStatus::FORWARD_LIMIT);
    }
}
