//! Reading a trace, whole or cut short.
//!
//! Responsible for: the file's channels; refusing what is no trace, with the way out; handing
//! records over span by span.
//! Not responsible for: framing and checksums (`frames`), whether the run they tell of is a legal one (`check`) or where bodies are
//! between records (`replay`).
//!
//! Terms: a *span* is all that lies between two marks. Records behind the last mark are not used:
//! only a mark says that nothing before it is missing.

use std::collections::BTreeMap;
use std::io::{self, Read};

use mcap::McapError;
use mcap::records::{Record as Raw, op};
use serde::de::DeserializeOwned;

use crate::channel::{Channel, ENCODING};
use crate::fit::{self, Unfit};
use crate::frames::{FrameError, Frames};
use crate::record::{End, Event, Gap, Mark, Motion, SceneRecord, State};

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
    Scene(Box<SceneRecord>),
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
    /// What holds from the beginning of it on, if it is not what held before.
    pub scene: Option<SceneRecord>,
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
    /// The newest version of it.
    present: SceneRecord,
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
        if !(1..=crate::record::FORMAT).contains(&head.format) {
            return Err(unfit(channel, 0, Unfit::Format { found: head.format }));
        }
        let scene: SceneRecord = parse(channel, &data, 0)?;
        fit::scene(&scene).map_err(|source| unfit(channel, 0, source))?;
        Ok(Self {
            file,
            channels,
            present: scene.clone(),
            scene,
            last: Mark {
                tick: 0,
                time_ns: 0,
            },
            ended: false,
            over: false,
        })
    }

    /// What holds from the start.
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
                        return decode(channel, &data, &self.present, after_ns).map(Some);
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
        let mut scene = None;
        let close = loop {
            match self.record()? {
                Some(Record::Scene(next)) => {
                    let is_first = motions.is_empty() && events.is_empty() && states.is_empty();
                    if !is_first || scene.is_some() {
                        let what = Unfit::Place {
                            what: "does not come first behind a mark",
                        };
                        return Err(unfit(Channel::Scene, self.last.time_ns, what));
                    }
                    self.present.clone_from(&next);
                    scene = Some(*next);
                }
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
            scene,
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
            let next = parse(channel, data, after_ns)?;
            fits(fit::scene(&next))?;
            fits(fit::version(&next, scene))?;
            Record::Scene(Box::new(next))
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
