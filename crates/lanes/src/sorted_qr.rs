//! Least squares with rows of widely different size, for one trial alone. This is the sorted QR of
//! [`asobench_identification::estimator`] in separate arithmetic, so that its bits do not depend on faer's choice of
//! instructions.

use asobench_identification::estimator::FailureKind;

/// Solves `argmin || rows x - rhs ||` by Householder QR with column pivoting, rows in descending order of size.
pub(super) fn solve<const N: usize>(n: usize, rows: &mut [([f64; N], f64)]) -> Result<[f64; N], FailureKind> {
    let finite = |(row, rhs): &([f64; N], f64)| rhs.is_finite() && row[..n].iter().all(|x| x.is_finite());
    if !rows.iter().all(finite) {
        return Err(FailureKind::NonFinite);
    }
    let size = |row: &[f64; N]| row[..n].iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    // Rows of equal size are ordered by their entries, because a stable sort would allocate.
    rows.sort_unstable_by(|(left, x), (right, y)| {
        let by_entries = || {
            let mut entries = right.iter().zip(left).map(|(y, x)| y.total_cmp(x));
            entries.find(|order| order.is_ne())
        };
        let by_size = size(right).total_cmp(&size(left));
        by_size.then_with(|| by_entries().unwrap_or_else(|| y.total_cmp(x)))
    });
    asobench_identification::signal::arithmetic::with_fma(
        #[inline(always)]
        || factorise(n, rows),
    )
}

#[inline(always)]
fn factorise<const N: usize>(n: usize, rows: &mut [([f64; N], f64)]) -> Result<[f64; N], FailureKind> {
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    // Columns are scaled by their largest entries if their squares would overflow.
    let mut diagonal = [0.0; N];
    for k in 0..n {
        let mut norms = [0.0; N];
        for (column, norm) in norms.iter_mut().enumerate().take(n).skip(k) {
            *norm = norm2(rows[k..].iter().map(|(row, _)| row[column]));
        }
        let pivot = (k..n).fold(k, |best, j| if norms[j] > norms[best] { j } else { best });
        if pivot != k {
            order.swap(k, pivot);
            for (row, _) in rows.iter_mut() {
                row.swap(k, pivot);
            }
        }
        let norm = norms[pivot];
        if norm == 0.0 {
            return Err(FailureKind::RankDeficient);
        }
        if !norm.is_finite() {
            return Err(FailureKind::NonFinite);
        }
        // v = x + sign(x_1) |x| e_1, scaled by |x|: |v|^2 / 2 = 1 + |x_1| / |x|.
        let first = rows[k].0[k];
        let sign = 1.0_f64.copysign(first);
        diagonal[k] = -sign * norm;
        let scale = 1.0 / norm;
        for (row, _) in &mut rows[k..] {
            row[k] *= scale;
        }
        rows[k].0[k] += sign;
        let half_square = rows[k].0[k].abs();
        for column in k + 1..=n {
            let entry = |(row, rhs): &([f64; N], f64)| if column < n { row[column] } else { *rhs };
            let product = rows[k..].iter().fold(0.0, |sum, row| row.0[k].mul_add(entry(row), sum));
            let factor = product / half_square;
            for (row, rhs) in &mut rows[k..] {
                let v = row[k];
                let target = if column < n { &mut row[column] } else { rhs };
                *target = (-factor).mul_add(v, *target);
            }
        }
    }
    let mut x = [0.0; N];
    let mut solution = [0.0; N];
    for i in (0..n).rev() {
        let mut sum = rows[i].1;
        for j in i + 1..n {
            sum = (-rows[i].0[j]).mul_add(solution[j], sum);
        }
        solution[i] = sum / diagonal[i];
        x[order[i]] = solution[i];
    }
    if x.iter().all(|x| x.is_finite()) {
        Ok(x)
    } else {
        Err(FailureKind::NonFinite)
    }
}

/// Returns the Euclidean norm, avoiding needless overflow.
#[inline(always)]
fn norm2(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = x.clone().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    let sum = x.fold(0.0, |sum, x| {
        let scaled = x / largest;
        scaled.mul_add(scaled, sum)
    });
    largest * sum.sqrt()
}
