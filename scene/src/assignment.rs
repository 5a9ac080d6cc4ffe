//! The least assignment: each row its own column, at the least sum (the Hungarian method).
//!
//! Responsible for: the assignment, and its sum.
//!
//! Source: Kuhn and Munkres, with the potentials and shortest augmenting paths of Jonker and
//! Volgenant; O(n³).

/// Least sum of a square matrix of `size` rows, given row by row; infinite entries are not
/// allowed to be chosen. None if no assignment avoids them.
pub fn least_assignment(size: usize, cost: impl Fn(usize, usize) -> f64) -> Option<f64> {
    let row_of = assignment(size, &cost)?;
    Some((0..size).map(|column| cost(row_of[column], column)).sum())
}

/// By column its row in a least assignment.
pub(crate) fn assignment(size: usize, cost: &impl Fn(usize, usize) -> f64) -> Option<Vec<usize>> {
    // Column `size` stands for the row that is being brought in.
    let mut row_of = vec![usize::MAX; size + 1];
    let mut row_price = vec![0.0; size];
    let mut column_price = vec![0.0; size + 1];
    for row in 0..size {
        row_of[size] = row;
        let mut least = vec![f64::INFINITY; size];
        let mut from = vec![size; size];
        let mut used = vec![false; size + 1];
        let mut column = size;
        while row_of[column] != usize::MAX {
            used[column] = true;
            let here = row_of[column];
            let mut nearest = (f64::INFINITY, size);
            for to in (0..size).filter(|&to| !used[to]) {
                let reduced = cost(here, to) - row_price[here] - column_price[to];
                if reduced < least[to] {
                    least[to] = reduced;
                    from[to] = column;
                }
                if least[to] < nearest.0 {
                    nearest = (least[to], to);
                }
            }
            let (step, to) = nearest;
            if !step.is_finite() {
                return None;
            }
            for known in (0..=size).filter(|&known| used[known]) {
                row_price[row_of[known]] += step;
                column_price[known] -= step;
            }
            for to in (0..size).filter(|&to| !used[to]) {
                least[to] -= step;
            }
            column = to;
        }
        while column != size {
            let before = from[column];
            row_of[column] = row_of[before];
            column = before;
        }
    }
    row_of.truncate(size);
    Some(row_of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute(rows: &[Vec<f64>], row: usize, taken: u32) -> f64 {
        let Some(costs) = rows.get(row) else {
            return 0.0;
        };
        (0..rows.len())
            .filter(|column| taken >> column & 1 == 0)
            .map(|column| costs[column] + brute(rows, row + 1, taken | 1 << column))
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn it_is_the_least(rows in (1_usize..6).prop_flat_map(|size| {
            let entry = prop_oneof![4 => (0_u32..50).prop_map(f64::from), 1 => Just(f64::INFINITY)];
            proptest::collection::vec(proptest::collection::vec(entry, size), size)
        })) {
            let least = brute(&rows, 0, 0);
            let found = least_assignment(rows.len(), |row, column| rows[row][column]);
            prop_assert_eq!(found, least.is_finite().then_some(least));
        }
    }
}
