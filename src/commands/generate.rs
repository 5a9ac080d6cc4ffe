//! `rearrange generate`: a random room that is certain to have a solution.
//!
//! Responsible for: where the room is written to.
//! Not responsible for: making it (crate `scene`).

use scene::{GenerateError, GenerateOptions};

use crate::cli::GenerateArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Writes the room to stdout or a file.
pub(crate) fn main(args: &GenerateArgs) -> Outcome {
    let options = GenerateOptions {
        seed: args.seed,
        objects: args.objects as usize,
        robots: args.robots as usize,
        area_m2: args.area,
        walls: args.walls as usize,
        crowding: args.crowding,
        extra_moves: args.extra_moves as usize,
    };
    let generated = scene::generate(&options).map_err(|error| {
        let exit = match error {
            GenerateError::Option { .. } => Exit::Usage,
            GenerateError::GaveUp { .. } => Exit::Unfinished,
        };
        Failure::new(exit, error)
    })?;
    match &args.output {
        None => output::print(&generated.text)?,
        Some(path) => {
            std::fs::write(path, &generated.text).map_err(|error| {
                Failure::system(format!("{} cannot be written: {error}", path.display()))
            })?;
            output::complain(&format!(
                "wrote {}: solvable in {} moves",
                path.display(),
                generated.certificate.len()
            ));
        }
    }
    Ok(Exit::Success)
}
