//! Biomomentum Mach-1.
//!
//! A file repeats: `<INFO>`, facts, `<END INFO>`, a function's name in angle brackets, facts, `<DATA>`, a header and rows,
//! `<END DATA>`. A `<divider>` ends a ramp of a function; its times go on in the next ramp or begin again.

mod press;

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

/// A function that ran, and its rows.
#[derive(Default)]
struct Block<'a> {
    function: String,
    /// The function and how often it ran before, as in `Stress Relaxation 2`.
    name: String,
    facts: Vec<(String, String)>,
    header: Option<Line<'a>>,
    /// The rows between dividers; none of a function that records nothing.
    ramps: Vec<Vec<Line<'a>>>,
    remarks: Vec<String>,
    /// The press that it belongs to, with how many of its ramps.
    press: Option<(String, usize)>,
}

impl<'a> Block<'a> {
    fn fact(&self, key: &str) -> Option<&str> {
        let found = self.facts.iter().find(|(one, _)| one == key);
        found.map(|(_, value)| value.as_str())
    }

    fn head(&self) -> Option<Head> {
        self.header.map(|(names, _)| Head { names, units: None })
    }

    /// A part for each ramp.
    fn parts(self) -> Vec<TextPart<'a>> {
        let is_one = self.ramps.len() == 1;
        let head = self.head();
        let part = |(index, rows): (usize, Vec<Line<'a>>)| TextPart {
            name: if is_one {
                self.name.clone()
            } else {
                format!("{} ramp {}", self.name, index + 1)
            },
            facts: self.facts.clone(),
            head,
            lines: self.header.into_iter().chain(rows).collect(),
            remarks: self.remarks.clone(),
            included_in: self
                .press
                .as_ref()
                .filter(|press| index < press.1)
                .map(|press| press.0.clone()),
            ..TextPart::default()
        };
        self.ramps.into_iter().enumerate().map(part).collect()
    }
}

fn cut<'a>(lines: &[Line<'a>]) -> Result<Vec<TextPart<'a>>, String> {
    let mut blocks = blocks(lines)?;
    let presses = press::join(&mut blocks);
    let mut parts: Vec<TextPart<'a>> =
        blocks.into_iter().flat_map(Block::parts).chain(presses).collect();
    // A press stands after its last block, and the part that ends the file is the last.
    parts.sort_by_key(|part| part.lines.last().map(|(number, _)| *number));
    Ok(parts)
}

fn blocks<'a>(lines: &[Line<'a>]) -> Result<Vec<Block<'a>>, String> {
    let mut blocks: Vec<Block<'a>> = Vec::new();
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut is_begun = false;
    let mut rest = lines;
    while let Some((&(number, line), after)) = rest.split_first() {
        rest = after;
        match line.trim() {
            "<INFO>" => {
                facts.clear();
                is_begun = true;
            }
            "<DATA>" => {
                if blocks.last().is_none_or(|block| !block.ramps.is_empty()) {
                    let function = blocks.last().map_or("", |block| &block.function).to_owned();
                    blocks.push(begun(function, &blocks));
                }
                if let Some(block) = blocks.last_mut() {
                    block.facts.clone_from(&facts);
                    rest = block.take_rows(number, rest)?;
                }
            }
            FIRST | "<END INFO>" => {}
            name if is_begun && name.starts_with('<') && name.ends_with('>') => {
                blocks.push(begun(name.trim_matches(['<', '>']).trim().to_owned(), &blocks));
            }
            line if facts.len() < FACTS_MAX => facts.extend(parse_fact(line)),
            _ => {}
        }
    }
    Ok(blocks)
}

fn begun<'a>(function: String, before: &[Block<'a>]) -> Block<'a> {
    let count = before.iter().filter(|block| block.function == function).count();
    Block { name: format!("{function} {}", count + 1), function, ..Block::default() }
}

impl<'a> Block<'a> {
    /// Takes header and rows below the line `<DATA>` with this number; returns the lines after them.
    fn take_rows<'l>(
        &mut self,
        number: usize,
        lines: &'l [Line<'a>],
    ) -> Result<&'l [Line<'a>], String> {
        let mut rest = lines;
        if let Some((header, after)) = rest.split_first()
            && !header.1.starts_with('<')
        {
            self.header = Some(*header);
            rest = after;
        }
        let mut ramps = vec![Vec::new()];
        let mut is_ended = false;
        while let (Some((&row, after)), false) = (rest.split_first(), is_ended) {
            match row.1.trim() {
                "<END DATA>" => is_ended = true,
                "<divider>" => ramps.push(Vec::new()),
                tag if tag.starts_with('<') => {
                    return Err(format!(
                        "line {}: '{tag}' comes before the <END DATA> of the <DATA> in line {number}; restore the missing lines",
                        row.0
                    ));
                }
                _ => {
                    if let Some(ramp) = ramps.last_mut() {
                        ramp.push(row);
                    }
                }
            }
            rest = after;
        }
        // A divider may end the last ramp, too.
        if ramps.len() > 1 && ramps.last().is_some_and(Vec::is_empty) {
            ramps.pop();
        }
        if !is_ended {
            self.remarks.push(format!(
                "line {number}: <DATA> has no <END DATA>, so the recording was interrupted or the end of the file is missing; compare the last row with the instrument's own file"
            ));
        }
        self.ramps = ramps;
        Ok(rest)
    }
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
            <INFO>\r\n<END INFO>\r\n<Move Relative>\r\n<DATA>\r\nTime, s\r\n0\r\n<divider>\r\n<END DATA>\r\n";
        let lines = lines_of(text);
        let parts = cut(&lines).unwrap();
        let expected =
            [("Move Relative 1 ramp 1", 3), ("Move Relative 1 ramp 2", 2), ("Move Relative 2", 2)];
        assert_eq!(names(&parts), expected.map(|(name, count)| (name.to_owned(), count)));
        let facts = [("Date", "Monday"), ("Velocity, mm/s", "0.1")];
        assert_eq!(parts[0].facts, facts.map(|(key, value)| (key.to_owned(), value.to_owned())));
        assert_eq!(parts[1].lines[0], parts[0].lines[0]);
        assert!(parts[1].remarks.is_empty());
        let cut_off = cut(&lines[..14]).unwrap();
        assert!(cut_off[0].remarks[0].starts_with("line 11: <DATA> has no <END DATA>"));
        let without_end: Vec<Line> =
            lines.iter().filter(|(number, _)| *number != 17).copied().collect();
        let reason = cut(&without_end).unwrap_err();
        assert!(reason.starts_with("line 18: '<INFO>' comes before"), "{reason}");
    }
}
