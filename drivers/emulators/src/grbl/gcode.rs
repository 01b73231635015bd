//! Words of a block of G-code: what it asks for, or why it is refused (gnea/grbl, gcode.c; doc/csv/error_codes_en_US.csv).
//! Arcs alone are left out: a slide has no plane. They are read, and refused as not supported if nothing else is wrong.

use super::planner::{AXES, Place};

/// Modes that stay from block to block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modes {
    /// 0 to 3, 80, or 382 to 385 for `G38.2` to `G38.5`.
    pub motion: u16,
    /// 17, 18 or 19.
    pub plane: u8,
    pub is_inch: bool,
    pub is_relative: bool,
    /// `G93`: `F` tells how many such blocks a minute has.
    pub is_inverse: bool,
    /// Of `G54` to `G59`, from 0 on.
    pub system: usize,
    /// 3, 4 or 5.
    pub spindle: u8,
    pub has_coolant: bool,
    pub tool: u8,
    /// mm/min.
    pub feed: f64,
    /// 1/min.
    pub spindle_speed: f64,
}

impl Default for Modes {
    fn default() -> Self {
        Self {
            motion: 0,
            plane: 17,
            is_inch: false,
            is_relative: false,
            is_inverse: false,
            system: 0,
            spindle: 5,
            has_coolant: false,
            tool: 0,
            feed: 0.0,
            spindle_speed: 0.0,
        }
    }
}

impl Modes {
    /// What `M2` and `M30` leave of them.
    #[must_use]
    pub fn after_end(self) -> Self {
        Self {
            is_inch: self.is_inch,
            motion: 1,
            tool: self.tool,
            feed: self.feed,
            spindle_speed: self.spindle_speed,
            ..Self::default()
        }
    }
}

/// Coordinate systems and places that are stored, in mm of the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offsets {
    /// `G54` to `G59`.
    pub systems: [Place; 6],
    /// `G28` and `G30`.
    pub stored: [Place; 2],
    /// `G92`.
    pub shift: Place,
    /// `G43.1`, of Z.
    pub tool: f64,
}

impl Offsets {
    /// Work coordinates are those of the machine less this.
    #[must_use]
    pub fn of(&self, system: usize) -> Place {
        let mut all: Place =
            std::array::from_fn(|axis| self.systems[system][axis] + self.shift[axis]);
        all[AXES - 1] += self.tool;
        all
    }
}

/// A motion that a block asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// 0, 1, or 382 to 385.
    pub kind: u16,
    /// Where to, in machine coordinates.
    pub to: Place,
    /// mm/min.
    pub feed: f64,
    /// It was asked for with `$J=`.
    pub is_jog: bool,
}

/// What becomes of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// It goes on.
    Runs,
    /// `M0`.
    Pauses,
    /// `M2` or `M30`.
    Ends,
}

/// What a block does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parsed {
    /// Modes after it.
    pub modes: Modes,
    /// Coordinates after it.
    pub offsets: Offsets,
    /// `G4`, in s.
    pub dwell: Option<f64>,
    /// A first way, of `G28` and `G30`.
    pub via: Option<Motion>,
    /// Its motion, if it has one.
    pub motion: Option<Motion>,
    /// What becomes of the program.
    pub flow: Flow,
    /// It is done only when all before it is.
    pub waits_for_rest: bool,
}

const MM_PER_INCH: f64 = 25.4;
/// `MAX_INT_DIGITS` (nuts_bolts.c): digits after these are passed over.
const DIGITS_MAX: usize = 8;

/// A number at the start of a text, and what is behind it (nuts_bolts.c, `read_float`).
pub fn number(text: &str) -> Option<(f64, &str)> {
    let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
    let mut has_point = false;
    let end = unsigned
        .find(|c: char| {
            !(c.is_ascii_digit() || c == '.' && !std::mem::replace(&mut has_point, true))
        })
        .unwrap_or(unsigned.len());
    let (digits, rest) = unsigned.split_at(end);
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.is_empty() && part.is_empty() {
        return None;
    }
    let kept = DIGITS_MAX.saturating_sub(whole.len()).min(part.len());
    let value: f64 = format!("0{whole}.{}0", &part[..kept]).parse().ok()?;
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    Some((sign * value, rest))
}

/// What the axis words of a block are for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum AxisUse {
    Motion,
    NonModal,
    ToolLength,
}

