//! The tutorial, done as it is written: every step of `docs/tutorial.md` in the window.
//!
//! Press, Type and Wait at the beginning of a sentence are done; what they name is found by its accessible name.
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use palpate_runner::TimeScale;
use palpate_tests::flow::{TestWindow, WindowFlow};
use palpate_tests::workspace;

/// One thing that the text asks for.
#[derive(Debug, PartialEq)]
enum TutorialStep {
    /// A key, with Ctrl or without.
    Key(Key, Modifiers),
    /// A key whenever a question stands there, until the window says so.
    KeyUntil(Key, String),
    /// A button.
    Press(String),
    /// A text into a field.
    Type(String, String),
    /// Until it says so.
    Wait(String),
    /// It says so now.
    See(String),
}

/// What stands between marks, in order.
fn between<'a>(text: &'a str, mark: &str) -> Vec<&'a str> {
    text.split(mark).skip(1).step_by(2).collect()
}

fn key(name: &str) -> (Key, Modifiers) {
    match name.strip_prefix("Ctrl+") {
        Some(rest) => (Key::from_name(rest).unwrap(), Modifiers::COMMAND),
        None => (Key::from_name(name).unwrap(), Modifiers::NONE),
    }
}

/// The words between single stars.
fn said(sentence: &str) -> String {
    let without_bold = sentence.replace("**", "");
    between(&without_bold, "*").first().copied().unwrap().to_owned()
}

/// The deeds of a step. A sentence ends with a full stop before a verb that is a deed.
fn deeds(step: &str) -> Vec<TutorialStep> {
    let mut deeds = Vec::new();
    let text = step
        .replace(". Press ", ".\u{1}Press ")
        .replace(". Type ", ".\u{1}Type ")
        .replace(". Wait for ", ".\u{1}Wait for ")
        .replace(". See ", ".\u{1}See ");
    for sentence in text.split('\u{1}') {
        if let Some(rest) = sentence.strip_prefix("Press ") {
            if let (true, Some(name)) = (rest.starts_with('`'), between(rest, "`").first()) {
                let (key, modifiers) = key(name);
                match rest.contains("until") {
                    true => deeds.push(TutorialStep::KeyUntil(key, said(rest))),
                    false => deeds.push(TutorialStep::Key(key, modifiers)),
                }
            } else {
                // "Press A, then B" is two.
                let names = between(rest, "**");
                let count = if rest.contains(", then ") { 2 } else { 1 };
                deeds.extend(
                    names.iter().take(count).map(|name| TutorialStep::Press((*name).into())),
                );
            }
        } else if let Some(rest) = sentence.strip_prefix("Type ") {
            let text = between(rest, "`")[0].to_owned();
            deeds.push(TutorialStep::Type(text, between(rest, "**")[0].to_owned()));
        } else if let Some(rest) = sentence.strip_prefix("Wait for ") {
            deeds.push(TutorialStep::Wait(said(rest)));
        } else if let Some(rest) = sentence.strip_prefix("See ") {
            deeds.push(TutorialStep::See(said(rest)));
        }
    }
    deeds
}

/// The numbered steps of a document, lines joined.
fn steps(text: &str) -> Vec<String> {
    let mut steps: Vec<String> = Vec::new();
    let mut is_inside = false;
    for line in text.lines() {
        if let Some(step) = line.strip_prefix("1. ") {
            steps.push(step.to_owned());
            is_inside = true;
        } else if let (true, Some(more)) = (is_inside, line.strip_prefix("   ")) {
            let last = steps.last_mut().unwrap();
            last.push(' ');
            last.push_str(more);
        } else {
            is_inside = false;
        }
    }
    steps
}

fn says(window: &TestWindow, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

fn carry_out(flow: &mut WindowFlow, deed: &TutorialStep) {
    match deed {
        TutorialStep::Key(key, modifiers) => {
            flow.window.key_press_modifiers(*modifiers, *key);
            flow.window.run_steps(4);
        }
        TutorialStep::KeyUntil(key, words) => {
            for _ in 0..40 {
                flow.wait("a question or the end", |window| {
                    let run = window.state().snapshot().run.as_ref();
                    run.is_some_and(|run| run.prompt.is_some() || run.outcome.is_some())
                });
                if flow.run().unwrap().outcome.is_some() {
                    break;
                }
                let asked = flow.run().unwrap().step_index;
                flow.window.key_press(*key);
                flow.window.run_steps(2);
                flow.wait("the answer", |window| {
                    let run = window.state().snapshot().run.as_ref();
                    run.is_some_and(|run| run.step_index > asked || run.outcome.is_some())
                });
            }
            flow.window.run_steps(3);
            assert!(flow.says(words), "{words}");
        }
        TutorialStep::Press(name) => {
            // What is closed for the moment says why; a reader would wait too.
            flow.wait(name, |window| {
                let found = window.query_by_label(name);
                found.is_some_and(|node| !node.accesskit_node().is_disabled())
            });
            flow.click(name);
        }
        TutorialStep::Type(text, name) => {
            // Files go where the test's files go.
            let text = match text.as_str() {
                "report.html" | "tables" => flow.folder.path().join("out").join(text),
                text => text.into(),
            };
            // A person types once the field is there: what it belongs to may still be read.
            flow.wait(name, |window| window.query_by_label(name).is_some());
            flow.type_into(name, &text.display().to_string());
        }
        TutorialStep::Wait(words) => flow.wait(words, |window| says(window, words)),
        TutorialStep::See(words) => assert!(flow.says(words), "'{words}' is not there"),
    }
    flow.window.run_steps(3);
}

#[test]
fn every_step_of_the_tutorial_does_what_it_says() {
    let text = std::fs::read_to_string(workspace().join("docs/tutorial.md")).unwrap();
    let steps = steps(&text);
    let count: usize = steps.iter().map(|step| deeds(step).len()).sum();
    assert!(steps.len() > 20 && count > 45, "{count} deeds in {} steps", steps.len());
    let mut flow = WindowFlow::open(TimeScale::Factor(20.0));
    std::fs::create_dir(flow.folder.path().join("out")).unwrap();
    for step in &steps {
        for deed in deeds(step) {
            println!("{deed:?}");
            carry_out(&mut flow, &deed);
        }
    }
    let page = flow.folder.path().join("out/report.html");
    assert!(std::fs::read_to_string(page).unwrap().contains("pig 1"));
}

#[test]
fn steps_are_read_as_they_are_written() {
    let read = |text: &str| deeds(&steps(text).concat());
    assert_eq!(
        read(
            "1. Press `Ctrl+K`: by name. Type `x y` into\n   **command**. Wait for *it: is*. See *A*.\n\nPress **No**.\n"
        ),
        [
            TutorialStep::Key(Key::K, Modifiers::COMMAND),
            TutorialStep::Type("x y".into(), "command".into()),
            TutorialStep::Wait("it: is".into()),
            TutorialStep::See("A".into()),
        ]
    );
    assert_eq!(
        read("1. Press **A  F5**, then **B**: fine. Press `F2` and so on, until it is *finish*.\n"),
        [
            TutorialStep::Press("A  F5".into()),
            TutorialStep::Press("B".into()),
            TutorialStep::KeyUntil(Key::F2, "finish".into()),
        ]
    );
}
