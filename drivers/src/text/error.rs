//! Why a device that speaks in lines cannot be used.

use crate::devices::{DeviceKind, split_lines};
use crate::galil;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DeviceError {
    #[error("the {device} does not answer; {hint}")]
    Silent { device: &'static str, hint: &'static str },
    #[error("the device is {found}, not the expected {device}; check the cables")]
    Other { device: &'static str, found: String },
    #[error(
        "the {device} has serial number {found}, but the rig file expects {expected}; check the cables, or correct the rig file"
    )]
    OtherSerial { device: &'static str, found: String, expected: String },
    /// It cannot do what is needed, or is not set up for it.
    #[error("the {device} cannot be used: {detail}")]
    Unfit { device: &'static str, detail: String },
    #[error("the link to the {device} was lost while it was opened ({detail}); check the cable")]
    Lost { device: &'static str, detail: String },
}

impl DeviceError {
    pub(crate) fn unfit(device: &'static str, detail: impl Into<String>) -> Self {
        Self::Unfit { device, detail: detail.into() }
    }

    /// Compares a serial number or a name with that of the rig file, if it has one.
    pub(crate) fn check_serial(
        device: &'static str,
        found: Option<&str>,
        expected: Option<&str>,
    ) -> Result<(), Self> {
        match expected {
            Some(expected) if found != Some(expected) => Err(Self::OtherSerial {
                device,
                found: found.unwrap_or("(not reported)").to_owned(),
                expected: expected.to_owned(),
            }),
            _ => Ok(()),
        }
    }
}

/// Longest quotation of an unexpected answer.
const QUOTE_MAX: usize = 60;

/// Names a device that answers unexpectedly, or quotes it where it is not recognised.
pub(crate) fn describe_unknown_device(text: &str) -> String {
    let known = DeviceKind::recognise_lines(&split_lines(text)).map(|(kind, _)| kind.title);
    let known = known.or_else(|| is_prompts(text).then_some(galil::KIND.title));
    known.map_or_else(
        || {
            let quote: String = text.chars().take(QUOTE_MAX).collect();
            format!("an unknown device that sends {quote:?}")
        },
        str::to_owned,
    )
}

/// Prompts of a Galil controller and nothing else.
fn is_prompts(text: &str) -> bool {
    let rest = text.trim();
    !rest.is_empty() && rest.chars().all(|c| matches!(c, ':' | '?' | '\r' | '\n'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unexpected_devices_are_recognised_by_their_lines() {
        for (text, name) in [
            ("\r\nGrbl 1.1h ['$' for help]\r\n", "Grbl"),
            ("error:8\r\n", "Grbl"),
            ("?:", "Galil"),
            ("DMC4143 Rev 1.3a\r\n:", "Galil"),
            ("4.285 N\r\n", "Mark-10 gauge"),
            ("-18.78 lbF\r\n", "Mark-10 gauge"),
            ("H,100,palpate-hx711,1,80,128,a*1234\r\n", "HX711"),
        ] {
            assert!(describe_unknown_device(text).contains(name), "{text:?}");
        }
        let other = describe_unknown_device("\0\u{fffd}hello\r\n");
        assert!(other.contains("hello") && !other.contains('\0'), "{other}");
    }
}
