//! Rules for the wording of messages: tests elsewhere compare the subject of a message, not its words.

use std::fmt::Display;

/// `message => [facts],` for each message of a table, as [`assert_message`] wants it.
#[macro_export]
macro_rules! assert_messages {
    ($($message:expr => $facts:expr,)*) => {
        $($crate::messages::assert_message(&$message, &$facts);)*
    };
}

/// A message is one sentence in the form that all have, and names its facts.
///
/// # Panics
/// If it is not.
#[track_caller]
pub fn assert_message(message: &dyn Display, facts: &[&str]) {
    let text = message.to_string();
    let is_one = !text.contains('\n') && !text.contains("  ") && text == text.trim();
    assert!(is_one, "not one sentence: {text:?}");
    assert!(!text.ends_with('.'), "a full stop: {text}");
    let first = text.chars().next().expect("a message is not empty");
    let is_name = || facts.iter().any(|fact| text.starts_with(fact));
    assert!(!first.is_uppercase() || is_name(), "a capital: {text}");
    assert!(text.split(' ').count() >= 4, "no sentence: {text}");
    for fact in facts {
        assert!(text.contains(fact), "no {fact:?} in: {text}");
    }
}
