//! `rearrange bench compare A B`: what got better or worse between two results.
//!
//! Responsible for: reading both, printing, the status.
//! Not responsible for: the comparison (crate `bench`).

use bench::compare::{Change, Verdict, compare};
use bench::files;

use crate::cli::CompareArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::{output, table};

/// Compares; status 1 where something got worse beyond the noise.
pub(crate) fn main(args: &CompareArgs) -> Outcome {
    let read = |path| files::read(path).map_err(|error| Failure::new(Exit::BadInput, error));
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let changes = compare(&a, &b).map_err(|error| Failure::new(Exit::BadInput, error))?;
    let mut text = String::new();
    if a.machine != b.machine {
        text += "The results are of different machines: ratios of times say little.\n";
    }
    if a.partial || b.partial {
        text += "A result is partial: only what is in both is compared.\n";
    }
    text += &render(&changes, args.all);
    output::print(&text)?;
    let worse = changes
        .iter()
        .any(|change| change.verdict == Verdict::Worse);
    Ok(if worse { Exit::Worse } else { Exit::Success })
}

fn render(changes: &[Change], all: bool) -> String {
    let mut table = table::plain();
    table.set_header(["", "WHAT", "MEASURE", "A", "B", "B / A"]);
    for change in changes
        .iter()
        .filter(|change| all || change.verdict != Verdict::Same)
    {
        let word = match change.verdict {
            Verdict::Better => "better",
            Verdict::Same => "same",
            Verdict::Worse => "worse",
        };
        let ratio = change.ratio;
        table.add_row([
            word.to_owned(),
            change.what.join(" "),
            change.measure.clone(),
            bench::report::short(change.a),
            bench::report::short(change.b),
            format!("{:.3} [{:.3}, {:.3}]", ratio.value, ratio.low, ratio.high),
        ]);
    }
    let count = |verdict| {
        changes
            .iter()
            .filter(|change| change.verdict == verdict)
            .count()
    };
    let sum = format!(
        "{} better, {} the same, {} worse\n",
        count(Verdict::Better),
        count(Verdict::Same),
        count(Verdict::Worse)
    );
    if table.row_count() > 0 {
        table::finish(&table) + &sum
    } else {
        sum
    }
}
