//! The loop around the trace's writer.
//!
//! Responsible for: giving the writer every batch in order and the snapshots as they come, telling
//! the world how far it has come.
//! Not responsible for: what is in a trace (crate `trace`).
//!
//! The recorder sleeps between two looks whatever the others do, so that it takes many batches at
//! once and disturbs nobody's caches at every tick. Only when it is falling behind does it look
//! again at once; the world waits for it when it is a whole window behind.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::time::Duration;

use shm_types::{
    Checked, EventKind, MotionBatch, Outcome, RecorderReport, SnapshotHeader, WorldSnapshot,
};
use trace::{Ending, Resumed, SceneRecord, WriteError, Writer};

use crate::options::Role;
use crate::ports::{Access, Publisher, Subscriber};
use crate::report::RecorderSummary;
use crate::roles::{RoleError, Seat, Telling, refused};
use crate::topics::MOTION_WINDOW;
use crate::wakes::Waker;

/// Sleep between two looks.
const PERIOD: Duration = Duration::from_micros(500);
/// Batches at once that say it is falling behind.
const BEHIND: u64 = MOTION_WINDOW / 2;

/// Takes part in the run in `run_dir`, as process `incarnation` of the recorder, until it ends.
///
/// # Errors
/// Set-up failed, the trace cannot be written, or the run broke off.
pub fn main(run_dir: &Path, incarnation: u32) -> Result<(), RoleError> {
    let mut seat = Seat::take(run_dir, Role::Recorder, incarnation)?;
    let mut shell = Shell::new(&mut seat)?;
    seat.settle();
    shell.tell()?;
    while !shell.has_seen_the_end() && !seat.is_stopped() {
        if shell.look(&mut seat)? < BEHIND {
            std::thread::sleep(PERIOD);
        }
    }
    let summary = shell.finish(&seat)?;
    let telling = Telling {
        lost: summary.lost,
        recorder: Some(summary),
        ..Telling::default()
    };
    seat.leave(telling)
}

/// The writer and its ports.
struct Shell {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    motion: Subscriber<MotionBatch>,
    snapshots: Subscriber<WorldSnapshot>,
    outlet: Publisher<RecorderReport>,
    waker: Option<Waker>,
    report: RecorderReport,
    batches: u64,
    /// How the run ended, and when, ns of virtual time.
    ended: Option<(Outcome, u64)>,
    /// Whether the snapshot after that has come, so that everybody can know of the end.
    end_is_out: bool,
}

impl Shell {
    fn new(seat: &mut Seat) -> Result<Self, RoleError> {
        let options = seat.options();
        let path = seat.trace_path();
        let every_ns = if options.state_rate_hz > 0.0 {
            (1e9 / options.state_rate_hz) as u64
        } else {
            u64::MAX
        };
        let scene = SceneRecord::new(&seat.scene, &options.settings, seat.run.id_number());
        let (writer, resumed) = open(&path, &scene, every_ns, seat.incarnation)?;
        if let Some(Resumed {
            scene_version,
            scenario_hash,
            ..
        }) = &resumed
        {
            seat.follow(&SnapshotHeader {
                scene_version: *scene_version,
                scenario_hash: u64::from_str_radix(scenario_hash, 16).unwrap_or(seat.scene.hash),
                ..SnapshotHeader::default()
            })?;
        }
        let next_sequence = resumed.map_or(0, |resumed| resumed.next_sequence);
        let (topics, node) = (&seat.topics, &seat.node);
        Ok(Self {
            path,
            motion: topics.motion.service(node, Access::Open)?.subscriber()?,
            snapshots: topics.world.service(node, Access::Open)?.subscriber()?,
            outlet: topics.recorder.service(node, Access::Open)?.publisher()?,
            waker: seat.waker(|| topics.wake_world.service(node, Access::Open)?.waker())?,
            report: RecorderReport {
                next_sequence,
                durable_sequence: next_sequence,
                lost: writer.missing_batches(),
                incarnation: seat.incarnation,
                reserved: 0,
            },
            writer,
            batches: next_sequence,
            ended: None,
            end_is_out: false,
        })
    }

    const fn has_seen_the_end(&self) -> bool {
        self.ended.is_some() && self.end_is_out
    }

    /// Writes all that has come; how many batches that were.
    fn look(&mut self, seat: &mut Seat) -> Result<u64, RoleError> {
        // A snapshot comes after the batch that led to it, so whoever takes it first has both.
        let snapshot = self.snapshots.receive()?;
        let before = self.batches;
        while let Some(batch) = self.motion.receive()? {
            if !self.is_next(&batch) {
                continue;
            }
            self.follow_batch(seat, &batch)?;
            self.write(&batch)?;
            seat.answering();
        }
        // One that is older than the last batch may be of a scene that is no more.
        let current = snapshot.filter(|snapshot| snapshot.header.scene_version >= seat.version());
        if let Some(snapshot) = current {
            // Told already, unless the batch that did was lost.
            self.follow(seat, &snapshot.header)?;
            let snapshot = Checked::new(&*snapshot, seat.counts()).map_err(refused("world"))?;
            let header = &snapshot.header;
            self.end_is_out = header.outcome != Outcome::Running.code();
            // A recorder before this one may have had the batch that tells of it.
            if self.end_is_out && self.report.next_sequence >= header.tick && self.ended.is_none() {
                let outcome = Outcome::decode(header.outcome).unwrap_or(Outcome::Failed);
                self.ended = Some((outcome, header.time_ns));
            }
            self.writer
                .snapshot(snapshot)
                .map_err(|error| unwritten(&self.path, &error))?;
        }
        let taken = self.batches - before;
        if taken > 0 {
            self.tell()?;
        } else {
            self.outlet.connect()?;
        }
        Ok(taken)
    }

