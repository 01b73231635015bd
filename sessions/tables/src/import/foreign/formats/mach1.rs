//! Biomomentum Mach-1.

use super::{Content, FACTS_MAX, Head, Layout, Line, TextPart, parse_fact};

pub(super) const LAYOUT: Layout = Layout {
    name: "mach-1",
    source: "a Mach-1's",
    content: Content::Text {
        is_it: |lines, _| lines.first().is_some_and(|(_, line)| line.trim() == FIRST),
        cut: |lines, _| cut(&lines),
    },
    words: &[],
};

const FIRST: &str = "<Mach-1 File>";

/// A file repeats: `<INFO>`, facts, `<END INFO>`, a function's name in angle brackets, facts, `<DATA>`, a header and rows,
/// `<END DATA>`. A `<divider>` separates ramps of one function, each with times from the start.
fn cut<'a>(lines: &[Line<'a>]) -> Result<Vec<TextPart<'a>>, String> {
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
                let mut ramps: Vec<Vec<Line>> = vec![header.copied().into_iter().collect()];
                loop {
                    match rest.next() {
                        None => {
                            return Err(format!(
                                "line {number}: <DATA> has no <END DATA>; restore the missing end of the file"
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
                    let ramp = if many { format!(" ramp {}", index + 1) } else { String::new() };
                    parts.push(TextPart {
                        name: format!("{function} {nth}{ramp}"),
                        facts: facts.clone(),
                        head: header.map(|(names, _)| Head { names: *names, units: None }),
                        lines,
                    });
                }
            }
            FIRST | "<END INFO>" => {}
            name if is_begun && name.starts_with('<') && name.ends_with('>') => {
                functions.push(name.trim_matches(['<', '>']).trim().to_owned());
            }
            line if facts.len() < FACTS_MAX => facts.extend(parse_fact(line)),
            _ => {}
        }
    }
    Ok(parts)
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
    fn mach1_blocks_have_the_name_of_their_function() {
        let text = "<Mach-1 File>\r\n<INFO>\r\nTime:\t10:00:00.0\r\n<END INFO>\r\n<Zero Load>\r\n\
            <INFO>\r\nDate:\tMonday\r\n<END INFO>\r\n<Move Relative>\r\nVelocity, mm/s:\t0.1\r\n<DATA>\r\n\
            Time, s\tFz, gf\r\n0\t1\r\n1\t2\r\n<divider>\r\n0\t3\r\n<END DATA>\r\n\
            <INFO>\r\n<END INFO>\r\n<Move Relative>\r\n<DATA>\r\nTime, s\r\n<END DATA>\r\n";
        let lines = lines_of(text);
        let parts = cut(&lines).unwrap();
        let expected =
            [("Move Relative 1 ramp 1", 3), ("Move Relative 1 ramp 2", 2), ("Move Relative 2", 1)];
        assert_eq!(names(&parts), expected.map(|(name, count)| (name.to_owned(), count)));
        let facts = [("Date", "Monday"), ("Velocity, mm/s", "0.1")];
        assert_eq!(parts[0].facts, facts.map(|(key, value)| (key.to_owned(), value.to_owned())));
        assert_eq!(parts[1].lines[0], parts[0].lines[0]);
        let reason = cut(&lines[..14]).unwrap_err();
        assert!(reason.contains("line 11: <DATA> has no <END DATA>"), "{reason}");
    }
}
