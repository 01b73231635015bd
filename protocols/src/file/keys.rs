//! The keys of steps, loops, monitors and limits. Every step holds its own in its file; reading, checking and the
//! reference all use them.

use super::quantity::QuantityKind;

#[derive(Clone, Copy)]
pub(crate) struct Key {
    pub name: &'static str,
    pub kind: QuantityKind,
    pub range: Range,
    pub need: KeyNeed,
    pub about: &'static str,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Range {
    Above0,
    From0,
    Any,
    OneOf(&'static [&'static str]),
}

/// What holds without the key.
#[derive(Clone, Copy)]
pub(crate) enum KeyNeed {
    Required,
    Optional,
    Usual(&'static str),
}

impl Key {
    const fn new(
        name: &'static str,
        kind: QuantityKind,
        need: KeyNeed,
        about: &'static str,
    ) -> Self {
        Self { name, kind, range: Range::Above0, need, about }
    }

    /// A key that must be there.
    pub const fn needed(name: &'static str, kind: QuantityKind, about: &'static str) -> Self {
        Self::new(name, kind, KeyNeed::Required, about)
    }

    /// A key that may be left out.
    pub const fn optional(name: &'static str, kind: QuantityKind, about: &'static str) -> Self {
        Self::new(name, kind, KeyNeed::Optional, about)
    }

    /// A key with a value that holds without it, as one would write it.
    pub const fn usual(
        name: &'static str,
        kind: QuantityKind,
        usual: &'static str,
        about: &'static str,
    ) -> Self {
        Self::new(name, kind, KeyNeed::Usual(usual), about)
    }

    /// It takes 0 too.
    pub const fn zero_allowed(self) -> Self {
        let range = Range::From0;
        Self { range, ..self }
    }

    /// It takes numbers below 0 too.
    pub const fn any(self) -> Self {
        let range = Range::Any;
        Self { range, ..self }
    }

    /// It takes one of these words.
    pub const fn one_of(self, words: &'static [&'static str]) -> Self {
        let range = Range::OneOf(words);
        Self { range, ..self }
    }
}

/// Keys that every step may have, beside `do`.
pub(super) const COMMON: [Key; 3] = [
    Key::optional(
        "checkpoint",
        QuantityKind::Text,
        "name of the checkpoint after the step; the run may pause at a checkpoint",
    ),
    Key::usual(
        "on_failure",
        QuantityKind::Text,
        "abort",
        "what follows if the step fails: `abort`, `skip`, or `retry 2` for two retries",
    ),
    Key::optional("only_if", QuantityKind::Flag, "`false` or `\"none\"` skips the step"),
];
