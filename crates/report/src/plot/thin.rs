//! Thins polylines to the resolution of the figure.

type Place = (i32, i32);

/// The column, in units of the figure, that contains a place.
fn column(place: Place) -> i32 {
    place.0.div_euclid(10)
}

/// Keeps the visible points: of each column the first, the lowest, the highest and the last.
pub(super) fn thin(points: &[Place]) -> Vec<Place> {
    let mut kept = Vec::new();
    for points in points.chunk_by(|a, b| column(*a) == column(*b)) {
        let by_y = |i: &usize| points[*i].1;
        let (lowest, highest) = ((0..points.len()).min_by_key(by_y), (0..points.len()).max_by_key(by_y));
        let mut shown = [0, lowest.unwrap_or(0), highest.unwrap_or(0), points.len() - 1].to_vec();
        shown.sort_unstable();
        shown.dedup();
        kept.extend(shown.into_iter().map(|i| points[i]));
    }
    kept
}

/// One edge of a band: of each column the outermost point, chosen by `outer` in y; the two end points are kept.
pub(super) fn envelope(points: &[Place], outer: impl Fn(i32, i32) -> i32) -> Vec<Place> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Vec::new();
    };
    let mut kept = vec![*first];
    for points in points[1..].chunk_by(|a, b| column(*a) == column(*b)) {
        kept.push((
            points[0].0,
            points.iter().map(|point| point.1).fold(points[0].1, &outer),
        ));
    }
    if kept.last().is_some_and(|end| end.0 < last.0) {
        kept.push(*last);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_and_ends_stay() {
        let n = 100_000;
        let mut points: Vec<Place> = (0..n).map(|i| (i * 8 / 100, i * 7919 % 101)).collect();
        points[31_007].1 = -50;
        points[77_777].1 = 500;
        let kept = thin(&points);
        assert!(kept.len() <= 3200 && kept.len() > 1600, "{}", kept.len());
        for point in [0, 31_007, 77_777, n as usize - 1] {
            assert!(kept.contains(&points[point]));
        }
        assert!(kept.is_sorted_by_key(|point| point.0));
        let short = [(0, 1), (50, 2), (55, 1), (56, 7), (90, 0)];
        assert_eq!(thin(&short), short);
        assert!(thin(&[]).is_empty());
    }

    #[test]
    fn the_edge_of_a_band_encloses_every_point() {
        let points: Vec<Place> = (0..5000).map(|i| (i / 10, i * 31 % 97)).collect();
        let kept = envelope(&points, i32::max);
        assert!(kept.len() < 60);
        assert_eq!((kept[0], kept[kept.len() - 1].0), (points[0], 499));
        for place in 1..49 {
            let high = kept.iter().find(|point| column(**point) == place);
            assert_eq!(high.unwrap().1, 96);
        }
        assert_eq!(envelope(&[(1, 2)], i32::max), [(1, 2)]);
    }
}
