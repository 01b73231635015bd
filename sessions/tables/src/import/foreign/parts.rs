//! A text cut into the measurements it holds: blocks of a Mach-1, intervals of a rheometer, or all of it.

use super::told::Format;

/// One measurement, before its columns are known.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextPart<'a> {
    /// Empty if the file is one measurement.
    pub name: String,
    /// What the file says of it.
    pub facts: Vec<(String, String)>,
    /// Its lines with their numbers.
    pub lines: Vec<(usize, &'a str)>,
}

/// Most lines kept of what a file says of a part; longer ones are cut.
const FACTS_MAX: usize = 64;
const FACT_LENGTH_MAX: usize = 200;

/// First line of a Mach-1 file.
const MACH1: &str = "<Mach-1 File>";
/// First cell of the line above a rheometer's interval.
const INTERVAL: &str = "Interval and data points:";
/// Line above a rheometer's step.
const STEP: &str = "[step]";

/// Lines that are not blank, with their numbers. Files of very old computers end lines with a return alone.
pub(super) fn lines_of(text: &str) -> Vec<(usize, &str)> {
    let is_blank = |line: &str| line.trim().is_empty();
    let with_numbers = |(i, line)| (i + 1, line);
    if text.contains('\n') {
        let lines = text.lines().enumerate().map(with_numbers);
        lines.filter(|(_, line)| !is_blank(line)).collect()
    } else {
        let lines = text.split('\r').enumerate().map(with_numbers);
        lines.filter(|(_, line)| !is_blank(line)).collect()
    }
}

/// The layout, from words that no other has.
pub(super) fn detect(lines: &[(usize, &str)]) -> Format {
    let has = |is_it: &dyn Fn(&str) -> bool| lines.iter().any(|(_, line)| is_it(line.trim()));
    if lines.first().is_some_and(|(_, line)| line.trim() == MACH1) {
        Format::Mach1
    } else if has(&|line| line.starts_with(INTERVAL) || line.eq_ignore_ascii_case(STEP)) {
        Format::Rheometer
    } else {
        Format::Table
    }
}

/// The measurements of a text.
pub(super) fn cut<'a>(
    format: Format,
    lines: Vec<(usize, &'a str)>,
) -> Result<Vec<TextPart<'a>>, String> {
    match format {
        Format::Mach1 => mach1(&lines),
        Format::Rheometer => rheometer(&lines),
        Format::Table | Format::Workbook => Ok(vec![TextPart {
            name: String::new(),
            facts: Vec::new(),
            lines,
        }]),
    }
}

/// A line of the form `key: value` or `key<tab>value`.
fn fact(line: &str) -> Option<(String, String)> {
    let cut = |text: &str| {
        text.trim()
            .chars()
            .take(FACT_LENGTH_MAX)
            .collect::<String>()
    };
    let (key, value) = line
        .split_once('\t')
        .or_else(|| line.split_once(':'))
        .map(|(key, value)| (cut(key.trim().trim_end_matches(':')), cut(value)))?;
    (!key.is_empty() && !value.is_empty()).then_some((key, value))
}

/// `<INFO>`, facts, `<END INFO>`, the name of a function in angle brackets, facts, `<DATA>`, a header and
/// rows, `<END DATA>`, and again. A `<divider>` stands between the ramps of one function, whose times begin
/// anew.
fn mach1<'a>(lines: &[(usize, &'a str)]) -> Result<Vec<TextPart<'a>>, String> {
    let mut parts: Vec<TextPart> = Vec::new();
    let mut functions: Vec<String> = Vec::new();
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut is_begun = false;
    let mut rest = lines.iter().peekable();
    while let Some(&(number, line)) = rest.next() {
        match line.trim() {
            "<INFO>" => {
                facts.clear();
                is_begun = true;
            }
            "<DATA>" => {
                let function = functions.last().cloned().unwrap_or_default();
                let nth = functions.iter().filter(|one| **one == function).count();
                let header = rest.next().filter(|(_, line)| !line.starts_with('<'));
                let mut ramps: Vec<Vec<(usize, &str)>> =
                    vec![header.copied().into_iter().collect()];
                loop {
                    match rest.next() {
                        None => {
                            return Err(format!(
                                "line {number}: <DATA> is never closed by <END DATA>; the end of the file is missing"
                            ));
                        }
                        Some((_, line)) if line.trim() == "<END DATA>" => break,
                        Some((_, line)) if line.trim() == "<divider>" => {
                            ramps.push(header.copied().into_iter().collect());
                        }
                        Some(row) => {
                            if let Some(ramp) = ramps.last_mut() {
                                ramp.push(*row);
                            }
                        }
                    }
                }
                let many = ramps.len() > 1;
                for (index, lines) in ramps.into_iter().enumerate() {
                    let ramp = if many {
                        format!(" ramp {}", index + 1)
                    } else {
                        String::new()
                    };
                    parts.push(TextPart {
                        name: format!("{function} {nth}{ramp}"),
                        facts: facts.clone(),
                        lines,
                    });
                }
            }
            MACH1 | "<END INFO>" => {}
            name if is_begun && name.starts_with('<') && name.ends_with('>') => {
                functions.push(name.trim_matches(['<', '>']).trim().to_owned());
            }
            line if facts.len() < FACTS_MAX => facts.extend(fact(line)),
            _ => {}
        }
    }
    Ok(parts)
}

