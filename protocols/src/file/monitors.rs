//! Limits and monitors of a protocol.

use super::args::{Args, check_range};
use super::keys::{Key, Range};
use super::problem::Problems;
use super::quantity::QuantityKind;
use super::scope::Scope;
use super::tree::{DocumentNode, DocumentTable, DocumentValue};
use crate::plans::{Monitor, MonitorAction, MonitorSource, PlanLimits, ThresholdSide};
use palpate_model::rig::SensorChannel;
use palpate_model::units::{Newtons, Position, Seconds};

const LIMIT_KEYS: [Key; 2] = [
    Key::optional(
        "force_max",
        QuantityKind::Force,
        "highest force above tare; the rig's own limit also applies",
    ),
    Key::optional(
        "travel_max",
        QuantityKind::Length,
        "largest distance from home that the probe may reach, for example just short of the base; the rig's own limit also applies",
    ),
];

pub(super) fn read_limits(
    node: Option<&DocumentNode>,
    scope: &Scope,
    problems: &mut Problems,
) -> PlanLimits {
    match node {
        None => PlanLimits::default(),
        Some(DocumentNode { value: DocumentValue::Table(table), .. }) => {
            let args = Args::read(table, "[limits]", &[&LIMIT_KEYS], &[], scope, problems);
            PlanLimits {
                force_max: args.maybe("force_max").map(Newtons),
                travel_max: args.maybe("travel_max").map(Position),
            }
        }
        Some(node) => {
            problems
                .error(node.line, "'limits' must be a table; write [limits] on a line of its own");
            PlanLimits::default()
        }
    }
}

/// What a monitor can look at, with its kind.
const SOURCES: [(&str, MonitorSource, QuantityKind); 4] = [
    ("force", MonitorSource::Force, QuantityKind::Force),
    ("depth", MonitorSource::Depth, QuantityKind::Length),
    ("signal", MonitorSource::Volts, QuantityKind::Voltage),
    ("position", MonitorSource::Position, QuantityKind::Length),
];

const ACTIONS: [(&str, MonitorAction); 5] = [
    ("note", MonitorAction::Note),
    ("pause", MonitorAction::Pause),
    ("stop", MonitorAction::Stop),
    ("retract", MonitorAction::Retract),
    ("halt", MonitorAction::Halt),
];

/// Keys of a monitor beside the values, whose unit depends on what is watched.
pub(super) const MONITOR_KEYS: [Key; 4] = [
    Key::needed(
        "watch",
        QuantityKind::Text,
        "watched quantity: `force`, `depth`, `signal`, `position`, or `sensor NAME` for a sensor of the rig, whose values are plain numbers in its unit",
    ),
    Key::usual(
        "settle",
        QuantityKind::Time,
        "1 s",
        "time that the value must stay in range before a paused run continues",
    )
    .zero_allowed(),
    Key::needed(
        "action",
        QuantityKind::Text,
        "what follows when the monitor trips: `note`, `pause`, `stop`, `retract` or `halt`",
    )
    .one_of(&["note", "pause", "stop", "retract", "halt"]),
    Key::needed("message", QuantityKind::Text, "text that the operator reads"),
];

pub(super) fn read_monitors(
    node: Option<&DocumentNode>,
    scope: &Scope,
    problems: &mut Problems,
) -> Vec<Monitor> {
    let Some(node) = node else {
        return Vec::new();
    };
    let DocumentValue::List(items) = &node.value else {
        problems.error(node.line, "'monitor' must be a list of tables; write [[monitor]] in double brackets above each monitor");
        return Vec::new();
    };
    let tables = items.iter().filter_map(|item| match &item.value {
        DocumentValue::Table(table) => Some(table),
        _ => None,
    });
    tables.filter_map(|table| read_monitor(table, scope, problems)).collect()
}

