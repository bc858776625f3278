//! Messages between the program and a worker; see docs/protocol.md.

use super::layout::Layout;
use asobench_identification::estimator::Window;
use serde::Serialize;
use serde_json::{Map, Value};
use xxhash_rust::xxh3::xxh3_64;

/// The version of the protocol.
pub const PROTOCOL: u64 = 1;
/// Longest header in bytes, including its line end.
pub const LONGEST_HEADER: usize = 1 << 16;
/// Largest number of a message: every language has integers of 31 bits.
const LARGEST_NUMBER: u64 = (1 << 31) - 1;
/// Longest name of a worker in characters; also the limit for its version.
const LONGEST_NAME: usize = 100;

/// The greeting that describes a cell to a worker.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Hello {
    pub frame: &'static str,
    pub protocol: u64,
    pub program: String,
    pub method: String,
    pub fingerprint: String,
    pub order: usize,
    pub na: usize,
    pub nb: usize,
    pub nc: usize,
    pub nd: usize,
    pub nf: usize,
    pub nk: usize,
    pub samples: usize,
    pub sampling: f64,
    #[serde(rename = "loop")]
    pub feedback: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Value>,
}

impl Hello {
    /// Returns the line to send.
    pub fn line(&self) -> String {
        let mut line = serde_json::to_string(self).unwrap_or_default();
        line.push('\n');
        line
    }
}

/// A worker's answer to the greeting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ready {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Whether its models are matrices, not polynomials.
    pub matrices: bool,
    /// Whether equal batches have equal replies, bit for bit.
    pub deterministic: bool,
}

impl Ready {
    /// "NAME VERSION".
    pub fn identity(&self) -> String {
        format!("{} {}", self.name, self.version)
    }

    /// Reads a worker's answer from its header.
    ///
    /// # Errors
    /// A description of the fault.
    pub fn read(header: &Map<String, Value>) -> Result<Self, String> {
        expect_frame(header, "ready")?;
        let protocol = header.get("protocol").and_then(Value::as_u64);
        if protocol != Some(PROTOCOL) {
            return Err(format!("\"protocol\" of \"ready\": expected {PROTOCOL}"));
        }
        let text = |key: &str| {
            let text = header.get(key).and_then(Value::as_str);
            let fits =
                |text: &&str| (1..=LONGEST_NAME).contains(&text.chars().count()) && !text.chars().any(char::is_control);
            let text = text.filter(fits).map(str::to_owned);
            text.ok_or_else(|| format!("\"{key}\" of \"ready\": expected a text of 1 to {LONGEST_NAME} characters"))
        };
        let matrices = match header.get("returns").and_then(Value::as_str) {
            Some("polynomials") => false,
            Some("matrices") => true,
            _ => {
                return Err("\"returns\" of \"ready\": expected \"polynomials\" or \"matrices\"".to_owned());
            }
        };
        let deterministic = header.get("deterministic").and_then(Value::as_bool);
        Ok(Self {
            name: text("name")?,
            version: text("version")?,
            matrices,
            deterministic: deterministic.ok_or("\"deterministic\" of \"ready\": expected true or false")?,
        })
    }
}

/// Returns an error if a header is not that of the frame `name`.
fn expect_frame(header: &Map<String, Value>, name: &str) -> Result<(), String> {
    match header.get("frame").and_then(Value::as_str) {
        Some(found) if found == name => Ok(()),
        _ => Err(format!("expected a header with \"frame\": \"{name}\"")),
    }
}

/// Records to send to a worker.
#[derive(Default)]
pub struct Batch {
    pub trials: Vec<u64>,
    pub seeds: Vec<u64>,
    pub u: Vec<f64>,
    pub y: Vec<f64>,
    pub r: Vec<f64>,
    pub samples: usize,
}

impl Batch {
    /// A batch without records, which will have so many samples.
    pub fn of(samples: usize) -> Self {
        Self {
            samples,
            ..Self::default()
        }
    }

