//! The world's journal: what a world process that is started again goes on from.
//!
//! Responsible for: a mapped file in the run's directory with the newest two states and the
//! newest batches of motion, such that whatever instant its writer dies at, one whole state is in
//! it, and every batch that led there and is not in the trace yet.
//! Not responsible for: what a state is (crate `world`), or what is done with it (`roles::world`).
//!
//! Terms: a *slot* holds one state; tick k goes to slot k mod 2, so that the one before stays
//! whole while it is written. The *ring* holds batches one after the other, the *index* where
//! each lies. What a dead process has written stays in the page cache: nothing is ever synced, and
//! a machine that fails takes its runs along.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::atomic::{Ordering, compiler_fence};

use memmap2::MmapMut;
use shm_types::capacity::{MAX_EVENTS, MAX_MOTIONS};
use shm_types::{EventRecord, MotionBatch, MotionRecord, StateHash};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// First word of the file: "rrjournl" in ASCII, little endian.
const MAGIC: u64 = u64::from_le_bytes(*b"rrjournl");
/// Form of the file. Raised whenever it changes.
const VERSION: u32 = 1;
/// Bytes of batches that are kept.
const RING: usize = 4 << 20;
/// Batches that are kept at most.
const KEPT: u64 = 8_192;
/// Most bytes of one batch.
const LARGEST: usize = size_of::<Entry>()
    + MAX_MOTIONS * size_of::<MotionRecord>()
    + MAX_EVENTS * size_of::<EventRecord>();
/// Bytes in front of a state: its tick and its length.
const SLOT_HEAD: usize = 16;
/// Where things lie.
const INDEX: usize = 4_096;
const RING_AT: usize = INDEX + KEPT as usize * size_of::<Place>();
const SLOTS_AT: usize = RING_AT + RING;

const _: () = assert!(2 * LARGEST < RING);
const _: () = assert!(size_of::<Head>() <= INDEX);

/// The beginning of the file.
#[derive(Clone, Copy, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
struct Head {
    magic: u64,
    version: u32,
    /// Which world process writes it, from 1.
    generation: u32,
    run_id: u64,
    slot_bytes: u64,
}

/// Where a batch lies in the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
struct Place {
    sequence: u64,
    offset: u32,
    bytes: u32,
}

/// What comes before the pieces of a batch.
#[derive(Clone, Copy, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
struct Entry {
    sequence: u64,
    tick: u64,
    time_ns: u64,
    motion_count: u32,
    event_count: u32,
    /// Over all else.
    checksum: u64,
}

/// A state that was found, and its tick.
pub(crate) type Found = (u64, Vec<u8>);

/// The file, mapped.
pub(crate) struct Journal {
    map: MmapMut,
    slot_bytes: usize,
    generation: u32,
    state: Vec<u8>,
    /// Batches that can be read, oldest first, without gaps.
    kept: VecDeque<Place>,
    /// Where the next one is put.
    next: usize,
}

