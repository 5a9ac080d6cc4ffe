//! Bounds where there is something to choose: by which of its grasps an object is held, which goal
//! of its kind it goes to (rule 32).
//!
//! Responsible for: the legs of every choice, and from them the bounds that hold whatever is
//! chosen; R as the best over all choices.
//! Not responsible for: scenes without choices (`bounds`, from `legs`), R of one choice
//! (`yardstick`), how long ways are (`floods`).
//!
//! Terms: a *group* is an object with a goal of its own, or all objects of a kind with all goals of
//! it. An object is *carried* by one grasp all the way, and *moved* by whichever is best at every
//! point of it: it may be put down and taken up otherwise on the way, also by another robot, on the
//! other side of a wall.
//!
//! Why (b) is the better of two sums: what robots do between carrying can only be put together to
//! ways from releases to grasps where an object is taken up as it was put down. So one sum has the
//! ways of objects that have one grasp and certainly have to be moved, and lets all other carrying
//! be part of these ways; the other has all moves, and no ways.

mod floods;

use scene::{CONTACT_M, ClassId, ROBOT_ALONE, Scene, Vec2, least_assignment};

use crate::bounds::choices::floods::Floods;
use crate::bounds::timing::{Model, Tables, Timing};
use crate::bounds::yardstick::{MOST_ROBOTS, MOST_TASKS, Yardstick, longest_s};
use crate::bounds::{BoundLimits, Bounds, ways_s};
use crate::event::Precedence;
use crate::legs::LEG_EXACTNESS;
use crate::store::Store;

/// Most work on R, in sets of tasks over all choices and robots.
const MOST_SETS: usize = 20_000_000;

/// Objects that are alike, and where they are to go.
struct Group {
    objects: Vec<usize>,
    starts: Vec<Vec2>,
    goals: Vec<Vec2>,
    grasps: Vec<(Vec2, ClassId)>,
    /// Number of its first grasp place: by object, then by grasp.
    first_grasp: usize,
    /// Number of its first release place: by goal, then by grasp.
    first_release: usize,
    /// By object, goal and grasp, s.
    carried_s: Vec<f64>,
    /// By object and goal, s.
    moved_s: Vec<f64>,
}

impl Group {
    fn grasp_at(&self, object: usize, by: usize) -> usize {
        self.first_grasp + object * self.grasps.len() + by
    }

    fn release_at(&self, goal: usize, by: usize) -> usize {
        self.first_release + goal * self.grasps.len() + by
    }

    fn carried_s(&self, object: usize, goal: usize, by: usize) -> f64 {
        self.carried_s[(object * self.goals.len() + goal) * self.grasps.len() + by]
    }

    fn moved_s(&self, object: usize, goal: usize) -> f64 {
        self.moved_s[object * self.goals.len() + goal]
    }

    /// Whether an object stands at a goal from the beginning.
    fn is_there(&self, object: usize, goal: usize) -> bool {
        (self.starts[object] - self.goals[goal]).amax() <= CONTACT_M
    }

    /// The goal that an object stands at from the beginning.
    fn goal_of(&self, object: usize) -> Option<usize> {
        (0..self.goals.len()).find(|&goal| self.is_there(object, goal))
    }

    /// Whether each of its objects has to be moved, and can be held in one way only.
    fn is_certain(&self) -> bool {
        let (objects, goals) = (self.objects.len(), self.goals.len());
        let stays = (0..objects).any(|object| self.goal_of(object).is_some());
        self.grasps.len() == 1 && objects == goals && !stays
    }

    /// The least sum over all ways to give goals to objects; none for an object is 0.
    fn least(&self, cost: impl Fn(usize, usize) -> f64) -> Option<f64> {
        least_assignment(self.objects.len(), |object, goal| {
            if goal < self.goals.len() {
                cost(object, goal)
            } else {
                0.0
            }
        })
    }

