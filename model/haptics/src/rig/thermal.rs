//! Temperature of the winding: winding and case as two bodies in series.

use serde::{Deserialize, Serialize};

/// Two thermal resistances and two time constants, as motor catalogues give them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thermal {
    /// From winding to case, in K/W.
    pub winding_case: f64,
    /// From case to air, in K/W.
    pub case_air: f64,
    /// Time constant of the winding against the case, in s.
    pub winding_s: f64,
    /// Time constant of the case against the air, in s.
    pub case_s: f64,
    /// Temperature of the air in degrees Celsius.
    pub air_c: f64,
    /// Hottest the winding may be, in degrees Celsius.
    pub winding_max_c: f64,
}

impl Thermal {
    /// The catalogue of the motor's successor (Faulhaber 3863...CR, 2012): 2.5 and 6 K/W, 50 and 900 s, 125
    /// degrees; the source's own motor has no such lines.
    pub const SUCCESSOR: Self = Self {
        winding_case: 2.5,
        case_air: 6.0,
        winding_s: 50.0,
        case_s: 900.0,
        air_c: 22.0,
        winding_max_c: 125.0,
    };
}

/// Temperatures in degrees Celsius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThermalState {
    pub winding_c: f64,
    pub case_c: f64,
}

impl Thermal {
    /// Everything as warm as the air.
    pub fn cold(&self) -> ThermalState {
        ThermalState { winding_c: self.air_c, case_c: self.air_c }
    }

    /// Temperatures after `watts` for ever.
    pub fn settled(&self, watts: f64) -> ThermalState {
        let case_c = self.air_c + watts * self.case_air;
        ThermalState { winding_c: case_c + watts * self.winding_case, case_c }
    }

    /// After `dt` s of `watts`: each node by its exact exponential with the other held, which is stable at
    /// any step and right to `dt` over the shorter time constant.
    pub fn after(&self, state: ThermalState, watts: f64, dt: f64) -> ThermalState {
        let towards = |from: f64, to: f64, tau: f64| from + (to - from) * -(-dt / tau).exp_m1();
        let winding = state.case_c + watts * self.winding_case;
        // What reaches the case is what the winding passes on.
        let passed = (state.winding_c - state.case_c) / self.winding_case;
        let case = self.air_c + passed * self.case_air;
        ThermalState {
            winding_c: towards(state.winding_c, winding, self.winding_s),
            case_c: towards(state.case_c, case, self.case_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_settles_where_resistances_say_and_on_their_time() {
        let thermal = Thermal::SUCCESSOR;
        let watts = 7.0;
        let mut state = thermal.cold();
        for _ in 0..50 {
            state = thermal.after(state, watts, 1.0);
        }
        // After one time constant of the winding; the case has warmed by a kelvin meanwhile, which keeps the winding
        // behind by 0.6 of 17.5 K.
        let share = (state.winding_c - state.case_c) / (watts * thermal.winding_case);
        assert!((share - (1.0 - (-1f64).exp())).abs() < 0.04, "{share}");
        for _ in 0..20_000 {
            state = thermal.after(state, watts, 1.0);
        }
        let settled = thermal.settled(watts);
        assert!((state.winding_c - settled.winding_c).abs() < 1e-6, "{state:?}");
    }
}
