//! Chooses blocks that together make up the trials of a cell.

use std::ops::Range;

/// Returns ranges without overlap that together have the most trials; among such choices, the one with the fewest
/// ranges. They ascend. A block can only be taken whole, because it holds the tally of all its trials.
pub(crate) fn cover<T>(mut found: Vec<T>, range: impl Fn(&T) -> &Range<u64>) -> Vec<T> {
    found.sort_by_key(|block| (range(block).end, range(block).start));
    // For the first i ranges: the most trials, and the smallest number of ranges that have them.
    let mut best: Vec<(u64, std::cmp::Reverse<usize>)> = vec![(0, std::cmp::Reverse(0))];
    let mut before = Vec::with_capacity(found.len());
    for (i, block) in found.iter().enumerate() {
        let Range { start, end } = *range(block);
        let earlier = found[..i].partition_point(|other| range(other).end <= start);
        let (trials, std::cmp::Reverse(count)) = best[earlier];
        let with = (trials + (end - start), std::cmp::Reverse(count + 1));
        before.push((with > best[i]).then_some(earlier));
        best.push(with.max(best[i]));
    }
    let mut taken = vec![false; found.len()];
    let mut left = found.len();
    while left > 0 {
        left -= 1;
        if let Some(earlier) = before[left] {
            taken[left] = true;
            left = earlier;
        }
    }
    let mut taken = taken.into_iter();
    found.retain(|_| taken.next().unwrap_or(false));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the most trials of any choice without overlap, by trying all choices.
    fn most(found: &[Range<u64>]) -> u64 {
        let choices = 0..1_u32 << found.len();
        let trials = |choice: u32| {
            let mut chosen: Vec<&Range<u64>> = (0..found.len())
                .filter(|i| choice >> i & 1 == 1)
                .map(|i| &found[i])
                .collect();
            chosen.sort_by_key(|range| range.start);
            let apart = chosen.windows(2).all(|two| two[0].end <= two[1].start);
            let lengths = chosen.iter().map(|range| range.end - range.start);
            if apart { lengths.sum() } else { 0 }
        };
        choices.map(trials).max().unwrap_or(0)
    }

    #[test]
    fn the_most_trials_are_covered() {
        let mut state = 7_u64;
        let mut below = |limit: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % limit
        };
        for _ in 0..500 {
            let found: Vec<Range<u64>> = (0..below(9))
                .map(|_| {
                    let start = below(20);
                    start..start + 1 + below(9)
                })
                .collect();
            let covered = cover(found.clone(), |range| range);
            assert!(
                covered.windows(2).all(|two| two[0].end <= two[1].start),
                "{found:?}: {covered:?}"
            );
            let trials: u64 = covered.iter().map(|range| range.end - range.start).sum();
            assert_eq!(trials, most(&found), "{found:?}: {covered:?}");
        }
    }

    /// A greedy choice by the first trial would leave a gap here.
    #[test]
    fn blocks_of_two_processes_are_not_mixed() {
        let found = vec![0..100, 100..200, 0..130, 130..180];
        assert_eq!(cover(found, |range| range), [0..100, 100..200]);
        let found = vec![0..100, 100..200, 0..200];
        let covered = cover(found, |range| range);
        assert_eq!(covered.len(), 1);
        assert_eq!(covered[0], 0..200);
    }
}