    /// The least longest, likewise.
    fn least_longest(&self, cost: impl Fn(usize, usize) -> f64) -> Option<f64> {
        let pairs = (0..self.objects.len())
            .flat_map(|object| (0..self.goals.len()).map(move |goal| (object, goal)));
        let mut all: Vec<f64> = pairs.map(|(object, goal)| cost(object, goal)).collect();
        all.retain(|cost| cost.is_finite());
        all.push(0.0);
        all.sort_by(f64::total_cmp);
        let within = |most: f64| {
            let fits = |object, goal| {
                if cost(object, goal) <= most {
                    0.0
                } else {
                    f64::INFINITY
                }
            };
            self.least(fits).is_some()
        };
        all.get(all.partition_point(|most| !within(*most))).copied()
    }
}

/// All legs of a scene, s; infinite where there is no way.
struct Choices {
    groups: Vec<Group>,
    robots: usize,
    grips_s: (f64, f64),
    grasps: usize,
    /// By robot and grasp place.
    approach_s: Vec<f64>,
    /// By release place and robot.
    home_s: Vec<f64>,
    /// By release place and grasp place.
    turn_s: Vec<f64>,
    /// By robot and robot.
    between_s: Vec<f64>,
}

/// How one task is done: its object, as numbered in the scene; where it is grasped, where released,
/// and how long it is carried.
#[derive(Clone, Copy, Debug)]
struct Way {
    object: usize,
    grasp: usize,
    release: usize,
    carried_s: f64,
}

/// As [`Bounds::of`], for any scene.
pub(super) fn bounds(scene: &Scene, limits: BoundLimits) -> Option<Bounds> {
    let grasps = scene.objects.iter().map(|object| object.grasps.len());
    let floods = scene.homes.len() + 3 * grasps.sum::<usize>();
    if floods.saturating_mul(scene.lattice.len()) > limits.points {
        return None;
    }
    let choices = Choices::of(scene);
    let precedences: Vec<Precedence> = Store::of(scene, limits.searches)
        .precedences()
        // Which of a kind comes to a goal is open.
        .filter(|order| {
            let ends = [order.before, order.after];
            let own = |task: usize| scene.objects[task].kind.is_none();
            ends.iter().all(|event| own(event.task()))
        })
        .collect();
    if choices.groups.is_empty() {
        return None;
    }
    let below = 1.0 - LEG_EXACTNESS;
    let longest = choices
        .groups
        .iter()
        .map(|group| group.least_longest(|object, goal| choices.alone_s(group, object, goal)));
    let longest_task_s = longest.collect::<Option<Vec<f64>>>()?;
    let longest_task_s = longest_task_s.into_iter().fold(0.0, f64::max) * below;
    let shared_s = choices.shared_s()? * below;
    let critical_path_s = choices.critical_path_s(&precedences)? * below;
    let least_s = longest_task_s.max(shared_s).max(critical_path_s);
    Some(Bounds {
        longest_task_s,
        shared_s,
        critical_path_s,
        yardstick: choices.yardstick(&precedences, least_s, limits.nodes),
    })
}

