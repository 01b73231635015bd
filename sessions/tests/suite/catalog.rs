//! The catalog against the sessions themselves: every search against a plain scan, every update against a
//! rebuilt catalog.

use crate::support::{MemorySink, Random, end, manifest, rows};
use chrono::{Duration, TimeZone, Utc};
use palpate_model::metadata::SessionLabels;
use palpate_sessions::analyses::{Analysis, AnalysisContent, add_analysis};
use palpate_sessions::catalog::{
    CATALOG_FILE, Catalog, CatalogEntry, CatalogOrder, CatalogQuery, Condition, FieldWords,
    QualityFilter, ReviewFilter, SearchField, parse_query_line,
};
use palpate_sessions::edits::{DataQuality, Edit, EditChange, ReviewDecision, add_edit};
use palpate_sessions::{LOG_FILE, LogWriter, Manifest};
use std::fs;
use std::path::Path;

const SPECIMENS: [&str; 5] = ["liver 3", "µ-gel 3 %", "it's \"quoted\"", "a*b -c", ""];
const OPERATORS: [&str; 3] = ["Ada", "Grace Hopper", "O'Brien; DROP TABLE session"];
const PROTOCOLS: [&str; 2] = ["ramp-hold", "preconditioning"];

fn plan(random: &mut Random) -> serde_json::Value {
    let depth = random.below(6);
    let name = PROTOCOLS[random.below(2)];
    let steps = serde_json::json!([
        {"step": "ramp", "depth": depth, "speed": 3.0},
        {"step": "hold", "duration": 2.5, "until": {"parameter": "tau_eps"}},
    ]);
    match name {
        "ramp-hold" => serde_json::json!({"name": name, "version": 1, "steps": steps}),
        name => serde_json::json!({
            "name": name, "version": 2, "title": "Ten cycles", "steps": steps,
            "source": {"values": {"depth": format!("{depth} mm"), "rest": "3 min", "until": "none"}},
        }),
    }
}

fn random_manifest(random: &mut Random) -> Manifest {
    let started_at = Utc.with_ymd_and_hms(2026, 3, 1, 12, 0, 0).unwrap()
        + Duration::hours(random.below(240) as i64);
    let mut labels = SessionLabels::default();
    let thickness = format!("specimen.thickness_mm={}", 1 + random.below(9));
    labels.set_pair(&thickness).unwrap();
    labels.set_pair("series.id=pilot 7").unwrap();
    Manifest {
        session_id: format!("20260301T120000Z-{:08x}", random.next() as u32),
        started_at,
        specimen: SPECIMENS[random.below(SPECIMENS.len())].into(),
        operator: OPERATORS[random.below(OPERATORS.len())].into(),
        about: labels.about,
        plan: plan(random),
        ..manifest()
    }
}

fn write_session(folder: &Path, manifest: &Manifest, count: usize, is_ended: bool) {
    let sink = MemorySink::default();
    let mut log = LogWriter::begin(sink.clone(), "memory", manifest).unwrap();
    let rows = rows(count, 1);
    for batch in rows.chunks(100) {
        log.append(batch, &[]).unwrap();
    }
    if is_ended {
        log.finish(end(rows[count - 1].host)).unwrap();
    }
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join(LOG_FILE), sink.bytes()).unwrap();
}

fn edit(reason: &str, change: EditChange) -> Edit {
    Edit {
        at: Utc.with_ymd_and_hms(2026, 4, 1, 9, 0, 0).unwrap(),
        by: "Grace".into(),
        reason: reason.into(),
        change,
    }
}

fn judge(folder: &Path, id: &str, verdict: DataQuality, reason: &str) {
    add_edit(folder, id, &edit(reason, EditChange::Verdict { verdict })).unwrap();
}

