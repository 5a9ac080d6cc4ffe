//! Reading a trace, whole or cut short.
//!
//! Responsible for: the file's framing, checksums and channels; refusing what is no trace, with
//! the way out; handing records over span by span.
//! Not responsible for: whether the run they tell of is a legal one (`check`) or where bodies are
//! between records (`replay`).
//!
//! Terms: a *span* is all that lies between two marks. Records behind the last mark are not used:
//! only a mark says that nothing before it is missing.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Read};

use mcap::McapError;
use mcap::records::{Record as Raw, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::de::DeserializeOwned;

use crate::channel::{Channel, ENCODING};
use crate::fit::{self, Unfit};
use crate::record::{End, Event, Gap, Mark, Motion, SceneRecord, State};

/// Longest record of a file that is read, bytes. Chunks are about 1 MiB.
const MAX_RECORD_BYTES: usize = 64 << 20;
/// Most bytes asked of the source at a time.
const READ_BYTES: usize = 64 << 10;
/// Opcode and length in front of each record.
const FRAME_BYTES: usize = 9;

/// Why a trace cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error("could not be read: {0}")]
    Io(io::Error),
    /// No MCAP file.
    #[error(
        "is no trace: it does not begin as an MCAP file does; give a file written by `--trace`"
    )]
    Foreign,
    /// An MCAP file of another program.
    #[error(
        "is an MCAP file, but no trace of this program: it does not begin with a `scene` record; \
         give a file written by `--trace`"
    )]
    OtherProgram,
    /// Cut before anything could be read.
    #[error(
        "ends before its first whole chunk, so there is nothing to check; record the run again"
    )]
    TooShort,
    /// Compressed by another program.
    #[error(
        "is compressed with {0}, which this program does not read; write it anew without compression, \
         for instance with `mcap decompress`"
    )]
    Compressed(String),
    /// Bytes were changed after they were written.
    #[error(
        "is damaged after {} s of the run: {source}; use another copy or record the run again",
        seconds(*after_ns)
    )]
    Damaged {
        /// Time up to which it reads well, ns.
        after_ns: u64,
        /// What was found.
        source: McapError,
    },
    /// A record that is not what its channel's records are.
    #[error(
        "has a {channel} record after {} s of the run that is none: {source}; record the run again \
         with this version of the program",
        seconds(*after_ns)
    )]
    Json {
        /// Its channel.
        channel: &'static str,
        /// Time up to which the trace reads well, ns.
        after_ns: u64,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// A record that contradicts the scene.
    #[error(
        "has a {channel} record after {} s of the run that {source}; record the run again with this \
         version of the program",
        seconds(*after_ns)
    )]
    Unfit {
        /// Its channel.
        channel: &'static str,
        /// Time up to which the trace reads well, ns.
        after_ns: u64,
        /// What is wrong with it.
        source: Unfit,
    },
}

fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// One record behind the scene.
#[derive(Clone, Debug, PartialEq)]
enum Record {
    Motion(Motion),
    Event(Event),
    State(State),
    Mark(Mark),
    Gap(Gap),
    End(End),
}

/// What ends a span.
#[derive(Clone, Debug, PartialEq)]
pub enum Close {
    /// Everything up to this time has been read.
    Mark(Mark),
    /// Batches are missing from here on.
    Gap(Gap),
    /// The trace ends as it should.
    End(End),
}

/// All records between two marks, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Pieces of motion.
    pub motions: Vec<Motion>,
    /// Events.
    pub events: Vec<Event>,
    /// States.
    pub states: Vec<State>,
    /// What ends it.
    pub close: Close,
}

/// Reads one trace from start to end, as an iterator over spans. It stops after the first error.
pub struct Reader<R> {
    file: Frames<R>,
    channels: BTreeMap<u16, Option<Channel>>,
    scene: SceneRecord,
    last: Mark,
    ended: bool,
    over: bool,
}

impl<R: Read> Reader<R> {
    /// Opens a trace and reads its scene.
    ///
    /// # Errors
    /// It is no trace, of another version, damaged, or cut before its first chunk.
    pub fn new(source: R) -> Result<Self, ReadError> {
        let mut file = Frames::new(source)?;
        let mut channels = BTreeMap::new();
        let (channel, data) = loop {
            match file.next() {
                Ok(Some((opcode, body))) => {
                    if let Some(message) = message(&mut channels, opcode, &body, 0)? {
                        break message;
                    }
                }
                Ok(None) => return Err(ReadError::OtherProgram),
                Err(FrameError::Cut) => return Err(ReadError::TooShort),
                Err(FrameError::Read(error)) => return Err(error.at(0)),
            }
        };
        if channel != Channel::Scene {
            return Err(ReadError::OtherProgram);
        }
        // The format first: another version's record may not parse at all.
        #[derive(serde::Deserialize)]
        struct Head {
            format: u32,
        }
        let head: Head = parse(channel, &data, 0)?;
        if head.format != crate::record::FORMAT {
            return Err(unfit(channel, 0, Unfit::Format { found: head.format }));
        }
        let scene: SceneRecord = parse(channel, &data, 0)?;
        fit::scene(&scene).map_err(|source| unfit(channel, 0, source))?;
        Ok(Self {
            file,
            channels,
            scene,
            last: Mark {
                tick: 0,
                time_ns: 0,
            },
            ended: false,
            over: false,
        })
    }

