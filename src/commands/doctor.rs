//! `rearrange doctor`: what is wrong with this machine for runs, and how to mend it.
//!
//! Responsible for: a line for each thing, ok, a warning or bad, with the way out.
//! Not responsible for: looking (`node::doctor`).

use node::doctor::{Grade, examine};

use crate::cli::DoctorArgs;
use crate::exit::{Exit, Outcome};
use crate::output;

/// Prints what was found; status 7 if runs cannot work here.
pub(crate) fn main(args: &DoctorArgs) -> Outcome {
    let findings = examine();
    if args.json {
        output::print_json(&findings)?;
    } else {
        for finding in &findings {
            let grade = match finding.grade {
                Grade::Ok => "ok  ",
                Grade::Warn => "warn",
                Grade::Bad => "BAD ",
            };
            let mut line = format!("{grade}  {:16} {}", finding.what, finding.found);
            if let Some(mend) = &finding.mend {
                line += &format!("\n      {:16} mend: {mend}", "");
            }
            output::print(&(line + "\n"))?;
        }
    }
    let bad = findings.iter().any(|finding| finding.grade == Grade::Bad);
    Ok(if bad { Exit::System } else { Exit::Success })
}
