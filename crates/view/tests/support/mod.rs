//! A recording, a server that shows it, and a client that says what it is told to.

#![expect(dead_code, unreachable_pub, reason = "each test binary uses a part of it")]

pub mod chromium;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use chainwave_camera::OpenOptions;
use chainwave_measurement::Subset;
use chainwave_view::{Collection, Server, ShownRecording, ShownTrack};
use serde_json::Value;
use tempfile::TempDir;

pub const WIDTH: usize = 160;
const HEIGHT: usize = 90;
const N_FRAMES: usize = 3;

/// What a pixel of the recording counts, of 12 bits.
pub fn count(frame: usize, x: usize, y: usize) -> u16 {
    let mixed = (x as u32 * 7919 + y as u32 * 104_729 + frame as u32 * 31).wrapping_mul(2_654_435_761);
    (mixed >> 20) as u16
}

/// Writes a folder of images of 12 bits.
pub fn write_frames(folder: &Path, width: usize, frames: &[Vec<u16>]) {
    std::fs::create_dir(folder).unwrap();
    for (frame, counts) in frames.iter().enumerate() {
        let mut bytes = format!("P5 {width} {} 4095\n", counts.len() / width).into_bytes();
        bytes.extend(counts.iter().flat_map(|count| count.to_be_bytes()));
        std::fs::write(folder.join(format!("{frame}.pgm")), bytes).unwrap();
    }
}

/// A server of a recording `shot` and of one whose file is gone.
pub struct Site {
    pub folder: TempDir,
    pub token: String,
    port: u16,
}

impl Site {
    pub fn start() -> Self {
        let (folder, collection) = Self::shot();
        Self::of(folder, collection)
    }

    /// The recordings of a server, and their folder.
    pub fn shot() -> (TempDir, Collection) {
        let folder = tempfile::tempdir().unwrap();
        let shot = folder.path().join("shot");
        let of_frame =
            |frame: usize| (0..WIDTH * HEIGHT).map(|i| count(frame, i % WIDTH, i / WIDTH)).collect();
        write_frames(&shot, WIDTH, &(0..N_FRAMES).map(of_frame).collect::<Vec<_>>());
        let subset = Subset::new("body 1", 40.0, 45.0, 10, 10);
        let places_px = vec![Some([40.0, 45.0]), None, Some([41.5, 45.0])];
        let recording = ShownRecording {
            options: OpenOptions { rate_hz: Some(1000.0), ..OpenOptions::default() },
            subsets: vec![subset],
            tracks: vec![ShownTrack { name: "body 1".into(), half_px: [10, 10], places_px }],
            ..ShownRecording::new(shot)
        };
        let gone = ShownRecording::new(folder.path().join("gone"));
        let collection =
            Collection { title: "test".into(), recordings: vec![recording, gone], ..Collection::default() };
        (folder, collection)
    }

    /// A server of other recordings.
    pub fn of(folder: TempDir, collection: Collection) -> Self {
        let server = Arc::new(Server::bind(collection, None).unwrap());
        let address = server.address();
        let port = server.port();
        assert!(address.starts_with(&format!("http://127.0.0.1:{port}/?token=")), "{address}");
        let token = address.rsplit('=').next().unwrap().to_owned();
        std::thread::spawn(move || server.serve());
        Self { folder, token, port }
    }

    /// What a browser opens.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token)
    }

    pub fn get(&self, path: &str) -> Answer {
        self.send("GET", path, b"")
    }

    pub fn json(&self, path: &str) -> Value {
        let answer = self.get(path);
        assert_eq!(answer.status, 200, "{path}: {}", String::from_utf8_lossy(&answer.body));
        serde_json::from_slice(&answer.body).unwrap()
    }

    /// A request with the token.
    pub fn send(&self, method: &str, path: &str, body: &[u8]) -> Answer {
        let length = format!(
            "Host: 127.0.0.1:{}\r\nX-Token: {}\r\nContent-Length: {}\r\n",
            self.port,
            self.token,
            body.len()
        );
        self.raw(method, path, &length, body)
    }

    /// A request with these headers and no others.
    pub fn raw(&self, method: &str, path: &str, headers: &str, body: &[u8]) -> Answer {
        let mut stream = self.open(method, path, &format!("{headers}Connection: close\r\n"));
        // Whoever is refused at once may find the connection closed.
        let _ = stream.write_all(body);
        Answer::read(&mut stream)
    }

    /// The beginning of a request.
    pub fn open(&self, method: &str, path: &str, headers: &str) -> TcpStream {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        self.go_on(&mut stream, method, path, headers);
        stream
    }

    /// A further request on a connection.
    pub fn go_on(&self, stream: &mut TcpStream, method: &str, path: &str, headers: &str) {
        stream.write_all(format!("{method} {path} HTTP/1.1\r\n{headers}\r\n").as_bytes()).unwrap();
    }
}

/// Reads until the announced length is there, or the connection ends.
fn read_answer(stream: &mut TcpStream, bytes: &mut Vec<u8>) -> std::io::Result<()> {
    let mut part = [0; 65_536];
    loop {
        let n = stream.read(&mut part)?;
        bytes.extend_from_slice(&part[..n]);
        if n == 0 || Answer::is_whole(bytes) {
            return Ok(());
        }
    }
}

/// An answer of the server.
pub struct Answer {
    pub status: u16,
    head: String,
    pub body: Vec<u8>,
}

impl Answer {
    /// The next answer on a connection.
    pub fn read(stream: &mut TcpStream) -> Self {
        let mut bytes = Vec::new();
        // A connection that is closed on an unread body may be reset after the answer.
        let _ = read_answer(stream, &mut bytes);
        Self::parse(&bytes)
    }

    fn split(bytes: &[u8]) -> Option<(String, &[u8])> {
        let end = bytes.windows(4).position(|window| window == b"\r\n\r\n")?;
        Some((String::from_utf8_lossy(&bytes[..end]).into_owned(), &bytes[end + 4..]))
    }

    fn is_whole(bytes: &[u8]) -> bool {
        let Some((head, body)) = Self::split(bytes) else { return false };
        header_of(&head, "content-length").is_some_and(|length| length.parse() == Ok(body.len()))
    }

    fn parse(bytes: &[u8]) -> Self {
        let (head, body) = Self::split(bytes).expect("an answer has a head");
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        let is_chunked = header_of(&head, "transfer-encoding").is_some();
        assert!(!is_chunked, "answers of a known length are sent whole: {head}");
        Self { status, body: body.to_vec(), head }
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        header_of(&self.head, name)
    }

    /// Columns, rows and grey values of a picture.
    pub fn png(&self) -> ([u32; 2], Vec<u8>) {
        assert_eq!(self.status, 200, "{}", String::from_utf8_lossy(&self.body));
        let mut reader = png::Decoder::new(self.body.as_slice()).read_info().unwrap();
        assert_eq!(
            (reader.info().color_type, reader.info().bit_depth),
            (png::ColorType::Grayscale, png::BitDepth::Eight)
        );
        let mut greys = vec![0; reader.output_buffer_size()];
        let info = reader.next_frame(&mut greys).unwrap();
        ([info.width, info.height], greys)
    }
}

fn header_of<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    let mut lines = head.lines().filter_map(|line| line.split_once(':'));
    lines.find(|(found, _)| found.eq_ignore_ascii_case(name)).map(|(_, value)| value.trim())
}
