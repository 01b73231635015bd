//! A property of a material as people read it: the numbers first, and all that they rest on under them.

use super::{dynamic, material, relaxation, text, unloading};
use crate::material::ValidityRow;
use crate::property::PropertyReport;
use crate::relaxation::UncertainNumber;
use palpate_figures::uncertain::{significant, with_error, with_interval};

/// A name and its words.
pub type NamedWords = (String, String);

/// The parts of a report, in the order in which they are read.
#[derive(Clone, Debug, PartialEq)]
pub struct PropertySections {
    /// Name of the property.
    pub title: &'static str,
    pub numbers: Vec<NumberLine>,
    /// Why the numbers may not be those of the specimen.
    pub warnings: Vec<NamedWords>,
    pub assumptions: Vec<NamedWords>,
    pub validity: Vec<ValidityRow>,
    /// A source, and what it adds to each number; the largest first.
    pub budget: Vec<Vec<String>>,
    pub not_included: Vec<&'static str>,
    /// What no budget has.
    pub remarks: Vec<&'static str>,
}

/// A number that has the line to itself, or several that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberLine {
    pub name: String,
    pub numbers: Vec<NumberInPrint>,
}

/// A number in the unit in which it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberInPrint {
    /// Empty for a number that has the name of its line.
    pub name: &'static str,
    pub number: UncertainNumber,
    /// Empty for a ratio.
    pub unit: &'static str,
}

impl NumberInPrint {
    /// The number with its standard uncertainty and its unit.
    #[must_use]
    pub fn words(&self) -> String {
        let UncertainNumber { value, standard_uncertainty, .. } = self.number;
        let words = with_error(value, standard_uncertainty);
        format!("{words} {}", self.unit).trim_end().to_owned()
    }

    #[must_use]
    pub fn interval_words(&self) -> String {
        let [low, high] = self.number.total95.map(|end| significant(end, 4));
        format!("95 % interval {low} to {high} {}", self.unit).trim_end().to_owned()
    }

    /// Head of a column of such numbers.
    #[must_use]
    pub fn head(&self) -> String {
        match self.unit {
            "" => self.name.to_owned(),
            unit => format!("{} ({unit})", self.name),
        }
    }

    /// The number with its 95 % interval, without its unit.
    #[must_use]
    pub fn cell(&self) -> String {
        let UncertainNumber { value, standard_uncertainty, total95 } = self.number;
        with_interval(value, standard_uncertainty, total95)
    }
}

impl NumberLine {
    fn words(&self) -> String {
        match self.numbers.as_slice() {
            [one] => format!("{}, {}", one.words(), one.interval_words()),
            several => {
                let words = several.iter().map(|one| format!("{} {}", one.name, one.words()));
                words.collect::<Vec<_>>().join(", ")
            }
        }
    }
}

#[must_use]
pub fn sections(report: &PropertyReport) -> PropertySections {
    match report {
        PropertyReport::Modulus(report) => material::sections(report),
        PropertyReport::Unloading(report) => unloading::sections(report),
        PropertyReport::Relaxation(report) => relaxation::sections(report),
        PropertyReport::Dynamic(report) => dynamic::sections(report),
    }
}

#[must_use]
pub fn property_text(report: &PropertyReport) -> String {
    let sections = sections(report);
    let line = |name: &str, words: &str| format!("{name:<16} {words}");
    let number = |one: &NumberLine| line(&one.name, &one.words());
    let mut lines: Vec<String> = sections.numbers.iter().map(number).collect();
    let named = sections.warnings.iter().chain(&sections.assumptions);
    lines.extend(named.map(|(name, words)| line(name, words)));
    lines.extend(sections.validity.iter().map(|row| {
        let value = significant(row.value, 3);
        line("valid", &format!("{} {value}, at most {}", row.ratio, row.max))
    }));
    let budget = text::in_columns(&sections.budget);
    lines.extend(budget.lines().map(|row| line("uncertainty", row)));
    if !sections.not_included.is_empty() {
        lines.push(line("not included", &sections.not_included.join(", ")));
    }
    lines.extend(sections.remarks.into_iter().map(str::to_owned));
    lines.join("\n")
}