    /// Removes the records; their room stays.
    pub fn clear(&mut self) {
        self.trials.clear();
        self.seeds.clear();
        [&mut self.u, &mut self.y, &mut self.r].into_iter().for_each(Vec::clear);
    }

    /// Adds a record.
    pub fn push(&mut self, trial: u64, seed: u64, of: Window<'_>) {
        self.trials.push(trial);
        self.seeds.push(seed);
        for (signal, samples) in [(&mut self.u, of.u), (&mut self.y, of.y), (&mut self.r, of.r)] {
            signal.extend_from_slice(samples);
        }
    }

    /// The number of the message with the records in the range `of`, for a process that has answered `answered`
    /// messages. It depends on the seeds, which the process cannot know before it reads the message. So no answer can
    /// arrive before its question.
    pub fn number(&self, answered: u64, of: std::ops::Range<usize>) -> u64 {
        let seeds = self.seeds[of].iter();
        let bytes = seeds.flat_map(|seed| seed.to_le_bytes());
        let bytes: Vec<u8> = bytes.chain(answered.to_le_bytes()).collect();
        1 + xxh3_64(&bytes) % LARGEST_NUMBER
    }

    /// The message with the records in the range `of`.
    pub fn frame(&self, number: u64, of: std::ops::Range<usize>) -> Vec<u8> {
        let (count, samples) = (of.len(), self.samples);
        let bytes = 8 * count * (2 + 3 * samples);
        let header = format!(
            "{{\"frame\":\"batch\",\"number\":{number},\"trials\":{count},\"samples\":{samples},\"bytes\":{bytes}}}\n"
        );
        let mut frame = Vec::with_capacity(header.len() + bytes);
        frame.extend_from_slice(header.as_bytes());
        for whole in [&self.trials, &self.seeds] {
            let numbers = whole[of.clone()].iter();
            frame.extend(numbers.flat_map(|number| (*number as f64).to_le_bytes()));
        }
        let signal = of.start * samples..of.end * samples;
        for numbers in [&self.u, &self.y, &self.r] {
            let numbers = numbers[signal.clone()].iter();
            frame.extend(numbers.flat_map(|number| number.to_le_bytes()));
        }
        frame
    }
}

/// The numbers of a reply.
pub struct Reply {
    /// The header line.
    pub header: String,
    pub layout: Layout,
    pub numbers: Vec<f64>,
}

/// A header with its length in bytes.
type Header = (usize, Map<String, Value>);

/// Bytes received from a worker.
#[derive(Default)]
pub struct Incoming {
    bytes: Vec<u8>,
    /// Number of bytes searched without finding a line end.
    searched: usize,
    /// Length and content of the header, once it is complete.
    header: Option<(usize, Layout)>,
}

impl Incoming {
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Number of bytes to read at most before they are looked at.
    pub const ROOM: usize = 1 << 16;

