//! Files of changes: what a run is told on its way, and when.
//!
//! Responsible for: reading them, and saying what is wrong with them.
//! Not responsible for: whether a change can be made (crate `world`).

use std::fs;
use std::path::{Path, PathBuf};

use node::{Told, ToldAt};
use scene::Change;
use serde::Deserialize;

/// Why a file of changes cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ChangesError {
    /// It cannot be read.
    #[error("{path} cannot be read: {source}")]
    Read {
        /// Which.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// It is none.
    #[error("{path} is no file of changes: {reason}")]
    Malformed {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

/// A whole file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    change: Vec<Entry>,
}

/// One `[[change]]`: when, and exactly one of the rest.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Entry {
    /// World time, s.
    #[serde(rename = "at_s")]
    at_s: f64,
    goal: Option<Goal>,
    r#move: Option<Move>,
    add_object: Option<Add>,
    close: Option<Close>,
    open: Option<Open>,
    lose: Option<Robot>,
    back: Option<Robot>,
    add_robot: Option<AddRobot>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Goal {
    object: usize,
    to: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Move {
    object: usize,
    to: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Add {
    at: [f64; 2],
    goal: Option<[f64; 2]>,
    #[serde(default)]
    like: usize,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Close {
    r#box: [f64; 4],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Open {
    at: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AddRobot {
    at: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Robot {
    robot: u32,
}

/// Reads a file of changes for ticks of `tick_ns`. Changes of the scene at one time are made
/// together.
///
/// # Errors
/// It cannot be read, or is none.
pub(crate) fn read(path: &Path, tick_ns: u64) -> Result<Vec<ToldAt>, ChangesError> {
    let text = fs::read_to_string(path).map_err(|source| ChangesError::Read {
        path: path.to_owned(),
        source,
    })?;
    parse(&text, tick_ns).map_err(|reason| ChangesError::Malformed {
        path: path.to_owned(),
        reason,
    })
}

fn parse(text: &str, tick_ns: u64) -> Result<Vec<ToldAt>, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string())?;
    let mut told: Vec<ToldAt> = Vec::new();
    for (number, entry) in file.change.into_iter().enumerate() {
        let at_s = entry.at_s;
        if !at_s.is_finite() || at_s < 0.0 {
            return Err(format!(
                "change {number}: at_s is {at_s}, but time begins at 0"
            ));
        }
        let tick = (at_s * 1e9 / tick_ns as f64).round() as u64;
        let what = entry
            .what()
            .map_err(|why| format!("change {number}: {why}"))?;
        let same = told.iter_mut().find(|other| other.tick == tick);
        match (same.map(|other| &mut other.what), what) {
            (Some(Told::Change(all)), Told::Change(more)) => all.extend(more),
            (_, what) => told.push(ToldAt { tick, what }),
        }
    }
    Ok(told)
}

/// How many robots are added.
pub(crate) fn more_robots(told: &[ToldAt]) -> u32 {
    let changes = told.iter().filter_map(|told| match &told.what {
        Told::Change(changes) => Some(changes),
        _ => None,
    });
    let added = changes
        .flatten()
        .filter(|change| matches!(change, Change::AddRobot { .. }));
    added.count() as u32
}

impl Entry {
    fn what(self) -> Result<Told, &'static str> {
        let change = |change| Told::Change(vec![change]);
        let all = [
            self.goal
                .map(|Goal { object, to }| change(Change::Goal { object, to })),
            self.r#move
                .map(|Move { object, to }| change(Change::Move { object, to })),
            self.add_object
                .map(|Add { at, goal, like }| change(Change::AddObject { at, goal, like })),
            self.close
                .map(|Close { r#box: corners }| change(Change::Close { corners })),
            self.open.map(|Open { at }| change(Change::Open { at })),
            self.add_robot
                .map(|AddRobot { at }| change(Change::AddRobot { at })),
            self.lose.map(|Robot { robot }| Told::Lose(robot)),
            self.back.map(|Robot { robot }| Told::Back(robot)),
        ];
        let mut given = all.into_iter().flatten();
        match (given.next(), given.next()) {
            (Some(what), None) => Ok(what),
            _ => Err(
                "give exactly one of goal, move, add-object, close, open, add-robot, lose and back",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_reads_as_ticks_and_what_they_bring() {
        let text = "
            [[change]]
            at_s = 2.0
            goal = { object = 1, to = [4.0, 1.0] }
            [[change]]
            at_s = 2.004
            add-object = { at = [1.0, 1.0], goal = [2.0, 2.0], like = 3 }
            [[change]]
            at_s = 2.0
            add-robot = { at = [3.0, 1.0] }
            [[change]]
            at_s = 3.5
            lose = { robot = 2 }
        ";
        let told = parse(text, 10_000_000).unwrap();
        let first = vec![
            Change::Goal {
                object: 1,
                to: Some([4.0, 1.0]),
            },
            Change::AddObject {
                at: [1.0, 1.0],
                goal: Some([2.0, 2.0]),
                like: 3,
            },
            Change::AddRobot { at: [3.0, 1.0] },
        ];
        let expected = [
            ToldAt {
                tick: 200,
                what: Told::Change(first),
            },
            ToldAt {
                tick: 350,
                what: Told::Lose(2),
            },
        ];
        assert_eq!(told, expected);
        assert_eq!(more_robots(&told), 1);
    }

    #[test]
    fn what_is_no_change_is_refused_with_the_reason() {
        let cases = [
            ("[[change]]\nat_s = 1.0\n", "change 0: give exactly one of"),
            (
                "[[change]]\nat_s = 1.0\nlose = { robot = 0 }\nback = { robot = 0 }\n",
                "give exactly one of",
            ),
            (
                "[[change]]\nat_s = -1.0\nlose = { robot = 0 }\n",
                "time begins at 0",
            ),
            (
                "[[change]]\nat_s = 1.0\nexplode = 1\n",
                "unknown field `explode`",
            ),
        ];
        for (text, words) in cases {
            let error = parse(text, 10_000_000).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }
}