impl Journal {
    /// Opens the journal of a run, or makes one with room for states of `slot_bytes`; the states
    /// in it, newest first.
    ///
    /// # Errors
    /// The system refused.
    pub(crate) fn open(
        path: &Path,
        run_id: u64,
        slot_bytes: usize,
    ) -> io::Result<(Self, Vec<Found>)> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(path)?;
        let old = read_head(&file)?
            .filter(|head| head.magic == MAGIC && head.version == VERSION && head.run_id == run_id);
        let slot_bytes = old.map_or(slot_bytes, |head| head.slot_bytes as usize);
        let length = slot_bytes
            .checked_mul(2)
            .and_then(|slots| slots.checked_add(SLOTS_AT))
            .ok_or(io::ErrorKind::InvalidData)?;
        if old.is_none() {
            file.set_len(0)?;
        }
        if file.metadata()?.len() != length as u64 {
            file.set_len(length as u64)?;
        }
        // SAFETY: only processes of this user can open the file, and of these only the one world
        // process of the run does; nobody shortens it while the run goes on.
        let map = unsafe { MmapMut::map_mut(&file)? };
        let generation = old.map_or(0, |head| head.generation) + 1;
        let mut journal = Self {
            map,
            slot_bytes,
            generation,
            state: Vec::with_capacity(slot_bytes),
            kept: VecDeque::with_capacity(KEPT as usize + 1),
            next: 0,
        };
        let mut found: Vec<Found> = (0..2).filter_map(|slot| journal.read_slot(slot)).collect();
        found.sort_by_key(|(tick, _)| std::cmp::Reverse(*tick));
        let head = Head {
            magic: MAGIC,
            version: VERSION,
            generation,
            run_id,
            slot_bytes: slot_bytes as u64,
        };
        journal.put(0, head.as_bytes());
        Ok((journal, found))
    }

    /// Which world process this is, from 1.
    pub(crate) const fn generation(&self) -> u32 {
        self.generation
    }

    /// Goes on from a state that was found: the batches that led to it are those before `tick`.
    pub(crate) fn go_on_from(&mut self, tick: u64) {
        self.kept.clear();
        let mut bytes = 0;
        let mut sequence = tick;
        while let Some(before) = sequence.checked_sub(1)
            && let Some(place) = self.read_place(before)
        {
            bytes += place.bytes as usize;
            if bytes > RING - LARGEST {
                break;
            }
            self.kept.push_front(place);
            sequence = before;
        }
        self.next = (self.kept.back()).map_or(0, |last| (last.offset + last.bytes) as usize);
    }

    /// Keeps a batch, if there is one, and then the state that it led to.
    ///
    /// # Errors
    /// The state is longer than there is room for.
    pub(crate) fn commit(
        &mut self,
        tick: u64,
        batch: Option<&MotionBatch>,
        save: impl FnOnce(&mut Vec<u8>),
    ) -> io::Result<()> {
        if let Some(batch) = batch {
            self.keep(batch);
        }
        let mut state = std::mem::take(&mut self.state);
        state.clear();
        save(&mut state);
        let result = self.write_slot(tick, &state);
        self.state = state;
        result
    }

    /// Whether another batch can be kept without losing one from `durable` on.
    pub(crate) fn has_room(&self, durable: u64) -> bool {
        let kept = self.kept.iter().rev();
        let needed = kept.take_while(|place| place.sequence >= durable);
        let (count, bytes) = needed.fold((0, 0), |(count, bytes), place| {
            (count + 1, bytes + place.bytes as usize)
        });
        // A batch that does not fit behind the last is put at the beginning.
        count + 1 < KEPT && bytes + 2 * LARGEST < RING
    }

    /// Oldest batch that is kept; the next one if none is.
    pub(crate) fn kept_from(&self, next: u64) -> u64 {
        self.kept.front().map_or(next, |place| place.sequence)
    }

    /// Writes the live part of batch `sequence`, if it is kept.
    pub(crate) fn read(&self, sequence: u64, out: &mut MotionBatch) -> bool {
        let from = self.kept_from(sequence);
        let place = (sequence.checked_sub(from)).and_then(|at| self.kept.get(at as usize));
        let entry = place.and_then(|place| Some((place, self.entry(place)?)));
        let Some((place, entry)) = entry else {
            return false;
        };
        (out.sequence, out.tick, out.time_ns) = (entry.sequence, entry.tick, entry.time_ns);
        (out.motion_count, out.event_count) = (entry.motion_count, entry.event_count);
        out.kept_from = from;
        let pieces = &self.bytes(place)[size_of::<Entry>()..];
        let motions = &mut out.motions[..entry.motion_count as usize];
        let (moved, happened) = pieces.split_at(size_of_val(motions));
        motions.as_mut_bytes().copy_from_slice(moved);
        let events = &mut out.events[..entry.event_count as usize];
        events.as_mut_bytes().copy_from_slice(happened);
        true
    }

    fn keep(&mut self, batch: &MotionBatch) {
        let (motions, events) = (batch.motions(), batch.events());
        let bytes = size_of::<Entry>() + size_of_val(motions) + size_of_val(events);
        if self.next + bytes > RING {
            self.next = 0;
        }
        let (from, to) = (self.next, self.next + bytes);
        let is_in_the_way = |place: &Place| {
            let offset = place.offset as usize;
            offset < to && offset + place.bytes as usize > from
        };
        while self.kept.len() as u64 >= KEPT || self.kept.front().is_some_and(is_in_the_way) {
            self.kept.pop_front();
        }
        let mut entry = Entry {
            sequence: batch.sequence,
            tick: batch.tick,
            time_ns: batch.time_ns,
            motion_count: motions.len() as u32,
            event_count: events.len() as u32,
            checksum: 0,
        };
        entry.checksum = checksum(&entry, motions.as_bytes(), events.as_bytes());
        let place = Place {
            sequence: batch.sequence,
            offset: from as u32,
            bytes: bytes as u32,
        };
        let at = RING_AT + from;
        self.put(at, entry.as_bytes());
        self.put(at + size_of::<Entry>(), motions.as_bytes());
        let at = at + size_of::<Entry>() + size_of_val(motions);
        self.put(at, events.as_bytes());
        self.put(index_of(batch.sequence), place.as_bytes());
        self.kept.push_back(place);
        self.next = to;
    }

    /// Where a batch lies, if it is whole.
    fn read_place(&self, sequence: u64) -> Option<Place> {
        let at = index_of(sequence);
        let place = Place::read_from_bytes(&self.map[at..at + size_of::<Place>()]).ok()?;
        let ends = place.offset as usize + place.bytes as usize;
        let fits = place.sequence == sequence && ends <= RING;
        fits.then_some(())?;
        (self.entry(&place)?.sequence == sequence).then_some(place)
    }

    /// What a batch begins with, if it is whole.
    fn entry(&self, place: &Place) -> Option<Entry> {
        let bytes = self.bytes(place);
        let (head, pieces) = bytes.split_at_checked(size_of::<Entry>())?;
        let entry = Entry::read_from_bytes(head).ok()?;
        let (motions, events) = (entry.motion_count as usize, entry.event_count as usize);
        (motions <= MAX_MOTIONS && events <= MAX_EVENTS).then_some(())?;
        let moved = motions * size_of::<MotionRecord>();
        let length = moved + events * size_of::<EventRecord>();
        (pieces.len() == length).then_some(())?;
        let (moved, happened) = pieces.split_at(moved);
        let plain = Entry {
            checksum: 0,
            ..entry
        };
        (checksum(&plain, moved, happened) == entry.checksum).then_some(entry)
    }

    fn bytes(&self, place: &Place) -> &[u8] {
        let at = RING_AT + place.offset as usize;
        &self.map[at..at + place.bytes as usize]
    }

    fn slot_at(&self, slot: usize) -> usize {
        SLOTS_AT + slot * self.slot_bytes
    }

    fn write_slot(&mut self, tick: u64, state: &[u8]) -> io::Result<()> {
        if SLOT_HEAD + state.len() > self.slot_bytes {
            return Err(io::Error::other(format!(
                "a state of {} bytes is more than the journal has room for",
                state.len()
            )));
        }
        let at = self.slot_at((tick % 2) as usize);
        // Of no length while it is written: its reader need not find a torn one by its checksum.
        self.put(at + 8, &0_u64.to_le_bytes());
        self.put(at, &tick.to_le_bytes());
        self.put(at + SLOT_HEAD, state);
        self.put(at + 8, &(state.len() as u64).to_le_bytes());
        Ok(())
    }

    fn read_slot(&self, slot: usize) -> Option<Found> {
        let at = self.slot_at(slot);
        let bytes = &self.map[at..at + self.slot_bytes];
        let (head, rest) = bytes.split_at_checked(SLOT_HEAD)?;
        let tick = u64::read_from_bytes(&head[..8]).ok()?;
        let length = usize::try_from(u64::read_from_bytes(&head[8..]).ok()?).ok()?;
        let state = rest.get(..length).filter(|state| !state.is_empty())?;
        Some((tick, state.to_vec()))
    }

    /// Writes, after all that was written before. For another process that is enough: the kernel
    /// has what a process stored before it died, in the order of its stores.
    fn put(&mut self, at: usize, bytes: &[u8]) {
        compiler_fence(Ordering::SeqCst);
        self.map[at..at + bytes.len()].copy_from_slice(bytes);
        compiler_fence(Ordering::SeqCst);
    }
}