/// Words of one block.
#[derive(Default)]
struct Words {
    /// Values of the letters from A on.
    values: [Option<f64>; 26],
    /// Modal groups that have a word: `G` words in the lower half, `M` words in the upper one.
    groups: u32,
    /// 4, 10, 28, 30, 53, 92, and 281, 301, 921 for those with `.1`.
    non_modal: u16,
    axes_for: Option<AxisUse>,
    has_motion_word: bool,
    tool_length: Option<bool>,
}

impl Words {
    fn value(&self, letter: char) -> Option<f64> {
        self.values[letter as usize - 'A' as usize]
    }

    /// The value of a letter that is used up by it.
    fn take(&mut self, letter: char) -> Option<f64> {
        self.values[letter as usize - 'A' as usize].take()
    }

    fn axes(&self) -> [Option<f64>; AXES] {
        [self.value('X'), self.value('Y'), self.value('Z')]
    }

    fn claim_axes(&mut self, by: AxisUse) -> Result<(), u8> {
        if self.axes_for.replace(by).is_some() {
            return Err(24);
        }
        Ok(())
    }

    fn group(&mut self, number: u32) -> Result<(), u8> {
        let bit = 1 << number;
        if self.groups & bit != 0 {
            return Err(21);
        }
        self.groups |= bit;
        Ok(())
    }
}

/// Reads a block, or a jog without its `$J=`. `here` is where the last block ends, in machine coordinates.
pub fn parse(
    line: &str,
    modes: Modes,
    is_jog: bool,
    here: Place,
    offsets: &Offsets,
) -> Result<Parsed, u8> {
    let mut block = modes;
    if is_jog {
        block.motion = 1;
    }
    let mut words = Words::default();
    let mut flow = Flow::Runs;
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        let (value, behind) = number(&rest[1..]).ok_or(2_u8)?;
        rest = behind;
        let whole = value.trunc() as i64;
        let part = (100.0 * (value - value.trunc())).round() as i64;
        match letter {
            'G' => take_g(&mut block, &mut words, whole, part)?,
            'M' => take_m(&mut block, &mut words, &mut flow, whole, part)?,
            _ => take_value(&mut words, letter, value)?,
        }
    }
    let line = Line {
        block,
        before: modes,
        is_jog,
        here,
    };
    finish(line, *offsets, words, flow)
}

/// What a block is read with.
struct Line {
    block: Modes,
    before: Modes,
    is_jog: bool,
    here: Place,
}

fn take_g(block: &mut Modes, words: &mut Words, whole: i64, part: i64) -> Result<(), u8> {
    let mut left = part;
    let group = match whole {
        4 | 10 | 28 | 30 | 53 | 92 => {
            let has_axes = matches!(whole, 10 | 28 | 30 | 92) && part == 0;
            if has_axes {
                words.claim_axes(AxisUse::NonModal)?;
            }
            words.non_modal = whole as u16;
            if matches!(whole, 28 | 30 | 92) {
                if !matches!(part, 0 | 10) {
                    return Err(20);
                }
                if part == 10 {
                    words.non_modal = whole as u16 * 10 + 1;
                }
                left = 0;
            }
            0
        }
        0..=3 | 38 | 80 => {
            if whole != 80 {
                words.claim_axes(AxisUse::Motion)?;
                words.has_motion_word = true;
            }
            block.motion = whole as u16;
            if whole == 38 {
                if !matches!(part, 20 | 30 | 40 | 50) {
                    return Err(20);
                }
                block.motion = 380 + part as u16 / 10;
                left = 0;
            }
            1
        }
        17..=19 => {
            block.plane = whole as u8;
            2
        }
        90 | 91 if part == 0 => {
            block.is_relative = whole == 91;
            3
        }
        91 if part == 10 => {
            left = 0;
            4
        }
        93 | 94 => {
            block.is_inverse = whole == 93;
            5
        }
        20 | 21 => {
            block.is_inch = whole == 20;
            6
        }
        40 => 7,
        43 | 49 => {
            words.claim_axes(AxisUse::ToolLength)?;
            if whole == 43 && part != 10 {
                return Err(20);
            }
            words.tool_length = Some(whole == 43);
            left = 0;
            8
        }
        54..=59 => {
            block.system = whole as usize - 54;
            12
        }
        61 if part == 0 => 13,
        _ => return Err(20),
    };
    if left > 0 {
        return Err(23);
    }
    words.group(group)
}

