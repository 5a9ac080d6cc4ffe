//! The world's journal: what a world process that is started again goes on from.
//!
//! Responsible for: a mapped file in the run's directory with the newest two states and the
//! newest batches of motion, such that whatever instant its writer dies at, one whole state is in
//! it, and every batch that led there and is not in the trace yet.
//! Not responsible for: what a state is (crate `world`), or what is done with it (`roles::world`).
//!
//! Terms: a *slot* holds one state; tick k goes to slot k mod 2, so that the one before stays
//! whole while it is written. A state comes in *parts* (crate `world`), each with a place of its own
//! in the slot; only those are written that have changed since this slot was written last: what the
//! tick before has changed comes from the other slot. While a slot is written it has no parts; that
//! its parts are whole, and of one tick, their checksums say. The *ring* holds batches one after the other, the *index* where
//! each lies. What a dead process has written stays in the page cache: nothing is ever synced, and
//! a machine that fails takes its runs along.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io;
use std::ops::Range;
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
const VERSION: u32 = 2;
/// Bytes of batches that are kept.
const RING: usize = 4 << 20;
/// Batches that are kept at most.
const KEPT: u64 = 8_192;
/// Most bytes of one batch.
const LARGEST: usize = size_of::<Entry>()
    + MAX_MOTIONS * size_of::<MotionRecord>()
    + MAX_EVENTS * size_of::<EventRecord>();
/// Bytes in front of a state: its tick, and how many parts it has.
const SLOT_HEAD: usize = 16;
/// Bytes of the length that each part begins with: that of the rest of it.
const LENGTH: usize = 8;
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

/// The places of a state's parts in a slot.
struct Slots {
    /// Where each begins and ends.
    places: Vec<Range<usize>>,
    /// Which parts are newer in the other slot, by slot.
    stale: [Vec<bool>; 2],
    /// How many parts states have.
    parts: usize,
}

impl Slots {
    fn new(rooms: &[usize]) -> Self {
        let mut end = SLOT_HEAD;
        let places = rooms.iter().map(|room| {
            let start = end;
            end += room.next_multiple_of(LENGTH);
            start..end
        });
        Self {
            places: places.collect(),
            stale: [0, 1].map(|_| vec![false; rooms.len()]),
            parts: 0,
        }
    }

    fn bytes(&self) -> usize {
        self.places.last().map_or(SLOT_HEAD, |place| place.end)
    }
}

/// The file, mapped.
pub(crate) struct Journal {
    map: MmapMut,
    slots: Slots,
    generation: u32,
    copied: Vec<u8>,
    /// A test lets its writer die after so many bytes.
    #[cfg(test)]
    dies_after: Option<usize>,
    /// Batches that can be read, oldest first, without gaps.
    kept: VecDeque<Place>,
    /// Where the next one is put.
    next: usize,
}

