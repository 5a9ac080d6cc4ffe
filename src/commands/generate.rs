//! `rearrange generate`: a random room that is certain to have a solution.
//!
//! Responsible for: where the room is written to.
//! Not responsible for: making it (crate `scene`).

use scene::{GenerateError, GenerateOptions};

use crate::cli::{GenerateArgs, Layout};
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Writes the room to stdout or a file.
pub(crate) fn main(args: &GenerateArgs) -> Outcome {
    let (text, moves) = match args.layout {
        Layout::Rooms => rooms(args)?,
        Layout::Warehouse => warehouse(args)?,
    };
    match &args.output {
        None => output::print(&text)?,
        Some(path) => {
            std::fs::write(path, &text).map_err(|error| {
                Failure::system(format!("{} cannot be written: {error}", path.display()))
            })?;
            let path = path.display();
            output::complain(&format!("wrote {path}: solvable in {moves} moves"));
        }
    }
    Ok(Exit::Success)
}

/// The file, and how many moves solve it.
fn rooms(args: &GenerateArgs) -> Result<(String, usize), Failure> {
    let or_default = GenerateOptions::default();
    let count = |given: Option<u32>, default: usize| given.map_or(default, |n| n as usize);
    let generated = scene::generate(&GenerateOptions {
        seed: args.seed,
        objects: args.objects as usize,
        robots: args.robots as usize,
        area_m2: args.area.unwrap_or(or_default.area_m2),
        walls: count(args.walls, or_default.walls),
        crowding: args.crowding.unwrap_or(or_default.crowding),
        extra_moves: count(args.extra_moves, or_default.extra_moves),
    })
    .map_err(failure)?;
    Ok((generated.text, generated.certificate.len()))
}

fn warehouse(args: &GenerateArgs) -> Result<(String, usize), Failure> {
    let given = [
        ("--area", args.area.is_some()),
        ("--walls", args.walls.is_some()),
        ("--crowding", args.crowding.is_some()),
        ("--extra-moves", args.extra_moves.is_some()),
    ];
    if let Some((option, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
        let message = format!("{option} is for --layout rooms; a warehouse is laid out by itself");
        return Err(Failure::new(Exit::Usage, message));
    }
    let (objects, robots) = (args.objects as usize, args.robots as usize);
    let text = scene::warehouse(objects, robots, args.seed).map_err(failure)?;
    Ok((text, objects))
}

fn failure(error: GenerateError) -> Failure {
    let exit = match error {
        GenerateError::Option { .. } => Exit::Usage,
        GenerateError::GaveUp { .. } => Exit::Unfinished,
    };
    Failure::new(exit, error)
}
