//! A press: the contact that a block `Find Contact` found and the `Stress Relaxation` after it, as one measurement.

use super::super::{Line, Stage, StageKind, TextPart};
use super::Block;

const CONTACT: &str = "Find Contact";
const RELAXATION: &str = "Stress Relaxation";
/// Functions that leave the stage where the contact is.
const RESTS: [&str; 2] = ["Wait", "Zero Load"];

const DAY_S: f64 = 86_400.0;

/// The presses of a file; their blocks learn which one they belong to, or why they are not joined.
pub(super) fn join<'a>(blocks: &mut [Block<'a>]) -> Vec<TextPart<'a>> {
    let mut presses = Vec::new();
    for last in 0..blocks.len() {
        if blocks[last].function != RELAXATION || blocks[last].ramps.is_empty() {
            continue;
        }
        let before = &blocks[..last];
        let Some(first) = before.iter().rposition(|one| !RESTS.contains(&one.function.as_str()))
        else {
            continue;
        };
        if blocks[first].function != CONTACT || blocks[first].ramps.is_empty() {
            continue;
        }
        let name = format!("Press {}", presses.len() + 1);
        match press(&name, &blocks[first..=last]) {
            Ok(press) => {
                presses.push(press);
                for block in &mut blocks[first..=last] {
                    block.press = Some((name.clone(), joined_ramps(block).len()));
                }
            }
            Err(reason) => {
                let remark = format!(
                    "'{}' is not joined with '{}': {reason}",
                    blocks[last].name, blocks[first].name
                );
                blocks[last].remarks.push(remark);
            }
        }
    }
    presses
}

/// Joins blocks, of which the first found the contact and the last is the relaxation.
fn press<'a>(name: &str, blocks: &[Block<'a>]) -> Result<TextPart<'a>, String> {
    let ([contact, ..], [.., relaxation]) = (blocks, blocks) else {
        return Err("there are no blocks".into());
    };
    let moved = contact.fact("Stage Repositioning").filter(|moved| *moved != "None");
    if let Some(moved) = moved {
        return Err(format!("the stage left the contact (Stage Repositioning: {moved})"));
    }
    let began_s = clock_s(contact)?;
    let mut part = TextPart {
        name: name.to_owned(),
        facts: facts(contact, relaxation),
        head: contact.head(),
        lines: contact.header.into_iter().collect(),
        ..TextPart::default()
    };
    for block in blocks.iter().filter(|block| !block.ramps.is_empty()) {
        if block.header.map(|(_, names)| names) != contact.header.map(|(_, names)| names) {
            return Err(format!("'{}' has other columns", block.name));
        }
        // The clock has milliseconds, and may pass midnight.
        let start_s = (1e3 * (clock_s(block)? - began_s)).round().rem_euclid(1e3 * DAY_S) / 1e3;
        let kind = match block.function.as_str() {
            CONTACT => StageKind::Contact,
            RELAXATION => StageKind::Press,
            _ => StageKind::Rest,
        };
        for rows in joined_ramps(block) {
            let Some((first, _)) = rows.first() else { continue };
            part.stages.push(Stage { first: *first, start_s, kind });
            part.lines.extend(rows);
        }
        part.remarks.extend(block.remarks.iter().cloned());
    }
    match part.stages.iter().find(|stage| stage.kind == StageKind::Contact) {
        Some(_) => Ok(part),
        None => Err(format!("'{}' has no rows", contact.name)),
    }
}

/// The ramps whose times go on; the time between others is not in the file.
fn joined_ramps<'l, 'a>(block: &'l Block<'a>) -> &'l [Vec<Line<'a>>] {
    let goes_on = |pair: &[Vec<Line<'a>>]| {
        let last = pair[0].last().and_then(time_s);
        last.zip(pair[1].first().and_then(time_s)).is_some_and(|(last, next)| next > last)
    };
    let count = block.ramps.windows(2).take_while(|pair| goes_on(pair)).count();
    &block.ramps[..block.ramps.len().min(count + 1)]
}

/// The first cell of a row.
fn time_s((_, row): &Line<'_>) -> Option<f64> {
    row.split('\t').next()?.trim().parse().ok()
}

/// When a block began, in s of the day, as in `10:08:47.546`.
fn clock_s(block: &Block<'_>) -> Result<f64, String> {
    let time = block.fact("Time").unwrap_or_default();
    let mut fields = time.split(':').map(|field| field.trim().parse::<f64>().ok());
    let mut field = || fields.next().flatten().filter(|field| (0.0..60.0).contains(field));
    match (field(), field(), field()) {
        (Some(hours), Some(minutes), Some(seconds)) => {
            Ok(3600.0 * hours + 60.0 * minutes + seconds)
        }
        _ => Err(format!("the time '{time}' of '{}' is not of the form 10:08:47.546", block.name)),
    }
}

/// The facts of the relaxation, and those of the contact that differ.
fn facts(contact: &Block<'_>, relaxation: &Block<'_>) -> Vec<(String, String)> {
    let mut facts = relaxation.facts.clone();
    let others = contact.facts.iter().filter(|fact| !relaxation.facts.contains(fact));
    facts.extend(others.map(|(key, value)| (format!("{CONTACT}, {key}"), value.clone())));
    facts.push(("Blocks".into(), format!("{}, {}", contact.name, relaxation.name)));
    facts
}
