//! `rearrange explain`: what has to come before what in a scenario, and why.
//!
//! Responsible for: gathering what is known of a scenario as it begins; the words and the JSON.
//! Not responsible for: finding any of it (crate `planner`), why robots stood still in a run
//! (`still`).

use std::fmt::Write as _;
use std::path::Path;

use planner::{
    BoundLimits, Bounds, Constraint, Event, Precedence, Proof, Repair, Store, Yardstick,
    event_ring, task_rings,
};
use scene::Scene;
use serde::Serialize;

use crate::cli::ExplainArgs;
use crate::commands::still;
use crate::exit::{Exit, Outcome};
use crate::{output, result, scenario};

/// Explains; status 4 if there is a proof that the scenario has no solution.
pub(crate) fn main(args: &ExplainArgs) -> Outcome {
    if let Some(at_s) = args.at {
        return still::main(Path::new(&args.scenario), at_s, args.json);
    }
    let scene = scenario::load(&args.scenario, args.robots)?.scene;
    let explanation = Explanation::of(&scene, args.searches);
    if args.json {
        output::print_json(&explanation)?;
    } else {
        output::print(&explanation.words())?;
    }
    Ok(match explanation.infeasible {
        Some(_) => Exit::Infeasible,
        None => Exit::Success,
    })
}

/// All there is to tell, as JSON has it. Objects and robots are counted from 0.
#[derive(Debug, Serialize)]
struct Explanation {
    schema_version: u32,
    scenario: String,
    scenario_hash: String,
    robots: usize,
    objects: usize,
    constraints: Vec<Told>,
    /// Whether all constraints were looked for that are called for.
    complete: bool,
    waits: Vec<Wait>,
    /// Objects that have to be moved and wait for nobody.
    free: Vec<usize>,
    /// Rings under rule 13: each waits for the one before to be completed.
    task_rings: Vec<Vec<usize>>,
    /// A ring of events, which nobody can keep.
    event_ring: Option<Vec<String>>,
    infeasible: Option<Verdict>,
    bounds: Option<Limits>,
}

/// One constraint.
#[derive(Debug, Serialize)]
struct Told {
    /// At least one of these holds in every plan.
    any_of: Vec<Before>,
    reason: &'static str,
    /// The task that is hindered.
    task: usize,
    blockers: Vec<Blocker>,
    words: String,
}

#[derive(Debug, Serialize)]
struct Before {
    before: String,
    after: String,
}

#[derive(Debug, Serialize)]
struct Blocker {
    object: usize,
    at: &'static str,
}

/// Whom an object waits for if one task is completed before the next is selected (rule 13).
#[derive(Debug, Serialize)]
struct Wait {
    object: usize,
    waits_for: Vec<Cause>,
}

#[derive(Debug, Serialize)]
struct Cause {
    object: usize,
    reasons: Vec<&'static str>,
}

#[derive(Debug, Serialize)]
struct Verdict {
    proof: String,
    /// Objects without which no proof is left; nothing if none are.
    take_away: Option<Vec<usize>>,
    /// Objects that can be delivered, as far as is known, if none is taken away.
    deliver: Option<Vec<usize>>,
    /// Whether fewer do not do, nor can more be delivered.
    exact: bool,
}

/// Bounds on the makespan, s (rule 32).
#[derive(Debug, Serialize)]
struct Limits {
    longest_task_s: f64,
    shared_s: f64,
    critical_path_s: f64,
    lower_bound_s: f64,
    yardstick_s: Option<f64>,
    yardstick_is_at_least_s: Option<f64>,
    /// Tasks of each robot in the plan of R.
    yardstick_routes: Option<Vec<Vec<usize>>>,
}

