//! The canonical text of a scenario: everything said, in one order, in one spelling.
//!
//! Responsible for: that equal scenarios have equal texts, that reading one back gives the same
//! text again, and the hash over it. All processes of a run start from this text.
//! Not responsible for: the certificate, which is advice and no part of a scenario's identity.

use std::fmt::Write as _;

use xxhash_rust::xxh3::xxh3_64;

use crate::draft::{Draft, Move, ObjectDraft, ShapeDraft, WallDraft};
use crate::scene::Scene;

/// The canonical text of a scene.
#[must_use]
pub fn to_canonical_toml(scene: &Scene) -> String {
    text(scene.draft())
}

/// Hash of the canonical text.
pub(crate) fn hash(draft: &Draft) -> u64 {
    xxh3_64(text(draft).as_bytes())
}

/// The canonical text of a draft.
pub(crate) fn text(draft: &Draft) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = write_draft(&mut out, draft);
    out
}

/// The moves of a certificate, as they may follow a canonical text.
pub(crate) fn certificate_text(moves: &[Move]) -> String {
    let mut out = String::new();
    for Move { object, from, to } in moves {
        let _ = write!(
            out,
            "\n[[certificate]]\nobject = {object}\nfrom = {}\nto = {}\n",
            list(from),
            list(to)
        );
    }
    out
}

fn write_draft(out: &mut String, draft: &Draft) -> std::fmt::Result {
    writeln!(out, "name = {}", toml::Value::from(draft.name.as_str()))?;
    writeln!(out, "resolution = {}", number(draft.resolution_m))?;
    writeln!(out, "connectivity = {}", draft.connectivity.neighbours())?;
    let robot = &draft.robot;
    writeln!(out, "\n[robot]")?;
    writeln!(out, "shape = {}", shape(&robot.shape))?;
    writeln!(out, "speed = {}", number(robot.speed_m_per_s))?;
    writeln!(out, "clearance = {}", number(robot.clearance_m))?;
    writeln!(out, "grasp_s = {}", number(robot.grasp_s))?;
    writeln!(out, "release_s = {}", number(robot.release_s))?;
    writeln!(out, "\n[workspace]")?;
    writeln!(out, "bounds = {}", list(&draft.bounds))?;
    writeln!(out, "walls = [")?;
    for wall in &draft.walls {
        match wall {
            WallDraft::Box(corners) => writeln!(out, "  {{ box = {} }},", list(corners))?,
            WallDraft::Polygon(points) => writeln!(out, "  {{ polygon = {} }},", corners(points))?,
        }
    }
    writeln!(out, "]")?;
    for home in &draft.homes {
        writeln!(out, "\n[[robots]]\nhome = {}", list(home))?;
    }
    for object in &draft.objects {
        write_object(out, object)?;
    }
    for order in &draft.before {
        let (first, then) = (order.first, order.then);
        writeln!(
            out,
            "\n[[before]]\nfirst = \"{}.{}\"\nthen = \"{}.{}\"",
            first.0, first.1, then.0, then.1
        )?;
    }
    Ok(())
}

fn write_object(out: &mut String, object: &ObjectDraft) -> std::fmt::Result {
    writeln!(out, "\n[[objects]]")?;
    if let Some(kind) = &object.kind {
        writeln!(out, "kind = {}", toml::Value::from(kind.as_str()))?;
    }
    writeln!(out, "start = {}", list(&object.start))?;
    if let Some(goal) = &object.goal {
        writeln!(out, "goal = {}", list(goal))?;
    }
    writeln!(out, "shape = {}", shape(&object.shape))?;
    if object.other_grasps.is_empty() {
        writeln!(out, "grasp = {}", list(&object.grasp))?;
    } else {
        let grasps: Vec<_> = (std::iter::once(&object.grasp).chain(&object.other_grasps))
            .copied()
            .collect();
        writeln!(out, "grasps = {}", corners(&grasps))?;
    }
    writeln!(out, "pass_under = {}", object.pass_under)
}

/// The shortest decimal that reads back as the same number; never a negative zero.
fn number(x: f64) -> String {
    format!("{:?}", x + 0.0)
}

fn list(numbers: &[f64]) -> String {
    let numbers: Vec<_> = numbers.iter().map(|x| number(*x)).collect();
    format!("[{}]", numbers.join(", "))
}

fn corners(points: &[[f64; 2]]) -> String {
    let points: Vec<_> = points.iter().map(|p| list(p)).collect();
    format!("[{}]", points.join(", "))
}

fn shape(shape: &ShapeDraft) -> String {
    match shape {
        ShapeDraft::Box(full) => format!("{{ box = {} }}", list(full)),
        ShapeDraft::Circle(radius) => format!("{{ circle = {} }}", number(*radius)),
        ShapeDraft::Polygon(points) => format!("{{ polygon = {} }}", corners(points)),
    }
}
