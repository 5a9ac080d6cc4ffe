//! The parts of a world's saved state.
//!
//! Responsible for: cutting the state into parts, so that a tick saves only those that may have
//! changed; the checksums by which parts that are damaged, or do not belong together, are refused.
//! Not responsible for: how values are saved (`saved.rs`, `checkpoint.rs`), where parts are kept
//! (crate `node`).
//!
//! Terms: part 0 is the *head*: all that changes in most ticks, and the checksums of the others.
//! Part 1 has the tables of constraints, each further one [`PER_PART`] objects. On the outside each
//! begins with the length of the rest of it (u64) and ends with its checksum; a whole state is its
//! parts one after the other.

use shm_types::StateHash;

use crate::checkpoint::CheckpointError;
use crate::guards::{Guard, Guards};
use crate::objects::PER_PART;
use crate::saved::{Reader, Saved};
use crate::step::World;

/// Bytes of a checksum, and of a length.
const WORD: usize = size_of::<u64>();
/// Which part has the constraints, and which the first objects.
const CONSTRAINTS: usize = 1;
const OBJECTS: usize = 2;

impl World {
    /// Appends the whole state as it is between two steps to `out`, which needs no more room
    /// than it had the time before unless the state has grown.
    pub fn save(&self, out: &mut Vec<u8>) {
        let head = out.len();
        let count = self.part_count();
        frame(out, |out| {
            self.save_head(out);
            (count - 1).save(out);
            out.resize(out.len() + WORD * (count - 1), 0);
        });
        let sums = out.len() - WORD * count;
        let end = out.len();
        for part in 1..count {
            let sum = frame(out, |out| self.save_part(part, out));
            let at = sums + WORD * (part - 1);
            out[at..at + WORD].copy_from_slice(&sum.to_le_bytes());
        }
        let sum = checksum(&out[head + WORD..end - WORD]);
        out[end - WORD..end].copy_from_slice(&sum.to_le_bytes());
    }

    /// Hands to `keep` the number and the bytes of each part that may have changed since the last
    /// call, of a world that was just made or restored of all parts. With the parts that were
    /// handed out before they are the state.
    pub fn save_changed(&mut self, mut keep: impl FnMut(usize, &[u8])) {
        let mut bytes = std::mem::take(&mut self.saving.bytes);
        let count = self.part_count();
        self.saving.sums.resize(count - 1, 0);
        let (objects, ground) = (
            self.objects.touched().take_unsaved(),
            self.bodies.ground.touched().take_unsaved(),
        );
        let constraints = self.constraints.take_touched();
        for part in 1..count {
            let changed = match part.checked_sub(OBJECTS) {
                Some(group) => objects.has(group) || ground.has(group),
                None => constraints,
            };
            if changed {
                bytes.clear();
                self.saving.sums[part - 1] = frame(&mut bytes, |out| self.save_part(part, out));
                keep(part, &bytes);
            }
        }
        bytes.clear();
        frame(&mut bytes, |out| {
            self.save_head(out);
            self.saving.sums.save(out);
        });
        keep(0, &bytes);
        self.saving.bytes = bytes;
    }

    /// How many parts there are.
    fn part_count(&self) -> usize {
        OBJECTS + self.objects.len().div_ceil(PER_PART)
    }

    fn save_part(&self, part: usize, out: &mut Vec<u8>) {
        if part == CONSTRAINTS {
            return self.constraints.save(out);
        }
        let first = (part - OBJECTS) * PER_PART;
        let end = self.objects.len().min(first + PER_PART);
        for object in first..end {
            self.objects[object].save(out);
            self.bodies.ground.place(object).save(out);
        }
    }
}

/// What saving keeps from tick to tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Saving {
    /// Checksums of the parts after the head, as handed out last.
    sums: Vec<u64>,
    bytes: Vec<u8>,
}

/// The parts of a state, each found whole, and all to belong together.
pub(crate) struct Parts<'a> {
    /// What is left of the head, without its checksums.
    pub(crate) head: Reader<'a>,
    others: Vec<&'a [u8]>,
    sums: Vec<u64>,
    guards: Guards,
}

impl<'a> Parts<'a> {
    /// Takes a saved state apart.
    ///
    /// # Errors
    /// A part is cut short or damaged.
    pub(crate) fn of(bytes: &'a [u8], guards: Guards) -> Result<Self, CheckpointError> {
        let mut from = Reader(bytes);
        let mut parts = Vec::new();
        let mut sums = Vec::new();
        while !from.0.is_empty() {
            let (body, sum) = unframe(&mut from).ok_or(CheckpointError::Damaged)?;
            let is_whole = sum == checksum(body);
            if !guards.holds(Guard::Checksum, is_whole) {
                return Err(CheckpointError::Damaged);
            }
            parts.push(body);
            sums.push(sum);
        }
        if parts.len() < OBJECTS {
            return Err(CheckpointError::Damaged);
        }
        let head = Reader(parts.remove(0));
        sums.remove(0);
        Ok(Self {
            head,
            others: parts,
            sums,
            guards,
        })
    }

    /// Reads the end of the head: whether it is the head of these other parts.
    ///
    /// # Errors
    /// It is that of others.
    pub(crate) fn end_head(&mut self) -> Result<(), CheckpointError> {
        let sums: Vec<u64> = Saved::restore(&mut self.head)?;
        let belong = sums == self.sums;
        if !self.guards.holds(Guard::Checksum, belong) {
            return Err(CheckpointError::Damaged);
        }
        is_read(&self.head)
    }

