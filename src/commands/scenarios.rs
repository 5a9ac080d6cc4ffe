//! `rearrange scenarios`: the rooms inside the binary.
//!
//! Responsible for: listing them, printing one, writing all of them out.

use std::fs;
use std::path::Path;

use scene::Builtin;

use crate::cli::ScenariosArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::scenario::shipped;
use crate::{output, table};

/// Lists, prints or writes the built-in scenarios.
pub(crate) fn main(args: &ScenariosArgs) -> Outcome {
    match (&args.name, &args.write) {
        (Some(name), _) => output::print(find(name)?.text)?,
        (None, Some(directory)) => write_all(directory)?,
        (None, None) => output::print(&overview())?,
    }
    Ok(Exit::Success)
}

fn find(name: &str) -> Result<Builtin, Failure> {
    scene::builtin(name).ok_or_else(|| {
        let names: Vec<_> = shipped().map(|builtin| builtin.name).collect();
        Failure::new(
            Exit::Usage,
            format!(
                "no built-in scenario is called {name}; there are {}",
                names.join(", ")
            ),
        )
    })
}

fn overview() -> String {
    let mut table = table::plain();
    for builtin in shipped() {
        table.add_row([builtin.name, &first_sentence(&builtin.about())]);
    }
    table::finish(&table)
}

fn first_sentence(text: &str) -> String {
    match text.find(". ") {
        Some(end) => text[..end].to_owned(),
        None => text.trim_end_matches('.').to_owned(),
    }
}

fn write_all(directory: &Path) -> Result<(), Failure> {
    let failed = |path: &Path, error| {
        Failure::system(format!("{} cannot be written: {error}", path.display()))
    };
    fs::create_dir_all(directory).map_err(|error| failed(directory, error))?;
    for builtin in shipped() {
        let path = directory.join(format!("{}.toml", builtin.name));
        fs::write(&path, builtin.text).map_err(|error| failed(&path, error))?;
        output::complain(&format!("wrote {}", path.display()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_the_first_sentence() {
        assert_eq!(first_sentence("Two rooms. And more."), "Two rooms");
        assert_eq!(first_sentence("Two rooms."), "Two rooms");
        assert_eq!(first_sentence("pitch 0.05 m"), "pitch 0.05 m");
    }
}