fn fit_of(name: &str, tau: f64) -> Analysis {
    Analysis {
        name: name.into(),
        at: Utc.with_ymd_and_hms(2026, 4, 2, 9, 0, 0).unwrap(),
        by: "Mary Somerville".into(),
        reason: String::new(),
        software_version: "0.1.0".into(),
        engine_version: 1,
        inputs: Vec::new(),
        what: AnalysisContent::Fit {
            based_on: None,
            settings: serde_json::Value::Null,
            results: serde_json::json!({"parameters": [
                {"name": "tau_eps", "value": tau, "unit": "s"}
            ]}),
        },
    }
}

/// Some of a session's tags, analyses and reviews, at random.
fn talk(folder: &Path, id: &str, random: &mut Random) {
    let tags = |word: &str| EditChange::Tags {
        add: vec![word.into(), "all".into()],
        remove: vec!["none".into()],
    };
    let analyse = |name: &str, tau: f64| add_analysis(folder, id, &fit_of(name, tau)).unwrap();
    match random.below(4) {
        0 => add_edit(folder, id, &edit("", tags("pilot"))).unwrap(),
        1 => add_edit(folder, id, &edit("", tags("good"))).unwrap(),
        _ => {}
    }
    let tau = random.below(5) as f64;
    if random.below(2) == 0 {
        analyse("first fit", tau);
    }
    let decision = [ReviewDecision::Accepted, ReviewDecision::Rejected, ReviewDecision::Repeat]
        [random.below(3)];
    if random.below(2) == 0 {
        let seen = palpate_sessions::Analyses::read(folder, id).unwrap().input();
        let seen = seen.into_iter().collect();
        let change = EditChange::Review { decision, seen };
        add_edit(folder, id, &edit("seen by two", change)).unwrap();
    }
    match random.below(4) {
        0 => analyse("second fit", tau + 0.5),
        1 => judge(folder, id, DataQuality::Suspect, "second thoughts"),
        _ => {}
    }
}

/// A library of random sessions, some without an end, some judged, one damaged.
fn library(count: usize, seed: u64) -> tempfile::TempDir {
    let library = tempfile::tempdir().unwrap();
    let mut random = Random(seed);
    for number in 0..count {
        let manifest = random_manifest(&mut random);
        let place = ["sessions", "programmes/day one"][random.below(2)];
        let folder = library.path().join(place).join(format!("s{number:03}"));
        let samples = 150 + 100 * random.below(4);
        write_session(&folder, &manifest, samples, random.below(5) > 0);
        let verdicts = [DataQuality::Valid, DataQuality::Suspect, DataQuality::Rejected];
        if let Some(verdict) = verdicts.get(random.below(4)) {
            let reason = ["hair on the probe", "Überlast (naïve)"][random.below(2)];
            judge(&folder, &manifest.session_id, *verdict, reason);
        }
        talk(&folder, &manifest.session_id, &mut random);
    }
    let damaged = library.path().join("sessions/damaged");
    fs::create_dir_all(&damaged).unwrap();
    fs::write(damaged.join(LOG_FILE), b"no log at all").unwrap();
    library
}

fn updated(library: &Path) -> Catalog {
    let mut catalog = Catalog::open(library).unwrap();
    catalog.update(&mut |_, _| {}).unwrap();
    catalog
}

/// The words of a text as the index parts them, capitals and the accents used here taken off.
fn plain_words(text: &str) -> Vec<String> {
    let lower = text.to_lowercase().replace('ü', "u").replace('ï', "i");
    lower
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
        .collect()
}

/// Everything of an entry that is words.
fn words_of(entry: &CatalogEntry) -> Vec<String> {
    let named = entry.named.iter().filter(|one| one.number.is_none());
    let mut text = [
        &entry.folder,
        &entry.session_id,
        &entry.operator,
        &entry.specimen,
        &entry.indenter,
        &entry.protocol,
        &entry.protocol_title,
        &entry.rig,
        &entry.rig_identity,
        &entry.cell,
        &entry.calibration,
        &entry.reason,
        &entry.verdict_reason,
    ]
    .map(String::as_str)
    .join(" ");
    let names = entry.analyses.iter().map(|one| &one.name);
    let words = named.map(|one| &one.text).chain(&entry.words);
    for one in words.chain(&entry.tags).chain(names) {
        text = format!("{text} {one}");
    }
    text += entry.trouble.as_deref().unwrap_or_default();
    plain_words(&text)
}

