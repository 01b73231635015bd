//! Why the force is zero, or less than the model says.

use super::device::DeviceSettings;
use crate::Flags;
use crate::surface::TouchState;
use serde::Serialize;

palpate_model::named! {
    /// Why the force is zero or reduced; the first reason that applies.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum NoForceReason {
        /// Nothing does.
        None = "the force is that of the model",
        /// The stylus is above the surface.
        #[default]
        NoContact = "the stylus is above the surface",
        /// The stylus is outside the mesh.
        Outside = "the stylus is outside the tissue",
        /// The place is no number.
        NotANumber = "the device reports no position",
        /// The model has no force.
        NoModel = "the model gives no finite force for this move",
        /// The tissue follows more slowly than the stylus leaves.
        Leaving = "the stylus withdraws faster than the tissue follows, and tissue cannot pull the stylus",
        /// The force rises after start, stall or contact.
        RampingIn = "the force rises slowly after a start, a stall or a contact",
        /// The device gives all it has.
        Saturated = "the device gives its largest force, but the force of the model is larger",
        /// A guard changes the force: it changes too fast, or the loop made energy.
        Guarded = "a guard limits the force: the force would change too fast, or the loop generated energy",
        /// The force is less than the device's friction.
        BelowThreshold = "the force is less than the device's own friction, so it cannot be felt",
    }
}

impl NoForceReason {
    pub(super) fn of(
        state: TouchState,
        flags: Flags,
        is_saturated: bool,
        force: f64,
        device: &DeviceSettings,
    ) -> Self {
        let ramps = Flags::SOFT_START | Flags::STALL | Flags::CONTACT_RAMP;
        let guards = Flags::SLEW | Flags::PASSIVITY | Flags::DAMPING_LIMIT;
        match state {
            TouchState::Free => Self::NoContact,
            TouchState::Outside => Self::Outside,
            TouchState::NotANumber => Self::NotANumber,
            _ if flags.has(Flags::NO_FORCE) => Self::NoModel,
            _ if flags.has(Flags::PULL) => Self::Leaving,
            _ if flags.has_any(ramps) => Self::RampingIn,
            _ if is_saturated => Self::Saturated,
            _ if flags.has_any(guards) => Self::Guarded,
            _ if force < device.friction_n => Self::BelowThreshold,
            _ => Self::None,
        }
    }
}
