//! The words of the language: every step with its keys. Reading, checking and the reference all use this table.

use super::args::Args;
use super::quantity::Kind;
use crate::plans::{
    FindBase, FindContact, HoldForce, HoldRate, HoldUntil, LoadTo, OnTimeout, Press, Prompt,
    Settle, Sine, Step, Weigh,
};
use palpate_model::rig::HandAction;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};

/// One key of a step.
pub(super) struct Key {
    pub name: &'static str,
    pub kind: Kind,
    pub range: Range,
    pub need: Need,
    pub about: &'static str,
}

/// Which numbers a key takes.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Range {
    Above0,
    From0,
    Any,
    /// One of these words.
    OneOf(&'static [&'static str]),
}

/// What holds without the key.
#[derive(Clone, Copy)]
pub(super) enum Need {
    Required,
    Optional,
    /// The value, as one would write it.
    Usual(&'static str),
}

/// One step.
pub(super) struct Word {
    pub name: &'static str,
    pub about: &'static str,
    pub keys: &'static [Key],
    pub build: fn(&Args) -> Result<Step, String>,
}

const fn key(name: &'static str, kind: Kind, need: Need, about: &'static str) -> Key {
    Key {
        name,
        kind,
        range: Range::Above0,
        need,
        about,
    }
}

const fn ranged(range: Range, key: Key) -> Key {
    Key { range, ..key }
}

/// Keys that every step may have, beside `do`.
pub(super) const COMMON: [Key; 3] = [
    key(
        "checkpoint",
        Kind::Text,
        Need::Optional,
        "name of a place behind the step where the run may pause",
    ),
    key(
        "on_failure",
        Kind::Text,
        Need::Usual("abort"),
        "`abort`, `skip`, or `retry 2`: what follows if the step cannot be done",
    ),
    key(
        "only_if",
        Kind::Flag,
        Need::Optional,
        "leaves the step out where this is `false` or `\"none\"`",
    ),
];

const CONTACT_KEYS: [Key; 9] = [
    key("speed", Kind::Speed, Need::Optional, "of the first pass"),
    key(
        "criterion",
        Kind::Force,
        Need::Optional,
        "force that ends the first pass",
    ),
    key(
        "retreat",
        Kind::Length,
        Need::Optional,
        "way back before the second pass",
    ),
    key(
        "pass_speed",
        Kind::Speed,
        Need::Optional,
        "of the second pass",
    ),
    key(
        "pass_force",
        Kind::Force,
        Need::Optional,
        "force that ends the second pass",
    ),
    ranged(
        Range::From0,
        key(
            "recovery",
            Kind::Time,
            Need::Optional,
            "rest after each pass",
        ),
    ),
    key(
        "std_error_max",
        Kind::Length,
        Need::Optional,
        "widest accepted standard error of the position found",
    ),
    ranged(
        Range::From0,
        key(
            "press_force",
            Kind::Force,
            Need::Optional,
            "force to which the first pass goes on to learn how the tissue answers; `0 N` ends it at the criterion",
        ),
    ),
    ranged(
        Range::From0,
        key(
            "press_dwell",
            Kind::Time,
            Need::Optional,
            "time at the end of each pass while the force relaxes",
        ),
    ),
];

const BASE_KEYS: [Key; 5] = [
    key(
        "speed",
        Kind::Speed,
        Need::Usual("0.6 mm/s"),
        "of the first touch",
    ),
    key(
        "criterion",
        Kind::Force,
        Need::Usual("0.05 N"),
        "force at which the first touch has felt the base",
    ),
    key(
        "retreat",
        Kind::Length,
        Need::Usual("0.3 mm"),
        "way back before the second touch",
    ),
    key(
        "pass_speed",
        Kind::Speed,
        Need::Usual("0.03 mm/s"),
        "of the second touch",
    ),
    key(
        "pass_force",
        Kind::Force,
        Need::Usual("0.4 N"),
        "force that ends the second touch",
    ),
];

const HOME_KEYS: [Key; 2] = [
    key("speed", Kind::Speed, Need::Usual("9 mm/s"), "of the search"),
    key(
        "touch_speed",
        Kind::Speed,
        Need::Usual("0.3 mm/s"),
        "of the second touch, which defines position zero",
    ),
];

/// Every step, in the order in which a run uses them.
pub(super) const WORDS: [Word; 17] = [
    Word {
        name: "self-test",
        about: "Check link, signal and stop, and switch the motor on. First in every protocol that moves.",
        keys: &[key(
            "for",
            Kind::Time,
            Need::Usual("0.5 s"),
            "how long the signal is watched",
        )],
        build: |args| {
            Ok(Step::SelfTest {
                duration: args.seconds("for")?,
            })
        },
    },
    Word {
        name: "home",
        about: "Find the home switch, unless the axis is homed already.",
        keys: &HOME_KEYS,
        build: |args| {
            Ok(Step::Home {
                speed: args.speed("speed")?,
                touch_speed: args.speed("touch_speed")?,
            })
        },
    },
    Word {
        name: "tare",
        about: "Average the unloaded signal. The probe touches nothing.",
        keys: &[key(
            "for",
            Kind::Time,
            Need::Usual("4 s"),
            "whole mains cycles: whole seconds; from 2 s on the drift is told too",
        )],
        build: |args| {
            Ok(Step::Tare {
                duration: args.seconds("for")?,
            })
        },
    },
    Word {
        name: "find-contact",
        about: "Find the surface of the tissue and stop there. Depths count from it.",
        keys: &CONTACT_KEYS,
        build: |args| Ok(Step::FindContact(find(args)?)),
    },
    Word {
        name: "find-base",
        about: "Find the base the specimen lay on, with the specimen taken away: its thickness.",
        keys: &BASE_KEYS,
        build: |args| {
            let mut search = FindBase::default();
            for (name, field) in [
                ("speed", &mut search.approach_speed.0),
                ("criterion", &mut search.criterion.0),
                ("retreat", &mut search.retreat_mm),
                ("pass_speed", &mut search.pass_speed.0),
                ("pass_force", &mut search.pass_force.0),
            ] {
                *field = args.maybe(name).unwrap_or(*field);
            }
            Ok(Step::FindBase(search))
        },
    },
    Word {
        name: "ramp",
        about: "Indent to a depth at constant speed.",
        keys: &[
            key("speed", Kind::Speed, Need::Required, "of the indentation"),
            key("depth", Kind::Length, Need::Required, "from contact"),
        ],
        build: |args| {
            Ok(Step::Ramp {
                speed: args.speed("speed")?,
                depth: Depth(args.number("depth")?),
            })
        },
    },
    Word {
        name: "load",
        about: "Indent at constant speed until a force is reached.",
        keys: &[
            key("to", Kind::Force, Need::Required, "force above tare"),
            key("speed", Kind::Speed, Need::Required, "of the indentation"),
            key(
                "deepest",
                Kind::Length,
                Need::Required,
                "depth at which the step is given up",
            ),
            key(
                "brake",
                Kind::Force,
                Need::Optional,
                "so much before the target the probe slows to a tenth, then to a hundredth",
            ),
        ],
        build: |args| {
            Ok(Step::LoadTo(LoadTo {
                speed: args.speed("speed")?,
                force: Newtons(args.number("to")?),
                depth_max: Depth(args.number("deepest")?),
                brake: args.maybe("brake").map(Newtons),
            }))
        },
    },
    Word {
        name: "hold",
        about: "Stay at depth while the force relaxes.",
        keys: &[
            ranged(
                Range::From0,
                key("for", Kind::Time, Need::Required, "how long, at most"),
            ),
            key(
                "until",
                Kind::Text,
                Need::Optional,
                "end it once a parameter is known so well, as `\"tau=1%\"`",
            ),
            key(
                "slope",
                Kind::ForceRate,
                Need::Optional,
                "end it once the force changes by less",
            ),
            key(
                "over",
                Kind::Time,
                Need::Optional,
                "time over which the slope is judged; goes with `slope`",
            ),
        ],
        build: hold,
    },
    Word {
        name: "hold-force",
        about: "Keep the force and let the depth creep.",
        keys: &[
            key("force", Kind::Force, Need::Required, "above tare"),
            ranged(
                Range::From0,
                key("for", Kind::Time, Need::Required, "how long"),
            ),
            key(
                "speed",
                Kind::Speed,
                Need::Usual("0.75 mm/s"),
                "of the corrections",
            ),
            key(
                "deepest",
                Kind::Length,
                Need::Required,
                "depth at which the step is given up",
            ),
        ],
        build: |args| {
            Ok(Step::HoldForce(HoldForce {
                force: Newtons(args.number("force")?),
                duration: args.seconds("for")?,
                speed: args.speed("speed")?,
                depth_max: Depth(args.number("deepest")?),
            }))
        },
    },
    Word {
        name: "sine",
        about: "Swing from where the probe stands to deeper and back, beginning and ending at rest.",
        keys: &[
            key(
                "amplitude",
                Kind::Length,
                Need::Required,
                "half of the way between the turning points",
            ),
            key("frequency", Kind::Frequency, Need::Required, "of the swing"),
            key("cycles", Kind::Count, Need::Required, "whole cycles"),
        ],
        build: |args| {
            Ok(Step::Sine(Sine {
                amplitude_mm: args.number("amplitude")?,
                frequency_hz: args.number("frequency")?,
                cycles: args.count("cycles")?,
            }))
        },
    },
    Word {
        name: "unload",
        about: "Come back to the surface at constant speed, recorded like the way in.",
        keys: &[
            key("speed", Kind::Speed, Need::Required, "of the way back"),
            ranged(
                Range::From0,
                key(
                    "clearance",
                    Kind::Length,
                    Need::Usual("0.5 mm"),
                    "distance from the surface to stop at",
                ),
            ),
        ],
        build: |args| {
            Ok(Step::Unload {
                speed: args.speed("speed")?,
                clearance_mm: args.number("clearance")?,
            })
        },
    },
    Word {
        name: "retract",
        about: "Leave the tissue.",
        keys: &[
            key(
                "speed",
                Kind::Speed,
                Need::Usual("6 mm/s"),
                "of the way out",
            ),
            ranged(
                Range::From0,
                key(
                    "clearance",
                    Kind::Length,
                    Need::Usual("10 mm"),
                    "distance from the surface to stop at",
                ),
            ),
        ],
        build: |args| {
            Ok(Step::Retract {
                speed: args.speed("speed")?,
                clearance_mm: args.number("clearance")?,
            })
        },
    },
    Word {
        name: "rest",
        about: "Stay where the probe is and let the tissue recover.",
        keys: &[ranged(
            Range::From0,
            key("for", Kind::Time, Need::Required, "how long"),
        )],
        build: |args| {
            Ok(Step::Rest {
                duration: args.seconds("for")?,
            })
        },
    },
    Word {
        name: "prompt",
        about: "Ask a person for something and wait. A simulated rig does the hand's work when the answer comes.",
        keys: &[
            key(
                "message",
                Kind::Text,
                Need::Required,
                "what to do, as one sentence",
            ),
            key(
                "timeout",
                Kind::Time,
                Need::Usual("10 min"),
                "how long the run waits",
            ),
            ranged(
                Range::OneOf(&["stop", "continue"]),
                key(
                    "on_timeout",
                    Kind::Text,
                    Need::Usual("stop"),
                    "`stop` or `continue`: what follows without an answer",
                ),
            ),
            ranged(
                Range::From0,
                key(
                    "cell_mass",
                    Kind::Mass,
                    Need::Optional,
                    "by hand: all that shall lie on the load cell, `\"0 g\"` for nothing",
                ),
            ),
            ranged(
                Range::From0,
                key(
                    "mount",
                    Kind::Count,
                    Need::Optional,
                    "by hand: the number of the specimen to clip in",
                ),
            ),
            key(
                "unmount",
                Kind::Flag,
                Need::Optional,
                "by hand: `true` takes the specimen out",
            ),
        ],
        build: prompt,
    },
    Word {
        name: "weigh",
        about: "Read the load cell under a known mass, once the signal has settled.",
        keys: &[
            ranged(
                Range::From0,
                key(
                    "mass",
                    Kind::Mass,
                    Need::Required,
                    "all of it, the platform included",
                ),
            ),
            ranged(
                Range::OneOf(&["up", "down"]),
                key(
                    "masses_go",
                    Kind::Text,
                    Need::Usual("up"),
                    "`up` or `down`: whether weights were put on or taken off",
                ),
            ),
            key(
                "pass",
                Kind::Count,
                Need::Usual("1"),
                "which pass through the masses",
            ),
            key(
                "window",
                Kind::Time,
                Need::Usual("2 s"),
                "time that must be steady, and is averaged",
            ),
            key("timeout", Kind::Time, Need::Usual("30 s"), "longest wait"),
        ],
        build: |args| {
            Ok(Step::Weigh(Weigh {
                mass_g: args.number("mass")?,
                is_loading: args.text("masses_go")? == "up",
                repeat: args.count("pass")?,
                settle: Settle {
                    window: args.seconds("window")?,
                    timeout: args.seconds("timeout")?,
                },
            }))
        },
    },
    Word {
        name: "check-home",
        about: "Touch the home switch again and tell how many pulses were missed.",
        keys: &HOME_KEYS,
        build: |args| {
            Ok(Step::CheckHome {
                speed: args.speed("speed")?,
                touch_speed: args.speed("touch_speed")?,
            })
        },
    },
    Word {
        name: "jog",
        about: "Move by a distance, positive towards the tissue. Allowed before homing.",
        keys: &[
            ranged(
                Range::Any,
                key("distance", Kind::Length, Need::Required, "signed"),
            ),
            key("speed", Kind::Speed, Need::Required, "of the move"),
        ],
        build: |args| {
            Ok(Step::Jog {
                distance_mm: args.number("distance")?,
                speed: args.speed("speed")?,
            })
        },
    },
];

fn find(args: &Args) -> Result<FindContact, String> {
    let mut search = FindContact::default();
    for (name, field) in [
        ("speed", &mut search.approach_speed.0),
        ("criterion", &mut search.criterion.0),
        ("retreat", &mut search.retreat_mm),
        ("pass_speed", &mut search.pass_speed.0),
        ("pass_force", &mut search.pass_force.0),
        ("recovery", &mut search.recovery.0),
        ("std_error_max", &mut search.std_error_mm_max),
    ] {
        *field = args.maybe(name).unwrap_or(*field);
    }
    let usual = Press::default();
    let force = args.maybe("press_force").unwrap_or(usual.force.0);
    let dwell = args.maybe("press_dwell").unwrap_or(usual.dwell.0);
    search.press = (force > 0.0).then_some(Press {
        force: Newtons(force),
        dwell: Seconds(dwell),
    });
    Ok(search)
}

fn hold(args: &Args) -> Result<Step, String> {
    let until = args.maybe_text("until").map(HoldUntil::parse).transpose()?;
    let rate =
        match (args.maybe("slope"), args.maybe("over")) {
            (Some(below_n_per_s), Some(over)) => Some(HoldRate {
                below_n_per_s,
                over: Seconds(over),
            }),
            (None, None) => None,
            _ => return Err(
                "'slope' and 'over' go together: how little the force changes, and over how long"
                    .into(),
            ),
        };
    rate.map_or(Ok(()), |rule| rule.check())?;
    Ok(Step::Hold {
        duration: args.seconds("for")?,
        until,
        rate,
    })
}

fn prompt(args: &Args) -> Result<Step, String> {
    let mount = if args.has("mount") {
        Some(u64::from(args.count("mount")?))
    } else {
        None
    };
    let hand = match (args.maybe("cell_mass"), mount, args.is_true("unmount")) {
        (None, None, false) => None,
        (Some(mass_g), None, false) => Some(HandAction::LoadCell { mass_g }),
        (None, Some(specimen), false) => Some(HandAction::Mount { specimen }),
        (None, None, true) => Some(HandAction::Unmount),
        _ => {
            return Err(
                "a prompt asks for one thing: give one of 'cell_mass', 'mount' and 'unmount'"
                    .into(),
            );
        }
    };
    Ok(Step::Prompt(Prompt {
        message: args.text("message")?.to_owned(),
        timeout: args.seconds("timeout")?,
        on_timeout: match args.text("on_timeout")? {
            "continue" => OnTimeout::Continue,
            _ => OnTimeout::Stop,
        },
        hand,
    }))
}

/// A speed of a step.
impl Args {
    fn speed(&self, key: &str) -> Result<MmPerS, String> {
        self.number(key).map(MmPerS)
    }

    fn seconds(&self, key: &str) -> Result<Seconds, String> {
        self.number(key).map(Seconds)
    }
}
