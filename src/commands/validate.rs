//! `rearrange validate`: is a scenario file right, and can it be solved as far as is easy to see?
//!
//! Responsible for: a short summary of what the file was understood to say.
//! Not responsible for: solving it.

use std::fmt::Write as _;

use planner::{EasyConstraints, Kind, Places, Proof};
use scene::{Budget, Connectivity, ObjectSpec, Scene};
use shm_types::Counters;

use crate::cli::ValidateArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::{output, scenario};

/// Says ok with a summary, what is wrong (status 3), or why it cannot be solved (status 4).
pub(crate) fn main(args: &ValidateArgs) -> Outcome {
    let scene = scenario::load(&args.scenario, args.robots)?.scene;
    if let (Some(proof), _) = Proof::search(&scene) {
        return Err(Failure::new(
            Exit::Infeasible,
            format!("{} cannot be solved: {proof}", scene.name),
        ));
    }
    output::print(&summary(&scene))?;
    Ok(Exit::Success)
}

fn summary(scene: &Scene) -> String {
    let mut text = String::new();
    let with_goal = scene.objects.iter().filter(|object| object.goal.is_some());
    let (lower, upper) = scene.bounds;
    let lattice = &scene.lattice;
    let steps = match lattice.connectivity {
        Connectivity::Four => "4-connected",
        Connectivity::Eight => "8-connected without corner cutting",
    };
    let exact = if lattice.exact {
        "exact: every length of the room is a multiple of the pitch"
    } else {
        "not exact: places off it are connected by straight pieces"
    };
    let _ = writeln!(text, "{}: ok", scene.name);
    let _ = writeln!(
        text,
        "  {}, {} ({} with a goal), room of {:.2} m by {:.2} m",
        output::count(scene.homes.len() as u64, "robot"),
        output::count(scene.objects.len() as u64, "object"),
        with_goal.count(),
        upper.x - lower.x,
        upper.y - lower.y
    );
    let _ = writeln!(
        text,
        "  lattice: pitch {} m, {} by {} points, {steps}; {exact}",
        lattice.pitch_m, lattice.width, lattice.height
    );
    let _ = writeln!(text, "  easy constraints at the start: {}", easy(scene));
    let _ = writeln!(text, "  no proof that it cannot be solved");
    text
}

/// Constraints named one by one; more are counted by kind.
const MOST_NAMED: usize = 12;

/// The easy constraints at the start, in words (rule 9).
fn easy(scene: &Scene) -> String {
    let mut found = Vec::new();
    let mut easy = EasyConstraints::new(scene);
    easy.begin(scene.objects.iter().map(open_places));
    let mut counters = Counters::default();
    while easy
        .advance(scene, &mut Budget::new(u64::MAX), &mut counters)
        .is_pending()
    {}
    easy.for_each(|kind, before, after| found.push((kind, before, after)));
    let words: Vec<_> = if found.len() <= MOST_NAMED {
        let named = found.iter();
        named
            .map(|(kind, before, after)| format!("{kind:?} {before} before {after}"))
            .collect()
    } else {
        Kind::EASY
            .iter()
            .map(|kind| {
                (
                    kind,
                    found.iter().filter(|(other, ..)| other == kind).count(),
                )
            })
            .map(|(kind, count)| format!("{count} of {kind:?}"))
            .collect()
    };
    if words.is_empty() {
        "none".to_owned()
    } else {
        words.join(", ")
    }
}

fn open_places(object: &ObjectSpec) -> Option<Places> {
    let goal = object.goal?;
    let initial = object.start;
    ((goal - initial).norm() > scene::CONTACT_M).then_some(Places { initial, goal })
}
