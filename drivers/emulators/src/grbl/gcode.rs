//! Parses a block of G-code, or refuses it with its error number (gnea/grbl, gcode.c; doc/csv/error_codes_en_US.csv).
//! Only arcs are missing: a slide has no plane. They are read, and refused as not supported if nothing else is wrong.

use super::block_check::check_block;
use super::planner::{AXES, Coordinates};
use super::words::{BlockWords, number, take_g, take_m, take_value};

/// Modes that stay from block to block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalState {
    /// 0 to 3, 80, or 382 to 385 for `G38.2` to `G38.5`.
    pub motion: u16,
    /// 17, 18 or 19.
    pub plane: u8,
    pub is_inch: bool,
    pub is_relative: bool,
    /// `G93`: `F` is the number of such blocks per minute.
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

impl Default for ModalState {
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

impl ModalState {
    /// After `M2` and `M30`.
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

/// Coordinate systems and stored positions, in machine coordinates in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoordinateOffsets {
    /// `G54` to `G59`.
    pub systems: [Coordinates; 6],
    /// `G28` and `G30`.
    pub stored: [Coordinates; 2],
    /// `G92`.
    pub shift: Coordinates,
    /// `G43.1`, of Z.
    pub tool: f64,
}

impl CoordinateOffsets {
    /// Work coordinates are machine coordinates minus this.
    pub fn of(&self, system: usize) -> Coordinates {
        let mut all: Coordinates =
            std::array::from_fn(|axis| self.systems[system][axis] + self.shift[axis]);
        all[AXES - 1] += self.tool;
        all
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GcodeMotion {
    /// 0, 1, or 382 to 385.
    pub kind: u16,
    /// Target in machine coordinates.
    pub to: Coordinates,
    /// mm/min.
    pub feed: f64,
    /// Requested with `$J=`.
    pub is_jog: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgramFlow {
    Runs,
    /// `M0`.
    Pauses,
    /// `M2` or `M30`.
    Ends,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParsedBlock {
    pub modes: ModalState,
    /// Coordinates after it.
    pub offsets: CoordinateOffsets,
    /// `G4`, in s.
    pub dwell: Option<f64>,
    /// First motion of `G28` and `G30`.
    pub via: Option<GcodeMotion>,
    pub motion: Option<GcodeMotion>,
    pub flow: ProgramFlow,
    /// It begins only after all earlier blocks have ended.
    pub waits_for_rest: bool,
}

/// Reads a block, or a jog without its `$J=`. `here` is where the last block ends, in machine coordinates.
pub fn parse(
    line: &str,
    modes: ModalState,
    is_jog: bool,
    here: Coordinates,
    offsets: &CoordinateOffsets,
) -> Result<ParsedBlock, u8> {
    let mut block = modes;
    if is_jog {
        block.motion = 1;
    }
    let mut words = BlockWords::default();
    let mut flow = ProgramFlow::Runs;
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return Err(1);
        }
        let (value, after) = number(&rest[1..]).ok_or(2_u8)?;
        rest = after;
        let whole = value.trunc() as i64;
        let part = (100.0 * (value - value.trunc())).round() as i64;
        match letter {
            'G' => take_g(&mut block, &mut words, whole, part)?,
            'M' => take_m(&mut block, &mut words, &mut flow, whole, part)?,
            _ => take_value(&mut words, letter, value)?,
        }
    }
    let line = BlockContext { block, before: modes, is_jog, here };
    check_block(line, *offsets, words, flow)
}

pub struct BlockContext {
    /// After the words of this block.
    pub block: ModalState,
    /// After the last block.
    pub before: ModalState,
    /// It came with `$J=`.
    pub is_jog: bool,
    /// Where the last block ends.
    pub here: Coordinates,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jog(line: &str) -> Result<ParsedBlock, u8> {
        let offsets = CoordinateOffsets { shift: [2.0, 0.0, 0.0], ..CoordinateOffsets::default() };
        parse(line, ModalState::default(), true, [1.0, 0.0, 0.0], &offsets)
    }

    #[test]
    fn jogs_match_the_manual() {
        // doc/markdown/jogging.md: examples.
        let to = |line| jog(line).unwrap().motion.unwrap().to;
        assert_eq!(to("X10.0Y-1.5F100"), [12.0, -1.5, 0.0]);
        assert_eq!(to("G91G20X0.5F10"), [13.7, 0.0, 0.0]);
        assert_eq!(to("G53Y5.0F100"), [1.0, 5.0, 0.0]);
        assert_eq!(jog("G91X1F5").unwrap().modes, ModalState::default());
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
        let block =
            |line, modes| parse(line, modes, false, [0.0; 3], &CoordinateOffsets::default());
        let first = block("G21G91G1X2F60", ModalState::default()).unwrap();
        assert_eq!(first.motion.unwrap().feed, 60.0);
        assert!(first.modes.is_relative && first.modes.motion == 1);
        assert_eq!(block("X3", first.modes).unwrap().motion.unwrap().to[0], 3.0);
        assert_eq!(block("G1X1", ModalState::default()), Err(22));
        assert_eq!(block("G5X1", ModalState::default()), Err(20));
        assert_eq!(block("G80X1", ModalState::default()), Err(31));
        let probe = block("G38.2X-5F30", ModalState::default()).unwrap();
        assert_eq!(probe.motion.unwrap().kind, 382);
        assert_eq!(block("M30", ModalState::default()).unwrap().flow, ProgramFlow::Ends);
    }

    #[test]
    fn refused_blocks_have_the_error_number_of_the_table() {
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
            let parsed =
                parse(line, ModalState::default(), false, [0.0; 3], &CoordinateOffsets::default());
            assert_eq!(parsed.err().unwrap_or(0), error, "{line}");
        }
    }

    #[test]
    fn coordinate_offsets_are_set_and_cleared() {
        let mut offsets = CoordinateOffsets::default();
        let mut modes = ModalState::default();
        let mut apply_block = |line: &str, here: Coordinates| {
            let parsed = parse(line, modes, false, here, &offsets).unwrap();
            (modes, offsets) = (parsed.modes, parsed.offsets);
            parsed
        };
        let here = [5.0, 0.0, 0.0];
        assert_eq!(apply_block("G10L20P1X0", here).offsets.systems[0][0], 5.0);
        assert_eq!(apply_block("G0X1", here).motion.unwrap().to[0], 6.0);
        assert_eq!(apply_block("G55X1", here).motion.unwrap().to[0], 1.0);
        assert_eq!(apply_block("G92X2", here).offsets.shift[0], 3.0);
        assert_eq!(apply_block("X2", here).motion.unwrap().to[0], 5.0);
        assert_eq!(apply_block("G54G92.1", here).offsets.shift[0], 0.0);
        apply_block("G28.1", here);
        let home = apply_block("G28X1", [9.0, 0.0, 0.0]);
        assert_eq!(home.via.unwrap().to[0], 6.0);
        assert_eq!(home.motion.unwrap().to[0], 5.0);
        assert_eq!(modes.after_end().motion, 1);
    }
}
