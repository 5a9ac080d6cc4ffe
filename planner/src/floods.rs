//! All hard constraints at once (rule 30): instead of one path plan a test, one look at each place
//! of each object, which answers the tests of all tasks.
//!
//! Responsible for: H1 and H2 between all open tasks, the same ones that `hard` finds without the
//! easy ones.
//! Not responsible for: what the paper's methods are charged (`hard` plans a path a test and
//! charges that, rule 23); pieces of free space (`scene::Pieces`).
//!
//! How: for each *class* of bodies (a robot that carries this shape by this grasp) the free space
//! among the walls is labelled once. An object that stands somewhere takes some of it away. If
//! that cuts nothing, only tasks that are grasped or released right there can have lost their
//! path; if it may cut, every task of the class is looked up in the new labels.
//!
//! Not a step machine: it is done at once, and its memory grows to what it needs.

use scene::{ClassId, Occupancy, PieceWork, Pieces, ROBOT_ALONE, Scene, Vec2, joints};
use shm_types::Constraint;

use crate::joints::are_close;
use crate::kind::Kind;
use crate::nearby::Nearby;
use crate::places::Places;

/// A configuration off the lattice joins it, and a path shorter than the lattice can tell goes,
/// within so many pitches.
const JOIN_PITCHES: f64 = 3.0;

/// What it took, in numbers that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FloodWork {
    /// Tests that are decided: two for each ordered pair of open tasks.
    pub tests: u64,
    /// Of these, those that were looked at one by one.
    pub looked_up: u64,
    /// Places looked at, those of rule 10 included.
    pub placements: u64,
    /// Of these, those that took a flood of the whole lattice.
    pub floods: u64,
    /// Runs of lattice points looked at.
    pub runs: u64,
}

/// A robot centre, and how it is tied to the lattice among the walls.
#[derive(Clone, Debug)]
struct End {
    at: Vec2,
    is_on_lattice: bool,
    joints: Vec<u32>,
}

/// The two ends of a transfer, or of a robot's way.
#[derive(Clone, Debug)]
struct Way {
    from: End,
    to: End,
    /// Whether the straight piece is the whole path, as far as the walls go.
    is_straight: bool,
}

/// One obstacle in the pieces of one class.
struct Obstacle<'a> {
    scene: &'a Scene,
    pieces: &'a Pieces,
    /// The object, where it stands, and whether with clearance.
    object: Option<(usize, Vec2, bool)>,
}

/// Finds all hard constraints between the open tasks of a scene.
#[derive(Clone, Debug)]
pub struct Floods {
    places: Vec<Option<Places>>,
    /// Whether each task can be done alone, once that is known (rule 10).
    feasible: Vec<Option<bool>>,
    /// A robot alone among the walls.
    walls: Occupancy,
    robot: Pieces,
    homes: Vec<End>,
    found: Vec<Constraint>,
    work: FloodWork,
}

impl Floods {
    /// Finds them for the open tasks' places: one item a task, none for those that are finished.
    #[must_use]
    pub fn of(scene: &Scene, places: impl IntoIterator<Item = Option<Places>>) -> Self {
        let walls = Occupancy::new(scene);
        let homes = scene.homes.iter().map(|home| End::of(scene, &walls, *home));
        let homes = homes.collect();
        let mut floods = Self {
            places: places.into_iter().collect(),
            feasible: vec![None; scene.objects.len()],
            homes,
            walls,
            robot: Pieces::new(scene, ROBOT_ALONE),
            found: Vec::new(),
            work: FloodWork::default(),
        };
        floods.places.resize(scene.objects.len(), None);
        floods.find(scene);
        floods
    }

    /// The constraints, in the order of the table.
    #[must_use]
    pub fn constraints(&self) -> &[Constraint] {
        &self.found
    }

    /// What it took.
    #[must_use]
    pub const fn work(&self) -> FloodWork {
        self.work
    }

    fn find(&mut self, scene: &Scene) {
        let open = self.places.iter().flatten().count() as u64;
        self.work.tests = 2 * open * open.saturating_sub(1);
        for class in 0..scene.class_count() {
            self.find_of_class(scene, ClassId(class));
        }
        self.add_work(self.robot.work());
        self.found
            .sort_unstable_by_key(|found| (found.before, found.after, found.kind));
    }

