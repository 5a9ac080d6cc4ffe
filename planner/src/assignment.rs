//! Handing out tasks to free robots (rule 17).
//!
//! Responsible for: the loop: the highest-priority task goes to the free robot with the highest
//! performance, until no task or no robot is left. Ties between tasks: larger performance, then
//! lower task; between robots: lower robot.
//! Not responsible for: what can be selected at all, and the values themselves (`selection`).

use shm_types::capacity::ROBOT_WORDS;

/// A selectable task.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) task: usize,
    /// Bit r set: not for robot r.
    barred: [u64; ROBOT_WORDS],
    /// The free robot with the best performance for it, and the length it is the inverse of, m.
    best: Option<(f64, usize)>,
    taken: bool,
}

impl Candidate {
    pub(crate) const fn new(task: usize, barred: [u64; ROBOT_WORDS]) -> Self {
        Self {
            task,
            barred,
            best: None,
            taken: false,
        }
    }

    fn is_barred(&self, robot: usize) -> bool {
        self.barred[robot / 64] >> (robot % 64) & 1 == 1
    }
}

/// Who gets what.
#[derive(Clone, Debug)]
pub(crate) struct Assignment {
    task_of: Vec<Option<usize>>,
    free: Vec<bool>,
}

impl Assignment {
    pub(crate) fn new(robots: usize) -> Self {
        Self {
            task_of: vec![None; robots],
            free: vec![false; robots],
        }
    }

    /// Starts over: nobody has anything, and these robots may get something.
    pub(crate) fn begin(&mut self, free: impl Iterator<Item = bool>) {
        self.task_of.fill(None);
        for (slot, free) in self.free.iter_mut().zip(free) {
            *slot = free;
        }
    }

    pub(crate) fn task_of(&self, robot: usize) -> Option<usize> {
        self.task_of[robot]
    }

    /// Hands out one *class* of tasks, all of the same priority, as far as there are robots
    /// free. `length` is what the performance of a robot for a task is the inverse of. The number
    /// of pairs looked at.
    pub(crate) fn hand_out(
        &mut self,
        class: &mut [Candidate],
        length: impl Fn(usize, usize) -> f64,
    ) -> u64 {
        let mut pairs = 0;
        let robots = self.free.len() as u64;
        for candidate in class.iter_mut() {
            candidate.best = self.best(candidate, &length);
            pairs += robots;
        }
        while let Some(chosen) = choose(class) {
            let Some((_, robot)) = class[chosen].best else {
                break;
            };
            class[chosen].taken = true;
            self.free[robot] = false;
            self.task_of[robot] = Some(class[chosen].task);
            for candidate in class.iter_mut() {
                if candidate.best.is_some_and(|(_, best)| best == robot) {
                    candidate.best = self.best(candidate, &length);
                    pairs += robots;
                }
            }
        }
        pairs
    }

    /// Whether some robot may still get something.
    pub(crate) fn any_free(&self) -> bool {
        self.free.contains(&true)
    }

    fn best(
        &self,
        candidate: &Candidate,
        length: &impl Fn(usize, usize) -> f64,
    ) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        for robot in 0..self.free.len() {
            if candidate.taken || !self.free[robot] || candidate.is_barred(robot) {
                continue;
            }
            let length = length(candidate.task, robot);
            if best.is_none_or(|(least, _)| length < least) {
                best = Some((length, robot));
            }
        }
        best
    }
}

/// The task, not taken yet, whose best robot performs best; the lower task among equals.
fn choose(class: &[Candidate]) -> Option<usize> {
    let mut chosen: Option<(f64, usize)> = None;
    for (index, candidate) in class.iter().enumerate() {
        let Some((length, _)) = candidate.best.filter(|_| !candidate.taken) else {
            continue;
        };
        if chosen.is_none_or(|(least, _)| length < least) {
            chosen = Some((length, index));
        }
    }
    chosen.map(|(_, index)| index)
}
