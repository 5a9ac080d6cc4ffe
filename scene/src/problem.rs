//! What is wrong with a scenario, and where.
//!
//! Responsible for: naming the place (a key of the scenario) and the reason of each problem.
//! Not responsible for: finding them (`validate`), or their line in a file (`scenario`).

use std::fmt;

/// A place in a scenario, displayed as the key in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A key outside of any table.
    Top(&'static str),
    /// A key of `[robot]`.
    Robot(&'static str),
    /// A key of `[workspace]`.
    Workspace(&'static str),
    /// A wall.
    Wall(usize),
    /// The home of a robot.
    Home(usize),
    /// A key of an object.
    Object(usize, &'static str),
    /// A key of one of the user's orders.
    Before(usize, &'static str),
    /// One move of the certificate.
    Certificate(usize),
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Top(key) => write!(f, "{key}"),
            Self::Robot(key) => write!(f, "robot.{key}"),
            Self::Workspace(key) => write!(f, "workspace.{key}"),
            Self::Wall(i) => write!(f, "workspace.walls[{i}]"),
            Self::Home(i) => write!(f, "robots[{i}].home"),
            Self::Object(i, key) => write!(f, "objects[{i}].{key}"),
            Self::Before(i, key) => write!(f, "before[{i}].{key}"),
            Self::Certificate(i) => write!(f, "certificate[{i}]"),
        }
    }
}

/// One thing that is wrong with a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Where.
    pub key: Key,
    /// What, in words.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The other places it has to do with.
    pub also: Vec<Key>,
}

impl Problem {
    /// A problem at one place.
    pub(crate) fn new(key: Key, message: impl Into<String>) -> Self {
        Self {
            key,
            message: message.into(),
            help: None,
            also: Vec::new(),
        }
    }

    /// Adds what to do about it.
    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds another place it has to do with.
    pub(crate) fn also(mut self, key: Key) -> Self {
        self.also.push(key);
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.key, self.message)
    }
}

/// All that is wrong with a scenario; at least one thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Problems(pub Vec<Problem>);

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.0.iter().enumerate() {
            if i > 0 {
                f.write_str("; ")?;
            }
            write!(f, "{problem}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}