fn take_m(
    block: &mut Modes,
    words: &mut Words,
    flow: &mut Flow,
    whole: i64,
    part: i64,
) -> Result<(), u8> {
    if part > 0 {
        return Err(23);
    }
    let group = match whole {
        0 | 1 | 2 | 30 => {
            match whole {
                0 => *flow = Flow::Pauses,
                2 | 30 => *flow = Flow::Ends,
                // A stop that may be chosen is never chosen here.
                _ => {}
            }
            16
        }
        3..=5 => {
            block.spindle = whole as u8;
            17
        }
        8 | 9 => {
            block.has_coolant = whole == 8;
            18
        }
        _ => return Err(20),
    };
    words.group(group)
}

fn take_value(words: &mut Words, letter: char, value: f64) -> Result<(), u8> {
    if !matches!(letter, 'F' | 'I'..='L' | 'N' | 'P' | 'R'..='T' | 'X'..='Z') {
        return Err(20);
    }
    if letter == 'T' && value > 255.0 {
        return Err(38);
    }
    if words.values[letter as usize - 'A' as usize]
        .replace(value)
        .is_some()
    {
        return Err(25);
    }
    if value < 0.0 && matches!(letter, 'F' | 'N' | 'P' | 'S' | 'T') {
        return Err(4);
    }
    Ok(())
}

/// Checks the words against each other, in the order in which Grbl does.
fn finish(line: Line, mut offsets: Offsets, mut words: Words, flow: Flow) -> Result<Parsed, u8> {
    let Line {
        mut block,
        before,
        is_jog,
        here,
    } = line;
    let scale = if block.is_inch { MM_PER_INCH } else { 1.0 };
    let axes = words.axes().map(|value| value.map(|value| value * scale));
    let has_axes = axes.iter().any(Option::is_some);
    if has_axes {
        words.axes_for.get_or_insert(AxisUse::Motion);
    }
    if words.value('N').is_some_and(|number| number > 1e7) {
        return Err(27);
    }
    let is_motion = words.axes_for == Some(AxisUse::Motion);
    block.feed = feed(&block, before, &words, is_jog, is_motion, scale)?;
    if let Some(speed) = words.value('S') {
        block.spindle_speed = speed;
    }
    // A block without it forgets it.
    block.tool = words.value('T').map_or(0, |tool| tool as u8);
    let dwell = match words.non_modal {
        4 => Some(words.take('P').ok_or(28_u8)?),
        _ => None,
    };
    if let Some(is_given) = words.tool_length {
        if is_given && (axes[0].or(axes[1]).is_some() || axes[2].is_none()) {
            return Err(37);
        }
        offsets.tool = axes[2].filter(|_| is_given).unwrap_or(0.0);
    }
    let mut waits_for_rest = dwell.is_some() || flow != Flow::Runs;
    let own = offsets.of(block.system);
    let is_machine = words.non_modal == 53;
    let target: Place = std::array::from_fn(|axis| match axes[axis] {
        None => here[axis],
        Some(value) if is_machine => value,
        Some(value) if block.is_relative => here[axis] + value,
        Some(value) => value + own[axis],
    });
    let rapid = |to| Motion {
        kind: 0,
        to,
        feed: block.feed,
        is_jog: false,
    };
    let (mut via, mut stored) = (None, None);
    match words.non_modal {
        10 => {
            store(&mut offsets, &mut words, axes, &block, here)?;
            waits_for_rest = true;
        }
        92 if !has_axes => return Err(26),
        92 => {
            for axis in 0..AXES {
                if let Some(value) = axes[axis] {
                    offsets.shift[axis] = 0.0;
                    offsets.shift[axis] = here[axis] - offsets.of(block.system)[axis] - value;
                }
            }
        }
        28 | 30 => {
            let place = offsets.stored[usize::from(words.non_modal == 30)];
            if has_axes {
                via = Some(rapid(target));
                let to = std::array::from_fn(|axis| {
                    if axes[axis].is_some() {
                        place[axis]
                    } else {
                        target[axis]
                    }
                });
                stored = Some(rapid(to));
            } else {
                stored = Some(rapid(place));
            }
        }
        281 | 301 => {
            offsets.stored[usize::from(words.non_modal == 301)] = here;
            waits_for_rest = true;
        }
        921 => offsets.shift = [0.0; AXES],
        53 if block.motion > 1 => return Err(30),
        _ => {}
    }
    if block.motion == 80 && has_axes {
        return Err(31);
    }
    let mut motion = None;
    if is_motion && block.motion != 80 {
        if block.motion != 0 && block.feed == 0.0 {
            return Err(22);
        }
        if matches!(block.motion, 2 | 3) {
            return Err(arc(&block, &words, axes));
        }
        if block.motion > 80 {
            if !has_axes {
                return Err(26);
            }
            if target == here {
                return Err(33);
            }
            waits_for_rest = true;
        }
        let way = (0..AXES).map(|axis| (target[axis] - here[axis]).powi(2));
        let length = way.sum::<f64>().sqrt();
        motion = has_axes.then_some(Motion {
            kind: block.motion,
            to: target,
            feed: if block.is_inverse && !is_jog {
                block.feed * length
            } else {
                block.feed
            },
            is_jog,
        });
    }
    for letter in ['N', 'F'] {
        words.take(letter);
    }
    if !is_jog {
        for letter in ['S', 'T'] {
            words.take(letter);
        }
    }
    if words.axes_for.is_some() {
        for letter in ['X', 'Y', 'Z'] {
            words.take(letter);
        }
    }
    if words.values.iter().any(Option::is_some) {
        return Err(36);
    }
    if is_jog {
        // Only distance, units and G53 beside the way.
        let is_plain = words.groups & !(1 << 0 | 1 << 3 | 1 << 6) == 0;
        if !is_plain || !matches!(words.non_modal, 0 | 53) {
            return Err(16);
        }
        // A jog leaves everything as it was (doc/markdown/jogging.md).
        return Ok(Parsed {
            modes: before,
            offsets,
            dwell: None,
            via: None,
            motion,
            flow,
            waits_for_rest: false,
        });
    }
    let has_spindle = block.spindle != before.spindle
        || block.spindle != 5 && block.spindle_speed != before.spindle_speed;
    waits_for_rest |= has_spindle || block.has_coolant != before.has_coolant;
    Ok(Parsed {
        modes: block,
        offsets,
        dwell,
        via,
        motion: stored.or(motion),
        flow,
        waits_for_rest,
    })
}

