//! Where each unfinished task's object stands and has to go, copied once for a computation that
//! takes several steps.
//!
//! Responsible for: what "initial" and "goal" mean (rule 9), and noticing what has changed since
//! the last time.
//! Not responsible for: which tasks may be selected (`selection`).
//!
//! Terms: a task is *open* if it is a node of the priority graph: not finished, and with a goal.

use scene::{CONTACT_M, Scene, Vec2, vec};
use shm_types::{ObjectState, TaskStatus};

/// Initial and goal place of an open task's object, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Places {
    /// Where the object last stood on the ground. For an object that is being carried this is
    /// still where it was taken from: edges at a task in progress are frozen (rule 9).
    pub initial: Vec2,
    /// Where it has to be.
    pub goal: Vec2,
}

impl Places {
    /// The places of a task that stands at `status`; none if it is not open.
    #[must_use]
    pub fn of(object: &ObjectState, status: u32) -> Option<Self> {
        let open = status != TaskStatus::Done.code() && object.has_goal == 1;
        open.then(|| Self {
            initial: vec(object.rest),
            goal: vec(object.goal),
        })
    }

    /// Whether the object still has to be brought anywhere.
    #[must_use]
    pub fn is_open(&self) -> bool {
        (self.goal - self.initial).amax() > CONTACT_M
    }

    /// The places of all tasks as a run begins: none for clutter.
    pub fn at_start(scene: &Scene) -> impl Iterator<Item = Option<Self>> {
        scene.objects.iter().map(|object| {
            object.goal.map(|goal| Self {
                initial: object.start,
                goal,
            })
        })
    }

    /// Where the object stands in a test.
    pub(crate) fn at(&self, goal: bool) -> Vec2 {
        if goal { self.goal } else { self.initial }
    }
}

/// Places of all tasks, and which of them have changed.
#[derive(Clone, Debug)]
pub(crate) struct PlaceBook {
    places: Vec<Option<Places>>,
    changed: Vec<usize>,
}

impl PlaceBook {
    pub(crate) fn new(scene: &Scene) -> Self {
        let tasks = scene.objects.len();
        Self {
            places: vec![None; tasks],
            changed: Vec::with_capacity(tasks),
        }
    }

    /// Takes over new places, task by task; the tasks that changed are in [`PlaceBook::changed`].
    pub(crate) fn update(&mut self, places: impl Iterator<Item = Option<Places>>) {
        self.changed.clear();
        for (task, new) in places.take(self.places.len()).enumerate() {
            if self.places[task] != new {
                self.places[task] = new;
                self.changed.push(task);
            }
        }
    }

    /// Number of tasks, open or not.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Places of an open task.
    pub(crate) fn get(&self, task: usize) -> Option<Places> {
        self.places[task]
    }

    /// Tasks whose places differ from before the last update: opened, closed or moved.
    pub(crate) fn changed(&self) -> &[usize] {
        &self.changed
    }

    /// All open tasks, ascending.
    pub(crate) fn open(&self) -> impl Iterator<Item = (usize, Places)> + '_ {
        self.places
            .iter()
            .enumerate()
            .filter_map(|(task, places)| Some((task, (*places)?)))
    }
}