    /// What does not change.
    #[must_use]
    pub const fn scene(&self) -> &SceneRecord {
        &self.scene
    }

    /// Time up to which the trace has been read, ns.
    #[must_use]
    pub const fn read_until_ns(&self) -> u64 {
        self.last.time_ns
    }

    /// Whether the trace has been read to its `end` record. A trace that is over without one was
    /// cut short.
    #[must_use]
    pub const fn has_ended(&self) -> bool {
        self.ended
    }

    /// The next record, or none where the file ends, be it as it should or not.
    fn record(&mut self) -> Result<Option<Record>, ReadError> {
        let after_ns = self.last.time_ns;
        loop {
            match self.file.next() {
                Ok(Some((opcode, body))) => {
                    let message = message(&mut self.channels, opcode, &body, after_ns)?;
                    if let Some((channel, data)) = message {
                        return decode(channel, &data, &self.scene, after_ns).map(Some);
                    }
                }
                Ok(None) | Err(FrameError::Cut) => return Ok(None),
                Err(FrameError::Read(error)) => return Err(error.at(after_ns)),
            }
        }
    }

    /// Behind the `end` record come the index of the file and the checksum over all of it, which
    /// tells of damage that left each record by itself readable.
    fn read_behind_the_end(&mut self) -> Result<(), ReadError> {
        match self.record()? {
            Some(_) => {
                let what = Unfit::Place {
                    what: "is followed by more records",
                };
                Err(unfit(Channel::End, self.last.time_ns, what))
            }
            None => Ok(()),
        }
    }

    fn span(&mut self) -> Result<Option<Span>, ReadError> {
        let (mut motions, mut events, mut states) = (Vec::new(), Vec::new(), Vec::new());
        let close = loop {
            match self.record()? {
                Some(Record::Motion(motion)) => motions.push(motion),
                Some(Record::Event(event)) => events.push(event),
                Some(Record::State(state)) => states.push(state),
                Some(Record::Mark(mark)) => break Close::Mark(mark),
                Some(Record::Gap(gap)) => break Close::Gap(gap),
                Some(Record::End(end)) => break Close::End(end),
                None => return Ok(None),
            }
        };
        match &close {
            Close::Mark(mark) => self.last = *mark,
            Close::Gap(_) => {}
            Close::End(_) => {
                self.ended = true;
                self.read_behind_the_end()?;
            }
        }
        Ok(Some(Span {
            motions,
            events,
            states,
            close,
        }))
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Span, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.over {
            return None;
        }
        let span = self.span().transpose();
        self.over = self.ended || !matches!(span, Some(Ok(_)));
        span
    }
}

fn unfit(channel: Channel, after_ns: u64, source: Unfit) -> ReadError {
    ReadError::Unfit {
        channel: channel.topic(),
        after_ns,
        source,
    }
}

fn parse<T: DeserializeOwned>(
    channel: Channel,
    data: &[u8],
    after_ns: u64,
) -> Result<T, ReadError> {
    serde_json::from_slice(data).map_err(|source| ReadError::Json {
        channel: channel.topic(),
        after_ns,
        source,
    })
}

fn decode(
    channel: Channel,
    data: &[u8],
    scene: &SceneRecord,
    after_ns: u64,
) -> Result<Record, ReadError> {
    let fits = |fit: Result<(), Unfit>| fit.map_err(|source| unfit(channel, after_ns, source));
    Ok(match channel {
        Channel::Scene => {
            return Err(unfit(
                channel,
                after_ns,
                Unfit::Place {
                    what: "comes a second time",
                },
            ));
        }
        Channel::Motion => {
            let motion = parse(channel, data, after_ns)?;
            fits(fit::motion(&motion, scene))?;
            Record::Motion(motion)
        }
        Channel::Event => {
            let event = parse(channel, data, after_ns)?;
            fits(fit::event(&event, scene))?;
            Record::Event(event)
        }
        Channel::State => {
            let state = parse(channel, data, after_ns)?;
            fits(fit::state(&state, scene))?;
            Record::State(state)
        }
        Channel::Mark => Record::Mark(parse(channel, data, after_ns)?),
        Channel::Gap => Record::Gap(parse(channel, data, after_ns)?),
        Channel::End => Record::End(parse(channel, data, after_ns)?),
    })
}

