//! Reading a scenario file, and saying what is wrong with it: file, line, key, reason.
//!
//! Responsible for: turning text into a [`Scene`], and problems into diagnostics that point at
//! the text.
//! Not responsible for: opening files, or printing.

use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceSpan};

use crate::draft::Draft;
use crate::file::{Range, ScenarioFile};
use crate::problem::{Problem, Problems};
use crate::scene::Scene;

/// One problem with its place in the text.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{file}:{line}: {what}")]
pub struct Located {
    /// Name of the source the text came from.
    pub file: String,
    /// Line of the text, from 1.
    pub line: usize,
    /// The key and what is wrong with it.
    pub what: String,
    #[source_code]
    text: NamedSource<Arc<str>>,
    #[label(collection)]
    labels: Vec<LabeledSpan>,
    #[help]
    help: Option<String>,
}

/// A text that is no usable scenario, with everything that was found wrong with it.
///
/// A text that is not even TOML of the right structure has one problem: what follows the first
/// such mistake cannot be judged.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{file} is not a usable scenario ({})", count(.problems.len()))]
pub struct ScenarioError {
    /// Name of the source the text came from.
    pub file: String,
    /// What is wrong, in the order found.
    #[related]
    pub problems: Vec<Located>,
}

fn count(problems: usize) -> String {
    match problems {
        1 => "1 problem".to_owned(),
        n => format!("{n} problems"),
    }
}

impl ScenarioError {
    /// One line for each problem: file, line, key, reason.
    #[must_use]
    pub fn plain(&self) -> String {
        let lines: Vec<_> = self.problems.iter().map(ToString::to_string).collect();
        lines.join("\n")
    }
}

/// Reads a scenario. `source_name` is what messages call the text, usually a file name.
///
/// # Errors
/// Everything that is wrong with it, each with its line.
pub fn parse(text: &str, source_name: &str) -> Result<Scene, ScenarioError> {
    parse_with(text, source_name, Scene::new)
}

/// Reads a version of a scenario that a change during a run has led to: its starts are history,
/// and not checked.
///
/// # Errors
/// As those of [`parse`].
pub fn parse_version(text: &str, source_name: &str) -> Result<Scene, ScenarioError> {
    parse_with(text, source_name, Scene::version)
}

fn parse_with(
    text: &str,
    source_name: &str,
    make: fn(Draft) -> Result<Scene, Problems>,
) -> Result<Scene, ScenarioError> {
    let report = Report {
        file: source_name,
        text: Arc::from(text),
    };
    let file: ScenarioFile = toml::from_str(text).map_err(|error| report.malformed(&error))?;
    file.draft()
        .and_then(|draft| make(draft).map_err(|problems| problems.0))
        .map_err(|problems| report.problems(&file, &problems))
}

struct Report<'a> {
    file: &'a str,
    text: Arc<str>,
}

impl Report<'_> {
    fn malformed(&self, error: &toml::de::Error) -> ScenarioError {
        let span = error.span().unwrap_or(0..0);
        let labels = vec![label("here", &span)];
        let what = in_plain_words(error);
        self.error(vec![self.located(&span, what, labels, None)])
    }

    fn problems(&self, file: &ScenarioFile, problems: &[Problem]) -> ScenarioError {
        let mut located = Vec::new();
        let mut said: Vec<(Range, &str)> = Vec::new();
        for problem in problems {
            let place = file.place(problem.key);
            let span = place.clone().unwrap_or(0..0);
            // What all objects have from [object] is wrong once, not once for each.
            if place.is_some() && said.contains(&(span.clone(), &problem.message)) {
                continue;
            }
            said.push((span.clone(), &problem.message));
            let mut labels = Vec::new();
            if place.is_some() {
                labels.push(label(&problem.key.to_string(), &span));
            }
            for also in &problem.also {
                if let Some(span) = file.place(*also) {
                    labels.push(label(&also.to_string(), &span));
                }
            }
            let what = problem.to_string();
            located.push(self.located(&span, what, labels, problem.help.clone()));
        }
        self.error(located)
    }

    fn located(
        &self,
        span: &Range,
        what: String,
        labels: Vec<LabeledSpan>,
        help: Option<String>,
    ) -> Located {
        let before = &self.text.as_bytes()[..span.start.min(self.text.len())];
        Located {
            file: self.file.to_owned(),
            line: before.iter().filter(|byte| **byte == b'\n').count() + 1,
            what,
            text: NamedSource::new(self.file, Arc::clone(&self.text)),
            labels,
            help,
        }
    }

    fn error(&self, problems: Vec<Located>) -> ScenarioError {
        ScenarioError {
            file: self.file.to_owned(),
            problems,
        }
    }
}

/// The message of the TOML reader, with the key it is about.
fn in_plain_words(error: &toml::de::Error) -> String {
    let message = error
        .message()
        .replace("unknown field", "unknown key")
        .replace("missing field", "missing key")
        .replace("duplicate field", "duplicate key")
        .replace("unknown variant", "unknown kind")
        .replace("invalid type: floating point", "invalid type: number");
    // Without the text at hand the reader's own display names the key, as "in `robot.speed`".
    let mut bare = error.clone();
    bare.set_input(None);
    let display = bare.to_string();
    let key = display
        .lines()
        .last()
        .and_then(|line| line.strip_prefix("in `")?.strip_suffix('`'));
    match key {
        Some(key) => format!("{key}: {message}"),
        None => message,
    }
}

fn label(text: &str, span: &Range) -> LabeledSpan {
    let span = SourceSpan::from((span.start, span.len()));
    LabeledSpan::new_with_span(Some(text.to_owned()), span)
}