/// The plain scan.
fn is_meant(query: &CatalogQuery, entry: &CatalogEntry) -> bool {
    let is = |wanted: &Option<String>, own: &String| wanted.as_ref().is_none_or(|one| one == own);
    let start = chrono::DateTime::parse_from_rfc3339(&entry.started_at).ok();
    let words = words_of(entry);
    let has_word = |wanted: &String| words.iter().any(|word| word.starts_with(wanted.as_str()));
    is(&query.specimen, &entry.specimen)
        && is(&query.operator, &entry.operator)
        && is(&query.protocol, &entry.protocol)
        && is(&query.rig, &entry.rig)
        && query.tags.iter().all(|tag| entry.tags.contains(tag))
        && query.review.is_none_or(|wanted| match (wanted, &entry.review) {
            (ReviewFilter::None, review) => review.is_none() && entry.trouble.is_none(),
            (_, None) => false,
            (ReviewFilter::Outdated, Some(review)) => !review.changed.is_empty(),
            (ReviewFilter::Given(decision), Some(review)) => {
                review.changed.is_empty() && review.decision == decision
            }
        })
        && query.since.is_none_or(|since| start.is_some_and(|at| at >= since))
        && query.before.is_none_or(|before| start.is_some_and(|at| at < before))
        && query.conditions.iter().all(|one| one.is_met(entry))
        && query.verdict.is_none_or(|wanted| match wanted {
            QualityFilter::Given(verdict) => entry.verdict == Some(verdict),
            QualityFilter::None => entry.verdict.is_none() && entry.trouble.is_none(),
        })
        && plain_words(&query.words).iter().all(has_word)
        && query.fields.iter().all(|one| {
            let own = plain_words(&one.field.text_of(entry));
            plain_words(&one.words).iter().all(|word| own.iter().any(|own| own.starts_with(word)))
        })
}

fn random_query(random: &mut Random) -> CatalogQuery {
    let mut query = CatalogQuery::default();
    let day = |random: &mut Random| {
        Utc.with_ymd_and_hms(2026, 3, 1 + random.below(12) as u32, 0, 0, 0).unwrap()
    };
    let conditions = [
        "depth>=3",
        "depth_mm<3",
        "plan.depth=2mm",
        "ramp.depth<=1",
        "rest=180",
        "rest_min=3",
        "specimen.thickness_mm>4",
        "about.specimen.thickness_mm!=5",
        "series.id=pilot 7",
        "hold.until.parameter=tau_eps",
        "until!=none",
        "depth=3 s",
        "nothing=0",
    ];
    let words = [
        "ada",
        "GEL",
        "quoted it",
        "a*b -c",
        "drop table",
        "hair",
        "uberlast",
        "naive",
        "ten cyc",
        "\"",
        "-",
        "*",
        "NEAR(",
        "liver 3",
        "pilot",
        "programmes day",
        "s00",
        "damaged",
        "unknown",
        "pilot",
        "somer",
        "second",
    ];
    let fields = [
        "specimen:gel",
        "specimen:\"liver 3\"",
        "operator:ad",
        "operator:liver",
        "protocol:ramp",
        "rig:sim",
        "cell:s",
        "tag:pilot",
        "tag:go tag:all",
    ];
    for _ in 0..1 + random.below(2) {
        match random.below(8) {
            0 => query.specimen = Some(SPECIMENS[random.below(SPECIMENS.len())].into()),
            1 => query.operator = Some(OPERATORS[random.below(OPERATORS.len())].into()),
            2 => query.protocol = Some(PROTOCOLS[random.below(2)].into()),
            3 => query.since = Some(day(random)),
            4 => query.before = Some(day(random)),
            5 => {
                let text = conditions[random.below(conditions.len())];
                query.conditions.push(text.parse::<Condition>().unwrap());
            }
            6 => {
                let line = parse_query_line(fields[random.below(fields.len())]).unwrap();
                query.fields.extend(line.fields);
            }
            _ => query.words = words[random.below(words.len())].into(),
        }
    }
    let verdicts = [DataQuality::Valid, DataQuality::Suspect, DataQuality::Rejected];
    query.review = match random.below(12) {
        0 => Some(ReviewFilter::None),
        1 => Some(ReviewFilter::Outdated),
        2 => Some(ReviewFilter::Given(ReviewDecision::Accepted)),
        _ => None,
    };
    query.tags = match random.below(12) {
        0 => vec!["pilot".into()],
        1 => vec!["all".into(), "good".into()],
        2 => vec!["none".into()],
        _ => Vec::new(),
    };
    query.verdict = match random.below(8) {
        0 => Some(QualityFilter::None),
        1 => Some(QualityFilter::Given(verdicts[random.below(3)])),
        _ => None,
    };
    query
}

