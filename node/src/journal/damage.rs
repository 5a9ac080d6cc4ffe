//! Journals whose bytes were changed, as a world that is started again, or a run that is resumed,
//! may find them.
//!
//! Responsible for: a good journal of a real run, changing it as a tape says, opening it as the world's
//! shell does, and what must come of it: the state of one of both slots as it was, or an error.
//! Not responsible for: where tapes come from (`tests`, and the fuzz target `journal_file`, which
//! compiles this file too), states that were changed and have a checksum that is right (crate
//! `hostile`).

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;

use hostile::{Got, Tape};
use scene::{Scene, Settings};
use shm_types::{MotionBatch, Validate, zeroed};
use sim::Simulation;
use tempfile::TempDir;
use world::{World, WorldInput};

use super::{Found, INDEX, Journal, RING_AT, SLOTS_AT};

/// Number of the run.
const RUN: u64 = 7;
/// Ticks of the run before its journal begins, and that the journal has.
const BEFORE: u64 = 150;
const KEPT: u64 = 20;
/// Room for each part of a state, more than a part of this small a scene needs.
const ROOM: usize = 16 << 10;
/// Bytes of the places of its batches in the index, and about as many of batches in the ring.
const INDEX_BYTES: usize = 16;
const RING_BYTES: usize = 4_096;
/// Bytes of the head that have a meaning.
const HEAD: usize = 40;

/// A journal that a world process has left.
pub(crate) struct Left {
    directory: TempDir,
    scene: Scene,
    settings: Settings,
    rooms: Vec<usize>,
    /// Bytes of the file.
    length: usize,
    /// The parts of the good file that are not zeros, by place.
    pieces: Vec<(usize, Vec<u8>)>,
    /// Both states, each with its tick.
    states: Vec<Found>,
    /// The batches that led there.
    batches: Vec<Box<MotionBatch>>,
}

impl Left {
    /// That of a small run.
    pub(crate) fn new() -> Self {
        // In memory where there is such a place: every input is a file of its own.
        let directory = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
        let directory = directory.expect("a folder");
        let room = scene::generate(&scene::GenerateOptions {
            seed: 1,
            objects: 3,
            robots: 2,
            area_m2: 9.0,
            walls: 1,
            ..scene::GenerateOptions::default()
        });
        let scene = room.expect("a room").scene;
        let settings = Settings {
            units_per_second: 500_000,
            ..Settings::default()
        };
        let mut run = Simulation::new(&scene, &settings, 0);
        let mut saved = Vec::new();
        let mut copy_of = |world: &World| {
            saved.clear();
            world.save(&mut saved);
            World::restore(&scene, settings.clone(), &saved).expect("just saved")
        };
        let mut parts = 0;
        copy_of(run.world()).save_changed(|part, _| parts = parts.max(part + 1));
        let rooms = vec![ROOM; parts];
        let path = directory.path().join("journal");
        let (mut journal, _) = Journal::open(&path, RUN, &rooms).expect("a journal");
        let mut batches = Vec::new();
        for tick in 1..=BEFORE + KEPT {
            run.tick();
            if tick > BEFORE {
                let mut world = copy_of(run.world());
                let kept = journal.commit(tick, Some(run.motion()), |put| {
                    world.save_changed(put);
                });
                kept.expect("room");
                let mut batch: Box<MotionBatch> = zeroed();
                batch.copy_from(run.motion());
                batches.push(batch);
            }
        }
        drop(journal);
        let (_, states) = Journal::open(&path, RUN, &rooms).expect("a journal");
        let bytes = std::fs::read(&path).expect("a file");
        Self {
            length: bytes.len(),
            pieces: pieces(&bytes),
            directory,
            scene,
            settings,
            rooms,
            states,
            batches,
        }
    }