    /// Whether a batch is the one expected, or a later one while those before it are lost: what
    /// the world still has comes again.
    fn is_next(&self, batch: &MotionBatch) -> bool {
        let next = self.report.next_sequence;
        batch.sequence == next || (batch.sequence > next && batch.kept_from > next)
    }

    /// Begins a version of the scene with the batch that tells of it.
    fn follow_batch(&mut self, seat: &mut Seat, batch: &MotionBatch) -> Result<(), RoleError> {
        let changed = EventKind::Changed.code();
        let event = batch.events().iter().find(|event| event.kind == changed);
        match event {
            None => Ok(()),
            Some(event) => self.follow(
                seat,
                &SnapshotHeader {
                    scene_version: event.other,
                    scenario_hash: event.value,
                    ..SnapshotHeader::default()
                },
            ),
        }
    }

    /// Writes down the version of the scene that holds from here on, if it is another one.
    fn follow(&mut self, seat: &mut Seat, header: &SnapshotHeader) -> Result<(), RoleError> {
        if !seat.follow(header)? {
            return Ok(());
        }
        let settings = &seat.run.options.settings;
        let scene = SceneRecord::new(&seat.scene, settings, seat.run.id_number());
        self.writer
            .change(&scene)
            .map_err(|error| unwritten(&self.path, &error))
    }

    fn write(&mut self, batch: &MotionBatch) -> Result<(), RoleError> {
        self.writer
            .batch(batch)
            .map_err(|error| unwritten(&self.path, &error))?;
        self.batches += 1;
        self.report.next_sequence = batch.sequence + 1;
        self.report.durable_sequence = self.writer.safe_sequence();
        self.report.lost = self.writer.missing_batches();
        let ended = EventKind::Ended.code();
        if let Some(end) = batch.events().iter().find(|event| event.kind == ended) {
            let outcome = u32::try_from(end.value).ok();
            let outcome = outcome.and_then(|code| Outcome::decode(code).ok());
            self.ended = Some((outcome.unwrap_or(Outcome::Failed), batch.time_ns));
        }
        Ok(())
    }

    /// Tells the world how far it has come.
    fn tell(&mut self) -> Result<(), RoleError> {
        let report = self.report;
        self.outlet.send(|out| *out = report)?;
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }

    /// Ends the trace; one that breaks off before the run's end stays without an end.
    fn finish(mut self, seat: &Seat) -> Result<RecorderSummary, RoleError> {
        let lost = self.report.lost;
        let summary = RecorderSummary {
            batches: self.batches,
            lost,
            complete: lost == 0 && self.ended.is_some(),
        };
        let Some((outcome, makespan_ns)) = self.ended else {
            self.writer
                .flush()
                .map_err(|error| unwritten(&self.path, &error))?;
            return Ok(summary);
        };
        let ending = Ending {
            outcome: outcome.into(),
            reason: None,
            makespan_ns,
            // Numbers and words have a JSON form; `null` here would only be less to read.
            options: serde_json::to_value(seat.options()).unwrap_or_default(),
        };
        let path = self.path;
        let file = self
            .writer
            .finish(ending)
            .map_err(|error| unwritten(&path, &error))?;
        file.into_inner().map_err(|error| RoleError::File {
            path,
            reason: error.to_string(),
        })?;
        Ok(summary)
    }
}

/// A new trace; or, by a process that was started again, the one of its predecessor, as far as
/// that is whole.
fn open(
    path: &Path,
    scene: &SceneRecord,
    every_ns: u64,
    incarnation: u32,
) -> Result<(Writer<BufWriter<File>>, Option<Resumed>), RoleError> {
    let failed = |error: std::io::Error| RoleError::File {
        path: path.to_owned(),
        reason: error.to_string(),
    };
    if incarnation > 1
        && let Ok(old) = File::open(path)
    {
        // Beside the old one, which stays until all that it has is in the new one.
        let draft = path.with_extension("mcap.part");
        let out = BufWriter::new(File::create(&draft).map_err(failed)?);
        let made = Writer::go_on(BufReader::new(old), out, scene, every_ns)
            .map_err(|error| unwritten(path, &error))?;
        if let Some((writer, resumed)) = made {
            std::fs::rename(&draft, path).map_err(failed)?;
            return Ok((writer, Some(resumed)));
        }
        std::fs::remove_file(&draft).map_err(failed)?;
    }
    let file = File::create(path).map_err(failed)?;
    let writer = Writer::new(BufWriter::new(file), scene, every_ns);
    Ok((writer.map_err(|error| unwritten(path, &error))?, None))
}

fn unwritten(path: &Path, error: &WriteError) -> RoleError {
    RoleError::File {
        path: path.to_owned(),
        reason: error.to_string(),
    }
}