    /// Reads the constraints by `read`.
    ///
    /// # Errors
    /// What that says, or there is more than it reads.
    pub(crate) fn constraints<E>(
        &self,
        read: impl FnOnce(&mut Reader<'a>) -> Result<(), E>,
    ) -> Result<(), CheckpointError>
    where
        CheckpointError: From<E>,
    {
        let mut from = Reader(self.others[CONSTRAINTS - 1]);
        read(&mut from)?;
        is_read(&from)
    }

    /// Reads `count` objects by `read`.
    ///
    /// # Errors
    /// What that says, or there are more or fewer.
    pub(crate) fn objects<E>(
        &self,
        count: usize,
        mut read: impl FnMut(&mut Reader<'a>) -> Result<(), E>,
    ) -> Result<(), CheckpointError>
    where
        CheckpointError: From<E>,
    {
        let groups = &self.others[OBJECTS - 1..];
        if groups.len() != count.div_ceil(PER_PART) {
            return Err(CheckpointError::Unsound("the number of objects"));
        }
        for (group, bytes) in groups.iter().enumerate() {
            let mut from = Reader(bytes);
            for _ in 0..PER_PART.min(count - group * PER_PART) {
                read(&mut from)?;
            }
            is_read(&from)?;
        }
        Ok(())
    }
}

/// What the head of a saved state begins with.
pub(crate) fn head_of(bytes: &[u8]) -> Option<Reader<'_>> {
    bytes.get(WORD..).map(Reader)
}

fn is_read(from: &Reader<'_>) -> Result<(), CheckpointError> {
    let rest = CheckpointError::Unsound("what comes after its end");
    from.0.is_empty().then_some(()).ok_or(rest)
}

/// Appends what `body` appends, with its length before it and its checksum behind it; the checksum.
fn frame(out: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) -> u64 {
    let at = out.len();
    0_u64.save(out);
    body(out);
    let sum = checksum(&out[at + WORD..]);
    sum.save(out);
    let length = (out.len() - at - WORD) as u64;
    out[at..at + WORD].copy_from_slice(&length.to_le_bytes());
    sum
}

/// The next part without its frame, and its checksum.
fn unframe<'a>(from: &mut Reader<'a>) -> Option<(&'a [u8], u64)> {
    let length = usize::restore(from).ok()?;
    let part = from.take(length).ok()?;
    let (body, sum) = part.split_last_chunk::<WORD>()?;
    Some((body, u64::from_le_bytes(*sum)))
}

fn checksum(bytes: &[u8]) -> u64 {
    let mut hash = StateHash::new();
    hash.add(bytes);
    hash.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{BELOW, Bench, papers, room};

    /// Enough objects for three groups.
    fn bench() -> Bench {
        let objects: Vec<_> = (0..20)
            .map(|i| {
                let (x, y) = (0.5 + 0.6 * f64::from(i % 10), 3.0 + 0.6 * f64::from(i / 10));
                [[x, y], [x, y + 2.0]]
            })
            .collect();
        let mut bench = Bench::new(room(&[[1.0, 1.0], [3.0, 1.0]], &objects, BELOW, ""));
        bench.steps(2);
        bench
    }

    /// Which parts were handed out, put in the place of what there was.
    fn keep(bench: &mut Bench, parts: &mut Vec<Vec<u8>>) -> Vec<usize> {
        let mut kept = Vec::new();
        bench.world.save_changed(|part, bytes| {
            kept.push(part);
            parts.resize(parts.len().max(part + 1), Vec::new());
            parts[part] = bytes.to_vec();
        });
        kept
    }

    fn whole(bench: &Bench) -> Vec<u8> {
        let mut bytes = Vec::new();
        bench.world.save(&mut bytes);
        bytes
    }

    #[test]
    fn only_what_changes_is_saved_and_with_the_rest_it_is_the_state() {
        let mut bench = bench();
        let mut parts = Vec::new();
        assert_eq!(keep(&mut bench, &mut parts), [1, 2, 3, 4, 0]);
        assert!(parts.concat() == whole(&bench));
        bench.step();
        assert_eq!(keep(&mut bench, &mut parts), [0]);
        assert!(parts.concat() == whole(&bench));
        bench.claim(0, 9);
        bench.ask(1, &[[4.0, 1.0]]);
        bench.step();
        assert_eq!(keep(&mut bench, &mut parts), [3, 0], "object 9 is claimed");
        assert!(parts.concat() == whole(&bench));
        for _ in 0..20 {
            bench.step();
            keep(&mut bench, &mut parts);
            assert!(parts.concat() == whole(&bench));
        }
    }

    #[test]
    fn parts_of_different_ticks_are_refused_together() {
        let mut bench = bench();
        let mut before = Vec::new();
        keep(&mut bench, &mut before);
        bench.claim(0, 9);
        bench.step();
        let mut after = before.clone();
        assert_eq!(keep(&mut bench, &mut after), [3, 0]);
        let restore = |parts: &[Vec<u8>]| World::restore(&bench.scene, papers(), &parts.concat());
        for of in [0, 3] {
            let mut mixed = after.clone();
            mixed[of].clone_from(&before[of]);
            let error = restore(&mixed).err();
            assert_eq!(error, Some(CheckpointError::Damaged), "part {of}");
        }
        assert!(restore(&after).is_ok() && restore(&before).is_ok());
        after.pop();
        assert_eq!(restore(&after).err(), Some(CheckpointError::Damaged));
    }
}
