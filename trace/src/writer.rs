//! Writing a trace while the run goes on.
//!
//! Responsible for: what is written when, joining pieces of motion, marks, so that a file cut short
//! still reads, noticing lost batches.
//! Not responsible for: the words themselves (`record`).
//!
//! A chunk is built in memory and written whole. A mark says that every piece of motion so far has
//! been written: up to the last one in a whole chunk nothing is missing. It cuts the pieces that are
//! under way, so where marks are follows from the run alone, and not from how long it takes: equal
//! runs have equal pieces.

use std::collections::BTreeMap;
use std::io::{Read, Write};

use mcap::records::{MessageHeader, Record as Raw, op};
use mcap::write::NoSeek;
use shm_types::{Checked, Counts, Invalid, MotionBatch, WorldSnapshot};

use crate::channel::{Channel, ENCODING, PROFILE, SCHEMA_ENCODING};
use crate::frames::Frames;
use crate::merge::Pending;
use crate::record::{BodyKind, End, Gap, Mark, Motion, Outcome, SceneRecord};
use crate::wire;

/// A chunk is ended once it holds this many bytes.
const CHUNK_BYTES: usize = 1 << 20;
/// A mark is set, and the chunk with it ended, with each of these of virtual time, ns.
const MARK_EVERY_NS: u64 = 1_000_000_000;
/// Batches, and bytes of them, after which it is, too: until then the world keeps them.
const MARK_EVERY_BATCHES: u64 = 1_024;
const MARK_EVERY_BYTES: usize = 1 << 20;

/// Why a trace could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file could not be written.
    #[error("could not write the trace: {0}; is the disk full?")]
    File(#[from] mcap::McapError),
    /// A record has no JSON form.
    #[error("could not write a {channel} record as JSON: {source}")]
    Json {
        /// Channel of the record.
        channel: &'static str,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A batch is not a legal message.
    #[error("could not write a batch of motion: {0}")]
    Batch(#[from] Invalid),
}

/// How a run ended: what the caller knows and the writer does not.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// How it ended.
    pub outcome: Outcome,
    /// Why, where there is more to say.
    pub reason: Option<String>,
    /// When, ns of virtual time.
    pub makespan_ns: u64,
    /// All options of the command that ran it.
    pub options: serde_json::Value,
}

/// What a trace that is gone on with has told so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Resumed {
    /// Number of the batch it lacks next.
    pub next_sequence: u64,
    /// How often the scene has changed.
    pub scene_version: u32,
    /// Hash of the version in force, as the record has it.
    pub scenario_hash: String,
}

/// The records of a trace behind its first scene, up to its last mark.
struct ReadBack {
    messages: Vec<(Channel, u64, Vec<u8>)>,
    last: Mark,
}

/// Reads what is whole of a trace of the run `run_id`.
fn read_back(old: impl Read, run_id: &str) -> Option<ReadBack> {
    let mut frames = Frames::new(old).ok()?;
    let mut channels = BTreeMap::new();
    let mut messages = Vec::new();
    let (mut first, mut marked) = (None, None);
    // Whatever the end of the file is like, what is before it counts.
    while let Ok(Some((opcode, body))) = frames.next() {
        match mcap::parse_record(opcode, &body) {
            Ok(Raw::Channel(channel)) if opcode == op::CHANNEL => {
                channels.insert(channel.id, Channel::of_topic(&channel.topic));
            }
            Ok(Raw::Message { header, data }) => {
                let channel = channels.get(&header.channel_id).copied().flatten()?;
                if channel == Channel::End {
                    break;
                }
                if first.is_none() {
                    let scene: SceneRecord = serde_json::from_slice(&data).ok()?;
                    first = (scene.run_id == run_id).then_some(());
                    first?;
                    continue;
                }
                messages.push((channel, header.log_time, data.into_owned()));
                if channel == Channel::Mark
                    && let Ok(mark) = serde_json::from_slice::<Mark>(&messages.last()?.2)
                {
                    marked = Some((messages.len(), mark));
                }
            }
            _ => {}
        }
    }
    let (count, last) = marked?;
    messages.truncate(count);
    Some(ReadBack { messages, last })
}