    /// Changes the journal as `tape` says, and goes on from it.
    pub(crate) fn open(&self, tape: &[u8]) -> Got {
        let mut tape = Tape::new(tape);
        let path = self.directory.path().join("changed");
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(&path)
            .expect("a file");
        self.write(&file, &mut tape).expect("room in memory");
        let Ok((mut journal, found)) = Journal::open(&path, RUN, &self.rooms) else {
            return Got::Inside;
        };
        // As long as one of both is not empty, nobody begins anew.
        if found.is_empty() {
            assert!(self.is_emptied(&file), "nothing is found");
            return Got::Refused;
        }
        let mut got = Got::Refused;
        for (_, bytes) in &found {
            let Ok(mut world) = World::restore(&self.scene, self.settings.clone(), bytes) else {
                got = Got::Inside;
                continue;
            };
            let is_one = |(tick, state): &Found| *tick == world.tick() && state == bytes;
            assert!(self.states.iter().any(is_one), "neither of both states");
            self.go_on(&mut journal, &mut world);
            drop(journal);
            let (_, found) = Journal::open(&path, RUN, &self.rooms).expect("it was just written");
            let mut after = Vec::new();
            world.save(&mut after);
            assert!(
                found.iter().any(|(_, state)| *state == after),
                "not gone on"
            );
            return Got::Accepted;
        }
        got
    }

    /// Whether the file says that there never was a state.
    fn is_emptied(&self, file: &File) -> bool {
        let slot = (self.length - SLOTS_AT) / 2;
        let is_empty = |slot: usize, parts: &mut [u8; 8]| {
            let at = (SLOTS_AT + slot + 8) as u64;
            file.read_exact_at(parts, at).is_ok() && *parts == [0; 8]
        };
        is_empty(0, &mut [1; 8]) && is_empty(slot, &mut [1; 8])
    }

    /// Reads the batches that led to `world`, and commits a tick.
    fn go_on(&self, journal: &mut Journal, world: &mut World) {
        let tick = world.tick();
        journal.go_on_from(tick);
        assert!(journal.generation() > 0);
        let mut batch: Box<MotionBatch> = zeroed();
        for sequence in journal.kept_from(tick)..tick {
            assert!(journal.read(sequence, &mut batch), "it is kept");
            assert_eq!(batch.validate(self.scene.counts()), Ok(()));
            let same = |good: &MotionBatch| {
                good.motions() == batch.motions() && good.events() == batch.events()
            };
            let mut good = self.batches.iter().filter(|good| good.sequence == sequence);
            assert!(good.any(|good| same(good)), "another batch");
        }
        assert!(journal.has_room(tick));
        world.step(&self.scene, WorldInput::default(), &mut batch);
        let tick = world.tick();
        let kept = journal.commit(tick, Some(&batch), |put| world.save_changed(put));
        kept.expect("room");
    }

    /// Writes the good file with some words changed, and perhaps of another length.
    fn write(&self, file: &File, tape: &mut Tape<'_>) -> io::Result<()> {
        file.set_len(self.length as u64)?;
        for (at, bytes) in &self.pieces {
            file.write_all_at(bytes, *at as u64)?;
        }
        for _ in 0..tape.below(4) {
            let slot = (self.length - SLOTS_AT) / 2;
            let first = (BEFORE as usize) * INDEX_BYTES;
            let (at, bytes) = match tape.below(8) {
                0 => (0, HEAD),
                1 => (INDEX + first, KEPT as usize * INDEX_BYTES),
                2 => (RING_AT, RING_BYTES),
                // What a slot begins with: its tick, how many parts, the first part.
                3 => (SLOTS_AT, 64),
                4 => (SLOTS_AT + slot, 64),
                5 => (SLOTS_AT, slot),
                6 => (SLOTS_AT + slot, slot),
                _ => {
                    file.set_len(tape.below(self.length + RING_BYTES) as u64)?;
                    continue;
                }
            };
            let mut changed = vec![0; bytes];
            let read = file.read_at(&mut changed, at as u64)?;
            tape.change(&mut changed[..read]);
            file.write_all_at(&changed[..read], at as u64)?;
        }
        Ok(())
    }
}

/// What is in a file besides zeros, in pieces.
fn pieces(bytes: &[u8]) -> Vec<(usize, Vec<u8>)> {
    const PIECE: usize = 4_096;
    let pieces = bytes.chunks(PIECE).enumerate();
    let pieces = pieces.filter(|(_, piece)| piece.iter().any(|byte| *byte != 0));
    pieces
        .map(|(at, piece)| (at * PIECE, piece.to_vec()))
        .collect()
}
