//! Reads packed arrays of Protocol Buffers messages
//! (<https://protobuf.dev/programming-guides/encoding/>).
//!
//! The general decoder takes values one at a time, and was two thirds of the time of going through
//! a log. Here numbers of one byte, which most differences and codes are, are taken eight at a
//! time. That decoder is the oracle of the tests.

/// One field of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Field<'a> {
    /// A single number.
    Number(u64),
    /// A packed array, or a text.
    Bytes(&'a [u8]),
}

/// Takes the next field off the front: its number and what it holds.
pub(crate) fn next_field<'a>(bytes: &mut &'a [u8]) -> Result<(u32, Field<'a>), String> {
    let key = varint(bytes)?;
    let number = u32::try_from(key >> 3).map_err(|_| "a field has no valid number".to_owned())?;
    let field = match key & 7 {
        0 => Field::Number(varint(bytes)?),
        2 => {
            let length = varint(bytes)?;
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            let (head, tail) = bytes.split_at_checked(length).ok_or("an array is cut short")?;
            *bytes = tail;
            Field::Bytes(head)
        }
        kind => return Err(format!("a field is of kind {kind}, which no block has")),
    };
    Ok((number, field))
}

fn varint(bytes: &mut &[u8]) -> Result<u64, String> {
    let mut value = 0u64;
    for place in 0..10 {
        let (&byte, rest) = bytes.split_first().ok_or("a number is cut short")?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << (7 * place);
        if byte < 0x80 {
            // The tenth byte holds the last bit.
            return if place == 9 && byte > 1 {
                Err("a number is too long".into())
            } else {
                Ok(value)
            };
        }
    }
    Err("a number is too long".into())
}

/// A number of at most eight bytes, where eight can be looked at: without a step for each byte.
#[inline]
fn varint_of_eight(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let word = u64::from_le_bytes(*bytes.first_chunk()?);
    // The first byte without its highest bit is the last of the number.
    let ends = !word & 0x8080_8080_8080_8080;
    if ends == 0 {
        return None;
    }
    let stop = ends.trailing_zeros();
    let mut value = word & (u64::MAX >> (63 - stop)) & 0x7f7f_7f7f_7f7f_7f7f;
    // Groups of seven bits move together, pair by pair.
    value = (value & 0x7f00_7f00_7f00_7f00) >> 1 | (value & 0x007f_007f_007f_007f);
    value = (value & 0x3fff_0000_3fff_0000) >> 2 | (value & 0x0000_3fff_0000_3fff);
    value = (value & 0x0fff_ffff_0000_0000) >> 4 | (value & 0x0000_0000_0fff_ffff);
    Some((value, &bytes[stop as usize / 8 + 1..]))
}

/// Adds the numbers of a packed array, each made of its plain form by `of`.
pub(crate) fn extend_numbers<T>(
    values: &mut Vec<T>,
    mut bytes: &[u8],
    of: impl Fn(u64) -> T,
) -> Result<(), String> {
    // No number is shorter than a byte.
    values.reserve(bytes.len().min(crate::block::BLOCK_ROWS_MAX));
    while !bytes.is_empty() {
        if let Some((eight, rest)) = bytes.split_first_chunk::<8>()
            && u64::from_le_bytes(*eight) & 0x8080_8080_8080_8080 == 0
        {
            values.extend(eight.map(|byte| of(u64::from(byte))));
            bytes = rest;
        } else if let Some((value, rest)) = varint_of_eight(bytes) {
            values.push(of(value));
            bytes = rest;
        } else {
            values.push(of(varint(&mut bytes)?));
        }
    }
    Ok(())
}

/// Adds the doubles of a packed array.
pub(crate) fn extend_doubles(values: &mut Vec<f64>, bytes: &[u8]) -> Result<(), String> {
    let (eights, rest) = bytes.as_chunks::<8>();
    if !rest.is_empty() {
        return Err("an array of doubles is cut short".into());
    }
    values.extend(eights.iter().map(|eight| f64::from_le_bytes(*eight)));
    Ok(())
}

/// The signed number behind its zigzag form.
pub(crate) fn zigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}
