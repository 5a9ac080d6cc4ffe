//! `rearrange tell`: a live run is told of something that has changed.
//!
//! Responsible for: what is told, and saying what came of it.
//! Not responsible for: whether it can be so (crate `world`), how it gets there (crate `node`).

use node::{Answered, TellError, Told};
use scene::Change;

use crate::cli::{TellArgs, What};
use crate::exit::{Exit, Failure, Outcome};
use crate::output;

/// Tells the run, and prints the tick from which on it holds.
pub(crate) fn main(args: &TellArgs) -> Outcome {
    let told = told(&args.what).map_err(|why| Failure::new(Exit::Usage, why))?;
    let answered = node::tell(&args.run, &told).map_err(|error| {
        let exit = match error {
            TellError::Refused(_) | TellError::Run(_) | TellError::TooMany(_) => Exit::BadInput,
            _ => Exit::System,
        };
        Failure::new(exit, error)
    })?;
    let Answered {
        run, tick, time_ns, ..
    } = &answered;
    let seconds = *time_ns as f64 * 1e-9;
    output::print(&format!(
        "run {run}: {}, from tick {tick} on ({seconds:.2} s)\n",
        words(&args.what)
    ))?;
    Ok(Exit::Success)
}

/// What the run is told.
fn told(what: &What) -> Result<Told, String> {
    let place = |at: &[f64]| [at[0], at[1]];
    let change = |change| Ok(Told::Change(vec![change]));
    match what {
        What::Goal { goals } => goals_of(goals).map(Told::Change),
        What::Move { object, to } => change(Change::Move {
            object: *object,
            to: place(to),
        }),
        What::AddObject { at, goal, like } => change(Change::AddObject {
            at: place(at),
            goal: goal.as_deref().map(place),
            like: *like,
        }),
        What::Close { corners } => change(Change::Close {
            corners: [corners[0], corners[1], corners[2], corners[3]],
        }),
        What::Open { at } => change(Change::Open { at: place(at) }),
        What::AddRobot { at } => change(Change::AddRobot { at: place(at) }),
        What::Lose { robot } => Ok(Told::Lose(*robot)),
        What::Back { robot } | What::Release { robot } => Ok(Told::Back(*robot)),
    }
}

/// `OBJECT X Y` again and again, or `OBJECT none`.
fn goals_of(words: &[String]) -> Result<Vec<Change>, String> {
    let mut goals = Vec::new();
    let mut words = words.iter();
    while let Some(object) = words.next() {
        let object = object
            .parse()
            .map_err(|_| format!("{object:?} is no number of an object"))?;
        let mut number = |what: &str| {
            let word = words.next();
            let word =
                word.ok_or_else(|| format!("object {object} lacks the {what} of its goal"))?;
            if word == NONE && what == "x" {
                return Ok(None);
            }
            let number: Option<f64> = word.parse().ok().filter(|x: &f64| x.is_finite());
            let number = number.ok_or_else(|| format!("{word:?} is no {what} in metres"))?;
            Ok::<_, String>(Some(number))
        };
        let to = match number("x")? {
            None => None,
            Some(x) => number("y")?.map(|y| [x, y]),
        };
        goals.push(Change::Goal { object, to });
    }
    Ok(goals)
}

/// What stands for no goal.
const NONE: &str = "none";

/// What has been told, for people.
fn words(what: &What) -> String {
    match what {
        What::Goal { .. } => "the goal is changed".to_owned(),
        What::Move { object, .. } => format!("object {object} has been moved"),
        What::AddObject { .. } => "there is one more object".to_owned(),
        What::Close { .. } => "there is a wall".to_owned(),
        What::Open { .. } => "the wall is gone".to_owned(),
        What::AddRobot { .. } => "there is one more robot".to_owned(),
        What::Lose { robot } => format!("robot {robot} takes part no more"),
        What::Release { robot } => format!("robot {robot} may move again"),
        What::Back { robot } => format!("robot {robot} takes part again"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn goals(words: &str) -> Result<Vec<Change>, String> {
        let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
        goals_of(&words)
    }

    #[test]
    fn goals_read_as_objects_with_places() {
        let expected = vec![
            Change::Goal {
                object: 2,
                to: Some([4.5, -1.0]),
            },
            Change::Goal {
                object: 0,
                to: None,
            },
        ];
        assert_eq!(goals("2 4.5 -1 0 none"), Ok(expected));
        for (bad, why) in [
            ("2 4.5", "lacks the y"),
            ("2", "lacks the x"),
            ("x 1 2", "no number of an object"),
            ("1 2 none", "is no y"),
            ("1 NaN 2", "is no x"),
        ] {
            assert!(goals(bad).unwrap_err().contains(why), "{bad}");
        }
    }
}
