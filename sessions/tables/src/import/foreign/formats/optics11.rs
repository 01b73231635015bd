//! Optics11 Chiaro and Piuma.

use super::{Content, FACTS_MAX, Head, Layout, Line, TextPart, parse_fact};

pub(super) const LAYOUT: Layout = Layout {
    name: "optics11",
    source: "an Optics11 indenter's",
    content: Content::Text {
        is_it: |lines, _| {
            let is_dated = lines.first().is_some_and(|(_, line)| line.starts_with("Date\t"));
            is_dated && lines.iter().any(|(_, line)| is_header(line))
        },
        cut: |lines, _| cut(&lines),
    },
    words: &[],
};

fn is_header(line: &str) -> bool {
    line.starts_with("Time (s)\tLoad (uN)\t")
}

/// A file has facts, some lines with several of them, then a line of names and rows. The line without a tab names the
/// specimen.
fn cut<'a>(lines: &[Line<'a>]) -> Result<Vec<TextPart<'a>>, String> {
    let Some(at) = lines.iter().position(|(_, line)| is_header(line)) else {
        return Err(
            "the line of names 'Time (s)<tab>Load (uN)<tab>...' is missing; restore the file"
                .into(),
        );
    };
    let pairs = |line: &str| {
        let cells: Vec<&str> = line.split('\t').collect();
        match cells.as_slice() {
            [title] if !title.trim_end().ends_with(':') => {
                vec![("Specimen".to_owned(), title.trim().to_owned())]
            }
            cells => cells.chunks(2).filter_map(|pair| parse_fact(&pair.join("\t"))).collect(),
        }
    };
    let facts = lines[..at].iter().flat_map(|(_, line)| pairs(line)).take(FACTS_MAX).collect();
    Ok(vec![TextPart {
        facts,
        head: Some(Head { names: lines[at].0, units: None }),
        lines: lines[at..].to_vec(),
        ..TextPart::default()
    }])
}

#[cfg(test)]
mod tests {
    use super::super::lines_of;
    use super::*;

    #[test]
    fn facts_stand_in_pairs_and_rows_behind_their_names() {
        let text = "Date\t01/02/2020\tTime\t11:03\tStatus\tOK\ngel\nTip radius (um)\t10.000\n\
            Sweep (Relative to start):\nD[Z1] (nm)\t0.000\tt[1] (s)\t0.500\nE[v=0.50] (Pa)\t35156.063\n\n\
            Time (s)\tLoad (uN)\tIndentation (nm)\n0.0\t0.1\t1\n0.1\t0.2\t2\n";
        let lines = lines_of(text);
        let parts = cut(&lines).unwrap();
        let fact = |name: &str| {
            let found = parts[0].facts.iter().find(|(key, _)| key == name);
            found.map(|(_, value)| value.as_str())
        };
        for (name, value) in [
            ("Date", "01/02/2020"),
            ("Status", "OK"),
            ("Specimen", "gel"),
            ("Tip radius (um)", "10.000"),
            ("t[1] (s)", "0.500"),
            ("E[v=0.50] (Pa)", "35156.063"),
        ] {
            assert_eq!(fact(name), Some(value), "{name}");
        }
        assert_eq!((parts[0].lines.len(), parts[0].head.unwrap().names), (3, 8));
        assert!(cut(&lines[..5]).unwrap_err().contains("is missing"));
    }
}
