//! Making a failing trial small.
//!
//! Responsible for: leaving out faults as long as what is left fails in the same way (delta
//! debugging). Not responsible for: fewer robots and objects (the caller tries those).
//!
//! Source: Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input, 2002.

/// The smallest part of `all` that was found for which `fails` still holds. Leaving out any one
/// of what is left lets it pass, unless `tries` ran out before.
pub fn shrink<T: Clone>(
    all: &[T],
    mut tries: usize,
    mut fails: impl FnMut(&[T]) -> bool,
) -> Vec<T> {
    let mut left = all.to_vec();
    let mut parts = 2;
    while left.len() > 1 && tries > 0 {
        let size = left.len().div_ceil(parts);
        let mut shorter = None;
        for start in (0..left.len()).step_by(size) {
            if tries == 0 {
                break;
            }
            tries -= 1;
            let end = (start + size).min(left.len());
            let rest = [&left[..start], &left[end..]].concat();
            if fails(&rest) {
                shorter = Some(rest);
                break;
            }
        }
        match shorter {
            Some(rest) => {
                left = rest;
                parts = (parts - 1).max(2);
            }
            None if size == 1 => break,
            None => parts = (2 * parts).min(left.len()),
        }
    }
    if left.len() == 1 && tries > 0 && fails(&[]) {
        left.clear();
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_matter_is_left_out() {
        let all: Vec<u32> = (0..100).collect();
        let mut tried = 0;
        let left = shrink(&all, 1_000, |part| {
            tried += 1;
            part.contains(&7) && part.contains(&61) && part.contains(&62)
        });
        assert_eq!(left, [7, 61, 62]);
        assert!(tried < 200, "{tried}");
        assert_eq!(shrink(&all, 1_000, |_| true), [0_u32; 0]);
        assert_eq!(shrink(&all, 3, |part| part.contains(&7)).len(), 50);
    }
}
