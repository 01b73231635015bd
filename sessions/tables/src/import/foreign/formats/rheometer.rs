//! Rheometers: intervals of RheoCompass (Anton Paar), steps of TRIOS (TA Instruments).

use super::{Content, FACTS_MAX, Layout, Line, TextPart, parse_fact};

pub(super) const LAYOUT: Layout = Layout {
    name: "rheometer",
    source: "a rheometer's",
    content: Content::Text {
        is_it: |lines, _| {
            let is_head =
                |line: &str| line.starts_with(INTERVAL) || line.eq_ignore_ascii_case(STEP);
            lines.iter().any(|(_, line)| is_head(line.trim()))
        },
        cut: |lines, _| cut(&lines),
    },
    words: &[],
};

/// First cell of the line above an interval.
const INTERVAL: &str = "Interval and data points:";
const STEP: &str = "[step]";

/// A file has lines `Test:` and `Result:` and then intervals that begin with [`INTERVAL`], or steps that begin with [`STEP`]
/// and a name.
fn cut<'a>(lines: &[Line<'a>]) -> Result<Vec<TextPart<'a>>, String> {
    let mut parts: Vec<TextPart> = Vec::new();
    let mut result = String::new();
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut is_in_part = false;
    let mut rest = lines.iter();
    while let Some(&(number, line)) = rest.next() {
        let bare = line.trim();
        if let Some(after) = bare.strip_prefix(INTERVAL) {
            let after = after.trim_start_matches(['\t', ';', ',', ' ']);
            let digits: String = after.chars().take_while(char::is_ascii_digit).collect();
            let name = format!("{result} interval {digits}");
            parts.push(TextPart {
                name: name.trim().to_owned(),
                facts: facts.clone(),
                ..TextPart::default()
            });
            is_in_part = true;
        } else if bare.eq_ignore_ascii_case(STEP) {
            let (_, name) = rest.next().ok_or_else(|| {
                format!("line {number}: the step has no name; restore the missing end of the file")
            })?;
            parts.push(TextPart {
                name: name.trim().to_owned(),
                facts: facts.clone(),
                ..TextPart::default()
            });
            is_in_part = true;
        } else if let Some(name) = heading(bare) {
            is_in_part = false;
            if bare.starts_with("Result") {
                result = name;
            }
            facts.extend(parse_fact(bare).filter(|_| facts.len() < FACTS_MAX));
        } else if let Some(part) = parts.last_mut().filter(|_| is_in_part) {
            part.lines.push((number, line));
        } else {
            facts.extend(parse_fact(bare).filter(|_| facts.len() < FACTS_MAX));
        }
    }
    Ok(parts)
}

/// The value of a heading such as `Result:<tab>StressRelaxation 1`.
fn heading(line: &str) -> Option<String> {
    let after =
        ["Project:", "Test:", "Result:"].into_iter().find_map(|word| line.strip_prefix(word))?;
    let is_separator = |c: char| c.is_whitespace() || c == ';' || c == ',';
    Some(after.trim_matches(is_separator).to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::lines_of;
    use super::*;

    fn names(parts: &[TextPart]) -> Vec<(String, usize)> {
        let one = |part: &TextPart| (part.name.clone(), part.lines.len());
        parts.iter().map(one).collect()
    }

    #[test]
    fn rheometer_intervals_and_steps_become_parts() {
        let text = "Project:\tP\n\nTest:\tgel 3\n\nResult:\tSqueeze 1\n\nInterval and data points:\t1\t2\n\
            Interval data:\tPoint No.\tTime\n\t\t[s]\n\t1\t0,5\n\t2\t1,5\n\nInterval and data points:\t2\t1\n\
            Interval data:\tPoint No.\tTime\n\t\t[s]\n\t1\t2,5\nTest:\tgel 4\n";
        let lines = lines_of(text);
        let parts = cut(&lines).unwrap();
        let expected = [("Squeeze 1 interval 1", 4), ("Squeeze 1 interval 2", 3)];
        assert_eq!(names(&parts), expected.map(|(name, count)| (name.to_owned(), count)));
        assert!(parts[0].facts.contains(&("Test".into(), "gel 3".into())));
        let steps = "Filename\tx\n[step]\nAxial - 1\nTime\tGap\ns\tmm\n0\t1\n[step]\nAxial - 2\nTime\tGap\ns\tmm\n";
        let parts = cut(&lines_of(steps)).unwrap();
        let expected = [("Axial - 1", 3), ("Axial - 2", 2)];
        assert_eq!(names(&parts), expected.map(|(name, count)| (name.to_owned(), count)));
    }
}