    pub fn add(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// Reads the header once it is complete.
    fn header(&mut self) -> Result<Option<Header>, String> {
        if self.bytes.first().is_some_and(|first| *first != b'{') {
            return Err("expected a header, which begins with '{'".to_owned());
        }
        let searched = self.searched;
        let found = self.bytes[searched..].iter().position(|b| *b == b'\n');
        let length = found.map_or(self.bytes.len(), |at| searched + at + 1);
        if length > LONGEST_HEADER {
            return Err(format!("the header has more than {LONGEST_HEADER} bytes"));
        }
        if found.is_none() {
            self.searched = length;
            return Ok(None);
        }
        let header = serde_json::from_slice(&self.bytes[..length]);
        let header = header.map_err(|error| format!("the header is not a JSON object ({error})"))?;
        Ok(Some((length, header)))
    }

    /// Takes the answer to the greeting once it is complete.
    ///
    /// # Errors
    /// A description of the fault.
    pub fn ready(&mut self) -> Result<Option<Ready>, String> {
        let Some((length, header)) = self.header()? else {
            return Ok(None);
        };
        self.forget(length);
        Ready::read(&header).map(Some)
    }

    /// Takes the reply to the message with this number once it is complete.
    ///
    /// # Errors
    /// A description of the fault.
    pub fn reply(&mut self, number: u64, trials: usize, matrices: bool) -> Result<Option<Reply>, String> {
        if self.header.is_none()
            && let Some((length, header)) = self.header()?
        {
            expect_frame(&header, "reply")?;
            let layout = Layout::read(&header, number, trials, matrices)?;
            self.header = Some((length, layout));
        }
        let Some((length, layout)) = &self.header else {
            return Ok(None);
        };
        let end = length + 8 * layout.numbers();
        if self.bytes.len() <= end {
            return Ok(None);
        }
        if self.bytes[end] != b'\n' {
            return Err("expected a line end after the blocks, which have as many bytes as \"bytes\" says".to_owned());
        }
        let numbers = self.bytes[*length..end].as_chunks::<8>().0.iter();
        let numbers = numbers.map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let header = String::from_utf8_lossy(&self.bytes[..*length]).into_owned();
        let layout = layout.clone();
        self.forget(end + 1);
        Ok(Some(Reply {
            header,
            layout,
            numbers,
        }))
    }

    /// Describes how much of an incomplete answer has arrived.
    pub fn came(&self) -> String {
        let count = self.bytes.len();
        match &self.header {
            None if count == 0 => "nothing came".to_owned(),
            None => format!("{count} bytes came, without the line end that closes a header"),
            Some((length, layout)) => {
                let (came, all) = (count - length, 8 * layout.numbers() + 1);
                let hint = if came + 1 == all {
                    ": is the line end after the blocks missing, or not flushed?"
                } else {
                    ""
                };
                format!("the header and {came} of {all} bytes came{hint}")
            }
        }
    }

    /// Removes an answer of `length` bytes. Bytes that follow it answer no request.
    fn forget(&mut self, length: usize) {
        self.bytes.drain(..length);
        self.bytes.shrink_to(Self::ROOM);
        (self.searched, self.header) = (0, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asobench_identification::estimator::Pass;

    /// The bytes that docs/protocol.md shows after a header.
    fn shown(header: &str) -> Vec<u8> {
        let text = include_str!("../../../../docs/protocol.md");
        let after = text.split_once(header).unwrap().1;
        let dump = after.lines().skip_while(|line| !line.starts_with("    0"));
        let lines = dump.take_while(|line| line.starts_with("    "));
        let bytes = lines.flat_map(str::split_whitespace);
        bytes.map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
    }

    const BATCH: &str = "{\"frame\":\"batch\",\"number\":1,\"trials\":1,\"samples\":3,\"bytes\":88}\n";
    const REPLY: &str = "{\"frame\":\"reply\",\"number\":1,\"trials\":1,\"na\":1,\"nb\":1,\"nk\":1,\"bytes\":32}\n";

    fn batch() -> Batch {
        Batch {
            trials: vec![7],
            seeds: vec![4503599627370497],
            u: vec![1.0, -1.0, 1.0],
            y: vec![0.5, 0.25, -0.125],
            r: vec![1.0, -1.0, 1.0],
            samples: 3,
        }
    }

    fn taken(incoming: &mut Incoming) -> Result<Option<Reply>, String> {
        incoming.reply(1, 1, false)
    }

    #[test]
    fn the_hello_of_the_text() {
        let hello = Hello {
            frame: "hello",
            protocol: PROTOCOL,
            program: "asobench 0.2.0".to_owned(),
            method: "mine".to_owned(),
            fingerprint: "0123456789abcdef".repeat(2),
            order: 1,
            na: 1,
            nb: 1,
            nk: 1,
            samples: 3,
            sampling: 1.0,
            feedback: "open",
            ..Hello::default()
        };
        let line = hello.line();
        assert!(
            include_str!("../../../../docs/protocol.md").contains(&format!("    {line}")),
            "{line}"
        );
    }

    #[test]
    fn the_bytes_of_the_text() {
        let frame = batch().frame(1, 0..1);
        assert_eq!(frame, [BATCH.as_bytes(), &shown(BATCH)].concat());
        let bytes = [REPLY.as_bytes(), &shown(REPLY)].concat();
        // In pieces of any size.
        for size in [1, 7, bytes.len()] {
            let mut incoming = Incoming::default();
            let mut answer = None;
            for part in bytes.chunks(size) {
                assert!(answer.is_none());
                incoming.add(part);
                answer = taken(&mut incoming).unwrap();
            }
            let reply = answer.unwrap();
            reply.check().unwrap();
            let mut pass = Pass::new(1);
            let u = [1.0, 2.0, 3.0];
            reply.fill(0, Window::new(&u, &u, 3), &mut pass);
            assert_eq!(
                (&pass.model.a[..], &pass.model.b[..]),
                (&[1.0, -0.5][..], &[0.0, 0.25][..])
            );
            assert_eq!(reply.seconds(0), 0.001);
            assert!(incoming.is_empty());
        }
        // Without its line end the reply is incomplete, and `came` says so.
        let mut incoming = Incoming::default();
        assert_eq!(incoming.came(), "nothing came");
        incoming.add(&bytes[..bytes.len() - 1]);
        assert!(taken(&mut incoming).unwrap().is_none());
        assert!(
            incoming
                .came()
                .starts_with("the header and 32 of 33 bytes came: is the line end")
        );
        let ready = include_str!("../../../../docs/protocol.md");
        let ready = ready
            .lines()
            .find(|line| line.contains("{\"frame\":\"ready\""))
            .unwrap();
        let ready = Ready::read(&serde_json::from_str(ready).unwrap()).unwrap();
        assert_eq!(ready.identity(), "least squares 1.0");
    }

    /// A fault in an answer is reported before more of the answer is awaited.
    #[test]
    fn malformed_answers() {
        let blocks = shown(REPLY);
        let reply = |from: &str, to: &str| {
            assert!(REPLY.contains(from));
            [REPLY.replace(from, to).as_bytes(), &blocks].concat()
        };
        let mut surplus = [REPLY.as_bytes(), &blocks].concat();
        surplus.splice(surplus.len() - 1.., [0; 9]);
        for (bytes, part) in [
            (b"ok\n".to_vec(), "begins with '{'"),
            (vec![b'{'; LONGEST_HEADER + 1], "more than 65536 bytes"),
            (b"{\n".to_vec(), "not a JSON object"),
            (reply("reply", "ready"), "\"frame\": \"reply\""),
            (reply("\"number\":1", "\"number\":2"), "\"number\" of"),
            (reply("\"trials\":1", "\"trials\":1.5"), "\"trials\" of"),
            (reply("\"na\":1", "\"na\":1001"), "0 to 1000"),
            (reply("\"na\":1", "\"na\":-1"), "0 to 1000"),
            (reply("\"nk\":1", "\"reasons\":[\"\"]"), "not empty"),
            (
                reply("\"na\":1", "\"na\":2"),
                "\"bytes\" of \"reply\" is 32; expected 40, 8 for each number: a trial's status, seconds and 3 of",
            ),
            (
                reply(
                    "\"na\":1,\"nb\":1",
                    "\"na\":1000,\"nb\":1000,\"nf\":1000,\"nc\":1000,\"nd\":1000,\"covariance\":true",
                ),
                "blocks of",
            ),
            (reply("\"bytes\":32", "\"bytes\":33"), "expected 32"),
            (surplus, "expected a line end"),
        ] {
            let mut incoming = Incoming::default();
            incoming.add(&bytes);
            let error = taken(&mut incoming).err().unwrap_or_default();
            assert!(error.contains(part), "{part}: {error}");
        }
    }
}
