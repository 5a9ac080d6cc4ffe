//! The checker of traces, as it looks on at a simulated run.
//!
//! Responsible for: writing the run's trace to memory, and having it checked at the end.
//! Not responsible for: what a legal run is (crate `trace`).

use scene::{Scene, Settings};
use shm_types::Checked;
use sim::faults::{Disturbed, Onlooker};
use trace::{Ending, SceneRecord, Writer};

/// How often a whole state is written to the trace, ns of world time.
const STATE_EVERY_NS: u64 = 1_000_000_000;

/// A trace in memory.
pub(super) struct Checking<'a> {
    scene: &'a Scene,
    writer: Option<Writer<Vec<u8>>>,
}

impl<'a> Checking<'a> {
    pub(super) fn new(scene: &'a Scene, settings: &Settings) -> Self {
        let record = SceneRecord::new(scene, settings, 0);
        Self {
            scene,
            writer: Writer::new(Vec::new(), &record, STATE_EVERY_NS).ok(),
        }
    }
}

impl Onlooker for Checking<'_> {
    fn look(&mut self, run: &Disturbed<'_>) -> Option<String> {
        let Some(writer) = &mut self.writer else {
            return Some("there is no trace to check".to_owned());
        };
        let snapshot = match Checked::new(run.snapshot(), self.scene.counts()) {
            Ok(snapshot) => snapshot,
            Err(invalid) => return Some(format!("the world made an invalid snapshot: {invalid}")),
        };
        let written = writer
            .batch(run.motion())
            .and_then(|()| writer.snapshot(snapshot));
        written.err().map(|error| error.to_string())
    }

    fn close(&mut self, run: &Disturbed<'_>) -> Option<String> {
        let ending = Ending {
            outcome: run.world().outcome().into(),
            reason: None,
            makespan_ns: run.snapshot().header.time_ns,
            options: serde_json::Value::Null,
        };
        let bytes = match self.writer.take()?.finish(ending) {
            Ok(bytes) => bytes,
            Err(error) => return Some(error.to_string()),
        };
        match trace::check(&bytes[..]) {
            Ok(report) => report
                .violations
                .first()
                .map(|first| format!("the checker: {first}")),
            Err(error) => Some(format!("the trace {error}")),
        }
    }
}