/// What is watched, and the kind of its values; a sensor's have none.
fn find_source(watch: &str) -> Result<(MonitorSource, Option<QuantityKind>), String> {
    if let Some((_, source, kind)) = SOURCES.iter().find(|(name, ..)| *name == watch) {
        return Ok((source.clone(), Some(*kind)));
    }
    let name = watch.strip_prefix("sensor ").map(str::trim);
    match name.filter(|name| SensorChannel::is_name(name)) {
        Some(name) => Ok((MonitorSource::Channel(name.to_owned()), None)),
        None => Err(format!(
            "'watch' of a monitor cannot be '{watch}'; write force, depth, signal, position, or sensor NAME"
        )),
    }
}

fn plain_number(node: &DocumentNode) -> Result<f64, String> {
    let text = match &node.value {
        DocumentValue::Text(text) | DocumentValue::Number(text) => text.trim(),
        _ => "",
    };
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| "write a plain number in the unit of the sensor, like 21.5".into())
}

fn read_monitor(table: &DocumentTable, scope: &Scope, problems: &mut Problems) -> Option<Monitor> {
    let other_keys = ["above", "below", "resume"];
    let args = Args::read(table, "a monitor", &[&MONITOR_KEYS], &other_keys, scope, problems);
    let watch = args.text("watch").ok()?;
    let line = table.get("watch").map_or(table.line, |node| node.line);
    let (source, kind) = problems.take(line, find_source(watch))?;
    let mut value = |key: &str| {
        let node = table.get(key)?;
        let number = match kind {
            None => plain_number(node),
            Some(kind) => scope.value(node, kind).and_then(|given| {
                let number = given.number(kind)?;
                check_range(kind, Range::Any, number)
                    .map_err(|reason| format!("{} is out of range; {reason}", given.text))?;
                Ok(number)
            }),
        };
        problems.take(node.line, number.map_err(|reason| format!("'{key}' of a monitor: {reason}")))
    };
    let (above, below, resume) = (value("above"), value("below"), value("resume"));
    let (side, threshold) = match (table.get("above").is_some(), table.get("below").is_some()) {
        (true, false) => (ThresholdSide::Above, above?),
        (false, true) => (ThresholdSide::Below, below?),
        _ => {
            let message =
                "a monitor needs exactly one threshold; write above = \"6 N\" or below = \"6 N\"";
            problems.error(table.line, message);
            return None;
        }
    };
    let monitor = Monitor {
        source,
        side,
        threshold,
        // Without a value of its own it is past as soon as it no longer trips.
        resume: if table.get("resume").is_some() { resume? } else { threshold },
        settle: Seconds(args.number("settle").ok()?),
        action: ACTIONS.iter().find(|(name, _)| args.text("action") == Ok(name))?.1,
        message: args.text("message").ok()?.to_owned(),
    };
    if let Err(reason) = monitor.check() {
        let line = table.get("resume").map_or(table.line, |node| node.line);
        problems.error(line, reason);
    }
    Some(monitor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_is_watched_by_its_name_and_its_values_are_plain_numbers() {
        let channel = MonitorSource::Channel("room.temperature".into());
        assert_eq!(find_source("sensor room.temperature"), Ok((channel, None)));
        assert_eq!(find_source("force"), Ok((MonitorSource::Force, Some(QuantityKind::Force))));
        for wrong in ["sensor", "sensor ", "sensor a b", "room.temperature", ""] {
            assert!(find_source(wrong).is_err(), "{wrong}");
        }
        let node = |value| DocumentNode { line: 1, value };
        assert_eq!(plain_number(&node(DocumentValue::Number("21.5".into()))), Ok(21.5));
        assert_eq!(plain_number(&node(DocumentValue::Text("-3".into()))), Ok(-3.0));
        for wrong in ["25 °C", "inf", "$limit"] {
            assert!(plain_number(&node(DocumentValue::Text(wrong.into()))).is_err(), "{wrong}");
        }
    }
}
