//! The files of a JPK archive, read within limits, and its properties.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Largest unpacked size of one list of properties; a real one with shared data has 127 kB.
const PROPERTIES_BYTES_MAX: u64 = 1 << 20;
/// Most values that one list of properties takes from the shared ones; a real one takes some hundred.
const RESOLVED_MAX: usize = 10_000;
/// Largest number of files; a curve has three, and some ten for each segment.
const FILES_MAX: usize = 4096;

/// Largest size of all lists of properties together, as of some hundred segments.
const PROPERTIES_BYTES_ALL: u64 = 4 << 20;

pub(super) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// What is left of it.
    properties_bytes: u64,
}

fn damaged(err: impl std::fmt::Display) -> String {
    format!("the archive cannot be unpacked ({err}); copy the file again from the instrument")
}

impl<'a> Archive<'a> {
    pub fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
        if zip.len() > FILES_MAX {
            return Err(format!(
                "the archive contains {} files, more than {FILES_MAX}; save the curve as a file of its own",
                zip.len()
            ));
        }
        Ok(Self { zip, properties_bytes: PROPERTIES_BYTES_ALL })
    }

    pub fn contains(&self, name: &str) -> bool {
        self.zip.index_for_name(name).is_some()
    }

    /// The bytes of a file that has at most so many.
    pub fn read(&mut self, name: &str, bytes_max: u64) -> Result<Vec<u8>, String> {
        let file = self.zip.by_name(name).map_err(|err| damaged(format!("{name}: {err}")))?;
        let mut content = Vec::new();
        let read = file.take(bytes_max + 1).read_to_end(&mut content);
        read.map_err(|err| damaged(format!("{name}: {err}")))?;
        if content.len() as u64 > bytes_max {
            return Err(format!(
                "{name} unpacks to more than {bytes_max} bytes; export the curve as text"
            ));
        }
        Ok(content)
    }

    pub fn properties(&mut self, name: &str) -> Result<Properties, String> {
        let bytes = self.read(name, PROPERTIES_BYTES_MAX.min(self.properties_bytes))?;
        self.properties_bytes -= bytes.len() as u64;
        Ok(Properties::of_bytes(&bytes))
    }
}

/// Lines `key=value` in Latin-1, as the class `java.util.Properties` writes them.
#[derive(Clone, Default)]
pub(super) struct Properties(BTreeMap<String, String>);

impl Properties {
    fn of_bytes(bytes: &[u8]) -> Self {
        let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
        let lines = text.lines().filter(|line| !line.trim_start().starts_with(['#', '!']));
        let pairs = lines.filter_map(|line| line.split_once('='));
        Self(pairs.map(|(key, value)| (key.trim().into(), unescaped(value.trim()))).collect())
    }

    pub fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    /// A finite number; JPK writes NaN for what was not set.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.text(key)?.parse().ok().filter(|number: &f64| number.is_finite())
    }

    pub fn with_prefix<'p>(&'p self, prefix: &'p str) -> impl Iterator<Item = (&'p str, &'p str)> {
        let pairs = self.0.range(prefix.to_owned()..);
        let pairs = pairs.take_while(move |(key, _)| key.starts_with(prefix));
        pairs.map(move |(key, value)| (&key[prefix.len()..], value.as_str()))
    }

    /// Adds what the properties refer to: `a.list.*=2` gives `a.b` the value of `list.2.b` among the shared ones.
    pub fn resolve(&mut self, shared: &Self) {
        let mut added = Vec::new();
        for (key, number) in &self.0 {
            let Some((owner, list)) =
                key.strip_suffix(".*").and_then(|reference| reference.rsplit_once('.'))
            else {
                continue;
            };
            let from = format!("{list}.{number}.");
            // A damaged file may refer to everything from everywhere.
            let found = shared.with_prefix(&from).take(RESOLVED_MAX - added.len());
            added.extend(found.map(|(rest, value)| (format!("{owner}.{rest}"), value.to_owned())));
        }
        for (key, value) in added {
            self.0.entry(key).or_insert(value);
        }
    }
}

/// A value without its escapes, such as `\:` and `\u00b5`.
fn unescaped(value: &str) -> String {
    let mut text = String::with_capacity(value.len());
    let mut rest = value.chars();
    while let Some(one) = rest.next() {
        match (one, rest.clone().next()) {
            ('\\', Some('u')) => {
                let digits: String = rest.clone().skip(1).take(4).collect();
                let code = u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32);
                match code.filter(|_| digits.len() == 4) {
                    Some(code) => {
                        text.push(code);
                        rest.nth(4);
                    }
                    None => text.push(one),
                }
            }
            ('\\', Some(next)) => {
                text.push(next);
                rest.next();
            }
            _ => text.push(one),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn properties_lose_their_escapes_and_follow_references() {
        let text = b"#Thu\n time = 17\\:51 \\u00b5m\\u12\nchannel.height.lcd-info.*=1\nnan=NaN\n";
        let mut properties = Properties::of_bytes(text);
        assert_eq!(properties.text("time"), Some("17:51 \u{b5}m\\u12"));
        assert_eq!(properties.number("nan"), None);
        let shared =
            b"lcd-info.1.unit=V\nlcd-info.10.unit=m\nlcd-info.1.encoder.type=signedshort\n";
        properties.resolve(&Properties::of_bytes(shared));
        assert_eq!(properties.text("channel.height.unit"), Some("V"));
        assert_eq!(properties.text("channel.height.encoder.type"), Some("signedshort"));
    }
}