#[test]
fn every_search_finds_what_a_plain_scan_finds() {
    let library = library(60, 5);
    let catalog = updated(library.path());
    let entries = catalog.all().unwrap();
    assert_eq!(entries.len(), 61);
    let mut random = Random(6);
    let mut hits = 0;
    for _ in 0..600 {
        let query = random_query(&mut random);
        let found = catalog.find(&query).unwrap();
        let mut got: Vec<&str> = found.entries.iter().map(|one| one.folder.as_str()).collect();
        got.sort_unstable();
        let meant = entries.iter().filter(|entry| is_meant(&query, entry));
        let meant: Vec<&str> = meant.map(|entry| entry.folder.as_str()).collect();
        assert_eq!(got, meant, "{query:?}");
        assert_eq!((found.count, found.has_more), (meant.len(), false));
        // A page counts a few and then stops, whichever criterion leads to them.
        for (counted, skip) in [(0, 0), (6, 2), (1000, 40)] {
            let page = CatalogQuery { limit: Some(3), skip, ..query.clone() };
            let page = catalog.find_counting(&page, counted).unwrap();
            let most = counted.max(skip + 3);
            // All sessions are always counted.
            let is_capped = query.order == CatalogOrder::Started && meant.len() < entries.len();
            let count = if is_capped { meant.len().min(most) } else { meant.len() };
            assert_eq!((page.count, page.has_more), (count, count < meant.len()), "{query:?}");
            assert!(page.entries.iter().eq(found.entries.iter().skip(skip).take(3)), "{query:?}");
        }
        hits += usize::from(!got.is_empty() && got.len() < entries.len());
    }
    // A search that finds nothing or everything would prove little.
    assert!(hits > 200, "{hits}");
}

#[test]
fn sessions_before_1970_and_pages_after_the_last_are_found_as_any() {
    let library = tempfile::tempdir().unwrap();
    let mut random = Random(3);
    let new_year = |year| Utc.with_ymd_and_hms(year, 1, 1, 0, 0, 0).unwrap();
    for year in [1965, 1969, 1970, 2026] {
        let started_at = new_year(year) + Duration::hours(1);
        let manifest = Manifest { started_at, ..random_manifest(&mut random) };
        write_session(&library.path().join(format!("sessions/{year}")), &manifest, 150, true);
    }
    let catalog = updated(library.path());
    let found = |since, before, skip| {
        let (since, before) = (Some(new_year(since)), Some(new_year(before)));
        let query =
            CatalogQuery { since, before, skip, limit: Some(20), ..CatalogQuery::default() };
        let page = catalog.find(&query).unwrap();
        (page.count, page.entries.len())
    };
    assert_eq!(found(1960, 1966, 0), (1, 1));
    assert_eq!(found(1966, 1970, 0), (1, 1));
    assert_eq!(found(1966, 2026, 0), (2, 2));
    assert_eq!(found(1960, 2027, 0), (4, 4));
    assert_eq!(found(1970, 2027, usize::MAX), (2, 0));
}

