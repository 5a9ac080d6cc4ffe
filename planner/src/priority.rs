//! The priority graph (§III.C.2): who has to be completed before whom, and what each task is
//! worth.
//!
//! Responsible for: merging edges (rule 14), exact priority values, finding cycles and what
//! lies behind them (rule 15).
//! Not responsible for: where the edges come from (`easy`, `hard`) or who takes a task
//! (`selection`).
//!
//! Terms: an edge `before → after` says that `after` cannot be selected until `before` is
//! completed (rule 13). A task *behind* a cycle can be reached from it along edges. An
//! *unselectable* task lies on or behind a cycle: no order of completions ever frees it.

use ruint::Uint;
use scene::Budget;
use shm_types::capacity::MAX_OBJECTS;

/// A priority value. A totally ordered set of `k` tasks reaches `2^(k−1) − 1` (rule 14) and no
/// graph of `k` tasks reaches more, so 1,024 bits hold every value exactly.
pub type Priority = Uint<1024, 16>;

const _: () = assert!(MAX_OBJECTS <= 1024);

/// Edges summed into a priority for one unit of work: an addition of 1,024 bits against the
/// expansion of a cell.
const EDGES_PER_UNIT: u64 = 4;

/// A simple digraph over unfinished tasks, with the value of each.
#[derive(Clone, Debug)]
pub struct PriorityGraph {
    tasks: usize,
    words: usize,
    /// Row `v`, bit `w`: edge `v → w`.
    edges: Vec<u64>,
    nodes: Vec<u64>,
    indegree: Vec<u32>,
    values: Vec<Priority>,
    /// Nodes in an order in which every edge points forward; cycles and what lies behind them
    /// never enter it.
    order: Vec<u32>,
    /// Nodes of `order` without a value yet.
    unvalued: usize,
    solved: bool,
    ordered: Vec<u64>,
    cycle: Vec<usize>,
    /// Scratch of the walk that finds a cycle: place in the walk plus one, 0 for unvisited.
    visited: Vec<u32>,
}

impl PriorityGraph {
    /// A graph with room for `tasks` tasks and no node.
    #[must_use]
    pub fn new(tasks: usize) -> Self {
        let words = tasks.div_ceil(64);
        Self {
            tasks,
            words,
            edges: vec![0; tasks * words],
            nodes: vec![0; words],
            indegree: vec![0; tasks],
            values: vec![Priority::ZERO; tasks],
            order: Vec::with_capacity(tasks),
            unvalued: 0,
            solved: false,
            ordered: vec![0; words],
            cycle: Vec::with_capacity(tasks),
            visited: vec![0; tasks],
        }
    }

    /// Takes all nodes and edges away.
    pub fn clear(&mut self) {
        self.edges.fill(0);
        self.nodes.fill(0);
        self.reopen();
    }

    /// Adds a task as a node.
    pub fn add_task(&mut self, task: usize) {
        self.nodes[task / 64] |= 1 << (task % 64);
        self.reopen();
    }

    /// Adds an edge; a parallel one is merged, one that ends at no node or at itself is
    /// dropped. Says whether the edge is new.
    pub fn add_edge(&mut self, before: usize, after: usize) -> bool {
        if before == after || !self.is_node(before) || !self.is_node(after) {
            return false;
        }
        let word = &mut self.edges[before * self.words + after / 64];
        let bit = 1 << (after % 64);
        let new = *word & bit == 0;
        *word |= bit;
        self.reopen();
        new
    }

    /// Whether `task` is a node.
    #[must_use]
    pub fn is_node(&self, task: usize) -> bool {
        bit(&self.nodes, task)
    }

    /// Whether there is an edge from `before` to `after`.
    #[must_use]
    pub fn has_edge(&self, before: usize, after: usize) -> bool {
        bit(self.row(before), after)
    }

    /// Works on the values until they are all there or the budget is spent; says whether they
    /// are there. Work already done is kept until a node or an edge is added.
    pub fn advance(&mut self, budget: &mut Budget) -> bool {
        if self.solved {
            return true;
        }
        if self.order.is_empty() && self.unvalued == 0 {
            self.sort();
            self.find_cycle();
            budget.spend(self.order.len() as u64);
        }
        while self.unvalued > 0 {
            if budget.is_spent() {
                return false;
            }
            self.unvalued -= 1;
            let edges = self.evaluate(self.order[self.unvalued] as usize);
            budget.spend(1 + edges / EDGES_PER_UNIT);
        }
        self.solved = true;
        true
    }

