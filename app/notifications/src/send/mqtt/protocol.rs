//! Packets of MQTT 3.1.1 (OASIS Standard, 2014) that a client needs to publish with quality of service 1.

use thiserror::Error;

/// Longest remaining length of an answer that is read: all that a broker answers to a publisher has 2 bytes.
const ANSWER_BYTES_MAX: usize = 256;

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum PacketError {
    #[error("the text is too long for MQTT")]
    TooLong,
    #[error("the server does not answer as an MQTT 3.1.1 broker")]
    NoBroker,
}

/// What is said when a connection begins.
pub(crate) struct Connect<'a> {
    pub client: &'a str,
    pub keep_alive_s: u16,
    pub will: Publish<'a>,
    pub login: Option<(&'a str, &'a str)>,
}

/// What is said to all who listen.
#[derive(Clone, Copy)]
pub(crate) struct Publish<'a> {
    pub topic: &'a str,
    pub text: &'a str,
}

/// What a broker answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The return code of section 3.2.2.3; 0 accepts.
    Connected(u8),
    /// The packet of this identifier was taken.
    Taken(u16),
    Pong,
    /// Nothing that a publisher waits for.
    Other,
}

/// A length of section 2.2.3: 7 bits a byte, the lowest first.
fn remaining_length(mut length: usize) -> Result<Vec<u8>, PacketError> {
    let mut bytes = Vec::new();
    loop {
        let low = (length % 128) as u8;
        length /= 128;
        bytes.push(if length > 0 { low | 0x80 } else { low });
        if length == 0 {
            break;
        }
    }
    if bytes.len() > 4 { Err(PacketError::TooLong) } else { Ok(bytes) }
}

/// A text of section 1.5.3.
fn push_text(to: &mut Vec<u8>, text: &str) -> Result<(), PacketError> {
    let length = u16::try_from(text.len()).map_err(|_| PacketError::TooLong)?;
    to.extend(length.to_be_bytes());
    to.extend(text.as_bytes());
    Ok(())
}

fn packet(first: u8, content: &[u8]) -> Result<Vec<u8>, PacketError> {
    let mut bytes = vec![first];
    bytes.extend(remaining_length(content.len())?);
    bytes.extend(content);
    Ok(bytes)
}

/// Section 3.1, with a clean session and a will of quality of service 1 that is not retained.
pub(crate) fn connect(connect: &Connect<'_>) -> Result<Vec<u8>, PacketError> {
    const CLEAN_SESSION: u8 = 0x02;
    const WILL_AT_LEAST_ONCE: u8 = 0x04 | 0x08;
    const USER_AND_PASSWORD: u8 = 0x80 | 0x40;
    let mut content = Vec::new();
    push_text(&mut content, "MQTT")?;
    let login = connect.login.map_or(0, |_| USER_AND_PASSWORD);
    content.extend([4, CLEAN_SESSION | WILL_AT_LEAST_ONCE | login]);
    content.extend(connect.keep_alive_s.to_be_bytes());
    push_text(&mut content, connect.client)?;
    push_text(&mut content, connect.will.topic)?;
    push_text(&mut content, connect.will.text)?;
    if let Some((user, password)) = connect.login {
        push_text(&mut content, user)?;
        push_text(&mut content, password)?;
    }
    packet(0x10, &content)
}

/// Section 3.3, quality of service 1, not retained. `identifier` is above 0.
pub(crate) fn publish(publish: Publish<'_>, identifier: u16) -> Result<Vec<u8>, PacketError> {
    let mut content = Vec::new();
    push_text(&mut content, publish.topic)?;
    content.extend(identifier.to_be_bytes());
    content.extend(publish.text.as_bytes());
    packet(0x32, &content)
}

/// Section 3.12.
pub(crate) const PING: [u8; 2] = [0xC0, 0];

/// Section 3.14.
pub(crate) const DISCONNECT: [u8; 2] = [0xE0, 0];

