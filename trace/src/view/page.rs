//! The page that plays a run.
//!
//! Responsible for: what the page knows of the run, as compact JSON; putting page, style, script
//! and data into one file that loads nothing from elsewhere.
//! Not responsible for: reading the trace (`story`), how it looks and plays (`page.html`,
//! `page.css`, `page.js`).
//!
//! The page has the pieces of motion as the trace has them, so what it shows between two records
//! is exact. Lengths are rounded to 1 nm, as the trace itself joins pieces to within that.

use serde::Serialize;
use serde_json::{Value, json};

use crate::record::{ConstraintKind, Event, Happening, Motion, Outline, Place, SceneRecord};
use crate::view::easy;
use crate::view::story::{RobotDoing, Story, TaskDoing, Timeline};
use crate::view::waits::{self, Blocker};

const HTML: &str = include_str!("page.html");
const CSS: &str = include_str!("page.css");
const JS: &str = include_str!("page.js");

/// One task has to be completed before another may be selected (rule 13).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Constraint {
    pub(crate) before: usize,
    pub(crate) after: usize,
    /// The paper's name of the test that found it, or `user`.
    pub(crate) kind: &'static str,
    pub(crate) since_ns: u64,
}

/// The page, opened at `at_s` seconds of world time.
#[must_use]
pub fn page(story: &Story, at_s: f64) -> String {
    let data = data(story, at_s).to_string();
    // What ends a script, or begins a comment in one, cannot stand in it as it is.
    let data = data.replace('<', "\\u003c");
    let title = format!("{} · rearrange", story.scene.name);
    fill(
        HTML,
        &[
            ("{{title}}", &escaped(&title)),
            ("{{css}}", CSS),
            ("{{data}}", &data),
            ("{{js}}", JS),
        ],
    )
}

