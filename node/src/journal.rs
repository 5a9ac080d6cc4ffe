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
const VERSION: u64 = 3;
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
pub(crate) const INDEX: usize = 4_096;
pub(crate) const RING_AT: usize = INDEX + KEPT as usize * size_of::<Place>();
pub(crate) const SLOTS_AT: usize = RING_AT + RING;

const _: () = assert!(2 * LARGEST < RING);
const _: () = assert!(size_of::<Head>() <= INDEX);

/// The beginning of the file.
#[derive(Clone, Copy, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
struct Head {
    magic: u64,
    version: u64,
    run_id: u64,
    slot_bytes: u64,
    /// Which world process writes it, from 1; and from bit 32 on the opposite of that.
    generation: u64,
}

impl Head {
    /// Whether it begins a journal of the same run and form.
    fn is_as(&self, other: &Self) -> bool {
        let form = |head: &Self| (head.magic, head.version, head.run_id, head.slot_bytes);
        form(self) == form(other)
    }
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
    /// bytes each; the states in it, newest first. One that is not whole is among them.
    ///
    /// # Errors
    /// The system refused, or the journal has another form, or is damaged.
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
        let slots = Slots::new(rooms);
        let slot_bytes = slots.bytes();
        let length = SLOTS_AT + 2 * slot_bytes;
        let old = Head {
            magic: MAGIC,
            version: VERSION,
            run_id,
            slot_bytes: slot_bytes as u64,
            generation: twice(0),
        };
        let old = match (file.metadata()?.len(), read_head(&file)?) {
            (0, _) => {
                file.set_len(length as u64)?;
                old
            }
            // Its maker died before it had any state in it.
            (bytes, Some(head)) if bytes == length as u64 && head.magic == 0 => old,
            (bytes, Some(head)) if bytes == length as u64 && head.is_as(&old) => head,
            // Beginning anew would undo what everybody has seen.
            _ => return Err(damaged("it is damaged, or of another run or version")),
        };
        // Nobody would listen to a world of a generation that was before.
        let before = old.generation as u32;
        let generation = before.checked_add(1);
        let generation = generation.filter(|_| twice(before) == old.generation);
        let generation = generation.ok_or_else(|| damaged("its generation is damaged"))?;
        // SAFETY: only processes of this user can open the file, and of these only the one world
        // process of the run does; nobody shortens it while the run goes on.
        let map = unsafe { MmapMut::map_mut(&file)? };
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
        if before == 0 && !found.is_empty() {
            return Err(damaged("its beginning is damaged"));
        }
        let head = Head {
            generation: twice(generation),
            ..old
        };
        // Each word at once, and the first last: with it the file counts.
        for (at, word) in head.as_bytes().chunks(LENGTH).enumerate().rev() {
            journal.put(at * LENGTH, word);
        }
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

    /// What is in a slot, whole or not; nothing while it is written.
    fn read_slot(&self, slot: usize) -> Option<Found> {
        let at = self.slot_at(slot);
        let word = |at: usize| u64::read_from_bytes(&self.map[at..at + 8]).ok();
        let (tick, parts) = (word(at)?, word(at + 8)?);
        if parts == 0 {
            return None;
        }
        let mut state = Vec::new();
        for part in 0..parts {
            let part = usize::try_from(part).ok();
            match part.and_then(|part| self.part(slot, part)) {
                Some(bytes) => state.extend_from_slice(bytes),
                None => return Some((tick, Vec::new())),
            }
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

/// A generation, such that one that is damaged is seen to be.
fn twice(generation: u32) -> u64 {
    u64::from(generation) | u64::from(!generation) << 32
}

fn damaged(what: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
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

// Where they lie is said since this file is compiled into a fuzz target, too.
#[cfg(test)]
#[path = "journal/damage.rs"]
mod damage;
#[cfg(test)]
#[path = "journal/tests.rs"]
mod tests;