/// Reads the first answer of these bytes: it and its length, or `None` while it is not complete.
pub(crate) fn answer(bytes: &[u8]) -> Result<Option<(Answer, usize)>, PacketError> {
    let Some((first, rest)) = bytes.split_first() else { return Ok(None) };
    let (mut length, mut used) = (0_usize, 0);
    loop {
        let Some(byte) = rest.get(used) else { return Ok(None) };
        length |= usize::from(byte & 0x7F) << (7 * used);
        used += 1;
        if byte & 0x80 == 0 {
            break;
        }
        if used == 4 {
            return Err(PacketError::NoBroker);
        }
    }
    if length > ANSWER_BYTES_MAX {
        return Err(PacketError::NoBroker);
    }
    let Some(content) = rest.get(used..used + length) else { return Ok(None) };
    let answer = match (first, content) {
        (0x20, [_, code]) => Answer::Connected(*code),
        (0x40, [high, low]) => Answer::Taken(u16::from_be_bytes([*high, *low])),
        (0xD0, []) => Answer::Pong,
        (0x20 | 0x40 | 0xD0, _) => return Err(PacketError::NoBroker),
        // Types 0 and 15 are forbidden (section 2.2.1); a web server's "HTTP" is of type 4 with flags.
        (first, _) if matches!(first >> 4, 0 | 15) || first >> 4 == 4 => {
            return Err(PacketError::NoBroker);
        }
        _ => Answer::Other,
    };
    Ok(Some((answer, 1 + used + length)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_those_of_the_standard() {
        // Table 2.4 of section 2.2.3.
        for (length, bytes) in [
            (0, vec![0x00]),
            (127, vec![0x7F]),
            (128, vec![0x80, 0x01]),
            (16_383, vec![0xFF, 0x7F]),
            (16_384, vec![0x80, 0x80, 0x01]),
            (268_435_455, vec![0xFF, 0xFF, 0xFF, 0x7F]),
        ] {
            assert_eq!(remaining_length(length), Ok(bytes), "{length}");
        }
        assert_eq!(remaining_length(268_435_456), Err(PacketError::TooLong));
    }

    #[test]
    fn packets_are_those_of_the_standard() {
        let will = Publish { topic: "a/b", text: "off" };
        let bytes =
            connect(&Connect { client: "p", keep_alive_s: 60, will, login: Some(("u", "pw")) });
        let expected = b"\x10\x1e\x00\x04MQTT\x04\xce\x00\x3c\x00\x01p\x00\x03a/b\x00\x03off\x00\x01u\x00\x02pw";
        assert_eq!(bytes.unwrap(), expected);
        // Figure 3.11 of section 3.3.2 has the same topic and identifier.
        assert_eq!(
            publish(Publish { topic: "a/b", text: "x" }, 10).unwrap(),
            b"\x32\x08\x00\x03a/b\x00\x0ax"
        );
        let long = "x".repeat(65_536);
        assert_eq!(publish(Publish { topic: &long, text: "" }, 1), Err(PacketError::TooLong));
    }

    #[test]
    fn answers_come_in_pieces() {
        let bytes = [0x20, 2, 0, 5, 0x40, 2, 1, 2, 0xD0, 0];
        for end in 0..4 {
            assert_eq!(answer(&bytes[..end]), Ok(None), "{end}");
        }
        assert_eq!(answer(&bytes), Ok(Some((Answer::Connected(5), 4))));
        assert_eq!(answer(&bytes[4..]), Ok(Some((Answer::Taken(258), 4))));
        assert_eq!(answer(&bytes[8..]), Ok(Some((Answer::Pong, 2))));
    }

    #[test]
    fn other_servers_are_no_broker() {
        for bytes in
            [&b"HTTP/1.1 400 Bad Request\r\n"[..], b"220 mail ESMTP\r\n", &[0x20; 8], &[0xFF; 8]]
        {
            let found = answer(bytes);
            assert!(
                matches!(found, Err(PacketError::NoBroker) | Ok(Some((Answer::Other, _)) | None)),
                "{found:?}"
            );
        }
        assert_eq!(answer(b"HTTP/1.1 400 Bad Request, and a text that is long enough for its length to be complete ....."), Err(PacketError::NoBroker));
        assert_eq!(answer(&[0x20, 0xFF, 0xFF, 0xFF, 0xFF, 1]), Err(PacketError::NoBroker));
    }
}
