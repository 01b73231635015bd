//! The steps of a protocol written out: loops unrolled, names replaced by values.

use super::args::{Args, COUNT_MAX};
use super::keys::{COMMON, Key};
use super::problem::{Problems, suggestion};
use super::quantity::{ProtocolValue, QuantityKind, ValueContent};
use super::scope::Scope;
use super::tree::{DocumentNode, DocumentTable, DocumentValue};
use crate::plans::{OnFailure, PlannedStep};
use crate::steps::{BuildStep, KINDS, StepFacts};

/// Steps and passes of loops in one plan. A day of steps of ten seconds each.
pub(super) const STEPS_MAX: usize = 10_000;

/// Loops in one another.
const LOOPS_MAX: usize = 6;

pub(super) const LOOP_KEYS: [Key; 5] = [
    Key::optional(
        "as",
        QuantityKind::Text,
        "name of the pass counter, which starts at 1; write `$name` in values and `{name}` in texts",
    ),
    Key::optional("reverse", QuantityKind::Flag, "`true` takes the values in reverse order"),
    Key::optional(
        "cycle",
        QuantityKind::Flag,
        "`true`: each pass is one repeat of the measurement; repeats are numbered 1, 2, 3 through the whole plan",
    ),
    Key::optional(
        "checkpoint",
        QuantityKind::Text,
        "name of the checkpoint after each pass; the run may pause at a checkpoint",
    ),
    Key::optional(
        "only_if",
        QuantityKind::Flag,
        "with `false` or `\"none\"` the repeated steps are skipped",
    ),
];

pub(super) struct PlacedStep {
    pub planned: PlannedStep,
    pub line: u32,
}

pub(super) fn write_out(
    procedure: &DocumentNode,
    scope: &mut Scope,
    problems: &mut Problems,
) -> Vec<PlacedStep> {
    let mut writer =
        Writer { scope, problems, steps: Vec::new(), passes: 0, cycles: 0, is_too_long: false };
    writer.steps(procedure, 0, 0);
    writer.steps
}

struct Writer<'a> {
    scope: &'a mut Scope,
    problems: &'a mut Problems,
    steps: Vec<PlacedStep>,
    passes: usize,
    cycles: u32,
    is_too_long: bool,
}

/// A message with its line.
type Mistake = (u32, String);

