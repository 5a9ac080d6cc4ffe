//! What robots and planner read: snapshots, questions, answers.
//!
//! Responsible for: the targets that begin with a process of one of theirs that was just started.
//! Not responsible for: tables and schedules, which the world reads, too (`to_world`).

use shm_types::{Checked, HardAnswer, HardRequest, Validate, WorldSnapshot, zeroed};
use zerocopy::IntoBytes;

use crate::bench::{Bench, Mail, Reader};
use crate::{Got, Tape, each};

/// Work units a machine may spend in a step: mostly a few.
const UNITS: usize = 500;
/// And now and then.
const MANY_UNITS: usize = 20_000;
/// Bytes of the header that say what it is.
const NAME: usize = 16;

fn units(tape: &mut Tape<'_>) -> u64 {
    let units = if tape.once_in(16) { MANY_UNITS } else { UNITS };
    units as u64
}

/// One of the robots, or the planner.
fn reader(bench: &Bench, tape: &mut Tape<'_>) -> Reader {
    bench.reader(tape.below(bench.scene.homes.len() + 1))
}

/// What goes with the bench's own snapshot.
fn mail(bench: &Bench) -> Mail<'_> {
    Mail {
        table: &bench.table,
        schedule: Some(&bench.schedule),
        answer: None,
        requests: &[],
    }
}

/// A copy of the bench's snapshot, `later` ticks on.
fn copy(bench: &Bench, later: u64) -> Box<WorldSnapshot> {
    let mut snapshot: Box<WorldSnapshot> = zeroed();
    let old = &*bench.snapshot;
    snapshot.header = old.header;
    snapshot.header.tick += later;
    snapshot.header.time_ns += later * bench.settings.tick_ns;
    let (robots, objects) = (bench.scene.homes.len(), bench.scene.objects.len());
    snapshot.robots[..robots].copy_from_slice(&old.robots[..robots]);
    snapshot.objects[..objects].copy_from_slice(&old.objects[..objects]);
    snapshot
}

/// Snapshots one tick after the other. Of each the header is changed, or some robots, or objects.
pub(crate) fn snapshots(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut reader = reader(bench, tape);
    let counts = bench.scene.counts();
    let mut later = 0;
    each(tape, |tape| {
        later += 1;
        let mut snapshot = copy(bench, later);
        let header = size_of_val(&snapshot.header);
        let robots = size_of_val(&snapshot.robots[0]) * bench.scene.homes.len();
        match tape.below(3) {
            0 => tape.change(&mut snapshot.as_mut_bytes()[NAME..header]),
            1 => tape.change(&mut snapshot.as_mut_bytes()[header..header + robots]),
            _ => {
                let objects = bench.scene.objects.len();
                tape.change(snapshot.objects[..objects].as_mut_bytes());
            }
        }
        if tape.once_in(16) {
            tape.change_message(&mut *snapshot, NAME);
        }
        let checked = Checked::new(&*snapshot, counts);
        if let Ok(checked) = checked {
            reader.step(&bench.scene, checked, mail(bench), units(tape));
        }
        Got::of(&checked)
    })
}

/// Questions of robots to the planner, and answers to robots, with snapshots that are good.
pub(crate) fn questions(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut reader = reader(bench, tape);
    let counts = bench.scene.counts();
    let mut later = 0;
    each(tape, |tape| {
        later += 1;
        let snapshot = copy(bench, later);
        let header = &snapshot.header;
        let robot = tape.below(bench.scene.homes.len()) as u32;
        let task = tape.below(bench.scene.objects.len()) as u32;
        let mut request = HardRequest {
            robot,
            task,
            incarnation: 1,
            failure: 1,
            tick: header.tick - 1,
            epoch: header.epoch,
        };
        let mut answer = HardAnswer {
            robot,
            task,
            incarnation: 1,
            failure: 1,
            tick: header.tick - 1,
            constraints_version: header.constraints_version,
            found: 1,
            infeasible: 0,
            reserved: 0,
        };
        tape.change_message(&mut request, size_of::<HardRequest>());
        tape.change_message(&mut answer, size_of::<HardAnswer>());
        let results = [request.validate(counts), answer.validate(counts)];
        let requests = [request];
        let mail = Mail {
            answer: results[1].is_ok().then_some(answer),
            requests: if results[0].is_ok() { &requests } else { &[] },
            ..mail(bench)
        };
        let snapshot = Checked::new(&*snapshot, counts).expect("a good one");
        reader.step(&bench.scene, snapshot, mail, units(tape));
        Got::of(&results[0]).min(Got::of(&results[1]))
    })
}
