//! The search of the library as typed and chosen.

use crate::widgets::{choice_box_ui, small_alarm_ui, text_row};
use chrono::{DateTime, Utc};
use eframe::egui::Ui;
use palpate_sessions::catalog::{
    CatalogChoices, CatalogOrder, CatalogQuery, DayError, parse_end, parse_query_line, parse_start,
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
    pub order: CatalogOrder,
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
    pub fn query(&self) -> Result<CatalogQuery, String> {
        let line = parse_query_line(&self.line).map_err(|err| err.to_string())?;
        let verdict = self.verdict.chosen.as_deref().map(str::parse);
        let review = self.review.chosen.as_deref().map(str::parse);
        Ok(CatalogQuery {
            words: line.words,
            fields: line.fields,
            conditions: line.conditions,
            specimen: self.specimen.chosen.clone(),
            operator: self.operator.chosen.clone(),
            protocol: self.protocol.chosen.clone(),
            tags: self.tag.chosen.iter().cloned().collect(),
            verdict: verdict.transpose()?,
            review: review.transpose()?,
            since: day(&self.since, parse_start).map_err(|err| format!("from: {err}"))?,
            before: day(&self.until, parse_end).map_err(|err| format!("until: {err}"))?,
            order: self.order,
            is_reversed: self.is_reversed,
            ..CatalogQuery::default()
        })
    }

    /// Sorts by a column, in reverse where it is sorted by it already.
    pub fn sort(&mut self, order: CatalogOrder) {
        self.is_reversed = self.order == order && !self.is_reversed;
        self.order = order;
    }

    /// Removes all conditions; the order stays.
    pub fn clear(&mut self) {
        *self = Self { order: self.order, is_reversed: self.is_reversed, ..Self::default() };
    }

    pub fn ui(&mut self, ui: &mut Ui, choices: &CatalogChoices) {
        let words = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
        text_row(ui, "find", "words, depth>=20mm", &mut self.line);
        if let Err(err) = parse_query_line(&self.line) {
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
        for (text, read) in [(&self.since, parse_start as fn(&str) -> _), (&self.until, parse_end)]
        {
            if let Err(err) = day(text, read) {
                small_alarm_ui(ui, format!("'{text}' is not a date: {err}"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sessions::catalog::{QualityFilter, ReviewFilter};
    use palpate_sessions::edits::{DataQuality, ReviewDecision};

    #[test]
    fn the_form_asks_as_the_command_line_does() {
        let mut form = SearchForm {
            line: "pig operator:ada depth>=2cm".into(),
            since: "2026-03-05".into(),
            until: "2026-03-05".into(),
            ..SearchForm::default()
        };
        form.verdict.chosen = Some("suspect".into());
        form.review.chosen = Some("repeat".into());
        form.tag.chosen = Some("pilot".into());
        form.sort(CatalogOrder::Started);
        let query = form.query().unwrap();
        assert_eq!(query.words, "pig");
        assert_eq!(query.fields[0].to_string(), "operator:ada");
        assert_eq!(query.conditions, ["depth>=20mm".parse().unwrap()]);
        assert_eq!(query.verdict, Some(QualityFilter::Given(DataQuality::Suspect)));
        assert_eq!(query.review, Some(ReviewFilter::Given(ReviewDecision::Repeat)));
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
        assert!(form.query().unwrap_err().starts_with("from: this is neither a day nor a time"));
        form.line = "depth>=".into();
        assert!(form.query().unwrap_err().contains("is not a condition"));
    }
}
