//! `palpate extremes`, and the page it wrote for the guide.

use crate::support::{answer, assert_refused, palpate, stdout, succeeded, typed};
use std::path::Path;

#[test]
fn the_extremes_agree_with_the_page_of_the_guide() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("notes.md"), "mine").unwrap();
    let refused = palpate(at, &["extremes", "--quick", "--page", "notes.md"]);
    assert_refused(&refused, 2, "exists already");
    // An older page of this command is replaced.
    let older = ["extremes", "--quick", "--family", "voigt", "--page", "page.md"];
    succeeded(&palpate(at, &older));
    let run = answer(&palpate(at, &["extremes", "--quick", "--json", "--page", "page.md"]));
    assert_eq!(run["command"], "extremes");
    assert_eq!((&run["extent"], &run["wrong"]), (&"quick".into(), &0.into()));
    let rows = run["rows"].as_array().unwrap();
    let count = |verdict: &str| rows.iter().filter(|row| row["verdict"] == verdict).count();
    for verdict in ["right", "refused", "flagged"] {
        assert_eq!(run[verdict].as_u64(), Some(count(verdict) as u64));
    }
    let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/explanation/extremes.md");
    let pages = [
        std::fs::read_to_string(at.join("page.md")).unwrap(),
        std::fs::read_to_string(committed).unwrap(),
    ];
    // Every row of the quick part is on both pages, with the same verdict whatever its digits.
    for page in &pages {
        for row in rows {
            let text = |name: &str| row[name].as_str().unwrap();
            let found = on_page(page, text("group"), text("case"), text("subject"));
            let is_quick_only = text("group") == "long records";
            if found.is_none() && is_quick_only {
                continue;
            }
            // A record without the terms asked for leads a search nowhere in particular: whether it
            // is refused, flagged or right by chance hangs on the last digit.
            let is_chance = ["prony-4", "prony-5", "prony-6"]
                .iter()
                .any(|key| text("subject") == format!("fit of {key}"));
            if is_chance && text("group") == "records" {
                assert!(found.is_some_and(|verdict| verdict != "WRONG"), "{row}");
            } else {
                assert_eq!(found.as_deref(), Some(text("verdict")), "{row}");
            }
        }
    }
}

/// The verdict a page gives for a row.
fn on_page(page: &str, group: &str, case: &str, subject: &str) -> Option<String> {
    let mut sections = page.split("\n## ");
    let section =
        sections.find(|section| section.to_lowercase().starts_with(&format!("{group}\n")))?;
    let mut lines = section.lines().filter(|line| line.starts_with('|'));
    let columns: Vec<&str> = lines.next()?.split('|').map(str::trim).collect();
    let cells = |name: &str| {
        let found = lines.clone().find(|line| line.split('|').nth(1).map(str::trim) == Some(name));
        found.map(|line| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>())
    };
    let verdict_of = |cell: &str| match cell.parse::<f64>() {
        Ok(_) => "right".to_owned(),
        Err(_) => cell.to_owned(),
    };
    if let Some((tau, step)) =
        case.strip_prefix("tau 1e").and_then(|rest| rest.split_once(" s, step 1e"))
    {
        let (tau, step): (i32, i32) = (tau.parse().ok()?, step.strip_suffix(" s")?.parse().ok()?);
        let (line, column) = if group.starts_with("integrators") {
            (format!("1e{}", step - tau), subject.to_owned())
        } else {
            (format!("1e{tau} s"), format!("1e{step} s"))
        };
        let column = columns.iter().position(|name| *name == column)?;
        return Some(verdict_of(&cells(&line)?[column]));
    }
    // `all right`, or `right but for refused: voigt + fung; flagged: kelvin`.
    let cell = cells(case)?[2].clone();
    if let Some(all) = cell.strip_prefix("all ") {
        return Some(all.to_owned());
    }
    let (most, others) = cell.split_once(" but for ")?;
    let named = others.split("; ").find_map(|part| {
        let (verdict, subjects) = part.split_once(": ")?;
        subjects.split(" + ").any(|name| name == subject).then(|| verdict.to_owned())
    });
    Some(named.unwrap_or_else(|| most.to_owned()))
}

#[test]
fn one_family_in_words_and_an_unknown_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = palpate(at, &["extremes", "--quick", "--family", "kelvin"]);
    succeeded(&run);
    let text = stdout(&run);
    assert!(text.contains("9 right, 0 refused"), "{text}");
    assert!(text.contains("relative to its tolerance") && !text.contains("WRONG "), "{text}");

    let run = palpate(at, &["extremes", "--family", "burgers"]);
    assert_refused(&run, 2, "'burgers'");

    let run = typed(at, "extremes --quick --family voigt --page no/such/page.md");
    assert_refused(&run, 2, "no/such");
}