#[test]
fn pages_and_orders_make_up_the_whole() {
    let library = library(30, 9);
    let catalog = updated(library.path());
    let key = |order: CatalogOrder, entry: &CatalogEntry| match order {
        CatalogOrder::Started => entry.started_at.clone(),
        CatalogOrder::Specimen => entry.specimen.clone(),
        CatalogOrder::Operator => entry.operator.clone(),
        CatalogOrder::Protocol => entry.protocol.clone(),
        CatalogOrder::Duration => format!("{:020.9}", entry.duration_s),
        CatalogOrder::Verdict => entry.verdict.map_or("", DataQuality::name).to_owned(),
        // What cannot be read has no review that anybody knows of.
        CatalogOrder::Review if entry.trouble.is_some() => "?".to_owned(),
        CatalogOrder::Review => ReviewFilter::of(entry.review.as_ref()).word().to_owned(),
    };
    for order in [
        CatalogOrder::Started,
        CatalogOrder::Specimen,
        CatalogOrder::Operator,
        CatalogOrder::Protocol,
        CatalogOrder::Duration,
        CatalogOrder::Verdict,
        CatalogOrder::Review,
    ] {
        let mut pages = Vec::new();
        for page in 0..5 {
            let query =
                CatalogQuery { order, skip: 7 * page, limit: Some(7), ..CatalogQuery::default() };
            let found = catalog.find(&query).unwrap();
            assert_eq!(found.count, 31);
            pages.extend(found.entries);
        }
        assert_eq!(pages.len(), 31);
        let is_falling = matches!(order, CatalogOrder::Started | CatalogOrder::Duration);
        for pair in pages.windows(2) {
            let keys = (key(order, &pair[0]), key(order, &pair[1]));
            let is_sorted = if is_falling { keys.0 >= keys.1 } else { keys.0 <= keys.1 };
            assert!(is_sorted, "{order:?}: {keys:?}");
        }
        let query = CatalogQuery { order, is_reversed: true, ..CatalogQuery::default() };
        pages.reverse();
        assert_eq!(catalog.find(&query).unwrap().entries, pages);
        let folders: Vec<String> = pages.iter().map(|entry| entry.folder.clone()).collect();
        assert_eq!(catalog.folders(&query).unwrap(), folders);
        let mut some = folders[3..9].to_vec();
        some.push("not there".into());
        assert_eq!(catalog.entries(&some).unwrap(), pages[3..9]);
    }
}

#[test]
fn updated_catalog_equals_a_rebuilt_one() {
    let library = library(8, 11);
    let at = library.path();
    let mut random = Random(12);
    let mut catalog = updated(at);
    let mut read = 0;
    for step in 0..40 {
        let entries = catalog.all().unwrap();
        let one = &entries[random.below(entries.len())];
        let folder = at.join(&one.folder);
        match random.below(6) {
            0 | 1 => {
                let new = random_manifest(&mut random);
                write_session(&at.join(format!("new/{step}")), &new, 200, step % 3 > 0);
            }
            2 => fs::remove_dir_all(&folder).unwrap(),
            3 => {
                let to = at.join(format!("moved/{step}"));
                fs::create_dir_all(to.parent().unwrap()).unwrap();
                fs::rename(&folder, to).unwrap();
            }
            4 if one.trouble.is_none() => {
                judge(&folder, &one.session_id, DataQuality::Suspect, "looked at again");
            }
            // Cut off somewhere: an interrupted session, or no session any more.
            _ => {
                let bytes = fs::read(folder.join(LOG_FILE)).unwrap();
                let keep = random.below(bytes.len().max(1));
                fs::write(folder.join(LOG_FILE), &bytes[..keep]).unwrap();
            }
        }
        let changes = catalog.update(&mut |_, _| {}).unwrap();
        read += changes.read;
        assert!(changes.read <= 1 && changes.removed <= 1, "{changes:?}");
        assert_eq!(catalog.check(&mut |_, _| {}).unwrap(), [], "step {step}");
    }
    assert!(read > 20, "{read}");
    let grown = catalog.all().unwrap();
    let words = CatalogQuery { words: "ada".into(), ..CatalogQuery::default() };
    let found = catalog.find(&words).unwrap();
    drop(catalog);
    // Deleted, nothing is lost.
    for name in
        [CATALOG_FILE.to_owned(), format!("{CATALOG_FILE}-wal"), format!("{CATALOG_FILE}-shm")]
    {
        let _ = fs::remove_file(at.join(name));
    }
    let rebuilt = updated(at);
    assert_eq!(rebuilt.all().unwrap(), grown);
    assert_eq!(rebuilt.find(&words).unwrap(), found);
    assert!(rebuilt.remarks.is_empty());
}

