//! Thinning of polylines to the resolution of the figure.

/// The points that show: of those in one column of pixels the first, the lowest, the highest and the last.
pub(super) fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    let mut start = 0;
    while start < points.len() {
        let column = points[start].0.floor();
        let more = points[start..].iter();
        let end = start + more.take_while(|point| point.0.floor() == column).count();
        // A point that is not finite equals no column.
        let end = end.max(start + 1);
        keep(&points[start..end], &mut kept);
        start = end;
    }
    kept
}

fn keep(column: &[(f64, f64)], kept: &mut Vec<(f64, f64)>) {
    let by_y = |a: &usize, b: &usize| column[*a].1.total_cmp(&column[*b].1);
    let lowest = (0..column.len()).min_by(by_y).unwrap_or(0);
    let highest = (0..column.len()).max_by(by_y).unwrap_or(0);
    let mut shown = [0, lowest, highest, column.len() - 1];
    shown.sort_unstable();
    for (i, index) in shown.iter().enumerate() {
        if i == 0 || shown[i - 1] != *index {
            kept.push(column[*index]);
        }
    }
}

/// One edge of a band: of the points in one column of pixels the outermost, that is the one that `outer` prefers in
/// y; both ends stay.
pub(super) fn envelope(
    points: impl Iterator<Item = (f64, f64)>,
    outer: impl Fn(f64, f64) -> f64,
) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut last = None;
    for (i, point) in points.enumerate() {
        last = Some(point);
        match kept.last_mut() {
            // The first point stays as it is.
            Some(kept) if i > 1 && kept.0.floor() == point.0.floor() => {
                kept.1 = outer(kept.1, point.1);
            }
            _ => kept.push(point),
        }
    }
    let end = last.filter(|end| kept.last().is_some_and(|kept| kept.0 < end.0));
    kept.extend(end);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_and_ends_stay() {
        let n = 100_000;
        let mut points: Vec<(f64, f64)> = (0..n)
            .map(|i| {
                (
                    f64::from(i) * 800.0 / f64::from(n),
                    f64::from(i * 7919 % 101),
                )
            })
            .collect();
        points[31_007].1 = -50.0;
        points[77_777].1 = 500.0;
        let kept = thin(&points);
        assert!(kept.len() <= 3200 && kept.len() > 1600, "{}", kept.len());
        for point in [0, 31_007, 77_777, n as usize - 1] {
            assert!(kept.contains(&points[point]));
        }
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn the_edge_of_a_band_encloses_every_point() {
        let x = |i: i32| f64::from(i) * 0.01;
        let points: Vec<(f64, f64)> = (0..5000).map(|i| (x(i), f64::from(i * 31 % 97))).collect();
        let kept = envelope(points.iter().copied(), f64::max);
        assert!(kept.len() < 60);
        assert_eq!((kept[0].0, kept[kept.len() - 1].0), (x(0), x(4999)));
        for column in 1..49 {
            let high = kept
                .iter()
                .find(|point| point.0.floor() == f64::from(column));
            assert_eq!(high.unwrap().1, 96.0);
        }
        let one = [(1.0, 2.0)];
        assert_eq!(envelope(one.into_iter(), f64::max), one);
    }

    #[test]
    fn a_short_line_is_kept_whole() {
        let points = [(0.0, 1.0), (5.0, 2.0), (5.5, 1.0), (5.6, 7.0), (9.0, 0.0)];
        assert_eq!(thin(&points), points);
        assert!(thin(&[]).is_empty());
        assert_eq!(thin(&[(f64::NAN, 1.0)]).len(), 1);
    }
}