const fn index_of(sequence: u64) -> usize {
    INDEX + (sequence % KEPT) as usize * size_of::<Place>()
}

fn read_head(file: &File) -> io::Result<Option<Head>> {
    use std::os::unix::fs::FileExt;
    let mut bytes = [0; size_of::<Head>()];
    match file.read_exact_at(&mut bytes, 0) {
        Ok(()) => Ok(Head::read_from_bytes(&bytes).ok()),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
        Err(error) => Err(error),
    }
}

fn checksum(entry: &Entry, motions: &[u8], events: &[u8]) -> u64 {
    let mut hash = StateHash::new();
    hash.add(entry);
    hash.add(motions);
    hash.add(events);
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shm_types::{EventKind, zeroed};

    const SLOT: usize = 1_000;

    fn batch(sequence: u64, events: usize) -> Box<MotionBatch> {
        let mut batch: Box<MotionBatch> = zeroed();
        (batch.sequence, batch.tick) = (sequence, sequence + 1);
        batch.event_count = events as u32;
        for event in &mut batch.events[..events] {
            *event = EventRecord::new(EventKind::Epoch, sequence);
        }
        batch
    }

    fn commit(journal: &mut Journal, tick: u64, events: usize) {
        let led = tick.checked_sub(1).map(|sequence| batch(sequence, events));
        let save = |out: &mut Vec<u8>| out.extend_from_slice(&tick.to_le_bytes());
        journal.commit(tick, led.as_deref(), save).unwrap();
    }

    fn events_of(journal: &Journal, sequence: u64) -> Option<(u32, u64)> {
        let mut out: Box<MotionBatch> = zeroed();
        let found = journal.read(sequence, &mut out);
        found.then(|| (out.event_count, out.events[0].time_ns))
    }

    #[test]
    fn a_process_that_comes_after_finds_the_newest_state_and_what_led_to_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        {
            let (mut journal, found) = Journal::open(&path, 7, SLOT).unwrap();
            assert!(found.is_empty());
            for tick in 0..100 {
                commit(&mut journal, tick, 3);
            }
        }
        let (mut journal, found) = Journal::open(&path, 7, SLOT).unwrap();
        assert_eq!(journal.generation(), 2);
        let ticks: Vec<u64> = found.iter().map(|(tick, _)| *tick).collect();
        assert_eq!(ticks, [99, 98]);
        assert_eq!(found[0].1, 99_u64.to_le_bytes());
        journal.go_on_from(99);
        assert_eq!(journal.kept_from(0), 0);
        assert_eq!(events_of(&journal, 98), Some((3, 98)));
        assert_eq!(events_of(&journal, 99), None);
        commit(&mut journal, 100, 1);
        assert_eq!(events_of(&journal, 99), Some((1, 99)));
        let (_, found) = Journal::open(&path, 8, SLOT).unwrap();
        assert!(found.is_empty(), "of another run");
    }

    #[test]
    fn a_writer_that_dies_in_the_middle_leaves_the_state_before() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        let (mut journal, _) = Journal::open(&path, 7, SLOT).unwrap();
        commit(&mut journal, 0, 0);
        commit(&mut journal, 1, 2);
        let at = journal.slot_at(0);
        journal.put(at + 8, &0_u64.to_le_bytes());
        journal.put(at, &2_u64.to_le_bytes());
        let torn = batch(1, 2);
        journal.keep(&torn);
        let place = *journal.kept.back().unwrap();
        let at = RING_AT + place.offset as usize + size_of::<Entry>();
        journal.put(at, &[0xff]);
        drop(journal);
        let (mut journal, found) = Journal::open(&path, 7, SLOT).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].0, 1);
        journal.go_on_from(2);
        assert_eq!(events_of(&journal, 1), None, "its checksum is wrong");
        journal.go_on_from(1);
        assert_eq!(events_of(&journal, 0), Some((2, 0)));
    }

    #[test]
    fn what_is_needed_is_not_lost_while_there_is_room() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        let (mut journal, _) = Journal::open(&path, 7, SLOT).unwrap();
        let mut tick = 0;
        while journal.has_room(0) {
            commit(&mut journal, tick, 700);
            tick += 1;
        }
        assert!(tick > 100);
        assert_eq!(journal.kept_from(tick), 0, "up to here all is kept");
        // What is durable may go.
        let durable = tick / 2;
        assert!(journal.has_room(durable));
        for _ in 0..40 {
            commit(&mut journal, tick, 700);
            tick += 1;
        }
        assert!(journal.kept_from(tick) <= durable);
        assert_eq!(events_of(&journal, durable), Some((700, durable)));
        let (mut again, _) = Journal::open(&path, 7, SLOT).unwrap();
        again.go_on_from(tick - 1);
        assert_eq!(events_of(&again, durable), Some((700, durable)));
        assert!(commit_too_long(&mut again).is_err());
    }

    fn commit_too_long(journal: &mut Journal) -> io::Result<()> {
        journal.commit(0, None, |out| out.resize(SLOT, 0))
    }
}