impl Journal {
    /// Opens the journal of a run, or makes one with room for states of parts of at most so many
    /// bytes each; the states in it, newest first.
    ///
    /// # Errors
    /// The system refused, or the journal has another form.
    pub(crate) fn open(
        path: &Path,
        run_id: u64,
        rooms: &[usize],
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
        let slots = Slots::new(rooms);
        let slot_bytes = slots.bytes();
        if old.is_some_and(|head| head.slot_bytes != slot_bytes as u64) {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let length = SLOTS_AT + 2 * slot_bytes;
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
            copied: Vec::with_capacity(rooms.iter().copied().max().unwrap_or(0)),
            slots,
            generation,
            #[cfg(test)]
            dies_after: None,
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

    /// Keeps a batch, if there is one, and then the state that it led to: of its parts those that
    /// `save` hands over, which must be all that are not as they were at the last call, and all of
    /// them at the first.
    ///
    /// # Errors
    /// A part is longer than there is room for.
    pub(crate) fn commit(
        &mut self,
        tick: u64,
        batch: Option<&MotionBatch>,
        save: impl FnOnce(&mut dyn FnMut(usize, &[u8])),
    ) -> io::Result<()> {
        if let Some(batch) = batch {
            self.keep(batch);
        }
        let slot = (tick % 2) as usize;
        let at = self.slot_at(slot);
        // Of no parts while it is written: its reader need not find a torn one by its checksums.
        self.put(at + 8, &0_u64.to_le_bytes());
        self.put(at, &tick.to_le_bytes());
        let mut result = Ok(());
        save(&mut |part, bytes| {
            if let Err(error) = self.put_part(slot, part, bytes) {
                result = Err(error);
            }
        });
        result?;
        for part in 0..self.slots.parts {
            if std::mem::take(&mut self.slots.stale[slot][part]) {
                self.copy_part(slot, part);
            }
        }
        self.put(at + 8, &(self.slots.parts as u64).to_le_bytes());
        Ok(())
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
        SLOTS_AT + slot * self.slots.bytes()
    }

    fn put_part(&mut self, slot: usize, part: usize, bytes: &[u8]) -> io::Result<()> {
        let place = self.slots.places.get(part).cloned();
        let Some(place) = place.filter(|place| bytes.len() <= place.len()) else {
            return Err(io::Error::other(format!(
                "part {part} of a state, of {} bytes, is more than the journal has room for",
                bytes.len()
            )));
        };
        self.put(self.slot_at(slot) + place.start, bytes);
        self.slots.stale[slot][part] = false;
        self.slots.stale[1 - slot][part] = true;
        self.slots.parts = self.slots.parts.max(part + 1);
        Ok(())
    }

    /// Takes a part over from the other slot.
    fn copy_part(&mut self, slot: usize, part: usize) {
        let mut copied = std::mem::take(&mut self.copied);
        copied.clear();
        if let Some(bytes) = self.part(1 - slot, part) {
            copied.extend_from_slice(bytes);
        }
        self.put(self.slot_at(slot) + self.slots.places[part].start, &copied);
        self.copied = copied;
    }

    /// A part, if it can be one.
    fn part(&self, slot: usize, part: usize) -> Option<&[u8]> {
        let at = self.slot_at(slot);
        let place = self.slots.places.get(part)?;
        let room = &self.map[at + place.start..at + place.end];
        let length = u64::read_from_bytes(room.get(..LENGTH)?).ok()?;
        room.get(..usize::try_from(length).ok()?.checked_add(LENGTH)?)
    }

    fn read_slot(&self, slot: usize) -> Option<Found> {
        let at = self.slot_at(slot);
        let word = |at: usize| u64::read_from_bytes(&self.map[at..at + 8]).ok();
        let (tick, parts) = (word(at)?, usize::try_from(word(at + 8)?).ok()?);
        (1..=self.slots.places.len())
            .contains(&parts)
            .then_some(())?;
        let mut state = Vec::new();
        for part in 0..parts {
            state.extend_from_slice(self.part(slot, part)?);
        }
        Some((tick, state))
    }

    /// Writes, after all that was written before. For another process that is enough: the kernel
    /// has what a process stored before it died, in the order of its stores.
    fn put(&mut self, at: usize, bytes: &[u8]) {
        #[cfg(test)]
        let bytes = self.as_far_as_it_lives(bytes);
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
    use std::fs;

    use super::*;
    use shm_types::{EventKind, zeroed};

    /// Three parts: one that is other in every tick, one in every third, one never.
    const ROOMS: [usize; 3] = [48, 40, 24];

    impl Journal {
        /// Of what is written, as much as is before the writer's death.
        pub(super) fn as_far_as_it_lives<'a>(&mut self, bytes: &'a [u8]) -> &'a [u8] {
            let left = self.dies_after.unwrap_or(bytes.len()).min(bytes.len());
            self.dies_after = self.dies_after.map(|bytes| bytes - left);
            &bytes[..left]
        }
    }

    fn framed(bytes: &[u8]) -> Vec<u8> {
        [&(bytes.len() as u64).to_le_bytes(), bytes].concat()
    }

    /// Part `part` of the state at `tick`.
    fn part(part: usize, tick: u64) -> Vec<u8> {
        match part {
            0 => framed(&tick.to_le_bytes().repeat(1 + tick as usize % 4)),
            1 => framed(&vec![(tick / 3) as u8; 1 + (tick / 3) as usize % 30]),
            _ => framed(b"always the same"),
        }
    }

    fn state(tick: u64) -> Vec<u8> {
        [0, 1, 2].map(|number| part(number, tick)).concat()
    }

    fn open(path: &Path) -> (Journal, Vec<Found>) {
        Journal::open(path, 7, &ROOMS).unwrap()
    }

    fn batch(sequence: u64, events: usize) -> Box<MotionBatch> {
        let mut batch: Box<MotionBatch> = zeroed();
        (batch.sequence, batch.tick) = (sequence, sequence + 1);
        batch.event_count = events as u32;
        for event in &mut batch.events[..events] {
            *event = EventRecord::new(EventKind::Epoch, sequence);
        }
        batch
    }

    /// Hands over all parts, or those that are not as the tick before.
    fn commit_parts(journal: &mut Journal, tick: u64, batch: Option<&MotionBatch>, all: bool) {
        let save = |put: &mut dyn FnMut(usize, &[u8])| {
            for number in [1, 2, 0] {
                let bytes = part(number, tick);
                if all || bytes != part(number, tick - 1) {
                    put(number, &bytes);
                }
            }
        };
        journal.commit(tick, batch, save).unwrap();
    }

    fn commit(journal: &mut Journal, tick: u64, events: usize) {
        let led = tick.checked_sub(1).map(|sequence| batch(sequence, events));
        let all = journal.slots.parts == 0;
        commit_parts(journal, tick, led.as_deref(), all);
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
            let (mut journal, found) = open(&path);
            assert!(found.is_empty());
            for tick in 0..100 {
                commit(&mut journal, tick, 3);
            }
        }
        let (mut journal, found) = open(&path);
        assert_eq!(journal.generation(), 2);
        let ticks: Vec<u64> = found.iter().map(|(tick, _)| *tick).collect();
        assert_eq!(ticks, [99, 98]);
        assert!(found[0].1 == state(99) && found[1].1 == state(98));
        journal.go_on_from(99);
        assert_eq!(journal.kept_from(0), 0);
        assert_eq!(events_of(&journal, 98), Some((3, 98)));
        assert_eq!(events_of(&journal, 99), None);
        commit(&mut journal, 100, 1);
        assert_eq!(events_of(&journal, 99), Some((1, 99)));
        let (_, found) = Journal::open(&path, 8, &ROOMS).unwrap();
        assert!(found.is_empty(), "of another run");
    }