/// Replaces the marks of a template, in the order in which they stand there. What is put in is not
/// looked at again.
fn fill(template: &str, parts: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = template;
    for (mark, text) in parts {
        if let Some((before, behind)) = rest.split_once(mark) {
            page.push_str(before);
            page.push_str(text);
            rest = behind;
        }
    }
    page.push_str(rest);
    page
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// Everything the page knows. Times are ns, lengths m.
fn data(story: &Story, at_s: f64) -> Value {
    let scene = &story.scene;
    let waits = waits::waits(story);
    let robots = story.robots.iter().zip(&waits).map(|(robot, waits)| {
        json!({
            "since": robot.since_ns,
            "waits": timeline(waits, |blocker| json!(blocker.map(|blocker| match blocker {
                Blocker::Robot(id) => ("robot", id),
                Blocker::Object(id) => ("object", id),
            }))),
            "track": track(&robot.track),
            "doing": timeline(&robot.doing, robot_doing),
            "grants": timeline(&robot.grants, |corners| json!(points(corners))),
        })
    });
    let objects = story.objects.iter().map(|object| {
        json!({
            "since": object.since_ns,
            "track": track(&object.track),
            "doing": timeline(&object.doing, |doing| task_doing(*doing)),
        })
    });
    json!({
        "at_s": at_s,
        "name": scene.name,
        "version": scene.program_version,
        "hash": scene.scenario_hash,
        "method": method(scene),
        "low": point(scene.low),
        "high": point(scene.high),
        "versions": timeline(&story.versions, version),
        "robot": shape(&scene.robot.shape),
        "homes": points(&scene.homes),
        "things": scene.objects.iter().zip(&story.objects)
            .map(|(object, story)| json!({
                "shape": shape(&object.shape),
                "start": point(story.start),
            }))
            .collect::<Vec<_>>(),
        "robots": robots.collect::<Vec<_>>(),
        "objects": objects.collect::<Vec<_>>(),
        "constraints": constraints(story).into_iter()
            .map(|found| json!([found.before, found.after, found.kind, found.since_ns]))
            .collect::<Vec<_>>(),
        "events": story.events.iter().filter_map(event).collect::<Vec<_>>(),
        "gaps": story.gaps,
        "until": story.until_ns,
        "end": story.end.as_ref().map(|end| json!({
            "outcome": end.outcome, "reason": end.reason, "complete": end.complete,
        })),
    })
}

/// What may change in a scene.
fn version(scene: &SceneRecord) -> Value {
    let walls = scene.walls.iter();
    let walls = walls.map(|wall| json!({ "shape": shape(&wall.shape), "at": point(wall.at) }));
    json!({
        "walls": walls.collect::<Vec<_>>(),
        "goals": scene.objects.iter().map(|object| object.goal.map(point)).collect::<Vec<_>>(),
    })
}

/// What the scenario asks for, what overlaps tell at the start if the method asks that at all,
/// and what path searches found on the way.
pub(crate) fn constraints(story: &Story) -> Vec<Constraint> {
    let scene = &story.scene;
    let user = scene.before.iter().map(|order| Constraint {
        before: order.first.task,
        after: order.then.task,
        kind: "user",
        since_ns: 0,
    });
    let hard = story.events.iter().filter_map(|event| match event.what {
        Happening::Constraint {
            before,
            after,
            test,
        } => Some(Constraint {
            before,
            after,
            kind: match test {
                ConstraintKind::H1 => "H1",
                ConstraintKind::H2 => "H2",
            },
            since_ns: event.time_ns,
        }),
        _ => None,
    });
    let mut all: Vec<Constraint> = user.collect();
    if matches!(method(scene), "grasping-and-restricted" | "all") {
        all.extend(easy::constraints(scene));
    }
    all.extend(hard);
    all
}

fn method(scene: &SceneRecord) -> &str {
    scene
        .settings
        .get("method")
        .and_then(Value::as_str)
        .unwrap_or_default()
}

/// `[start, end, from x, from y, to x, to y]` for each piece, flat.
fn track(track: &[Motion]) -> Vec<Value> {
    track
        .iter()
        .flat_map(|piece| {
            let [x0, y0] = point(piece.from);
            let [x1, y1] = point(piece.to);
            [
                json!(piece.start_ns),
                json!(piece.end_ns),
                json!(x0),
                json!(y0),
                json!(x1),
                json!(y1),
            ]
        })
        .collect()
}

fn timeline<T>(timeline: &Timeline<T>, value: impl Fn(&T) -> Value) -> Vec<Value> {
    timeline
        .iter()
        .map(|(time_ns, entry)| json!([time_ns, value(entry)]))
        .collect()
}

fn robot_doing(doing: &RobotDoing) -> Value {
    json!([doing.phase, doing.activity, doing.task, doing.holding])
}

fn task_doing(doing: TaskDoing) -> Value {
    json!([doing.status, doing.robot])
}

/// The event in the trace's own words; epochs and starts of grips are left out, a log is read by
/// people.
fn event(event: &Event) -> Option<Value> {
    #[derive(Serialize)]
    struct Line<'a> {
        t: u64,
        #[serde(flatten)]
        what: &'a Happening,
    }
    match event.what {
        Happening::Epoch { .. }
        | Happening::GraspStarted { .. }
        | Happening::ReleaseStarted { .. } => None,
        _ => serde_json::to_value(Line {
            t: event.time_ns,
            what: &event.what,
        })
        .ok(),
    }
}

/// `{"r": radius}` or `{"p": [x, y, …]}`.
fn shape(outline: &Outline) -> Value {
    match outline {
        Outline::Circle { radius } => json!({ "r": rounded(*radius) }),
        Outline::Box { half } => {
            let [x, y] = point(*half);
            json!({ "p": [[-x, -y], [x, -y], [x, y], [-x, y]] })
        }
        Outline::Polygon { points: corners } => json!({ "p": points(corners) }),
    }
}

fn points(places: &[Place]) -> Vec<[f64; 2]> {
    places.iter().map(|&place| point(place)).collect()
}

fn point(place: Place) -> [f64; 2] {
    [rounded(place.x), rounded(place.y)]
}

/// To the nanometre.
fn rounded(length_m: f64) -> f64 {
    (length_m * 1e9).round() / 1e9
}
