//! Checks the words of a block against each other, in the order of Grbl (gnea/grbl, gcode.c, step 3).

use super::gcode::{
    BlockContext, CoordinateOffsets, GcodeMotion, ModalState, ParsedBlock, ProgramFlow,
};
use super::planner::{AXES, Coordinates};
use super::words::{AxisUse, BlockWords};

const MM_PER_INCH: f64 = 25.4;

/// Values of X, Y and Z in mm, where they are given.
type Axes = [Option<f64>; AXES];

pub fn check_block(
    line: BlockContext,
    mut offsets: CoordinateOffsets,
    mut words: BlockWords,
    flow: ProgramFlow,
) -> Result<ParsedBlock, u8> {
    let BlockContext { mut block, before, is_jog, here } = line;
    let scale = if block.is_inch { MM_PER_INCH } else { 1.0 };
    let axes = words.axes().map(|value| value.map(|value| value * scale));
    if axes.iter().any(Option::is_some) {
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
    // A block without it resets it.
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
    let target = target(&block, &words, axes, here, &offsets);
    let (via, stored) = non_modal(&mut offsets, &mut words, axes, &block, here, target)?;
    let motion = if is_motion && block.motion != 80 {
        motion(&block, &words, axes, (here, target), is_jog)?
    } else {
        None
    };
    refuse_leftovers(&mut words, is_jog)?;
    if is_jog {
        // Only distance mode, units and G53 are allowed.
        let is_plain = words.groups & !(1 << 0 | 1 << 3 | 1 << 6) == 0;
        if !is_plain || !matches!(words.non_modal, 0 | 53) {
            return Err(16);
        }
        // A jog changes no mode (doc/markdown/jogging.md).
        block = before;
    }
    let has_spindle = block.spindle != before.spindle
        || block.spindle != 5 && block.spindle_speed != before.spindle_speed;
    Ok(ParsedBlock {
        modes: block,
        offsets,
        dwell,
        via,
        motion: stored.or(motion),
        flow,
        waits_for_rest: dwell.is_some()
            || flow != ProgramFlow::Runs
            || matches!(words.non_modal, 10 | 281 | 301)
            || motion.is_some_and(|motion| motion.kind > 80)
            || has_spindle
            || block.has_coolant != before.has_coolant,
    })
}

/// Target of the axis words, in machine coordinates.
fn target(
    block: &ModalState,
    words: &BlockWords,
    axes: Axes,
    here: Coordinates,
    offsets: &CoordinateOffsets,
) -> Coordinates {
    let own = offsets.of(block.system);
    let is_machine = words.non_modal == 53;
    std::array::from_fn(|axis| match axes[axis] {
        None => here[axis],
        Some(value) if is_machine => value,
        Some(value) if block.is_relative => here[axis] + value,
        Some(value) => value + own[axis],
    })
}

/// Words that hold for one block: stores offsets, and returns the motions of `G28` and `G30`, via a position and to the
/// stored one.
fn non_modal(
    offsets: &mut CoordinateOffsets,
    words: &mut BlockWords,
    axes: Axes,
    block: &ModalState,
    here: Coordinates,
    target: Coordinates,
) -> Result<(Option<GcodeMotion>, Option<GcodeMotion>), u8> {
    let has_axes = axes.iter().any(Option::is_some);
    let rapid = |to| Some(GcodeMotion { kind: 0, to, feed: block.feed, is_jog: false });
    let mut motions = (None, None);
    match words.non_modal {
        10 => store(offsets, words, axes, block, here)?,
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
            let to = std::array::from_fn(|axis| match axes[axis] {
                None if has_axes => target[axis],
                _ => place[axis],
            });
            motions = (rapid(target).filter(|_| has_axes), rapid(to));
        }
        281 | 301 => offsets.stored[usize::from(words.non_modal == 301)] = here,
        921 => offsets.shift = [0.0; AXES],
        53 if block.motion > 1 => return Err(30),
        _ => {}
    }
    if block.motion == 80 && has_axes {
        return Err(31);
    }
    Ok(motions)
}

/// The motion of the axis words, if there are any.
fn motion(
    block: &ModalState,
    words: &BlockWords,
    axes: Axes,
    (here, target): (Coordinates, Coordinates),
    is_jog: bool,
) -> Result<Option<GcodeMotion>, u8> {
    let has_axes = axes.iter().any(Option::is_some);
    if block.motion != 0 && block.feed == 0.0 {
        return Err(22);
    }
    if matches!(block.motion, 2 | 3) {
        return Err(arc(block, words, axes));
    }
    if block.motion > 80 {
        if !has_axes {
            return Err(26);
        }
        if target == here {
            return Err(33);
        }
    }
    let squares = (0..AXES).map(|axis| (target[axis] - here[axis]).powi(2));
    let length = squares.sum::<f64>().sqrt();
    let share = if block.is_inverse && !is_jog { length } else { 1.0 };
    Ok(has_axes.then_some(GcodeMotion {
        kind: block.motion,
        to: target,
        feed: block.feed * share,
        is_jog,
    }))
}

/// Refuses a word that no other uses.
fn refuse_leftovers(words: &mut BlockWords, is_jog: bool) -> Result<(), u8> {
    let of_axes = words.axes_for.is_some();
    let used = [("NF", true), ("ST", !is_jog), ("XYZ", of_axes)];
    for letter in used.iter().filter(|(_, is)| *is).flat_map(|(all, _)| all.chars()) {
        words.take(letter);
    }
    if words.values.iter().any(Option::is_some) {
        return Err(36);
    }
    Ok(())
}

/// The feed of a block in mm/min.
fn feed(
    block: &ModalState,
    before: ModalState,
    words: &BlockWords,
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
        return if needs_it && given.is_none() { Err(22) } else { Ok(given.unwrap_or(0.0)) };
    }
    Ok(match given {
        Some(feed) => feed * scale,
        None if before.is_inverse => 0.0,
        None => before.feed,
    })
}

/// Error number of an arc.
fn arc(block: &ModalState, words: &BlockWords, axes: Axes) -> u8 {
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
    offsets: &mut CoordinateOffsets,
    words: &mut BlockWords,
    axes: Axes,
    block: &ModalState,
    here: Coordinates,
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
