//! The steps there are. A line here and a `mod` line in the folder's head make a file of a step known to the engine,
//! the language, the preview and the fidelity.

use super::{Executable, HasFacts, RunningStep, StepFacts, StepKind};
use crate::engine::Context;
use serde::{Deserialize, Serialize};

macro_rules! steps {
    ($($module:ident::$name:ident)*) => {
        $(pub use super::$module::*;)*

        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "step", rename_all = "kebab-case")]
        pub enum Step { $($name($name)),* }

        $(impl HasFacts for $name {
            fn facts(&self) -> &'static StepFacts { &super::$module::FACTS }
        })*

        $(impl From<$name> for Step {
            fn from(step: $name) -> Self { Self::$name(step) }
        })*

        /// A step in progress, holding only its own data.
        #[derive(Clone, Debug, PartialEq)]
        pub(crate) enum ActiveStep { $($name(<$name as Executable>::Run)),* }

        pub(crate) const KINDS: &[&StepFacts] = &[$(&super::$module::FACTS),*];

        impl Step {
            pub(crate) fn kind(&self) -> &dyn StepKind {
                match self { $(Self::$name(step) => step),* }
            }

            pub(crate) fn is_done_already(&self, cx: &Context<'_>) -> bool {
                match self { $(Self::$name(step) => step.is_done_already(cx)),* }
            }

            pub(crate) fn begin(&self, cx: &mut Context<'_>) -> Result<ActiveStep, String> {
                Ok(match self { $(Self::$name(step) => ActiveStep::$name(step.begin(cx)?)),* })
            }
        }

        impl ActiveStep {
            pub(crate) fn in_progress(&mut self) -> &mut dyn RunningStep {
                match self { $(Self::$name(run) => run),* }
            }
        }
    };
}

// In the order in which a run uses them, which is that of the reference.
steps! {
    self_test::SelfTest
    home::Home
    tare::Tare
    find_contact::FindContact
    find_base::FindBase
    ramp::Ramp
    load_to::LoadTo
    hold::Hold
    hold_force::HoldForce
    sine::Sine
    follow::Follow
    unload::Unload
    retract::Retract
    rest::Rest
    wait_until::WaitUntil
    prompt::Prompt
    weigh::Weigh
    check_home::CheckHome
    jog::Jog
}