/// The message of one of our channels in a record of the file, if it is one.
fn message(
    channels: &mut BTreeMap<u16, Option<Channel>>,
    opcode: u8,
    body: &[u8],
    after_ns: u64,
) -> Result<Option<(Channel, Vec<u8>)>, ReadError> {
    // Other kinds of record hold nothing of ours, and parsing them buys nothing but trouble.
    if opcode != op::CHANNEL && opcode != op::MESSAGE {
        return Ok(None);
    }
    let damaged = |source| ReadError::Damaged { after_ns, source };
    match mcap::parse_record(opcode, body).map_err(damaged)? {
        Raw::Channel(channel) => {
            let known = Channel::of_topic(&channel.topic);
            let ours = known.filter(|_| channel.message_encoding == ENCODING);
            channels.insert(channel.id, ours);
            Ok(None)
        }
        Raw::Message { header, data } => match channels.get(&header.channel_id) {
            Some(channel) => Ok(channel.map(|channel| (channel, data.into_owned()))),
            None => Err(damaged(McapError::UnknownChannel(
                header.sequence,
                header.channel_id,
            ))),
        },
        _ => Ok(None),
    }
}

/// Why there is no next record.
enum FrameError {
    /// The file ends in the middle of something.
    Cut,
    /// It cannot be read.
    Read(Unreadable),
}

/// A [`ReadError`] that does not know yet how far the trace read well.
enum Unreadable {
    Io(io::Error),
    Mcap(McapError),
}

impl Unreadable {
    fn at(self, after_ns: u64) -> ReadError {
        match self {
            Self::Io(error) => ReadError::Io(error),
            Self::Mcap(McapError::UnsupportedCompression(how)) => ReadError::Compressed(how),
            Self::Mcap(source) => ReadError::Damaged { after_ns, source },
        }
    }
}

impl From<McapError> for FrameError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::UnexpectedEof => Self::Cut,
            McapError::Io(error) => Self::Read(Unreadable::Io(error)),
            error => Self::Read(Unreadable::Mcap(error)),
        }
    }
}

/// The records of an MCAP file, those inside chunks as well. A chunk is handed out only once it is
/// there as a whole and its checksum is right.
struct Frames<R> {
    /// The first bytes, which were looked at, and the rest.
    source: io::Chain<io::Cursor<Vec<u8>>, R>,
    reader: LinearReader,
    /// Records of the newest chunk that are not handed out yet.
    chunk: VecDeque<(u8, Vec<u8>)>,
}

impl<R: Read> Frames<R> {
    fn new(mut source: R) -> Result<Self, ReadError> {
        let mut head = Vec::new();
        let magic = mcap::MAGIC;
        source
            .by_ref()
            .take(magic.len() as u64)
            .read_to_end(&mut head)
            .map_err(ReadError::Io)?;
        if head != magic {
            let cut = !head.is_empty() && magic.starts_with(&head);
            return Err(if cut {
                ReadError::TooShort
            } else {
                ReadError::Foreign
            });
        }
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        Ok(Self {
            source: io::Cursor::new(head).chain(source),
            reader: LinearReader::new_with_options(options),
            chunk: VecDeque::new(),
        })
    }

    fn next(&mut self) -> Result<Option<(u8, Vec<u8>)>, FrameError> {
        loop {
            if let Some(record) = self.chunk.pop_front() {
                return Ok(Some(record));
            }
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => self.fill(bytes)?,
                Some(Ok(LinearReadEvent::Record {
                    data,
                    opcode: op::CHUNK,
                })) => {
                    unpack(data, &mut self.chunk)?;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    return Ok(Some((opcode, data.to_vec())));
                }
                Some(Err(error)) => return Err(error.into()),
            }
        }
    }

    fn fill(&mut self, bytes: usize) -> Result<(), FrameError> {
        let space = self.reader.insert(bytes.min(READ_BYTES));
        loop {
            match self.source.read(space) {
                Ok(read) => {
                    self.reader.notify_read(read);
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(FrameError::Read(Unreadable::Io(error))),
            }
        }
    }
}

/// Checks a chunk and cuts it into its records.
fn unpack(chunk: &[u8], records: &mut VecDeque<(u8, Vec<u8>)>) -> Result<(), McapError> {
    let Raw::Chunk { header, data } = mcap::parse_record(op::CHUNK, chunk)? else {
        return Ok(());
    };
    if !header.compression.is_empty() {
        return Err(McapError::UnsupportedCompression(header.compression));
    }
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&data));
    if saved != 0 && saved != calculated {
        return Err(McapError::BadChunkCrc { saved, calculated });
    }
    let mut rest = &data[..];
    while let Some((frame, body)) = rest.split_at_checked(FRAME_BYTES) {
        let mut length = [0; 8];
        length.copy_from_slice(&frame[1..]);
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let Some((body, behind)) = body.split_at_checked(length) else {
            return Err(McapError::UnexpectedEoc);
        };
        records.push_back((frame[0], body.to_vec()));
        rest = behind;
    }
    if rest.is_empty() {
        Ok(())
    } else {
        Err(McapError::UnexpectedEoc)
    }
}
