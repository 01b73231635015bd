//! From a rig's name to the rig.

use crate::rig::{Rig, RigError, RigEvent};
use crate::sim::{SimRig, SimSettings};
use palpate_model::Nanos;
use palpate_model::rig::{HandAction, RawBytes, RigCommand, RigDescription};

/// Opens the rig called `name`: `sim`, or `sim:NAME` for a simulated rig that people share by name.
///
/// Two programs that open the same name get two rigs; keeping one name to one program is the
/// caller's business.
pub fn open(name: &str, settings: &SimSettings) -> Result<Box<dyn Rig>, RigError> {
    let is_sim = name == "sim"
        || name.strip_prefix("sim:").is_some_and(|own| {
            !own.is_empty()
                && !own
                    .chars()
                    .any(|c| !(c.is_alphanumeric() || " _-".contains(c)))
        });
    if is_sim {
        Ok(Box::new(SimRig::named(name, *settings)))
    } else {
        Err(RigError::Unknown {
            name: name.to_owned(),
        })
    }
}

impl<R: Rig + ?Sized> Rig for Box<R> {
    fn description(&self) -> &RigDescription {
        (**self).description()
    }

    fn send(&mut self, command: RigCommand) {
        (**self).send(command);
    }

    fn next_event(&mut self, until: Nanos) -> Option<RigEvent> {
        (**self).next_event(until)
    }

    fn is_virtual(&self) -> bool {
        (**self).is_virtual()
    }

    fn by_hand(&mut self, action: HandAction) {
        (**self).by_hand(action);
    }

    fn take_raw(&mut self) -> Vec<RawBytes> {
        (**self).take_raw()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shared_name_stands_in_the_description() {
        for name in ["sim", "sim:bench 2"] {
            let rig = open(name, &SimSettings::default()).unwrap();
            assert_eq!(rig.description().name, name);
            assert!(rig.is_virtual());
        }
    }

    #[test]
    fn other_names_are_refused_by_name() {
        for name in ["", "Sim", "sim:", "simulated", "/dev/ttyUSB0", "sim:a\nb"] {
            let Err(err) = open(name, &SimSettings::default()) else {
                panic!("'{name}' was opened");
            };
            assert!(err.to_string().contains(name));
        }
    }
}
