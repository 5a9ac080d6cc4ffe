//! Traces, and the batches of motion that they are made of.
//!
//! Responsible for: changing what is said inside records, and the file around them; reading the result
//! with everything that reads traces.
//! Not responsible for: what a trace says when nobody has changed it (crate `trace`).

use shm_types::{MotionBatch, Validate, zeroed};
use trace::{ReadError, Reader, Story, Writer};
use zerocopy::IntoBytes;

use crate::bench::Bench;
use crate::{Got, Tape, each};

/// What may stand where a number did.
const MARKS: [u8; 16] = *b"0123456789-eE.nN";
/// Bytes before the records of an MCAP file, and before the body of each of them.
const MAGIC: usize = 8;
const FRAME: usize = 9;

/// An MCAP file without its checksums: 0 says that there is none.
pub(crate) fn without_checksums(file: &[u8]) -> Vec<u8> {
    let mut open = file.to_vec();
    let mut at = MAGIC;
    while at + FRAME < open.len() {
        let mut length = [0; 8];
        length.copy_from_slice(&open[at + 1..at + FRAME]);
        // Where in a chunk, the end of the data and the footer it is.
        let sum = match open[at] {
            0x06 => Some(24),
            0x0f => Some(0),
            0x02 => Some(16),
            _ => None,
        };
        let body = at + FRAME;
        if let Some(sum) = sum {
            open[body + sum..body + sum + 4].fill(0);
        }
        at = body + u64::from_le_bytes(length) as usize;
    }
    open
}

/// A trace that was changed or cut short.
pub(crate) fn trace(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let whole = if tape.once_in(16) {
        &bench.trace
    } else {
        &bench.open_trace
    };
    let mut trace = whole.clone();
    if tape.once_in(8) {
        trace.truncate(tape.below(trace.len()));
    }
    if tape.once_in(4) {
        tape.change(&mut trace);
    } else {
        // Digits and letters inside records: the file is whole, what it says is not.
        for _ in 0..=tape.below(4) {
            let from = tape.below(trace.len());
            let is_digit = u8::is_ascii_digit;
            let found = trace[from.min(trace.len())..].iter().position(is_digit);
            let byte = found.and_then(|at| trace.get_mut(from + at));
            let mark = MARKS[tape.below(MARKS.len())];
            if let Some(byte) = byte {
                *byte = mark;
            }
        }
    }
    match tape.below(3) {
        0 => got(trace::check(&trace[..])),
        1 => got(show(bench, &trace, tape)),
        _ => go_on(bench, &trace),
    }
}

/// How far a trace got with somebody who reads it whole.
fn got<T>(read: Result<T, ReadError>) -> Got {
    match read {
        Ok(_) => Got::Accepted,
        Err(
            ReadError::Foreign
            | ReadError::OtherProgram
            | ReadError::TooShort
            | ReadError::Damaged { .. },
        ) => Got::Refused,
        Err(_) => Got::Inside,
    }
}

/// Shows it, as `view` and `explain` do.
fn show(bench: &Bench, trace: &[u8], tape: &mut Tape<'_>) -> Result<(), ReadError> {
    let story = Reader::new(trace).and_then(Story::read)?;
    let until_s = bench.snapshot.header.time_ns as f64 * 1e-9;
    let at_s = [0.0, until_s / 2.0, 1e18, -1.0][tape.below(4)];
    let _ = trace::standing(&story, at_s);
    if tape.once_in(8) {
        let _ = (trace::page(&story, at_s), trace::still(&story, at_s));
    }
    Ok(())
}

/// Goes on with it, as a recorder that was started again does. Of what it cannot read it says nothing
/// but that there is nothing to go on with.
fn go_on(bench: &Bench, trace: &[u8]) -> Got {
    let again = Writer::go_on(trace, Vec::new(), &bench.record, 0).expect("memory");
    let Some((mut writer, _)) = again else {
        return Got::Refused;
    };
    let _ = writer.batch(&bench.batch);
    Got::Accepted
}

/// Batches of motion that a recorder is sent.
pub(crate) fn motion(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut writer = Writer::new(Vec::new(), &bench.record, 0).expect("memory");
    let mut sequence = 0;
    let got = each(tape, |tape| {
        let mut batch: Box<MotionBatch> = zeroed();
        batch.copy_from(&bench.batch);
        batch.sequence = sequence;
        sequence += 1;
        let head =
            size_of::<MotionBatch>() - size_of_val(&batch.motions) - size_of_val(&batch.events);
        let (motions, events) = (batch.motion_count as usize, batch.event_count as usize);
        match tape.below(3) {
            0 => tape.change_message(&mut *batch, head),
            1 => tape.change(batch.motions[..motions].as_mut_bytes()),
            _ => tape.change(batch.events[..events].as_mut_bytes()),
        }
        let result = batch.validate(bench.scene.counts());
        assert!(result.is_ok() || writer.batch(&batch).is_err());
        if result.is_ok() {
            // Not all that is legal by itself is legal after what came before.
            let _ = writer.batch(&batch);
        }
        Got::of(&result)
    });
    writer.flush().expect("memory");
    got
}