/// The feed of a block in mm/min.
fn feed(
    block: &Modes,
    before: Modes,
    words: &Words,
    is_jog: bool,
    is_motion: bool,
    scale: f64,
) -> Result<f64, u8> {
    let given = words.value('F');
    if is_jog {
        return given.map(|feed| feed * scale).ok_or(22);
    }
    if block.is_inverse {
        let needs_it = is_motion && !matches!(block.motion, 0 | 80);
        return if needs_it && given.is_none() {
            Err(22)
        } else {
            Ok(given.unwrap_or(0.0))
        };
    }
    Ok(match given {
        Some(feed) => feed * scale,
        None if before.is_inverse => 0.0,
        None => before.feed,
    })
}

/// Why an arc is refused.
fn arc(block: &Modes, words: &Words, axes: [Option<f64>; AXES]) -> u8 {
    let plane = match block.plane {
        17 => [0, 1],
        18 => [2, 0],
        _ => [1, 2],
    };
    let centre = [words.value('I'), words.value('J'), words.value('K')];
    let is_in_plane = |all: &[Option<f64>; 3]| plane.iter().any(|axis| all[*axis].is_some());
    match () {
        () if axes.iter().all(Option::is_none) => 26,
        () if !is_in_plane(&axes) => 32,
        () if words.value('R').is_none() && !is_in_plane(&centre) => 35,
        () => 20,
    }
}