#[test]
fn a_changed_log_is_noticed_and_only_that_is_read() {
    let library = library(5, 21);
    let at = library.path();
    let mut catalog = updated(at);
    assert_eq!(catalog.update(&mut |_, _| {}).unwrap().read, 0);
    let folder = at.join("growing");
    let manifest = manifest();
    write_session(&folder, &manifest, 200, false);
    assert_eq!(catalog.update(&mut |_, _| {}).unwrap().read, 1);
    let of = |catalog: &Catalog| {
        let all = catalog.all().unwrap();
        all.into_iter().find(|one| one.folder == "growing").unwrap()
    };
    assert_eq!((of(&catalog).samples, of(&catalog).ending), (200, None));
    write_session(&folder, &manifest, 400, true);
    let doubts = catalog.check(&mut |_, _| {}).unwrap();
    assert_eq!(doubts.len(), 1);
    assert!(doubts[0].sentence.contains("has changed"), "{doubts:?}");
    assert_eq!(catalog.update(&mut |_, _| {}).unwrap().read, 1);
    assert_eq!((of(&catalog).samples, of(&catalog).ending), (400, Some("finish".into())));
    // As long as before, and other: its time tells.
    let other = Manifest { specimen: "µ-gel 4 %".into(), ..manifest };
    write_session(&folder, &other, 400, true);
    assert_eq!(catalog.update(&mut |_, _| {}).unwrap().read, 1);
    assert_eq!(of(&catalog).specimen, "µ-gel 4 %");
}

#[test]
fn several_at_a_time_end_with_the_same_catalog() {
    let library = library(40, 31);
    let at = library.path();
    std::thread::scope(|scope| {
        for number in 0..4 {
            scope.spawn(move || {
                let mut catalog = Catalog::open(at).unwrap();
                if number == 3 {
                    catalog.rebuild(&mut |_, _| {}).unwrap();
                } else {
                    catalog.update(&mut |_, _| {}).unwrap();
                }
                catalog.find(&CatalogQuery::default()).unwrap();
            });
        }
    });
    // A rebuild may have taken out what another had just written; the next update has it again.
    let catalog = updated(at);
    assert_eq!(catalog.all().unwrap().len(), 41);
    assert_eq!(catalog.check(&mut |_, _| {}).unwrap(), []);
    let query = CatalogQuery { words: "hair".into(), ..CatalogQuery::default() };
    let found = catalog.find(&query).unwrap();
    let meant = catalog.all().unwrap().iter().filter(|one| is_meant(&query, one)).count();
    assert_eq!(found.count, meant);
}

#[test]
fn what_is_typed_is_never_taken_for_syntax() {
    let library = library(10, 41);
    let catalog = updated(library.path());
    let mut texts: Vec<String> = [
        "\"",
        "'",
        "*",
        "-",
        "--",
        "a AND",
        "OR",
        "NOT x",
        "NEAR(a b, 2)",
        "text:ada",
        "^ada",
        "{a b}: c",
        "a + b",
        "(",
        ")",
        "\0",
        "ada\0",
        "%",
        "_",
        ";DROP TABLE words",
        "\u{feff}",
        "🙂",
        "e\u{301}",
        "\u{e000}",
        "١٢",
        "\\",
        "\n\t",
    ]
    .map(String::from)
    .to_vec();
    // Every kind of letter there is, a stretch of the code table at a time.
    for start in (0..0x3000u32).step_by(64) {
        texts.push((start..start + 64).filter_map(char::from_u32).collect());
    }
    for text in texts {
        for query in [
            CatalogQuery { words: text.clone(), ..CatalogQuery::default() },
            CatalogQuery { specimen: Some(text.clone()), ..CatalogQuery::default() },
            CatalogQuery { operator: Some(text.clone()), ..CatalogQuery::default() },
            CatalogQuery {
                fields: vec![FieldWords { field: SearchField::Specimen, words: text.clone() }],
                ..CatalogQuery::default()
            },
        ] {
            let found = catalog.find(&query);
            assert!(found.is_ok(), "{text:?}: {found:?}");
        }
    }
}

