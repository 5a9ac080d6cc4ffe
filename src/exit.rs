//! How the program ends: one status a kind of ending, and the message that goes with it.
//!
//! Responsible for: the exit statuses, printed in the help and in docs/; the one place where an
//! error becomes text on stderr.
//! Not responsible for: usage errors, which clap reports itself with status 2.

use std::process::ExitCode;

use crate::output;

/// The statuses a script can rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Exit {
    /// Solved, valid, clean: what was asked for is so.
    Success = 0,
    /// Something got worse (`bench compare`).
    Worse = 1,
    /// The command line is wrong.
    Usage = 2,
    /// The scenario or trace is unreadable, malformed or contradicts itself.
    BadInput = 3,
    /// The scenario is proved to have no solution.
    Infeasible = 4,
    /// The run got stuck or ran out of time.
    Unfinished = 5,
    /// An invariant is broken, during the run or in its trace.
    Invariant = 6,
    /// Shared memory, a process or a file failed.
    System = 7,
    /// Somebody stopped the run.
    Interrupted = 130,
}

/// Printed below the help of every command that runs something.
pub(crate) const STATUSES: &str = "\
Exit status:
  0    solved (check: no violation; validate: nothing wrong; explain: no proof against it)
  1    bench compare: something got worse beyond the noise
  2    the command line is wrong
  3    bad scenario, or a trace that cannot be read
  4    infeasible: proved, with the reason
  5    stuck, or out of time
  6    an invariant is broken (check: violations found)
  7    shared memory, a process or a file failed
  130  interrupted, with the partial result";

/// A command that could not do its work.
#[derive(Debug)]
pub(crate) struct Failure {
    /// Status to end with.
    pub(crate) exit: Exit,
    /// What to tell people.
    pub(crate) complaint: Complaint,
}

/// What to tell people when something has failed.
#[derive(Debug)]
pub(crate) enum Complaint {
    /// A sentence.
    Sentence(String),
    /// A report that points at places in a file.
    Report(miette::Report),
}

impl Failure {
    /// A failure that a sentence explains.
    pub(crate) fn new(exit: Exit, message: impl std::fmt::Display) -> Self {
        Self {
            exit,
            complaint: Complaint::Sentence(message.to_string()),
        }
    }

    /// Something the system refused.
    pub(crate) fn system(message: impl std::fmt::Display) -> Self {
        Self::new(Exit::System, message)
    }

    /// A file that is no good.
    pub(crate) fn bad_input(report: impl Into<miette::Report>) -> Self {
        Self {
            exit: Exit::BadInput,
            complaint: Complaint::Report(report.into()),
        }
    }

    /// Prints the complaint to stderr.
    pub(crate) fn print(&self) {
        match &self.complaint {
            Complaint::Sentence(text) => output::complain(&format!("error: {text}")),
            Complaint::Report(report) => output::complain(&format!("{report:?}")),
        }
    }
}

/// What every command returns.
pub(crate) type Outcome = Result<Exit, Failure>;

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}
