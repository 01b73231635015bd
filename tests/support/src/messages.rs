//! How messages are worded, in one place: tests elsewhere compare what a message is about, not its words.

use std::fmt::Display;

/// Each message is one sentence in the form that all have, and names its facts.
///
/// # Panics
/// If one is not.
pub fn assert_messages<M: Display>(messages: &[(M, &[&str])]) {
    for (message, facts) in messages {
        let text = message.to_string();
        let is_one = !text.contains('\n') && !text.contains("  ") && text == text.trim();
        assert!(is_one, "not one sentence: {text:?}");
        assert!(!text.ends_with('.'), "a full stop: {text}");
        let first = text.chars().next().expect("a message is not empty");
        let is_continued = !first.is_uppercase() || facts.iter().any(|fact| text.starts_with(fact));
        assert!(is_continued, "a capital: {text}");
        assert!(text.split(' ').count() >= 4, "no sentence: {text}");
        for fact in *facts {
            assert!(text.contains(fact), "no {fact:?} in: {text}");
        }
    }
}
