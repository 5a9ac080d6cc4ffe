//! Writing to people and to pipes.
//!
//! Responsible for: stdout that may be a closed pipe (`rearrange list | head -1`), stderr, and
//! whether either wants colours.
//! Not responsible for: what is written.

use std::io::{self, IsTerminal, Write};

use miette::MietteHandlerOpts;

use crate::exit::Failure;

/// Writes `text` to stdout. A reader that has gone away is no error: it has seen enough.
///
/// # Errors
/// Stdout cannot be written for another reason (a full disk).
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::system(format!(
            "the output cannot be written: {error}"
        ))),
        _ => Ok(()),
    }
}

/// Writes `value` to stdout as indented JSON.
///
/// # Errors
/// As [`print()`].
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| {
        Failure::system(format!("the output cannot be written as JSON: {error}"))
    })?;
    print(&(text + "\n"))
}

/// Writes one message to stderr. If even that fails there is nobody left to tell.
pub(crate) fn complain(message: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", message.trim_end());
}

/// Leaves lines of reports whole where no terminal bounds them, so that a script finds file, line
/// and reason in one. Comes before the first report.
pub(crate) fn unfold_reports() {
    if io::stderr().is_terminal() {
        return;
    }
    // Fails only if it was done already.
    let _ = miette::set_hook(Box::new(|_| {
        Box::new(MietteHandlerOpts::new().wrap_lines(false).build())
    }));
}

/// Whether people are watching stderr, so that a progress display is of use.
pub(crate) fn is_watched() -> bool {
    io::stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Whether colours are wanted on stdout: on a terminal, unless `NO_COLOR` says otherwise.
pub(crate) fn wants_colour() -> bool {
    io::stdout().is_terminal() && !no_colour()
}

/// Whether `NO_COLOR` is set to anything but nothing (<https://no-color.org>).
pub(crate) fn no_colour() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

/// A number with its noun: "1 robot", "2 robots".
pub(crate) fn count(number: u64, noun: &str) -> String {
    match number {
        1 => format!("1 {noun}"),
        number => format!("{number} {noun}s"),
    }
}