    #[test]
    fn whatever_byte_its_writer_dies_at_one_state_is_whole() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        let (mut before, mut after) = (0, 0);
        // Part 1 is other at ticks 6 and 9: written in the first tick, copied in the next.
        for last in 5..=8 {
            for dies_after in 0.. {
                let (mut journal, _) = open(&path);
                for tick in 0..=last {
                    commit(&mut journal, tick, 1);
                }
                journal.dies_after = Some(dies_after);
                commit(&mut journal, last + 1, 1);
                let lives = journal.dies_after != Some(0);
                drop(journal);
                let (mut journal, found) = open(&path);
                let newest = found[0].0;
                assert!(newest == last || newest == last + 1, "{newest}");
                assert!(found.iter().all(|(tick, bytes)| *bytes == state(*tick)));
                if newest == last {
                    before += 1;
                } else {
                    after += 1;
                }
                journal.go_on_from(newest);
                assert_eq!(events_of(&journal, newest - 1), Some((1, newest - 1)));
                for tick in newest + 1..newest + 3 {
                    commit(&mut journal, tick, 1);
                    let found: Vec<_> = (0..2).filter_map(|s| journal.read_slot(s)).collect();
                    let newest = found.iter().find(|(of, _)| *of == tick).unwrap();
                    assert!(newest.1 == state(tick), "{tick}");
                    assert!(found.iter().all(|(of, bytes)| *bytes == state(*of)));
                }
                if lives {
                    assert_eq!(newest, last + 1, "it was not killed any more");
                    break;
                }
                fs::remove_file(&path).unwrap();
            }
            fs::remove_file(&path).unwrap();
        }
        assert!(before > 300 && after >= 4, "{before} and {after}");
    }

    #[test]
    fn a_batch_that_is_torn_is_none() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        let (mut journal, _) = open(&path);
        commit(&mut journal, 0, 0);
        commit(&mut journal, 1, 2);
        journal.keep(&batch(1, 2));
        let place = *journal.kept.back().unwrap();
        let at = RING_AT + place.offset as usize + size_of::<Entry>();
        journal.put(at, &[0xff]);
        drop(journal);
        let (mut journal, found) = open(&path);
        assert_eq!(found[0].0, 1);
        journal.go_on_from(2);
        assert_eq!(events_of(&journal, 1), None, "its checksum is wrong");
        journal.go_on_from(1);
        assert_eq!(events_of(&journal, 0), Some((2, 0)));
    }

    #[test]
    fn a_journal_of_another_size_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        drop(open(&path));
        let other = Journal::open(&path, 7, &[24, 24, 24]);
        assert_eq!(
            other.err().map(|error| error.kind()),
            Some(io::ErrorKind::InvalidData)
        );
    }

    #[test]
    fn what_is_needed_is_not_lost_while_there_is_room() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("journal");
        let (mut journal, _) = open(&path);
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
        let (mut again, _) = open(&path);
        again.go_on_from(tick - 1);
        assert_eq!(events_of(&again, durable), Some((700, durable)));
        assert!(commit_too_long(&mut again).is_err());
    }

    fn commit_too_long(journal: &mut Journal) -> io::Result<()> {
        journal.commit(0, None, |put| put(1, &[0; 41]))
    }
}