/// Lines `Test:` and `Result:` above intervals that begin with [`INTERVAL`], or steps that begin with
/// [`STEP`] and their name.
fn rheometer<'a>(lines: &[(usize, &'a str)]) -> Result<Vec<TextPart<'a>>, String> {
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
                lines: Vec::new(),
            });
            is_in_part = true;
        } else if bare.eq_ignore_ascii_case(STEP) {
            let (_, name) = rest.next().ok_or_else(|| {
                format!("line {number}: a step without a name; the end of the file is missing")
            })?;
            parts.push(TextPart {
                name: name.trim().to_owned(),
                facts: facts.clone(),
                lines: Vec::new(),
            });
            is_in_part = true;
        } else if let Some(name) = heading(bare) {
            is_in_part = false;
            if bare.starts_with("Result") {
                result = name;
            }
            facts.extend(fact(bare).filter(|_| facts.len() < FACTS_MAX));
        } else if let Some(part) = parts.last_mut().filter(|_| is_in_part) {
            part.lines.push((number, line));
        } else {
            facts.extend(fact(bare).filter(|_| facts.len() < FACTS_MAX));
        }
    }
    Ok(parts)
}

/// The value of a line that heads what follows, such as `Result:<tab>Relaxation 1`.
fn heading(line: &str) -> Option<String> {
    let after = ["Project:", "Test:", "Result:"]
        .into_iter()
        .find_map(|word| line.strip_prefix(word))?;
    let is_separator = |c: char| c.is_whitespace() || c == ';' || c == ',';
    Some(after.trim_matches(is_separator).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(parts: &[TextPart]) -> Vec<(String, usize)> {
        let one = |part: &TextPart| (part.name.clone(), part.lines.len());
        parts.iter().map(one).collect()
    }

    #[test]
    fn mach1_blocks_are_named_by_their_function() {
        let text = "<Mach-1 File>\r\n<INFO>\r\nTime:\t10:00:00.0\r\n<END INFO>\r\n<Zero Load>\r\n\
            <INFO>\r\nDate:\tMonday\r\n<END INFO>\r\n<Move Relative>\r\nVelocity, mm/s:\t0.1\r\n<DATA>\r\n\
            Time, s\tFz, gf\r\n0\t1\r\n1\t2\r\n<divider>\r\n0\t3\r\n<END DATA>\r\n\
            <INFO>\r\n<END INFO>\r\n<Move Relative>\r\n<DATA>\r\nTime, s\r\n<END DATA>\r\n";
        let lines = lines_of(text);
        assert_eq!(detect(&lines), Format::Mach1);
        let parts = cut(Format::Mach1, lines.clone()).unwrap();
        let expected = [
            ("Move Relative 1 ramp 1", 3),
            ("Move Relative 1 ramp 2", 2),
            ("Move Relative 2", 1),
        ];
        assert_eq!(
            names(&parts),
            expected.map(|(name, count)| (name.to_owned(), count))
        );
        let facts = [("Date", "Monday"), ("Velocity, mm/s", "0.1")];
        assert_eq!(
            parts[0].facts,
            facts.map(|(key, value)| (key.to_owned(), value.to_owned()))
        );
        assert_eq!(parts[1].lines[0], parts[0].lines[0]);
        let cut_off = &lines[..14];
        let reason = cut(Format::Mach1, cut_off.to_vec()).unwrap_err();
        assert!(reason.contains("line 11: <DATA>"), "{reason}");
    }

    #[test]
    fn rheometer_intervals_and_steps_are_parts() {
        let text = "Project:\tP\n\nTest:\tgel 3\n\nResult:\tSqueeze 1\n\nInterval and data points:\t1\t2\n\
            Interval data:\tPoint No.\tTime\n\t\t[s]\n\t1\t0,5\n\t2\t1,5\n\nInterval and data points:\t2\t1\n\
            Interval data:\tPoint No.\tTime\n\t\t[s]\n\t1\t2,5\nTest:\tgel 4\n";
        let lines = lines_of(text);
        assert_eq!(detect(&lines), Format::Rheometer);
        let parts = cut(Format::Rheometer, lines).unwrap();
        let expected = [("Squeeze 1 interval 1", 4), ("Squeeze 1 interval 2", 3)];
        assert_eq!(
            names(&parts),
            expected.map(|(name, count)| (name.to_owned(), count))
        );
        assert!(parts[0].facts.contains(&("Test".into(), "gel 3".into())));
        let steps = "Filename\tx\n[step]\nAxial - 1\nTime\tGap\ns\tmm\n0\t1\n[step]\nAxial - 2\nTime\tGap\ns\tmm\n";
        let parts = cut(Format::Rheometer, lines_of(steps)).unwrap();
        let expected = [("Axial - 1", 3), ("Axial - 2", 2)];
        assert_eq!(
            names(&parts),
            expected.map(|(name, count)| (name.to_owned(), count))
        );
    }

    #[test]
    fn a_return_alone_ends_a_line() {
        let old = lines_of("a;b\r1;2\r");
        assert_eq!(old, [(1, "a;b"), (2, "1;2")]);
    }
}