/// Writes one trace.
///
/// Give it every batch in order, and snapshots as often as they come: it keeps those that are
/// due. Call [`Writer::finish`] at the end.
pub struct Writer<W: Write> {
    file: mcap::Writer<NoSeek<W>>,
    counts: Counts,
    state_every_ns: u64,
    state_due_ns: u64,
    /// A gap was found; the next snapshot from this tick on is written, due or not.
    resync_from: Option<u64>,
    next_sequence: u64,
    /// The same when the file was whole last.
    safe_sequence: u64,
    missing: u64,
    last: Mark,
    marked: Option<Mark>,
    /// Bytes of batches since the last mark.
    unmarked_bytes: usize,
    robots: Vec<Option<Pending>>,
    objects: Vec<Option<Pending>>,
    channels: BTreeMap<&'static str, (u16, u32)>,
    json: Vec<u8>,
    chunk_bytes: usize,
}

impl<W: Write> Writer<W> {
    /// Starts a trace with its scene. Snapshots are kept every `state_every_ns` of virtual time;
    /// with 0, every one.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn new(out: W, scene: &SceneRecord, state_every_ns: u64) -> Result<Self, WriteError> {
        let file = mcap::WriteOptions::new()
            .compression(None)
            .profile(PROFILE)
            .library(concat!("rearrange ", env!("CARGO_PKG_VERSION")))
            .chunk_size(None)
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        let mut writer = Self {
            file,
            counts: counts(scene),
            state_every_ns,
            state_due_ns: 0,
            resync_from: None,
            next_sequence: 0,
            safe_sequence: 0,
            missing: 0,
            last: Mark {
                tick: 0,
                time_ns: 0,
            },
            marked: None,
            unmarked_bytes: 0,
            robots: scene.homes.iter().map(|_| None).collect(),
            objects: scene.objects.iter().map(|_| None).collect(),
            channels: BTreeMap::new(),
            json: Vec::new(),
            chunk_bytes: 0,
        };
        for channel in Channel::ALL {
            writer.open(channel)?;
        }
        writer.write(Channel::Scene, 0, scene)?;
        writer.flush()?;
        Ok(writer)
    }

    /// From here on another version of the scene holds. Give it before the batch that tells of it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn change(&mut self, scene: &SceneRecord) -> Result<(), WriteError> {
        // The record comes first behind a mark, whatever has been written since the last one.
        self.marked = None;
        self.flush()?;
        self.counts = counts(scene);
        self.robots.resize_with(scene.homes.len(), || None);
        self.objects.resize_with(scene.objects.len(), || None);
        self.write(Channel::Scene, self.last.time_ns, scene)
    }

    /// Goes on with a trace of the same run that breaks off, or that has ended: copies all of it
    /// up to its last mark. `None` if there is nothing of it that could be gone on with.
    ///
    /// # Errors
    /// The new file cannot be written.
    pub fn go_on(
        old: impl Read,
        out: W,
        scene: &SceneRecord,
        state_every_ns: u64,
    ) -> Result<Option<(Self, Resumed)>, WriteError> {
        let Some(found) = read_back(old, &scene.run_id) else {
            return Ok(None);
        };
        let mut writer = Self::new(out, scene, state_every_ns)?;
        let mut resumed = Resumed {
            next_sequence: found.last.tick,
            scene_version: 0,
            scenario_hash: scene.scenario_hash.clone(),
        };
        // The first is the mark that the new file begins with, too.
        for (channel, time_ns, json) in found.messages.iter().skip(1) {
            if *channel == Channel::Scene {
                if let Ok(newer) = serde_json::from_slice::<SceneRecord>(json) {
                    writer.counts = counts(&newer);
                    writer.robots.resize_with(newer.homes.len(), || None);
                    writer.objects.resize_with(newer.objects.len(), || None);
                    resumed.scene_version += 1;
                    resumed.scenario_hash = newer.scenario_hash;
                }
            } else if *channel == Channel::Gap
                && let Ok(gap) = serde_json::from_slice::<Gap>(json)
            {
                writer.missing = writer.missing.saturating_add(gap.batches);
            }
            writer.write_json(*channel, *time_ns, json)?;
            if *channel == Channel::Mark {
                writer.end_chunk()?;
            }
        }
        writer.next_sequence = found.last.tick;
        writer.last = found.last;
        writer.marked = Some(found.last);
        let every = state_every_ns.max(1);
        writer.state_due_ns = (found.last.time_ns / every).saturating_mul(every);
        writer.flush()?;
        Ok(Some((writer, resumed)))
    }

    fn open(&mut self, channel: Channel) -> Result<(), WriteError> {
        let (name, schema) = channel.schema();
        let topic = channel.topic();
        let schema = (self.file).add_schema(&name, SCHEMA_ENCODING, schema.as_bytes())?;
        let id = self
            .file
            .add_channel(schema, topic, ENCODING, &BTreeMap::new())?;
        self.channels.insert(topic, (id, 0));
        Ok(())
    }

    fn write<T: serde::Serialize>(
        &mut self,
        channel: Channel,
        time_ns: u64,
        record: &T,
    ) -> Result<(), WriteError> {
        let topic = channel.topic();
        self.json.clear();
        serde_json::to_writer(&mut self.json, record).map_err(|source| WriteError::Json {
            channel: topic,
            source,
        })?;
        let json = std::mem::take(&mut self.json);
        let written = self.write_json(channel, time_ns, &json);
        self.json = json;
        written
    }

    fn write_json(
        &mut self,
        channel: Channel,
        time_ns: u64,
        json: &[u8],
    ) -> Result<(), WriteError> {
        let (id, sequence) = self.channels.entry(channel.topic()).or_default();
        let header = MessageHeader {
            channel_id: *id,
            sequence: *sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        *sequence = sequence.wrapping_add(1);
        self.chunk_bytes += json.len();
        Ok(self.file.write_to_known_channel(&header, json)?)
    }

    /// Adds the motion and events of one tick. A batch that comes again is ignored; when batches
    /// are missing before this one, the trace says so and is incomplete.
    ///
    /// # Errors
    /// The batch is not legal, or the file cannot be written.
    pub fn batch(&mut self, batch: &MotionBatch) -> Result<(), WriteError> {
        let batch = Checked::new(batch, self.counts)?;
        if batch.sequence < self.next_sequence {
            return Ok(());
        }
        if batch.sequence > self.next_sequence {
            self.gap(batch.tick, batch.sequence - self.next_sequence)?;
        }
        for record in batch.motions() {
            self.motion(&wire::motion(record)?)?;
        }
        for record in batch.events() {
            let event = wire::event(batch.tick, record)?;
            self.write(Channel::Event, event.time_ns, &event)?;
        }
        self.next_sequence = batch.sequence + 1;
        self.unmarked_bytes += size_of_val(batch.motions()) + size_of_val(batch.events());
        let before_ns = self.last.time_ns;
        self.last = Mark {
            tick: batch.tick,
            time_ns: batch.time_ns,
        };
        let marked = self.marked.map_or(0, |mark| mark.tick);
        if batch.time_ns / MARK_EVERY_NS != before_ns / MARK_EVERY_NS
            || batch.tick >= marked.saturating_add(MARK_EVERY_BATCHES)
            || self.unmarked_bytes >= MARK_EVERY_BYTES
        {
            return self.flush();
        }
        self.end_full_chunk()
    }

    fn gap(&mut self, before_tick: u64, batches: u64) -> Result<(), WriteError> {
        self.mark()?;
        let gap = Gap {
            after_tick: self.last.tick,
            before_tick,
            batches,
        };
        self.write(Channel::Gap, self.last.time_ns, &gap)?;
        self.missing = self.missing.saturating_add(batches);
        self.resync_from = Some(before_tick.saturating_sub(1));
        Ok(())
    }

    fn motion(&mut self, motion: &Motion) -> Result<(), WriteError> {
        let bodies = match motion.body {
            BodyKind::Robot => &mut self.robots,
            BodyKind::Object => &mut self.objects,
        };
        let slot = &mut bodies[motion.id];
        if slot.as_mut().is_some_and(|pending| pending.extend(motion)) {
            return Ok(());
        }
        match slot.replace(Pending::new(*motion)) {
            Some(pending) => self.write_motion(&pending.into_motion()),
            None => Ok(()),
        }
    }

    fn write_motion(&mut self, motion: &Motion) -> Result<(), WriteError> {
        self.write(Channel::Motion, motion.start_ns, motion)
    }

    /// Offers a snapshot. It is written if it is due and the batch that led to it has been given:
    /// one that runs ahead of the batches is left out.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn snapshot(&mut self, snapshot: Checked<'_, WorldSnapshot>) -> Result<(), WriteError> {
        let header = &snapshot.header;
        let after_mark = self.marked.is_none_or(|mark| header.tick >= mark.tick);
        if header.tick > self.last.tick || !after_mark {
            return Ok(());
        }
        let due = match self.resync_from {
            Some(tick) => header.tick >= tick,
            None => header.time_ns >= self.state_due_ns,
        };
        if !due {
            return Ok(());
        }
        self.resync_from = None;
        let state = wire::state(snapshot)?;
        self.write(Channel::State, state.time_ns, &state)?;
        let every = self.state_every_ns.max(1);
        self.state_due_ns = (state.time_ns / every + 1).saturating_mul(every);
        self.end_full_chunk()
    }

    /// Writes out all that is known so far and ends the chunk: a file cut short after this reads
    /// up to here.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.mark()?;
        self.end_chunk()?;
        self.safe_sequence = self.next_sequence;
        Ok(())
    }

    fn end_full_chunk(&mut self) -> Result<(), WriteError> {
        if self.chunk_bytes >= CHUNK_BYTES {
            self.end_chunk()?;
        }
        Ok(())
    }

    fn end_chunk(&mut self) -> Result<(), WriteError> {
        self.chunk_bytes = 0;
        Ok(self.file.flush()?)
    }

    /// Writes all pending motion, and a mark if anything is new since the last.
    fn mark(&mut self) -> Result<(), WriteError> {
        for id in 0..self.robots.len() {
            if let Some(pending) = self.robots[id].take() {
                self.write_motion(&pending.into_motion())?;
            }
        }
        for id in 0..self.objects.len() {
            if let Some(pending) = self.objects[id].take() {
                self.write_motion(&pending.into_motion())?;
            }
        }
        if self.marked != Some(self.last) {
            self.marked = Some(self.last);
            let mark = self.last;
            self.write(Channel::Mark, mark.time_ns, &mark)?;
        }
        self.unmarked_bytes = 0;
        Ok(())
    }

    /// All batches before this one are in a file that is cut short now.
    #[must_use]
    pub const fn safe_sequence(&self) -> u64 {
        self.safe_sequence
    }

    /// How many batches were lost so far: with any, the trace is incomplete.
    #[must_use]
    pub const fn missing_batches(&self) -> u64 {
        self.missing
    }

    /// Ends the trace and gives back what it was written to. A trace whose last batch is older
    /// than the end of the run lacks the rest.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self, ending: Ending) -> Result<W, WriteError> {
        if ending.makespan_ns > self.last.time_ns {
            let tick_ns = self.last.time_ns.checked_div(self.last.tick).unwrap_or(0);
            let lacking_ns = ending.makespan_ns - self.last.time_ns;
            let lacking = lacking_ns.checked_div(tick_ns).unwrap_or(0).max(1);
            self.gap(self.last.tick + lacking + 1, lacking)?;
        }
        self.mark()?;
        let end = End {
            outcome: ending.outcome,
            reason: ending.reason,
            makespan_ns: ending.makespan_ns,
            complete: self.missing == 0,
            options: ending.options,
        };
        self.write(Channel::End, self.last.time_ns, &end)?;
        self.file.finish()?;
        Ok(self.file.into_inner().into_inner())
    }
}

fn counts(scene: &SceneRecord) -> Counts {
    Counts {
        robots: u32::try_from(scene.homes.len()).unwrap_or(u32::MAX),
        objects: u32::try_from(scene.objects.len()).unwrap_or(u32::MAX),
    }
}