/// `G10 L2` and `G10 L20`.
fn store(
    offsets: &mut Offsets,
    words: &mut Words,
    axes: [Option<f64>; AXES],
    block: &Modes,
    here: Place,
) -> Result<(), u8> {
    if axes.iter().all(Option::is_none) {
        return Err(26);
    }
    if words.value('P').is_none() && words.value('L').is_none() {
        return Err(28);
    }
    let number = words.take('P').map_or(0, |number| number as usize);
    if number > 6 {
        return Err(29);
    }
    let form = words.take('L').map_or(0, |form| form as i64);
    if form != 20 && (form != 2 || words.value('R').is_some()) {
        return Err(20);
    }
    let system = number.checked_sub(1).unwrap_or(block.system);
    for axis in 0..AXES {
        let Some(value) = axes[axis] else {
            continue;
        };
        offsets.systems[system][axis] = if form == 2 {
            value
        } else {
            let mut others = *offsets;
            others.systems[system] = [0.0; AXES];
            here[axis] - others.of(system)[axis] - value
        };
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jog(line: &str) -> Result<Parsed, u8> {
        let offsets = Offsets {
            shift: [2.0, 0.0, 0.0],
            ..Offsets::default()
        };
        parse(line, Modes::default(), true, [1.0, 0.0, 0.0], &offsets)
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
            ("G1X1F1", 16),
            ("X1F1G2", 35),
            ("X1F1M3", 16),
            ("X1F1S5", 36),
            ("X1F1A1", 20),
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
        let block = |line, modes| parse(line, modes, false, [0.0; 3], &Offsets::default());
        let first = block("G21G91G1X2F60", Modes::default()).unwrap();
        assert_eq!(first.motion.unwrap().feed, 60.0);
        assert!(first.modes.is_relative && first.modes.motion == 1);
        assert_eq!(block("X3", first.modes).unwrap().motion.unwrap().to[0], 3.0);
        assert_eq!(block("G1X1", Modes::default()), Err(22));
        assert_eq!(block("G5X1", Modes::default()), Err(20));
        assert_eq!(block("G80X1", Modes::default()), Err(31));
        let probe = block("G38.2X-5F30", Modes::default()).unwrap();
        assert_eq!(probe.motion.unwrap().kind, 382);
        assert_eq!(block("M30", Modes::default()).unwrap().flow, Flow::Ends);
    }

    #[test]
    fn what_is_refused_has_the_number_of_the_table() {
        // doc/csv/error_codes_en_US.csv, and which check of gcode.c comes first.
        for (line, error) in [
            ("G1", 22),
            ("G0.5", 23),
            ("P5", 36),
            ("X1I2", 36),
            ("G0G1X1", 24),
            ("G10G92X1", 24),
            ("M3M5", 21),
            ("M7", 20),
            ("G61.1", 20),
            ("G2X1Y1F1", 35),
            ("G2Z1F1", 32),
            ("G2F1", 26),
            ("G2X1I1F1", 20),
            ("G4", 28),
            ("G10X1", 28),
            ("G10P1X1", 20),
            ("G10L2P7X1", 29),
            ("G10L3P1X1", 20),
            ("G92", 26),
            ("G1F1G53X1Z1", 0),
            ("G38.2F1G53X1", 30),
            ("G38.2F1", 26),
            ("G38.2X0F1", 33),
            ("G43.1X1", 37),
            ("G93G1X1", 22),
            ("T256", 38),
            ("N10000001", 27),
            ("X1-2", 1),
            ("X1E3", 20),
            ("X--1", 2),
            ("G", 2),
            ("F-1", 4),
        ] {
            let done = parse(line, Modes::default(), false, [0.0; 3], &Offsets::default());
            assert_eq!(done.err().unwrap_or(0), error, "{line}");
        }
    }

    #[test]
    fn coordinates_shift_and_are_shifted_back() {
        let mut offsets = Offsets::default();
        let mut modes = Modes::default();
        let mut obey = |line: &str, here: Place| {
            let done = parse(line, modes, false, here, &offsets).unwrap();
            (modes, offsets) = (done.modes, done.offsets);
            done
        };
        let here = [5.0, 0.0, 0.0];
        assert_eq!(obey("G10L20P1X0", here).offsets.systems[0][0], 5.0);
        assert_eq!(obey("G0X1", here).motion.unwrap().to[0], 6.0);
        assert_eq!(obey("G55X1", here).motion.unwrap().to[0], 1.0);
        assert_eq!(obey("G92X2", here).offsets.shift[0], 3.0);
        assert_eq!(obey("X2", here).motion.unwrap().to[0], 5.0);
        assert_eq!(obey("G54G92.1", here).offsets.shift[0], 0.0);
        obey("G28.1", here);
        let home = obey("G28X1", [9.0, 0.0, 0.0]);
        assert_eq!(home.via.unwrap().to[0], 6.0);
        assert_eq!(home.motion.unwrap().to[0], 5.0);
        assert_eq!(modes.after_end().motion, 1);
    }

    #[test]
    fn numbers_are_read_as_the_board_reads_them() {
        assert_eq!(number("1.5X"), Some((1.5, "X")));
        assert_eq!(number("-.5"), Some((-0.5, "")));
        assert_eq!(number("1.2.3"), Some((1.2, ".3")));
        assert_eq!(number("1.123456789"), Some((1.1234567, "")));
        assert_eq!(number("."), None);
        assert_eq!(number("-"), None);
        assert_eq!(number("X"), None);
    }
}
