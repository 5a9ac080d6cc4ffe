//! Finding a scenario: a file of the user's, or one inside the binary.
//!
//! Responsible for: which of the two a name means; reading it; cutting it to the robots asked for.
//! Not responsible for: what a scenario may say (crate `scene`).

use std::borrow::Cow;
use std::path::Path;

use scene::{BUILTIN, Builtin, Scene, warehouses};

use crate::exit::{Exit, Failure};

/// The scenario that is run if none is named.
pub(crate) const DEFAULT: &str = "paper-68a";

/// A scenario, and what its file says of where it came from.
#[derive(Debug)]
pub(crate) struct Loaded {
    pub(crate) scene: Scene,
    /// Seed it was generated from, if it was.
    pub(crate) seed: Option<u64>,
}

/// Every built-in scenario, the files first.
pub(crate) fn shipped() -> impl Iterator<Item = Builtin> {
    BUILTIN.iter().copied().chain(warehouses())
}

/// Reads the scenario called `name`, with its first `robots` robots if that is given.
///
/// A built-in scenario goes by its name, unless that looks like a path: `./paper-68a` and
/// `paper-68a.toml` are files.
///
/// # Errors
/// There is none, it is no good, or it has fewer homes than robots asked for.
pub(crate) fn load(name: &str, robots: Option<u32>) -> Result<Loaded, Failure> {
    let (text, source) = match scene::builtin(name) {
        Some(builtin) => (Cow::Borrowed(builtin.text), format!("built-in {name}")),
        None => (Cow::Owned(read(name)?), name.to_owned()),
    };
    let whole = scene::parse(&text, &source).map_err(Failure::bad_input)?;
    Ok(Loaded {
        scene: match robots {
            None => whole,
            Some(robots) => cut(&whole, robots)?,
        },
        seed: seed(&text),
    })
}

/// The seed in the opening comment of a generated file.
fn seed(text: &str) -> Option<u64> {
    let comment = text.lines().map_while(|line| line.strip_prefix('#'));
    let mut words = comment.flat_map(str::split_whitespace);
    words.find(|word| *word == "--seed")?;
    words.next()?.parse().ok()
}

fn read(name: &str) -> Result<String, Failure> {
    std::fs::read_to_string(name).map_err(|error| {
        let known = if !looks_like_path(name) {
            let names: Vec<_> = shipped().map(|builtin| builtin.name).collect();
            format!("; built-in scenarios are {}", names.join(", "))
        } else {
            String::new()
        };
        Failure::new(
            Exit::BadInput,
            format!("the scenario {name} cannot be read: {error}{known}"),
        )
    })
}

fn looks_like_path(name: &str) -> bool {
    name.contains('/') || Path::new(name).extension().is_some()
}

fn cut(scene: &Scene, robots: u32) -> Result<Scene, Failure> {
    let homes = scene.homes.len();
    if robots as usize > homes {
        return Err(Failure::new(
            Exit::Usage,
            format!(
                "--robots {robots} is more than {} has homes for: allowed are 1 to {homes}",
                scene.name
            ),
        ));
    }
    scene
        .with_robots(robots as usize)
        .map_err(|problems| Failure::new(Exit::BadInput, problems))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_inside_the_binary() {
        assert!(load(DEFAULT, None).is_ok());
    }

    #[test]
    fn a_generated_file_tells_its_seed() {
        assert_eq!(
            seed("# rearrange generate --seed 7 --objects 5\nname = 1"),
            Some(7)
        );
        assert_eq!(seed("name = \"--seed 7\""), None);
    }

    #[test]
    fn robots_beyond_the_homes_are_a_usage_error() {
        let failure = load(DEFAULT, Some(128)).unwrap_err();
        assert_eq!(failure.exit, Exit::Usage);
    }
}