    /// The value of a task: out-degree plus the values of its successors (rule 14). Zero for
    /// the unselectable (rule 15).
    #[must_use]
    pub fn priority(&self, task: usize) -> &Priority {
        &self.values[task]
    }

    /// Whether some unfinished task has to be completed first (rule 13).
    #[must_use]
    pub fn is_blocked(&self, task: usize) -> bool {
        self.indegree[task] > 0
    }

    /// Whether the task lies on or behind a cycle (rule 15).
    #[must_use]
    pub fn is_unselectable(&self, task: usize) -> bool {
        self.is_node(task) && !bit(&self.ordered, task)
    }

    /// One cycle, each task before the next and the last before the first; empty if there is
    /// none.
    #[must_use]
    pub fn cycle(&self) -> &[usize] {
        &self.cycle
    }

    fn reopen(&mut self) {
        self.order.clear();
        self.unvalued = 0;
        self.solved = false;
        self.cycle.clear();
    }

    fn row(&self, task: usize) -> &[u64] {
        &self.edges[task * self.words..(task + 1) * self.words]
    }

    /// Orders the nodes so that edges point forward, lowest task first among equals.
    fn sort(&mut self) {
        self.indegree.fill(0);
        self.values.fill(Priority::ZERO);
        self.ordered.fill(0);
        for task in 0..self.tasks {
            let row = task * self.words..(task + 1) * self.words;
            for after in bits(&self.edges[row]) {
                self.indegree[after] += 1;
            }
        }
        // `indegree` stays as it is, for `is_blocked`; `visited` counts down.
        self.visited.copy_from_slice(&self.indegree);
        for task in bits(&self.nodes) {
            if self.indegree[task] == 0 {
                self.order.push(id(task));
            }
        }
        let mut next = 0;
        while let Some(&task) = self.order.get(next) {
            next += 1;
            let task = task as usize;
            self.ordered[task / 64] |= 1 << (task % 64);
            let row = task * self.words..(task + 1) * self.words;
            for after in bits(&self.edges[row]) {
                self.visited[after] -= 1;
                if self.visited[after] == 0 {
                    self.order.push(id(after));
                }
            }
        }
        self.unvalued = self.order.len();
    }

    /// Walks back from the lowest unselectable task, always to the lowest unselectable task
    /// before it: each has one, so the walk closes.
    fn find_cycle(&mut self) {
        let Some(mut task) = bits(&self.nodes).find(|&task| !bit(&self.ordered, task)) else {
            return;
        };
        self.visited.fill(0);
        let mut length = 0;
        while self.visited[task] == 0 {
            length += 1;
            self.visited[task] = length;
            self.cycle.push(task);
            let before = bits(&self.nodes)
                .find(|&before| !bit(&self.ordered, before) && self.has_edge(before, task));
            debug_assert!(
                before.is_some(),
                "a node without edges into it was not ordered"
            );
            task = before.unwrap_or(task);
        }
        // The walk began behind the cycle: keep the cycle alone, in the direction of its edges,
        // lowest task first.
        let start = self.visited[task] as usize - 1;
        self.cycle.drain(..start);
        self.cycle.reverse();
        let lowest = (0..self.cycle.len()).min_by_key(|&i| self.cycle[i]);
        self.cycle.rotate_left(lowest.unwrap_or(0));
    }

    /// Sums up one task's value; its successors have theirs. Says how many edges it took.
    fn evaluate(&mut self, task: usize) -> u64 {
        let row = task * self.words..(task + 1) * self.words;
        let mut edges = 0_u64;
        let mut value = Priority::ZERO;
        for after in bits(&self.edges[row]) {
            edges += 1;
            value = value.wrapping_add(self.values[after]);
        }
        self.values[task] = value.wrapping_add(Priority::from(edges));
        edges
    }
}

fn bit(words: &[u64], index: usize) -> bool {
    words[index / 64] >> (index % 64) & 1 == 1
}

/// The indices of the bits set, ascending.
fn bits(words: &[u64]) -> impl Iterator<Item = usize> + '_ {
    words.iter().enumerate().flat_map(|(i, &word)| {
        std::iter::successors(Some(word), |w| Some(w & w.wrapping_sub(1)))
            .take_while(|w| *w != 0)
            .map(move |w| i * 64 + w.trailing_zeros() as usize)
    })
}

fn id(task: usize) -> u32 {
    u32::try_from(task).unwrap_or(u32::MAX)
}
