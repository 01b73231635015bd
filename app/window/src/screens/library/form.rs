//! The search of the library as typed and chosen.

use crate::widgets::{choice_box_ui, small_alarm_ui, text_row};
use chrono::{DateTime, Utc};
use eframe::egui::Ui;
use palpate_sessions::catalog::{
    Choices, DayError, Order, Query, beginning, ending, words_and_conditions,
};

const VERDICTS: [&str; 4] = ["valid", "suspect", "rejected", "none"];
const REVIEWS: [&str; 5] = ["accepted", "rejected", "repeat", "outdated", "none"];

/// A name that is chosen, and the text that narrows the list of names.
#[derive(Clone, Debug, Default)]
struct NamePick {
    chosen: Option<String>,
    narrow: String,
}

impl NamePick {
    fn ui(&mut self, ui: &mut Ui, name: &str, choices: &[String]) {
        choice_box_ui(ui, name, &mut self.chosen, choices, &mut self.narrow);
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct SearchForm {
    line: String,
    specimen: NamePick,
    operator: NamePick,
    protocol: NamePick,
    tag: NamePick,
    verdict: NamePick,
    review: NamePick,
    since: String,
    until: String,
    pub order: Order,
    pub is_reversed: bool,
}

/// A day, where one is typed.
fn day(
    text: &str,
    read: impl Fn(&str) -> Result<DateTime<Utc>, DayError>,
) -> Result<Option<DateTime<Utc>>, String> {
    match text.trim() {
        "" => Ok(None),
        text => read(text).map(Some).map_err(|err| err.to_string()),
    }
}

impl SearchForm {
    pub fn query(&self) -> Result<Query, String> {
        let (words, conditions) =
            words_and_conditions(&self.line).map_err(|err| err.to_string())?;
        let verdict = self.verdict.chosen.as_deref().map(str::parse);
        let review = self.review.chosen.as_deref().map(str::parse);
        Ok(Query {
            words,
            conditions,
            specimen: self.specimen.chosen.clone(),
            operator: self.operator.chosen.clone(),
            protocol: self.protocol.chosen.clone(),
            tags: self.tag.chosen.iter().cloned().collect(),
            verdict: verdict.transpose()?,
            review: review.transpose()?,
            since: day(&self.since, beginning).map_err(|err| format!("from: {err}"))?,
            before: day(&self.until, ending).map_err(|err| format!("until: {err}"))?,
            order: self.order,
            is_reversed: self.is_reversed,
            ..Query::default()
        })
    }

    /// Sorts by a column, in reverse where it is sorted by it already.
    pub fn sort(&mut self, order: Order) {
        self.is_reversed = self.order == order && !self.is_reversed;
        self.order = order;
    }

    /// Removes all conditions; the order stays.
    pub fn clear(&mut self) {
        *self = Self { order: self.order, is_reversed: self.is_reversed, ..Self::default() };
    }

    pub fn ui(&mut self, ui: &mut Ui, choices: &Choices) {
        let words = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
        text_row(ui, "find", "words, depth>=20mm", &mut self.line);
        if let Err(err) = words_and_conditions(&self.line) {
            small_alarm_ui(ui, err.to_string());
        }
        self.specimen.ui(ui, "specimen is", &choices.specimens);
        self.operator.ui(ui, "operator is", &choices.operators);
        self.protocol.ui(ui, "protocol is", &choices.protocols);
        self.tag.ui(ui, "tag is", &choices.tags);
        self.verdict.ui(ui, "verdict is", &words(&VERDICTS));
        self.review.ui(ui, "review is", &words(&REVIEWS));
        text_row(ui, "from", "2026-03-05", &mut self.since);
        text_row(ui, "until", "2026-03-31", &mut self.until);
        for (text, read) in [(&self.since, beginning as fn(&str) -> _), (&self.until, ending)] {
            if let Err(err) = day(text, read) {
                small_alarm_ui(ui, format!("'{text}' is not a day: {err}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sessions::catalog::{ReviewIs, VerdictIs};
    use palpate_sessions::edits::{Decision, Verdict};

    #[test]
    fn the_form_asks_as_the_command_line_does() {
        let mut form = SearchForm {
            line: "pig depth>=2cm".into(),
            since: "2026-03-05".into(),
            until: "2026-03-05".into(),
            ..SearchForm::default()
        };
        form.verdict.chosen = Some("suspect".into());
        form.review.chosen = Some("repeat".into());
        form.tag.chosen = Some("pilot".into());
        form.sort(Order::Started);
        let query = form.query().unwrap();
        assert_eq!(query.words, "pig");
        assert_eq!(query.conditions, ["depth>=20mm".parse().unwrap()]);
        assert_eq!(query.verdict, Some(VerdictIs::Given(Verdict::Suspect)));
        assert_eq!(query.review, Some(ReviewIs::Given(Decision::Repeat)));
        assert_eq!(query.tags, ["pilot"]);
        let day = query.before.unwrap() - query.since.unwrap();
        assert_eq!(day.num_hours(), 24);
        assert!(query.is_reversed);
        form.clear();
        let all = form.query().unwrap();
        assert_eq!((all.words.as_str(), all.is_reversed), ("", true));
        assert_eq!((all.verdict, all.since), (None, None));
        for word in VERDICTS {
            form.verdict.chosen = Some(word.into());
            assert!(form.query().is_ok(), "{word}");
        }
        for word in REVIEWS {
            form.review.chosen = Some(word.into());
            assert!(form.query().is_ok(), "{word}");
        }
        form.since = "yesterday".into();
        assert!(form.query().unwrap_err().starts_with("from: write a day"));
        form.line = "depth>=".into();
        assert!(form.query().unwrap_err().contains("is not a condition"));
    }
}
