//! Tests of the journal: what a process that comes after finds.

use std::fs;

use super::damage::Left;
use super::*;
use hostile::Got;
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
    assert!(
        Journal::open(&path, 8, &ROOMS).is_err(),
        "it is of another run"
    );
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

#[test]
fn of_a_damaged_journal_a_state_is_found_or_none() {
    let left = Left::new();
    let fresh = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    for seed in [1, fresh.unwrap().as_nanos() as u64] {
        let mut got = [0_u32; 3];
        let mut word = seed;
        for tape in 0..2_000 {
            let mut random = || {
                // Splitmix64.
                word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
                let z = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
                (z ^ (z >> 31)).to_le_bytes()
            };
            println!("{seed} {tape}");
            let tape = [(); 6].map(|()| random()).concat();
            got[left.open(&tape) as usize] += 1;
        }
        let past = got[Got::Inside as usize] + got[Got::Accepted as usize];
        assert!(got[Got::Inside as usize] > 0, "{got:?}");
        assert!(got[Got::Accepted as usize] > 0, "{got:?}");
        assert!(2 * past > got.iter().sum::<u32>(), "{got:?}");
    }
}