impl Writer<'_> {
    fn steps(&mut self, list: &DocumentNode, cycle: u32, depth: usize) {
        let DocumentValue::List(items) = &list.value else {
            let message =
                "'steps' must be a list in brackets, such as steps = [ { do = \"tare\" } ]";
            return self.problems.error(list.line, message);
        };
        for item in items {
            if self.is_too_long || self.problems.is_full() {
                return;
            }
            if let Err((line, message)) = self.item(item, cycle, depth) {
                self.problems.error(line, message);
            }
        }
    }

    /// A step or a loop.
    fn item(&mut self, item: &DocumentNode, cycle: u32, depth: usize) -> Result<(), Mistake> {
        let DocumentValue::Table(table) = &item.value else {
            let kind = item.kind();
            let message = format!("{kind} is not a step; write {{ do = \"ramp\", ... }} in braces");
            return Err((item.line, message));
        };
        let has = |key| table.get(key).is_some();
        let message = match (has("repeat"), has("for_each")) {
            (false, false) if has("do") || !has("steps") => {
                return self.step(table, cycle).map_err(|message| (item.line, message));
            }
            (false, false) => "a loop needs 'repeat' or 'for_each'; write repeat = 10",
            (true, true) => {
                "a loop cannot have both 'repeat' and 'for_each'; put one loop into the other"
            }
            _ if has("do") => {
                "a step cannot have 'repeat' or 'for_each'; put the step into a loop: { repeat = 10, steps = [ { do = ... } ] }"
            }
            _ => return self.run_loop(table, cycle, depth),
        };
        Err((item.line, message.into()))
    }

    fn step(&mut self, table: &DocumentTable, cycle: u32) -> Result<(), String> {
        let Some(DocumentValue::Text(name)) = table.get("do").map(|node| &node.value) else {
            return Err("a step needs 'do' with a name in quotes; write do = \"ramp\", or repeat = 10 for a loop".into());
        };
        let Some((kind, build)) = kinds().find(|(kind, _)| kind.word == name) else {
            let known: Vec<&str> = kinds().map(|(kind, _)| kind.word).collect();
            return Err(format!("'{name}' is not a known step; {}", suggestion(name, &known)));
        };
        let before = self.problems.count();
        let what = format!("'{name}'");
        let args =
            Args::read(table, &what, &[kind.keys, &COMMON], &["do"], self.scope, self.problems);
        let on_failure = args.text("on_failure").and_then(on_failure);
        let on_failure =
            on_failure.map_err(|reason| format!("'on_failure' of {what}: {reason}"))?;
        if args.is_no("only_if") || self.problems.count() > before {
            return Ok(());
        }
        let step = build(&args).map_err(|reason| format!("{what}: {reason}"))?;
        if self.has_room(table.line) {
            let checkpoint = args.maybe_text("checkpoint").map(str::to_owned);
            let planned = PlannedStep { step, cycle, checkpoint, on_failure };
            self.steps.push(PlacedStep { planned, line: table.line });
        }
        Ok(())
    }

    fn run_loop(&mut self, table: &DocumentTable, cycle: u32, depth: usize) -> Result<(), Mistake> {
        let mistake = |message: &str| Err((table.line, message.to_owned()));
        if depth == LOOPS_MAX {
            return mistake(&format!(
                "loops are nested more than {LOOPS_MAX} levels deep; replace the innermost loop by its steps, written once for each pass"
            ));
        }
        let Some(steps) = table.get("steps") else {
            return mistake("a loop needs 'steps'; write steps = [ { do = \"ramp\", ... } ]");
        };
        let other_keys = ["repeat", "for_each", "steps"];
        // The name of a checkpoint may use the loop's own names, so it is read in each pass.
        let mut own = table.clone();
        own.entries.retain(|entry| entry.key != "checkpoint");
        let args =
            Args::read(&own, "a loop", &[&LOOP_KEYS], &other_keys, self.scope, self.problems);
        let (name, mut values) = self.values(table)?;
        if args.is_no("only_if") {
            return Ok(());
        }
        if args.is_true("reverse") {
            values.reverse();
        }
        let number = args.maybe_text("as").unwrap_or_default();
        let outside = self.scope.len();
        for name in [name.as_str(), number].into_iter().filter(|name| !name.is_empty()) {
            if self.scope.has(name) {
                return mistake(&format!(
                    "the name '{name}' is already used; give the loop another name"
                ));
            }
        }
        let count = values.len();
        for (pass, value) in (1..).zip(values) {
            self.passes += 1;
            if self.is_too_long || self.problems.is_full() || !self.has_room(table.line) {
                return Ok(());
            }
            if !name.is_empty() {
                self.scope.push(&name, value);
            }
            if !number.is_empty() {
                self.scope.push(number, ProtocolValue::count(pass));
            }
            let cycle = if args.is_true("cycle") {
                self.cycles += 1;
                self.cycles
            } else {
                cycle
            };
            let begun = self.steps.len();
            self.steps(steps, cycle, depth + 1);
            self.name_checkpoint(table, begun);
            self.scope.shorten(outside);
        }
        if count > 0 && matches!(&steps.value, DocumentValue::List(items) if items.is_empty()) {
            return mistake(
                "the loop has no steps; write some between its brackets, or remove the loop",
            );
        }
        Ok(())
    }

    /// Names the checkpoint behind a pass of a loop, whose steps begin at an index.
    fn name_checkpoint(&mut self, table: &DocumentTable, begun: usize) {
        let Some(node) = table.get("checkpoint") else {
            return;
        };
        let named = self.scope.value(node, QuantityKind::Text);
        let named = named.map_err(|reason| format!("'checkpoint' of a loop: {reason}"));
        let named = self.problems.take(node.line, named);
        if let Some(last) = self.steps[begun..].last_mut() {
            last.planned.checkpoint = named.map(|given| given.text);
        }
    }

    /// What a loop runs through: the name of its values and the values; numbers have no name but `as`.
    fn values(&self, table: &DocumentTable) -> Result<(String, Vec<ProtocolValue>), Mistake> {
        if let Some(node) = table.get("repeat") {
            let value = self.scope.value(node, QuantityKind::Count);
            let count = value.and_then(|given| given.number(QuantityKind::Count));
            let count =
                count.map_err(|reason| (node.line, format!("'repeat' of a loop: {reason}")))?;
            if !(1.0..=COUNT_MAX).contains(&count) {
                let message = format!(
                    "a loop cannot be repeated {count} times; give 1 to {COUNT_MAX}, or remove the loop"
                );
                return Err((node.line, message));
            }
            return Ok((
                String::new(),
                (0..count as u32).map(|_| ProtocolValue::count(0)).collect(),
            ));
        }
        let node = table.get("for_each");
        let entries = match node.map(|node| &node.value) {
            Some(DocumentValue::Table(variables)) => variables.entries.as_slice(),
            _ => &[],
        };
        let [entry] = entries else {
            let message = "'for_each' needs one name and its values, such as for_each = { speed = [\"0.75 mm/s\", \"1.5 mm/s\"] }";
            return Err((node.map_or(table.line, |node| node.line), message.into()));
        };
        let mistake =
            |reason: String| (entry.line, format!("the values of '{}': {reason}", entry.key));
        let values = self.scope.list(&entry.node).map_err(mistake)?;
        let is_odd = |value: &&ProtocolValue| {
            matches!(value.content, ValueContent::List(_) | ValueContent::None)
        };
        if let Some(odd) = values.iter().find(is_odd) {
            let text = &odd.text;
            return Err(mistake(format!(
                "'{text}' is not a single value; write each value separately"
            )));
        }
        Ok((entry.key.clone(), values))
    }

    fn has_room(&mut self, line: u32) -> bool {
        if self.steps.len() < STEPS_MAX && self.passes <= STEPS_MAX {
            return true;
        }
        if !self.is_too_long {
            self.is_too_long = true;
            let message = format!(
                "the protocol has more than {STEPS_MAX} steps with all repeats written out; use fewer repeats, or split the protocol"
            );
            self.problems.error(line, message);
        }
        false
    }
}

/// The steps that a protocol can ask for, each with what makes it of its keys.
fn kinds() -> impl Iterator<Item = (&'static StepFacts, BuildStep)> {
    KINDS.iter().filter_map(|kind| Some((*kind, kind.build?)))
}

fn on_failure(text: &str) -> Result<OnFailure, String> {
    let form = "write \"abort\", \"skip\" or \"retry 2\"";
    match text.split_once(' ').unwrap_or((text, "")) {
        ("abort", "") => Ok(OnFailure::Abort),
        ("skip", "") => Ok(OnFailure::Skip),
        // More than nine retries of one specimen do not help.
        ("retry", count) => match count.trim().parse() {
            Ok(count @ 1..=9) => Ok(OnFailure::Retry(count)),
            _ => Err("a step can be retried 1 to 9 times; write a number from 1 to 9, such as \"retry 2\"".into()),
        },
        _ => Err(format!("'{text}' is not allowed; {form}")),
    }
}
