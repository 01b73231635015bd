//! The feedback check as a session: its table is imported like a foreign file and marked as simulated.

use super::haptics::FeedbackCheck;
use crate::report::haptics::follow_table;
use palpate_model::metadata::SessionLabels;
use palpate_runner::wall_now;
use palpate_sessions::new_session_id;
use palpate_tables::import::{ImportOptions, ImportTarget, parse_foreign, store_import};
use std::path::Path;

/// Name of the table that is kept beside the log.
const TABLE: &str = "follow.csv";

/// Makes the session in a folder that is new or empty; `source` is where the body is from.
pub fn store_feedback_check(
    followed: &FeedbackCheck,
    source: &str,
    folder: &Path,
) -> Result<(), String> {
    let table = follow_table(followed).into_bytes();
    let foreign = parse_foreign(TABLE, table, &ImportOptions::default())?;
    let at = wall_now().into();
    for mut part in foreign.parts {
        part.imported.remarks.insert(0, provenance(followed, source));
        part.imported.facts = facts(followed, source);
        let target = ImportTarget {
            folder,
            original: &foreign.bytes,
            session_id: new_session_id(at),
            at,
            software_version: env!("CARGO_PKG_VERSION"),
            labels: SessionLabels {
                specimen: format!("simulated master rendering {source}"),
                indenter: "rack of the master".into(),
                ..SessionLabels::default()
            },
        };
        store_import(&part, target).map_err(|err| err.to_string())?;
    }
    Ok(())
}

fn provenance(followed: &FeedbackCheck, source: &str) -> String {
    format!(
        "simulated, without tissue: 'palpate haptics follow' pushed the rack of a simulated master that rendered the model of {source}; the measured force includes friction of {:.3} N and drag of {:.3} N",
        followed.friction_n, followed.drag_n
    )
}

/// Settings that reproduce the session.
fn facts(followed: &FeedbackCheck, source: &str) -> Vec<(String, String)> {
    let settings = &followed.settings;
    let body = &followed.body;
    let [mu1, mu2, mu3] = body.mu;
    let all = [
        ("made by", "palpate haptics follow".to_owned()),
        ("body of", source.to_owned()),
        ("tau_eps (s)", body.tau_eps.to_string()),
        ("mu1 (N/mm)", mu1.to_string()),
        ("mu2 (N/mm^2)", mu2.to_string()),
        ("mu3 (N/mm^3)", mu3.to_string()),
        ("tau_sig (N*s/mm^2)", body.tau_sig.to_string()),
        ("speed (mm/s)", settings.speed.0.to_string()),
        ("depth (mm)", settings.depth.0.to_string()),
        ("hold (s)", settings.hold.0.to_string()),
        ("share of friction compensated", settings.friction_share.to_string()),
    ];
    all.map(|(name, value)| (name.to_owned(), value)).into()
}
