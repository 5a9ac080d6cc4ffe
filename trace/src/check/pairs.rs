//! Exact tests of two bodies, or of a body and a wall, that both go straight.
//!
//! Responsible for: shapes, where any two of them meet, what a test that fails is reported as.
//! Not responsible for: which pairs are tested (`bodies`), how far they must keep apart (`rules`).

use std::collections::BTreeMap;

use super::geometry::{Interval, Meeting, Solid, Vector};
use super::report::{Findings, Kind, Who};
use super::rules::{Apart, OVERLAP_M};
use crate::record::Outline;

/// Number of a shape.
pub(super) type Shape = usize;

/// All shapes, each once, and where any two of them meet.
pub(super) struct Pairs {
    outlines: Vec<Outline>,
    solids: Vec<Solid>,
    meetings: BTreeMap<(Shape, Shape), Meeting>,
    clearance_m: f64,
    tests: u64,
}

/// Two bodies, or a body and a wall, over a span of time in which both go straight.
pub(super) struct Pair {
    pub(super) who: (Who, Who),
    pub(super) shapes: (Shape, Shape),
    /// Place of the first relative to the second at the start, m.
    pub(super) from: Vector,
    /// And at the end.
    pub(super) to: Vector,
    /// Start and end, ns.
    pub(super) span_ns: (u64, u64),
}

impl Pairs {
    /// No shapes yet.
    pub(super) const fn new(clearance_m: f64) -> Self {
        Self {
            outlines: Vec::new(),
            solids: Vec::new(),
            meetings: BTreeMap::new(),
            clearance_m,
            tests: 0,
        }
    }

    /// Exact tests so far.
    pub(super) const fn tests(&self) -> u64 {
        self.tests
    }

    /// The number of a shape, new or known.
    pub(super) fn add(&mut self, outline: &Outline) -> Shape {
        if let Some(known) = self.outlines.iter().position(|other| other == outline) {
            return known;
        }
        self.outlines.push(outline.clone());
        self.solids.push(outline.into());
        self.solids.len() - 1
    }

    /// The box around a shape.
    pub(super) fn extent(&self, shape: Shape) -> (Vector, Vector) {
        self.solids[shape].extent()
    }

    /// Where the first meets the second.
    pub(super) fn meeting(&mut self, moving: Shape, standing: Shape) -> &Meeting {
        let solids = &self.solids;
        self.meetings
            .entry((moving, standing))
            .or_insert_with(|| Meeting::of(&solids[moving], &solids[standing]))
    }

    /// Tests whether two keep apart as they must.
    pub(super) fn test(&mut self, pair: &Pair, apart: Apart, findings: &mut Findings) {
        if apart == Apart::Free {
            return;
        }
        self.tests += 1;
        let clearance_m = self.clearance_m;
        let meeting = self.meeting(pair.shapes.0, pair.shapes.1);
        if let Some(when) = meeting.nearer_than(-OVERLAP_M, pair.from, pair.to) {
            report(findings, Kind::Collision, pair, when, clearance_m);
        } else if apart == Apart::Clearance
            && clearance_m > 0.0
            && let Some(when) = meeting.nearer_than(clearance_m - OVERLAP_M, pair.from, pair.to)
        {
            report(findings, Kind::Clearance, pair, when, clearance_m);
        }
    }
}

/// Says what two did wrong, and in which part of their span.
pub(super) fn report(
    findings: &mut Findings,
    kind: Kind,
    pair: &Pair,
    when: Interval,
    clearance_m: f64,
) {
    let (start_ns, end_ns) = pair.span_ns;
    // Casts of durations, exact far beyond any run's length.
    let time = |part: f64| start_ns.saturating_add(((end_ns - start_ns) as f64 * part) as u64);
    let (a, b) = pair.who;
    let (a, b) = if a <= b { (a, b) } else { (b, a) };
    findings.lasting(kind, (time(when.0), time(when.1)), (a, b), || {
        match (kind, b) {
            (Kind::Collision, Who::Bounds) => format!("{a} is partly beyond {b}"),
            (Kind::Collision, _) => format!("{a} and {b} overlap"),
            _ => format!("{a} is nearer to {b} than the clearance of {clearance_m} m"),
        }
    });
}