impl Explanation {
    fn of(scene: &Scene, searches: u64) -> Self {
        let store = Store::of(scene, searches);
        let orders: Vec<Precedence> = store.precedences().collect();
        let objects = scene.objects.len();
        let proof = Proof::of(scene, &store);
        let waits = waits(objects, &store);
        let has_to_move = |object: &usize| {
            let spec = &scene.objects[*object];
            let goal = spec
                .goal
                .filter(|goal| (goal - spec.start).amax() > scene::CONTACT_M);
            goal.is_some()
        };
        let is_free = |object: &usize| waits.iter().all(|wait| wait.object != *object);
        Self {
            schema_version: result::SCHEMA_VERSION,
            scenario: scene.name.clone(),
            scenario_hash: result::hex(scene.hash),
            robots: scene.homes.len(),
            objects,
            constraints: store.constraints().iter().map(Told::of).collect(),
            complete: store.is_complete(),
            free: (0..objects).filter(has_to_move).filter(is_free).collect(),
            waits,
            task_rings: task_rings(objects, &orders),
            event_ring: event_ring(objects, &orders).map(|ring| words_of(&ring)),
            infeasible: proof.map(|proof| Verdict::of(scene, &proof, searches)),
            bounds: Bounds::of(scene, BoundLimits::default()).map(Limits::of),
        }
    }

    fn words(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(
            text,
            "{}: {}, {}",
            self.scenario,
            output::count(self.objects as u64, "object"),
            output::count(self.robots as u64, "robot")
        );
        self.tell_constraints(&mut text);
        self.tell_waits(&mut text);
        self.tell_rings(&mut text);
        if let Some(verdict) = &self.infeasible {
            verdict.tell(&mut text);
        } else {
            text.push_str("\nno proof that it cannot be solved\n");
        }
        if let Some(bounds) = &self.bounds {
            bounds.tell(&mut text);
        }
        text
    }

    fn tell_constraints(&self, text: &mut String) {
        if self.constraints.is_empty() {
            text.push_str("\nno constraints between objects\n");
        } else {
            text.push_str("\nconstraints\n");
        }
        for constraint in &self.constraints {
            let _ = writeln!(text, "  {} ({})", constraint.words, constraint.reason);
        }
        if !self.complete {
            text.push_str("  There may be more: --searches allows no further search.\n");
        }
    }

    fn tell_waits(&self, text: &mut String) {
        if self.waits.is_empty() {
            return;
        }
        text.push_str("\nwho waits for whom, if one is completed before the next is selected\n");
        for wait in &self.waits {
            let causes = wait.waits_for.iter();
            let causes =
                causes.map(|cause| format!("{} ({})", cause.object, cause.reasons.join(", ")));
            let causes: Vec<_> = causes.collect();
            let _ = writeln!(
                text,
                "  object {} waits for {}",
                wait.object,
                causes.join(", ")
            );
        }
        if !self.free.is_empty() {
            let _ = writeln!(text, "  waiting for nobody: {}", list(&self.free));
        }
    }

    fn tell_rings(&self, text: &mut String) {
        if self.task_rings.is_empty() {
            return;
        }
        text.push_str("\nrings\n");
        for ring in &self.task_rings {
            let _ = writeln!(text, "  of tasks: {}", round(ring));
        }
        match &self.event_ring {
            Some(ring) => {
                let _ = writeln!(text, "  of events: {}; nobody can keep that", round(ring));
            }
            None => text.push_str(
                "  No ring of events: two robots that hold at once, or an intermediate place, may \
                 get round these.\n  Methods that complete one task before they select the next do not.\n",
            ),
        }
    }
}

impl Told {
    fn of(constraint: &Constraint) -> Self {
        let before = |order: &Precedence| Before {
            before: order.before.to_string(),
            after: order.after.to_string(),
        };
        Self {
            any_of: constraint.any_of.iter().map(before).collect(),
            reason: constraint.reason.word(),
            task: constraint.task,
            blockers: (constraint.blockers.iter())
                .map(|placement| Blocker {
                    object: placement.object,
                    at: if placement.at_goal { "goal" } else { "start" },
                })
                .collect(),
            words: constraint.to_string(),
        }
    }
}

impl Verdict {
    fn of(scene: &Scene, proof: &Proof, searches: u64) -> Self {
        let repair = Repair::of(scene, searches);
        Self {
            proof: proof.to_string(),
            exact: repair.as_ref().is_some_and(|repair| repair.is_exact),
            take_away: repair.as_ref().map(|repair| repair.take_away.clone()),
            deliver: repair.map(|repair| repair.deliver),
        }
    }