    /// The tests of all tasks whose transfer is made by bodies of this class.
    fn find_of_class(&mut self, scene: &Scene, class: ClassId) {
        let mut nearby = Nearby::new(scene);
        let mut ways: Vec<Option<Way>> = vec![None; self.places.len()];
        let mut movers = Vec::new();
        let mut walls = Occupancy::new(scene);
        walls.reset(scene, class);
        for (task, places) in self.places.iter().enumerate() {
            if let Some(places) = *places
                && scene.objects[task].class == class
            {
                ways[task] = Some(Way::of(scene, &walls, task, places));
                nearby.set(scene, task, Some(places));
                movers.push(task);
            }
        }
        if movers.is_empty() {
            return;
        }
        let mut pieces = Pieces::new(scene, class);
        let alone = Obstacle::none(scene, &pieces);
        // No constraint follows for a task that the walls stop already (rule 10).
        movers.retain(|&task| ways[task].as_ref().is_some_and(|way| alone.leaves(way)));
        let mut can_move = vec![false; ways.len()];
        for &task in &movers {
            can_move[task] = true;
        }
        let margin_m = JOIN_PITCHES * scene.lattice.pitch_m;
        let mut near = Vec::new();
        for one in 0..self.places.len() {
            let Some(places) = self.places[one] else {
                continue;
            };
            for kind in Kind::HARD {
                let at = places.at(kind.first_at_goal());
                pieces.block(scene, &scene.objects[one].shape, at, true);
                near.clear();
                if !pieces.may_be_cut() {
                    nearby.for_each_grasped_near(at, margin_m, |end| near.push(end.task));
                    near.retain(|&task| can_move[task]);
                    near.sort_unstable();
                    near.dedup();
                }
                let asked = if pieces.may_be_cut() { &movers } else { &near };
                let obstacle = Obstacle {
                    scene,
                    pieces: &pieces,
                    object: Some((one, at, true)),
                };
                for &two in asked {
                    let Some(way) = ways[two].as_ref().filter(|_| two != one) else {
                        continue;
                    };
                    self.work.looked_up += 1;
                    if !obstacle.leaves(way) && self.is_feasible(scene, two) {
                        self.add(kind, one, two);
                    }
                }
            }
        }
        self.add_work(pieces.work());
    }

    fn add(&mut self, kind: Kind, one: usize, two: usize) {
        let (before, after) = kind.edge(one, two);
        if let Some(wire) = kind.wire() {
            self.found.push(Constraint {
                before: before as u32,
                after: after as u32,
                kind: wire.code(),
            });
        }
    }

    /// Whether a task whose transfer has a path can be done alone: some robot gets to the grasp,
    /// and some robot gets home (rule 10).
    fn is_feasible(&mut self, scene: &Scene, task: usize) -> bool {
        if let Some(known) = self.feasible[task] {
            return known;
        }
        let feasible = self.places[task].is_some_and(|places| {
            [places.initial, places.goal]
                .into_iter()
                .all(|at| self.is_within_reach(scene, task, at))
        });
        self.feasible[task] = Some(feasible);
        feasible
    }

    /// Whether some robot gets from its home to the grasp of an object at `at`, among the walls
    /// and the object itself.
    fn is_within_reach(&mut self, scene: &Scene, task: usize, at: Vec2) -> bool {
        let spec = &scene.objects[task];
        let is_obstacle = !spec.pass_under && !scene.lifts_from_below(task);
        if is_obstacle {
            self.robot.block(scene, &spec.shape, at, false);
        } else {
            self.robot.unblock(scene);
        }
        let grasp = End::of(scene, &self.walls, at + spec.grasp);
        let obstacle = Obstacle {
            scene,
            pieces: &self.robot,
            object: is_obstacle.then_some((task, at, false)),
        };
        self.homes.iter().any(|home| {
            obstacle.leaves(&Way::between(
                scene,
                &self.walls,
                home.clone(),
                grasp.clone(),
            ))
        })
    }

    fn add_work(&mut self, work: PieceWork) {
        self.work.placements += work.obstacles;
        self.work.floods += work.floods;
        self.work.runs += work.runs;
    }
}

impl End {
    /// `walls` is of the class whose centre it is.
    fn of(scene: &Scene, walls: &Occupancy, at: Vec2) -> Self {
        Self {
            at,
            is_on_lattice: scene.lattice.cell(at).is_some(),
            joints: joints(scene, walls, at).collect(),
        }
    }
}

impl Way {
    fn of(scene: &Scene, walls: &Occupancy, task: usize, places: Places) -> Self {
        let grasp = scene.objects[task].grasp;
        let [from, to] = [places.initial, places.goal].map(|at| End::of(scene, walls, at + grasp));
        Self::between(scene, walls, from, to)
    }

    /// The same ways count as straight as in `search`.
    fn between(scene: &Scene, walls: &Occupancy, from: End, to: End) -> Self {
        let whole = from.at == to.at
            || !(from.is_on_lattice && to.is_on_lattice)
                && are_close(scene.lattice.pitch_m, from.at, to.at);
        Self {
            is_straight: whole && walls.straight_is_free(scene, from.at, to.at),
            from,
            to,
        }
    }
}

impl<'a> Obstacle<'a> {
    fn none(scene: &'a Scene, pieces: &'a Pieces) -> Self {
        Self {
            scene,
            pieces,
            object: None,
        }
    }

    /// Whether there is a path along `way`.
    fn leaves(&self, way: &Way) -> bool {
        way.is_straight && self.is_free(way.from.at, way.to.at)
            || self
                .open_joints(&way.from)
                .any(|from| self.open_joints(&way.to).any(|to| from == to))
    }

    /// The pieces that an end is still joined to.
    fn open_joints(&self, end: &'a End) -> impl Iterator<Item = u32> {
        end.joints.iter().filter_map(move |&cell| {
            let piece = self.pieces.piece(cell)?;
            let is_open = end.is_on_lattice || self.is_free(end.at, self.scene.lattice.at(cell));
            is_open.then_some(piece)
        })
    }

    /// Whether the obstacle lets the body move straight, exactly.
    fn is_free(&self, from: Vec2, to: Vec2) -> bool {
        self.object.is_none_or(|(object, at, clearance)| {
            let shape = &self.scene.objects[object].shape;
            let body = self.scene.body(self.pieces.class());
            !body.sweeps(from, to, clearance, shape, at, at)
        })
    }
}
