//! HTTP/1.1 as far as a page on this machine needs it: every size and every wait has a bound, whoever sends what.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use crate::refusal::Refusal;
use crate::replies::Reply;

/// Most bytes of a request's line and headers.
const MOST_HEAD_BYTES: usize = 16 * 1024;
const MOST_HEADERS: usize = 64;
/// Most bytes of a request's body: 10 000 points have some 800 000.
const MOST_BODY_BYTES: usize = 1 << 20;
/// How long a connection may say nothing, and how long a request may take to arrive.
const PATIENCE: Duration = Duration::from_secs(10);
/// What is still read, and for how long, of a request that was refused: a connection that is cut with bytes unread loses its answer.
const MOST_UNREAD_BYTES: usize = 1 << 20;
const LAST_WAIT: Duration = Duration::from_millis(500);

/// A request without its body.
#[derive(Debug)]
pub(crate) struct RequestHead {
    pub(crate) method: String,
    pub(crate) url: String,
    headers: Vec<(String, String)>,
    is_1_0: bool,
}

impl RequestHead {
    /// A header's value; `None` where it stands twice, so that nobody reads another one than we do.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        let mut found = self.headers.iter().filter(|(header, _)| header.eq_ignore_ascii_case(name));
        let value = found.next().map(|(_, value)| value.as_str());
        value.filter(|_| found.next().is_none())
    }

    fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(header, _)| header.eq_ignore_ascii_case(name))
    }

    /// Bytes of the body that it announces.
    fn body_bytes(&self) -> Result<usize, Refusal> {
        let refuse = |status, expected: String, found: &str| Refusal::new(status, "", expected, found);
        if self.has("Transfer-Encoding") {
            return Err(refuse(411, "a body of a stated length".into(), "Transfer-Encoding"));
        }
        if !self.has("Content-Length") {
            return Ok(0);
        }
        let text = self.header("Content-Length").unwrap_or("two lengths");
        let n_bytes: u64 =
            text.parse().map_err(|_| refuse(400, "Content-Length: a whole number".into(), text))?;
        match usize::try_from(n_bytes) {
            Ok(n_bytes) if n_bytes <= MOST_BODY_BYTES => Ok(n_bytes),
            _ => Err(refuse(413, format!("a body of at most {MOST_BODY_BYTES} bytes"), text)),
        }
    }

    fn keeps_open(&self) -> bool {
        !self.is_1_0 && !self.header("Connection").is_some_and(|value| value.eq_ignore_ascii_case("close"))
    }
}

/// A connection, and what was read of its next request.
pub(crate) struct Connection {
    stream: TcpStream,
    unread: Vec<u8>,
}