    fn tell(&self, text: &mut String) {
        let _ = writeln!(text, "\ninfeasible: {}", self.proof);
        if let Some(take_away) = &self.take_away {
            let fewest = if self.exact {
                "fewest to take away"
            } else {
                "enough to take away"
            };
            let _ = writeln!(
                text,
                "  {fewest} so that no proof is left: {}",
                list(take_away)
            );
        }
        if let Some(deliver) = &self.deliver {
            let most = if self.exact { "most" } else { "some" };
            let _ = writeln!(
                text,
                "  {most} that can be delivered, as far as is known, with none taken away: {}",
                list(deliver)
            );
        }
    }
}

impl Limits {
    fn of(bounds: Bounds) -> Self {
        let lower_bound_s = bounds.best_s();
        let mut limits = Self {
            longest_task_s: bounds.longest_task_s,
            shared_s: bounds.shared_s,
            critical_path_s: bounds.critical_path_s,
            lower_bound_s,
            yardstick_s: None,
            yardstick_is_at_least_s: None,
            yardstick_routes: None,
        };
        match bounds.yardstick {
            Yardstick::Exact { makespan_s, routes } => {
                limits.yardstick_s = Some(makespan_s);
                limits.yardstick_routes = Some(routes);
            }
            Yardstick::AtLeast { makespan_s } => {
                limits.yardstick_is_at_least_s = Some(makespan_s.max(lower_bound_s));
            }
            Yardstick::Impossible => {}
        }
        limits
    }

    fn tell(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "\nno plan is shorter than {:.2} s",
            self.lower_bound_s
        );
        for (what, seconds) in [
            ("the longest task by itself", self.longest_task_s),
            ("all work shared evenly", self.shared_s),
            ("the longest chain of constraints", self.critical_path_s),
        ] {
            let _ = writeln!(text, "  {what}: {seconds:.2} s");
        }
        let _ = match (self.yardstick_s, self.yardstick_is_at_least_s) {
            (Some(r_s), _) => writeln!(
                text,
                "moving each object once takes {r_s:.2} s, were nothing ever in the way"
            ),
            (None, Some(least_s)) => writeln!(
                text,
                "moving each object once takes {least_s:.2} s or more (a bound: the exact value is \
                 beyond the limit)"
            ),
            (None, None) => writeln!(text, "no plan moves each object only once"),
        };
    }
}

/// Whom each object waits for, by the constraints that leave no choice.
fn waits(objects: usize, store: &Store) -> Vec<Wait> {
    let causes = |object: usize| {
        let mut causes: Vec<Cause> = Vec::new();
        for constraint in store.constraints() {
            let order = constraint
                .precedence()
                .filter(|order| order.after.task() == object);
            let Some(order) = order else { continue };
            let (first, reason) = (order.before.task(), constraint.reason.word());
            match causes.iter_mut().find(|cause| cause.object == first) {
                Some(cause) => cause.reasons.push(reason),
                None => causes.push(Cause {
                    object: first,
                    reasons: vec![reason],
                }),
            }
        }
        causes.retain(|cause| cause.object != object);
        causes.sort_by_key(|cause| cause.object);
        causes
    };
    (0..objects)
        .map(|object| Wait {
            object,
            waits_for: causes(object),
        })
        .filter(|wait| !wait.waits_for.is_empty())
        .collect()
}

fn words_of(events: &[Event]) -> Vec<String> {
    events.iter().map(ToString::to_string).collect()
}

/// "0 → 1 → 0", of a ring.
fn round<T: std::fmt::Display>(ring: &[T]) -> String {
    let members = ring.iter().chain(ring.first());
    members
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join(" → ")
}

/// "objects 0, 2".
fn list(objects: &[usize]) -> String {
    if objects.is_empty() {
        return "none".to_owned();
    }
    let words: Vec<_> = objects.iter().map(ToString::to_string).collect();
    let noun = if objects.len() == 1 {
        "object"
    } else {
        "objects"
    };
    format!("{noun} {}", words.join(", "))
}
