//! Text encodings.

use encoding_rs::{Encoding, GB18030, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// An encoding by one of its names (WHATWG Encoding Standard, section 4.2).
#[derive(Clone, Copy, Debug)]
pub struct TextEncoding(&'static Encoding);

impl std::str::FromStr for TextEncoding {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Encoding::for_label(text.as_bytes()).map(Self).ok_or_else(|| {
            format!(
                "no encoding is called '{text}'; give utf-8, utf-16le, utf-16be, windows-1252 or gb18030"
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
            None if is_chinese(bytes) => (
                GB18030,
                ", assumed because the bytes above 127 are pairs of common Chinese characters",
            ),
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

/// Lead bytes of punctuation and of the 3755 common characters in GB 2312, which GBK and GB18030 contain.
const COMMON_LEADS: [std::ops::RangeInclusive<u8>; 2] = [0xa1..=0xa9, 0xb0..=0xd7];

/// Whether the bytes above 127 come in pairs of GB 2312, at least one of them next to another, and nine in ten of the common
/// characters. Letters with accents stand alone between others, and lower-case Cyrillic letters are above the common leads.
fn is_chinese(bytes: &[u8]) -> bool {
    let runs = bytes.split(u8::is_ascii).filter(|run| !run.is_empty());
    let (mut pairs, mut common, mut longest) = (0, 0, 0);
    for run in runs {
        let all = run.chunks(2);
        if !all.clone().all(|pair| matches!(pair, [0xa1..=0xf7, 0xa1..=0xfe])) {
            return false;
        }
        longest = longest.max(all.len());
        pairs += all.len();
        common +=
            all.filter(|pair| COMMON_LEADS.iter().any(|leads| leads.contains(&pair[0]))).count();
    }
    longest > 1 && 10 * common >= 9 * pairs
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
    fn chinese_text_is_told_from_western_text() {
        let encoded =
            |encoding: &'static Encoding, text: &str| encoding.encode(text).0.into_owned();
        for text in ["时间,位移,载荷\ns,mm,N\n", "试验力(N)\t时间(s)\n", "试样：凝胶，第３块\n"]
        {
            let (read, how) = decode(&encoded(GB18030, text), None).unwrap();
            assert_eq!((read.as_str(), &how[..7]), (text, "gb18030"), "{how}");
        }
        for (encoding, text) in [
            (WINDOWS_1252, "Prüfzeit;größe;Déformation;µm;°C\n"),
            (WINDOWS_1252, "ÄÖ;Ol\n"),
            (encoding_rs::WINDOWS_1251, "Время;Сила;Перемещение\n"),
            (encoding_rs::WINDOWS_1250, "Obciążenie;część;źródło\n"),
        ] {
            let (_, how) = decode(&encoded(encoding, text), None).unwrap();
            assert!(how.starts_with("windows-1252"), "{text}: {how}");
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