impl Connection {
    pub(crate) fn new(stream: TcpStream) -> std::io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(Self { stream, unread: Vec::new() })
    }

    /// Answers requests until the other side has no more.
    ///
    /// `answer` receives a head and what reads its body.
    pub(crate) fn serve(
        mut self,
        answer: impl Fn(&RequestHead, &mut dyn FnMut() -> Result<Vec<u8>, Refusal>) -> Reply,
    ) {
        loop {
            let (head, reply, is_read) = match self.head() {
                Ok(None) => return,
                Err(refusal) => (None, Reply::refused(&refusal), false),
                Ok(Some(head)) => {
                    let mut is_read = matches!(head.body_bytes(), Ok(0));
                    let mut read_body = || {
                        let body = self.body(&head)?;
                        is_read = true;
                        Ok(body)
                    };
                    let reply = answer(&head, &mut read_body);
                    (Some(head), reply, is_read)
                }
            };
            let goes_on = is_read && head.as_ref().is_some_and(RequestHead::keeps_open);
            let is_head = head.is_some_and(|head| head.method == "HEAD");
            if self.send(&reply, is_head, goes_on).is_err() || !goes_on {
                self.end();
                return;
            }
        }
    }

    /// The next request; `None` where none comes.
    fn head(&mut self) -> Result<Option<RequestHead>, Refusal> {
        let until = Instant::now() + PATIENCE;
        loop {
            if let Some((head, n_bytes)) = parsed(&self.unread)? {
                self.unread.drain(..n_bytes);
                return Ok(Some(head));
            }
            if self.unread.len() >= MOST_HEAD_BYTES {
                let expected = format!("a request of at most {MOST_HEAD_BYTES} bytes");
                return Err(Refusal::new(431, "", expected, "a longer one"));
            }
            if !self.read_more(MOST_HEAD_BYTES, until) {
                return Ok(None);
            }
        }
    }

    /// The body of a request.
    fn body(&mut self, head: &RequestHead) -> Result<Vec<u8>, Refusal> {
        let n_bytes = head.body_bytes()?;
        if head.header("Expect").is_some_and(|value| value.eq_ignore_ascii_case("100-continue")) {
            // If it cannot be sent, nothing will come, which is seen next.
            let _ = self.stream.write_all(b"HTTP/1.1 100 Continue\r\n\r\n");
        }
        let until = Instant::now() + PATIENCE;
        while self.unread.len() < n_bytes {
            if !self.read_more(n_bytes, until) {
                let found = format!("{} bytes", self.unread.len());
                return Err(Refusal::new(408, "", format!("a body of {n_bytes} bytes"), found));
            }
        }
        Ok(self.unread.drain(..n_bytes).collect())
    }

    /// Reads what is there, waiting for it until an instant; whether anything came.
    fn read_more(&mut self, most_bytes: usize, until: Instant) -> bool {
        let mut part = [0; 8192];
        let room = most_bytes.saturating_sub(self.unread.len()).min(part.len());
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || self.stream.set_read_timeout(Some(left)).is_err() {
                return false;
            }
            match self.stream.read(&mut part[..room]) {
                Ok(n_bytes) => {
                    self.unread.extend_from_slice(&part[..n_bytes]);
                    return n_bytes > 0;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return false,
            }
        }
    }

    fn send(&mut self, reply: &Reply, is_head: bool, goes_on: bool) -> std::io::Result<()> {
        let Reply { status, headers, body } = reply;
        let connection = if goes_on { "keep-alive" } else { "close" };
        let mut text = format!("HTTP/1.1 {status} {}\r\n", reason(*status));
        for (name, value) in headers {
            text.push_str(&format!("{name}: {value}\r\n"));
        }
        text.push_str(&format!("Content-Length: {}\r\nConnection: {connection}\r\n\r\n", body.len()));
        let mut bytes = text.into_bytes();
        if !is_head {
            bytes.extend_from_slice(body);
        }
        self.stream.write_all(&bytes)
    }

    /// Closes the connection so that what was sent arrives.
    fn end(mut self) {
        // Whether the other side still listens is its own matter.
        let _ = self.stream.shutdown(Shutdown::Write);
        let until = Instant::now() + LAST_WAIT;
        let mut n_bytes = 0;
        while n_bytes < MOST_UNREAD_BYTES {
            self.unread.clear();
            if !self.read_more(MOST_UNREAD_BYTES, until) {
                return;
            }
            n_bytes += self.unread.len();
        }
    }
}

/// A request's line and headers, and the bytes they take; `None` where they go on.
fn parsed(bytes: &[u8]) -> Result<Option<(RequestHead, usize)>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    let broken = |found: String| Refusal::new(400, "", "a request of HTTP/1.1", found);
    let status = request.parse(bytes).map_err(|error| broken(error.to_string()))?;
    let httparse::Status::Complete(n_bytes) = status else { return Ok(None) };
    let text = |header: &httparse::Header<'_>| {
        (header.name.to_owned(), String::from_utf8_lossy(header.value).into_owned())
    };
    let head = RequestHead {
        method: request.method.unwrap_or_default().to_owned(),
        url: request.path.unwrap_or_default().to_owned(),
        is_1_0: request.version == Some(0),
        headers: request.headers.iter().map(text).collect(),
    };
    Ok(Some((head, n_bytes)))
}

/// What a status is called.
fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    }
}
