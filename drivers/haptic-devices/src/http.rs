//! One small GET over plain HTTP 1.1, for a service on this computer.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;
use thiserror::Error;

/// More than any list of devices.
const BODY_MAX: u64 = 1 << 20;
const HEADERS_MAX: usize = 64;
const PATIENCE: Duration = Duration::from_secs(2);

/// Why there is no answer.
#[derive(Debug, Error)]
pub enum HttpError {
    #[error("no connection ({0})")]
    Connect(io::Error),
    #[error("no answer ({0})")]
    Read(io::Error),
    #[error("an answer that is not HTTP")]
    Format,
    #[error("the HTTP status {0}")]
    Status(u16),
}

/// What a GET of `path` answers, as text.
pub fn get(address: SocketAddr, path: &str) -> Result<String, HttpError> {
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE).map_err(HttpError::Connect)?;
    let request = format!(
        "GET {path} HTTP/1.1\r\nHost: {address}\r\nAccept: application/json\r\nConnection: close\r\n\r\n"
    );
    let mut answer = Vec::new();
    let mut exchange = || -> io::Result<()> {
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.write_all(request.as_bytes())?;
        read_answer(&mut stream, &mut answer)
    };
    exchange().map_err(HttpError::Read)?;
    body(&answer)
}

/// Reads until the answer is whole or the service closes; one that keeps the connection open is not waited for.
fn read_answer(stream: &mut TcpStream, answer: &mut Vec<u8>) -> io::Result<()> {
    let mut part = [0_u8; 4096];
    while (answer.len() as u64) < BODY_MAX && !is_whole(answer) {
        match stream.read(&mut part) {
            Ok(0) => break,
            Ok(count) => answer.extend_from_slice(&part[..count]),
            Err(err) if err.kind() == io::ErrorKind::Interrupted => {}
            Err(err) => return Err(err),
        }
    }
    Ok(())
}

/// Where the body begins, the status, its length if named, and whether it comes in chunks.
struct Head {
    body_at: usize,
    status: u16,
    length: Option<usize>,
    is_chunked: bool,
}

fn head(answer: &[u8]) -> Option<Head> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS_MAX];
    let mut response = httparse::Response::new(&mut headers);
    let httparse::Status::Complete(body_at) = response.parse(answer).ok()? else {
        return None;
    };
    let value = |name: &str| {
        let found = response.headers.iter().find(|header| header.name.eq_ignore_ascii_case(name));
        found.and_then(|header| std::str::from_utf8(header.value).ok())
    };
    Some(Head {
        body_at,
        status: response.code?,
        length: value("content-length").and_then(|text| text.trim().parse().ok()),
        is_chunked: value("transfer-encoding")
            .is_some_and(|text| text.to_ascii_lowercase().contains("chunked")),
    })
}

fn is_whole(answer: &[u8]) -> bool {
    head(answer).is_some_and(|head| {
        let body = &answer[head.body_at..];
        if head.is_chunked {
            unchunked(body).is_some()
        } else {
            head.length.is_some_and(|length| body.len() >= length)
        }
    })
}

fn body(answer: &[u8]) -> Result<String, HttpError> {
    let head = head(answer).ok_or(HttpError::Format)?;
    if head.status != 200 {
        return Err(HttpError::Status(head.status));
    }
    let bytes = &answer[head.body_at..];
    let bytes = match (head.is_chunked, head.length) {
        (true, _) => unchunked(bytes).ok_or(HttpError::Format)?,
        (false, Some(length)) => bytes.get(..length).ok_or(HttpError::Format)?.to_vec(),
        (false, None) => bytes.to_vec(),
    };
    String::from_utf8(bytes).map_err(|_| HttpError::Format)
}

/// The bytes of all chunks, up to the empty one; `None` if that is not there yet.
fn unchunked(mut bytes: &[u8]) -> Option<Vec<u8>> {
    let mut whole = Vec::new();
    loop {
        let httparse::Status::Complete((begin, length)) = httparse::parse_chunk_size(bytes).ok()?
        else {
            return None;
        };
        let length = usize::try_from(length).ok()?;
        if length == 0 {
            return Some(whole);
        }
        let end = begin.checked_add(length)?;
        whole.extend_from_slice(bytes.get(begin..end)?);
        // Each chunk ends with a line end of its own.
        bytes = bytes.get(end + 2..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_read_by_length_by_chunks_or_to_the_end() {
        for answer in [
            "HTTP/1.1 200 OK\r\nContent-Length: 7\r\n\r\n{\"a\":1}",
            "HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n3\r\n{\"a\r\n4\r\n\":1}\r\n0\r\n\r\n",
            "HTTP/1.0 200 OK\r\n\r\n{\"a\":1}",
        ] {
            assert_eq!(body(answer.as_bytes()).unwrap(), "{\"a\":1}", "{answer}");
        }
    }

    #[test]
    fn answers_cut_anywhere_are_refused_or_waited_for() {
        let whole =
            b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n3\r\n{\"a\r\n4\r\n\":1}\r\n0\r\n\r\n";
        // The last line end is not needed.
        for end in 0..whole.len() - 2 {
            assert!(!is_whole(&whole[..end]), "{end}");
            assert!(body(&whole[..end]).is_err(), "{end}");
        }
        assert!(matches!(body(b"SSH-2.0-x\r\n\r\n"), Err(HttpError::Format)));
        let missing = b"HTTP/1.1 404 Not Found\r\n\r\n";
        assert!(matches!(body(missing), Err(HttpError::Status(404))));
        let huge = b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\nffffffffffffffff\r\nx";
        assert!(body(huge).is_err());
    }
}
