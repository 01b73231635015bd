//! Protocols as people read them.

use super::FileReport;
use palpate_figures::uncertain::clock;
use palpate_protocols::file::{ExpandedProtocol, Protocol, ProtocolParameter, ProtocolProblem};
use palpate_protocols::preview::Preview;
use palpate_sessions::locked_protocols::StoredLockedProtocol;

/// Steps printed one by one; the totals follow in any case.
const STEPS_MAX: usize = 200;

pub(super) fn list(protocols: &[Protocol], locked: &[StoredLockedProtocol]) -> String {
    let line = |protocol: &Protocol| format!("{:<22} {}", protocol.name, protocol.title);
    let locked = locked
        .iter()
        .map(|one| format!("{:<22} locked by {}, {}", one.document.name, one.document.by, one.id));
    let lines: Vec<String> = protocols.iter().map(line).chain(locked).collect();
    lines.join("\n")
}

/// Every problem of a file on a line of its own.
pub(super) fn sentences(name: &str, problems: &[ProtocolProblem]) -> String {
    let line = |problem: &ProtocolProblem| format!("{name}, {problem}");
    let lines: Vec<String> = problems.iter().map(line).collect();
    lines.join("\n")
}

pub(super) fn check(files: &[FileReport]) -> String {
    let lines: Vec<String> = files
        .iter()
        .map(|file| match (file.problems.is_empty(), file.expected_s) {
            (true, Some(expected)) => format!("{}: sound, about {}", file.file, clock(expected)),
            _ => sentences(&file.file, &file.problems),
        })
        .collect();
    lines.join("\n")
}

pub(super) fn steps(written: &ExpandedProtocol) -> String {
    let mut lines = vec![format!(
        "{:>5} {:>5}  {:<13} {:>5}  {}",
        "step", "line", "what", "cycle", "checkpoint"
    )];
    let pairs = written.plan.steps.iter().zip(&written.lines);
    lines.extend(pairs.enumerate().map(|(index, (planned, line))| {
        let row = format!(
            "{:>5} {line:>5}  {:<13} {:>5}  {}",
            index + 1,
            planned.step.word(),
            cycle(planned.cycle),
            planned.checkpoint.as_deref().unwrap_or_default()
        );
        row.trim_end().to_owned()
    }));
    lines.join("\n")
}

fn cycle(cycle: u32) -> String {
    if cycle > 0 { cycle.to_string() } else { String::new() }
}

pub(super) fn preview(
    protocol: &Protocol,
    written: &ExpandedProtocol,
    preview: &Preview,
) -> String {
    let mut lines = vec![
        format!("{} (version {})", protocol.title, protocol.version),
        String::new(),
        format!(
            "{:>5}  {:<13} {:>12} {:>12}  {:>5}  {}",
            "step", "what", "expected", "at most", "cycle", "checkpoint"
        ),
    ];
    let pairs = written.plan.steps.iter().zip(&preview.steps);
    for (index, (planned, step)) in pairs.enumerate().take(STEPS_MAX) {
        let time = if step.is_exact {
            format!("{:.3} s", step.expected.0)
        } else {
            format!("~{:.0} s", step.expected.0)
        };
        let longest =
            if step.is_exact { String::new() } else { format!("{:.0} s", step.longest.0) };
        let row = format!(
            "{:>5}  {:<13} {time:>12} {longest:>12}  {:>5}  {}",
            index + 1,
            planned.step.word(),
            cycle(planned.cycle),
            planned.checkpoint.as_deref().unwrap_or_default()
        );
        lines.push(row.trim_end().to_owned());
    }
    if written.plan.steps.len() > STEPS_MAX {
        lines.push(format!("       and {} steps more", written.plan.steps.len() - STEPS_MAX));
    }
    lines.push(String::new());
    lines.push(format!(
        "total {}, at most {}; {:.3} s of the total are known exactly",
        clock(preview.expected.0),
        clock(preview.longest.0),
        preview.steps.iter().filter(|step| step.is_exact).map(|step| step.expected.0).sum::<f64>()
    ));
    lines.push(format!(
        "peak force {:.1} to {:.1}; up to {:.1} MB on disk",
        preview.force_band[0],
        preview.force_band[1],
        preview.storage_bytes as f64 * 1e-6
    ));
    if !protocol.ask.is_empty() {
        lines.push(format!("asks for {}", protocol.ask.join(", ")));
    }
    lines.extend(preview.acknowledgements.iter().map(|line| format!("to acknowledge: {line}")));
    lines.extend(preview.notes.iter().map(|line| format!("note: {line}")));
    if !protocol.parameters.is_empty() {
        lines.push(String::new());
        lines.push("parameters that --set changes:".into());
        let values = written.plan.source.as_ref().map(|source| &source.values);
        lines.extend(protocol.parameters.iter().map(|parameter| {
            let value = values.and_then(|values| values.get(&parameter.name));
            parameter_line(parameter, value.map_or("", String::as_str))
        }));
    }
    lines.join("\n")
}

fn parameter_line(parameter: &ProtocolParameter, value: &str) -> String {
    format!("  {} = {value}: {}", parameter.name, parameter.about)
}
