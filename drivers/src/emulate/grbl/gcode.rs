//! Words of a block of G-code, of which a slide needs few (gnea/grbl, gcode.c; doc/markdown/commands.md).

use super::planner::{AXES, Place};

/// Modes that stay from block to block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modes {
    /// 0, 1, 38 for `G38.2`, or 80.
    pub motion: u8,
    pub is_inch: bool,
    pub is_relative: bool,
    /// mm/min.
    pub feed: f64,
}

impl Default for Modes {
    fn default() -> Self {
        Self {
            motion: 0,
            is_inch: false,
            is_relative: false,
            feed: 0.0,
        }
    }
}

/// A motion that a block asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// 0, 1 or 38.
    pub kind: u8,
    /// Where to, in machine coordinates.
    pub to: Place,
    /// mm/min.
    pub feed: f64,
    /// It was asked for with `$J=`.
    pub is_jog: bool,
}

/// What a block does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parsed {
    /// Modes after it.
    pub modes: Modes,
    /// Its motion, if it has one.
    pub motion: Option<Motion>,
    /// `M2` or `M30`.
    pub is_end: bool,
}

const MM_PER_INCH: f64 = 25.4;

/// Splits a line without blanks into letters and numbers; error 1 or 2 (doc/markdown/interface.md).
fn words(line: &str) -> Result<Vec<(char, f64)>, u8> {
    let mut all = Vec::new();
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        rest = &rest[1..];
        let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
        let end = rest.find(|c| !is_number(c)).unwrap_or(rest.len());
        let value: f64 = rest[..end].parse().map_err(|_| 2_u8)?;
        all.push((letter, value));
        rest = &rest[end..];
    }
    Ok(all)
}

/// Reads a block, or a jog without its `$J=`. `here` is where the last block ends, `offset` the work coordinate offset.
pub fn parse(
    line: &str,
    modes: Modes,
    is_jog: bool,
    here: Place,
    offset: Place,
) -> Result<Parsed, u8> {
    let mut block = modes;
    let mut axes: [Option<f64>; AXES] = [None; AXES];
    let (mut feed, mut is_machine, mut is_end) = (None, false, false);
    let (mut has_motion, mut has_units, mut has_distance) = (false, false, false);
    for (letter, value) in words(line)? {
        let whole = (value * 10.0).round() as i64;
        match letter {
            'G' => {
                let is_new = match whole {
                    0 | 10 | 382 | 800 if !is_jog => {
                        block.motion = if whole == 382 { 38 } else { (whole / 10) as u8 };
                        !std::mem::replace(&mut has_motion, true)
                    }
                    200 | 210 => {
                        block.is_inch = whole == 200;
                        !std::mem::replace(&mut has_units, true)
                    }
                    900 | 910 => {
                        block.is_relative = whole == 910;
                        !std::mem::replace(&mut has_distance, true)
                    }
                    530 => !std::mem::replace(&mut is_machine, true),
                    // Planes, offsets and feed modes as they are anyway.
                    170 | 400 | 490 | 540 | 611 | 940 if !is_jog => true,
                    _ if is_jog => return Err(16),
                    _ => return Err(20),
                };
                if !is_new {
                    return Err(21);
                }
            }
            'X' | 'Y' | 'Z' => {
                let axis = letter as usize - 'X' as usize;
                if axes[axis].replace(value).is_some() {
                    return Err(25);
                }
            }
            'F' if value < 0.0 => return Err(4),
            'F' => {
                if feed.replace(value).is_some() {
                    return Err(25);
                }
            }
            'M' if !is_jog => match whole {
                20 | 300 => is_end = true,
                30 | 40 | 50 | 80 | 90 => {}
                _ => return Err(20),
            },
            'N' | 'S' | 'T' if !is_jog => {}
            _ if is_jog => return Err(16),
            _ => return Err(20),
        }
    }
    let scale = if block.is_inch { MM_PER_INCH } else { 1.0 };
    if let Some(feed) = feed {
        block.feed = feed * scale;
    }
    let has_axes = axes.iter().any(Option::is_some);
    let kind = if is_jog { 1 } else { block.motion };
    if is_jog && !has_axes {
        return Err(26);
    }
    if !is_jog && has_motion && kind == 38 && !has_axes {
        return Err(26);
    }
    if has_axes && kind == 80 {
        return Err(31);
    }
    let is_feed_missing = if is_jog {
        feed.is_none()
    } else {
        kind != 0 && block.feed == 0.0
    };
    if has_axes && is_feed_missing {
        return Err(22);
    }
    let mut to = here;
    for axis in 0..AXES {
        if let Some(value) = axes[axis] {
            to[axis] = match (block.is_relative, is_machine) {
                (_, true) => value * scale,
                (true, false) => here[axis] + value * scale,
                (false, false) => value * scale + offset[axis],
            };
        }
    }
    let motion = has_axes.then_some(Motion {
        kind,
        to,
        feed: block.feed,
        is_jog,
    });
    // A jog leaves the modes as they were (doc/markdown/jogging.md).
    let modes = if is_jog { modes } else { block };
    Ok(Parsed {
        modes,
        motion,
        is_end,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jog(line: &str) -> Result<Parsed, u8> {
        parse(
            line,
            Modes::default(),
            true,
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
        )
    }

    #[test]
    fn jogs_are_those_of_the_manual() {
        // doc/markdown/jogging.md: examples.
        let to = |line| jog(line).unwrap().motion.unwrap().to;
        assert_eq!(to("X10.0Y-1.5F100"), [12.0, -1.5, 0.0]);
        assert_eq!(to("G91G20X0.5F10"), [13.7, 0.0, 0.0]);
        assert_eq!(to("G53Y5.0F100"), [1.0, 5.0, 0.0]);
        assert_eq!(jog("G91X1F5").unwrap().modes, Modes::default());
        for (line, error) in [
            ("X1", 22),
            ("F100", 26),
            ("G1X1F1", 16),
            ("X1X2F1", 25),
            ("X1F-1", 4),
            ("1", 1),
            ("XF1", 2),
            ("G90G91X1F1", 21),
        ] {
            assert_eq!(jog(line), Err(error), "{line}");
        }
    }

    #[test]
    fn blocks_keep_their_modes() {
        let block = |line, modes| parse(line, modes, false, [0.0; 3], [0.0; 3]);
        let first = block("G21G91G1X2F60", Modes::default()).unwrap();
        assert_eq!(first.motion.unwrap().feed, 60.0);
        assert!(first.modes.is_relative && first.modes.motion == 1);
        assert_eq!(block("X3", first.modes).unwrap().motion.unwrap().to[0], 3.0);
        assert_eq!(block("G1X1", Modes::default()), Err(22));
        assert_eq!(block("G5X1", Modes::default()), Err(20));
        assert_eq!(block("G80X1", Modes::default()), Err(31));
        let probe = block("G38.2X-5F30", Modes::default()).unwrap();
        assert_eq!(probe.motion.unwrap().kind, 38);
        assert!(block("M30", Modes::default()).unwrap().is_end);
    }
}