impl Choices {
    fn of(scene: &Scene) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        for (object, spec) in scene.objects.iter().enumerate() {
            let alike = |group: &Group| scene.objects[group.objects[0]].kind == spec.kind;
            let known = groups.iter().position(alike);
            let index = match known.filter(|_| spec.kind.is_some()) {
                Some(index) => index,
                None => {
                    groups.push(Group {
                        objects: Vec::new(),
                        starts: Vec::new(),
                        goals: Vec::new(),
                        grasps: (spec.grasps.iter())
                            .map(|grasp| (grasp.offset, grasp.class))
                            .collect(),
                        first_grasp: 0,
                        first_release: 0,
                        carried_s: Vec::new(),
                        moved_s: Vec::new(),
                    });
                    groups.len() - 1
                }
            };
            let group = &mut groups[index];
            group.objects.push(object);
            group.starts.push(spec.start);
            group.goals.extend(spec.goal);
        }
        // What nobody has to bring anywhere is no task.
        groups.retain(|group| {
            let open = |goal| (0..group.objects.len()).all(|object| !group.is_there(object, goal));
            (0..group.goals.len()).any(open)
        });
        let (mut grasps, mut releases) = (Vec::new(), Vec::new());
        for group in &mut groups {
            (group.first_grasp, group.first_release) = (grasps.len(), releases.len());
            let offsets = &group.grasps;
            let at = |places: &[Vec2]| -> Vec<Vec2> {
                let by = places
                    .iter()
                    .flat_map(|place| offsets.iter().map(move |grasp| place + grasp.0));
                by.collect()
            };
            grasps.extend(at(&group.starts));
            releases.extend(at(&group.goals));
        }
        let mut floods = Floods::new(scene);
        for group in &mut groups {
            group.carried_s = floods.carried_s(group);
            group.moved_s = floods.moved_s(group);
        }
        let homes = &scene.homes;
        let mut from = |places: &[Vec2], to: &[Vec2]| floods.all_s(places, ROBOT_ALONE, to);
        // Motion is reversible: what is asked for is the way back of what is flooded.
        let transposed = |table: Vec<f64>, rows: usize, columns: usize| -> Vec<f64> {
            let cells = (0..columns).flat_map(|column| (0..rows).map(move |row| (row, column)));
            cells
                .map(|(row, column)| table[row * columns + column])
                .collect()
        };
        Self {
            approach_s: from(homes, &grasps),
            home_s: transposed(from(homes, &releases), homes.len(), releases.len()),
            turn_s: transposed(from(&grasps, &releases), grasps.len(), releases.len()),
            between_s: from(homes, homes),
            robots: homes.len(),
            grips_s: (
                scene.robot.grasp_ns as f64 / 1e9,
                scene.robot.release_ns as f64 / 1e9,
            ),
            grasps: grasps.len(),
            groups,
        }
    }

    fn approach_s(&self, robot: usize, grasp: usize) -> f64 {
        self.approach_s[robot * self.grasps + grasp]
    }

    fn home_s(&self, release: usize, robot: usize) -> f64 {
        self.home_s[release * self.robots + robot]
    }

    fn turn_s(&self, release: usize, grasp: usize) -> f64 {
        self.turn_s[release * self.grasps + grasp]
    }

    fn between_s(&self, from: usize, to: usize) -> f64 {
        self.between_s[from * self.robots + to]
    }

    fn gripping_s(&self) -> f64 {
        self.grips_s.0 + self.grips_s.1
    }

    /// From where the nearest robot starts to the nearest grasp of an object.
    fn least_approach_s(&self, group: &Group, object: usize) -> f64 {
        let robots = (0..self.robots).flat_map(|robot| {
            let places = (0..group.grasps.len()).map(|by| group.grasp_at(object, by));
            places.map(move |grasp| self.approach_s(robot, grasp))
        });
        robots.fold(f64::INFINITY, f64::min)
    }

    /// From the release at a goal that is nearest to some home, to that.
    fn least_home_s(&self, group: &Group, goal: usize) -> f64 {
        let robots = (0..self.robots).flat_map(|robot| {
            let places = (0..group.grasps.len()).map(|by| group.release_at(goal, by));
            places.map(move |release| self.home_s(release, robot))
        });
        robots.fold(f64::INFINITY, f64::min)
    }

    /// A task by itself (rule 32 (a)).
    fn alone_s(&self, group: &Group, object: usize, goal: usize) -> f64 {
        if group.is_there(object, goal) {
            return 0.0;
        }
        self.least_approach_s(group, object)
            + self.gripping_s()
            + group.moved_s(object, goal)
            + self.least_home_s(group, goal)
    }

    /// Rule 32 (b).
    fn shared_s(&self) -> Option<f64> {
        let moves = self.groups.iter().map(|group| {
            group.least(|object, goal| match group.is_there(object, goal) {
                true => 0.0,
                false => self.gripping_s() + group.moved_s(object, goal),
            })
        });
        let moves_s: f64 = moves.collect::<Option<Vec<f64>>>()?.into_iter().sum();
        Some((moves_s / self.robots as f64).max(self.certain_s()?))
    }

    /// All work with what certainly has to be moved, ways between included, shared evenly by the
    /// robots that can get there.
    fn certain_s(&self) -> Option<f64> {
        let certain = || self.groups.iter().filter(|group| group.is_certain());
        let grasps: Vec<usize> = certain()
            .flat_map(|group| (0..group.objects.len()).map(|object| group.grasp_at(object, 0)))
            .collect();
        let releases: Vec<usize> = certain()
            .flat_map(|group| (0..group.goals.len()).map(|goal| group.release_at(goal, 0)))
            .collect();
        let reaches = |robot: &usize| {
            let mut grasps = grasps.iter();
            grasps.any(|&grasp| self.approach_s(*robot, grasp).is_finite())
        };
        let shares = (0..self.robots).filter(reaches).count();
        let ways_s = ways_s(grasps.len(), self.robots, |from, to| {
            match (from.checked_sub(self.robots), to.checked_sub(grasps.len())) {
                (None, None) => self.approach_s(from, grasps[to]),
                (None, Some(home)) => self.between_s(from, home),
                (Some(from), None) => self.turn_s(releases[from], grasps[to]),
                (Some(from), Some(home)) => self.home_s(releases[from], home),
            }
        })?;
        let busy = certain().map(|group| {
            group.least(|object, goal| self.gripping_s() + group.carried_s(object, goal, 0))
        });
        let busy_s: f64 = busy.collect::<Option<Vec<f64>>>()?.into_iter().sum();
        Some((ways_s + busy_s) / shares.max(1) as f64)
    }

    /// Rule 32 (c), over objects with goals of their own. None if events wait for one another in a
    /// ring.
    fn critical_path_s(&self, precedences: &[Precedence]) -> Option<f64> {
        let own = || (self.groups.iter()).filter(|group| group.objects.len() == 1);
        let count = own().count();
        let tables = Tables {
            approach_s: (0..self.robots)
                .flat_map(|robot| own().map(move |group| self.nearest_grasp_s(group, robot)))
                .collect(),
            transfer_s: own().map(|group| group.moved_s(0, 0)).collect(),
            // Robots' routes are no part of it.
            turn_s: vec![0.0; count * count],
            home_s: own()
                .flat_map(|group| {
                    (0..self.robots).map(move |robot| self.nearest_release_s(group, robot))
                })
                .collect(),
            between_s: self.between_s.clone(),
        };
        let tasks: Vec<usize> = own().map(|group| group.objects[0]).collect();
        if tasks.is_empty() {
            return Some(0.0);
        }
        let orders = precedences.iter().copied();
        let model = Model::with(tasks, self.robots, self.grips_s, tables, orders)?;
        let mut timing = Timing::new(&model);
        let all = (0..count).map(|k| (k, None));
        timing.run().then(|| longest_s(&model, &timing, all))
    }

    fn nearest_grasp_s(&self, group: &Group, robot: usize) -> f64 {
        let grasps = (0..group.grasps.len()).map(|by| group.grasp_at(0, by));
        let ways = grasps.map(|grasp| self.approach_s(robot, grasp));
        ways.fold(f64::INFINITY, f64::min)
    }

    fn nearest_release_s(&self, group: &Group, robot: usize) -> f64 {
        let releases = (0..group.grasps.len()).map(|by| group.release_at(0, by));
        let ways = releases.map(|release| self.home_s(release, robot));
        ways.fold(f64::INFINITY, f64::min)
    }

    /// R: the least over all choices of a grasp for each object that is carried, and of objects for
    /// goals. Objects that stand at a goal of their kind stay there.
    fn yardstick(&self, precedences: &[Precedence], least_s: f64, nodes: u64) -> Yardstick {
        let at_least = Yardstick::AtLeast {
            makespan_s: least_s,
        };
        // All ways to do each task.
        let mut tasks: Vec<Vec<Way>> = Vec::new();
        for group in &self.groups {
            let free: Vec<usize> = (0..group.objects.len())
                .filter(|&object| group.goal_of(object).is_none())
                .collect();
            let open = |goal: &usize| {
                (0..group.objects.len()).all(|object| !group.is_there(object, *goal))
            };
            tasks.extend((0..group.goals.len()).filter(open).map(|goal| {
                let by = |object: &usize| {
                    let object = *object;
                    (0..group.grasps.len()).map(move |by| Way {
                        object: group.objects[object],
                        grasp: group.grasp_at(object, by),
                        release: group.release_at(goal, by),
                        carried_s: group.carried_s(object, goal, by),
                    })
                };
                free.iter().flat_map(by).collect()
            }));
        }
        if tasks.len() > MOST_TASKS || self.robots > MOST_ROBOTS {
            return at_least;
        }
        let most = MOST_SETS / (3_usize.pow(tasks.len() as u32) * self.robots);
        let mut all = Vec::new();
        if !choose(&tasks, &mut Vec::new(), most, &mut all) {
            return at_least;
        }
        let mut best = Yardstick::Impossible;
        // What is not known to be longer than the best.
        let mut open_s = f64::INFINITY;
        for ways in &all {
            let orders = precedences.iter().copied();
            let Some(model) = self.model(ways, orders) else {
                continue;
            };
            match Yardstick::of_model(&model, nodes / all.len() as u64) {
                Yardstick::Impossible => {}
                Yardstick::AtLeast { makespan_s } => open_s = open_s.min(makespan_s),
                exact @ Yardstick::Exact { .. } => {
                    if best
                        .exact_s()
                        .is_none_or(|best_s| exact.exact_s() < Some(best_s))
                    {
                        best = exact;
                    }
                }
            }
        }
        match best.exact_s() {
            Some(best_s) if best_s <= open_s => best,
            _ if open_s.is_finite() => Yardstick::AtLeast {
                makespan_s: open_s.max(least_s),
            },
            _ => best,
        }
    }

    /// The model of one choice; none if nobody can do it.
    fn model(
        &self,
        ways: &[Way],
        precedences: impl IntoIterator<Item = Precedence>,
    ) -> Option<Model> {
        let mut ways = ways.to_vec();
        ways.sort_unstable_by_key(|way| way.object);
        let tables = Tables {
            approach_s: (0..self.robots)
                .flat_map(|robot| ways.iter().map(move |way| (robot, way.grasp)))
                .map(|(robot, grasp)| self.approach_s(robot, grasp))
                .collect(),
            transfer_s: ways.iter().map(|way| way.carried_s).collect(),
            turn_s: ways
                .iter()
                .flat_map(|from| ways.iter().map(|to| self.turn_s(from.release, to.grasp)))
                .collect(),
            home_s: ways
                .iter()
                .flat_map(|way| (0..self.robots).map(|robot| self.home_s(way.release, robot)))
                .collect(),
            between_s: self.between_s.clone(),
        };
        let tasks = ways.iter().map(|way| way.object).collect();
        Model::with(tasks, self.robots, self.grips_s, tables, precedences)
    }
}

/// All choices of one way a task, each with another object. False if there are more than `most`.
fn choose(tasks: &[Vec<Way>], chosen: &mut Vec<Way>, most: usize, all: &mut Vec<Vec<Way>>) -> bool {
    let Some(ways) = tasks.get(chosen.len()) else {
        all.push(chosen.clone());
        return all.len() <= most;
    };
    for way in ways {
        if way.carried_s.is_finite() && chosen.iter().all(|other| other.object != way.object) {
            chosen.push(*way);
            let fits = choose(tasks, chosen, most, all);
            chosen.pop();
            if !fits {
                return false;
            }
        }
    }
    true
}
