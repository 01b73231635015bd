//! Text encodings.

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// An encoding by one of its names (WHATWG Encoding Standard, section 4.2).
#[derive(Clone, Copy, Debug)]
pub struct TextEncoding(&'static Encoding);

impl std::str::FromStr for TextEncoding {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Encoding::for_label(text.as_bytes()).map(Self).ok_or_else(|| {
            format!(
                "no encoding is called '{text}'; give utf-8, utf-16le, utf-16be or windows-1252"
            )
        })
    }
}

/// The text, and its encoding with the reason in words.
pub(super) fn decode(
    bytes: &[u8],
    chosen: Option<TextEncoding>,
) -> Result<(String, String), String> {
    let marked = Encoding::for_bom(bytes);
    let body = marked.map_or(bytes, |(_, length)| &bytes[length..]);
    let (encoding, reason) = match (chosen, marked) {
        (Some(TextEncoding(chosen)), _) => (chosen, ""),
        (None, Some((encoding, _))) => (encoding, ", from the byte order mark"),
        (None, None) => match detect_utf16(bytes) {
            Some(encoding) => (encoding, ", from the zeros in every other byte"),
            None if std::str::from_utf8(bytes).is_ok() => (UTF_8, ""),
            None => (
                WINDOWS_1252,
                ", assumed because the file is not UTF-8; other 8-bit encodings cannot be told apart",
            ),
        },
    };
    let text = encoding
        .decode_without_bom_handling_and_without_replacement(body)
        .ok_or_else(|| format!("it is not text in {}; give another encoding", encoding.name()))?;
    let is_binary = |c: char| {
        c.is_control() && !matches!(c, '\t' | '\n' | '\r' | '\u{c}' | '\u{80}'..='\u{9f}')
    };
    if text.contains(is_binary) {
        return Err("the file holds binary data; export it as text or as a spreadsheet".into());
    }
    Ok((text.into_owned(), format!("{}{reason}", encoding.name())))
}

/// Detects UTF-16 without a byte order mark: in Latin letters and digits, one byte of each pair is zero.
fn detect_utf16(bytes: &[u8]) -> Option<&'static Encoding> {
    // 2048 pairs include a header; text in an 8-bit encoding has far fewer zeros than half.
    let pairs: Vec<&[u8]> = bytes.chunks_exact(2).take(2048).collect();
    let zeros = |place: usize| pairs.iter().filter(|pair| pair[place] == 0).count();
    let (first, second) = (zeros(0), zeros(1));
    if 2 * second > pairs.len() && first == 0 {
        Some(UTF_16LE)
    } else if 2 * first > pairs.len() && second == 0 {
        Some(UTF_16BE)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_gives_the_same_text() {
        let text = "Weg [µm];Kraft\n1;2\n";
        let wide = |swap: bool, mark: bool| -> Vec<u8> {
            let units = mark.then_some(0xfeff).into_iter().chain(text.encode_utf16());
            units
                .flat_map(|unit: u16| if swap { unit.to_be_bytes() } else { unit.to_le_bytes() })
                .collect()
        };
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
        for (bytes, name) in [
            (text.as_bytes().to_vec(), "UTF-8"),
            (marked, "UTF-8"),
            (wide(false, true), "UTF-16LE"),
            (wide(true, true), "UTF-16BE"),
            (wide(false, false), "UTF-16LE"),
            (wide(true, false), "UTF-16BE"),
            (latin, "windows-1252"),
        ] {
            let (read, how) = decode(&bytes, None).unwrap();
            assert_eq!(read, text, "{name}");
            assert!(how.starts_with(name), "{how}");
        }
    }

    #[test]
    fn binary_data_is_refused() {
        assert!(decode(b"a\0\x01\x02", None).unwrap_err().contains("binary"));
        let chosen = "utf-16le".parse().unwrap();
        let reason = decode(b"\x00\xd8\x00", Some(chosen)).unwrap_err();
        assert!(reason.contains("UTF-16LE"), "{reason}");
        assert!("klingon".parse::<TextEncoding>().is_err());
    }
}