#[test]
fn a_file_that_is_no_catalog_is_set_aside_and_the_searches_go_on() {
    let library = library(6, 51);
    let at = library.path();
    let file = at.join(CATALOG_FILE);
    let expected = updated(at).all().unwrap();
    let whole = fs::read(&file).unwrap();
    // Another program's.
    fs::write(&file, "thesis, last chapter").unwrap();
    let catalog = updated(at);
    assert_eq!(catalog.all().unwrap(), expected);
    assert!(catalog.remarks[0].contains("was renamed to"), "{:?}", catalog.remarks);
    let aside = at.join(format!("{CATALOG_FILE}.aside-1"));
    assert_eq!(fs::read_to_string(aside).unwrap(), "thesis, last chapter");
    drop(catalog);
    // Torn and overwritten in every place: either it is still whole, or it is set aside.
    let mut random = Random(52);
    let mut set_aside = 0;
    for _ in 0..60 {
        let mut bytes = whole.clone();
        let from = random.below(bytes.len());
        let until = (from + 1 + random.below(5000)).min(bytes.len());
        bytes[from..until].iter_mut().for_each(|byte| *byte = random_byte(&mut random));
        if random.below(3) == 0 {
            bytes.truncate(from);
        }
        for ending in ["-wal", "-shm"] {
            let _ = fs::remove_file(at.join(format!("{CATALOG_FILE}{ending}")));
        }
        fs::write(&file, &bytes).unwrap();
        let words = CatalogQuery { words: "ada".into(), ..CatalogQuery::default() };
        let done = Catalog::with(at, |catalog| {
            set_aside += catalog.remarks.len();
            catalog.update(&mut |_, _| {})?;
            catalog.find(&words)?;
            catalog.all()
        });
        assert_eq!(done.unwrap(), expected);
    }
    assert!(set_aside > 10, "{set_aside}");
}

fn random_byte(random: &mut Random) -> u8 {
    random.below(256) as u8
}

#[test]
fn catalog_of_an_older_version_is_rebuilt_silently() {
    let library = library(3, 61);
    let at = library.path();
    let expected = updated(at).all().unwrap();
    let file = at.join(CATALOG_FILE);
    let mut bytes = fs::read(&file).unwrap();
    // The user version, four bytes at 60 (SQLite file format, 1.3).
    bytes[60..64].copy_from_slice(&1u32.to_be_bytes());
    fs::write(&file, bytes).unwrap();
    let catalog = updated(at);
    assert_eq!(catalog.all().unwrap(), expected);
    assert!(catalog.remarks.is_empty());
    assert!(!at.join(format!("{CATALOG_FILE}.aside-1")).exists());
}

#[test]
fn catalog_of_a_newer_version_is_left_alone_and_the_search_works() {
    let library = library(3, 61);
    let at = library.path();
    let expected = updated(at).all().unwrap();
    let file = at.join(CATALOG_FILE);
    let mut bytes = fs::read(&file).unwrap();
    bytes[60..64].copy_from_slice(&999u32.to_be_bytes());
    fs::write(&file, &bytes).unwrap();
    let mut catalog = updated(at);
    assert!(catalog.is_in_memory());
    assert_eq!(catalog.all().unwrap(), expected);
    assert!(catalog.remarks[0].contains("a newer version"), "{:?}", catalog.remarks);
    catalog.rebuild(&mut |_, _| {}).unwrap();
    drop(catalog);
    assert_eq!(fs::read(&file).unwrap(), bytes);
}
