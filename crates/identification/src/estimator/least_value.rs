//! The least value of a function of one number.

/// The accuracy of a minimiser: the value is flat to rounding there.
const REST: f64 = 1e-7;

/// The most steps of a search between two points.
const MOST_STEPS: usize = 80;

/// Returns the least value of a function on an ascending grid, and then between the neighbours of the least: by
/// parabolas and golden sections (R. P. Brent, *Algorithms for Minimization without Derivatives*, 1973, chapter 5).
pub(super) fn least(grid: impl Iterator<Item = f64>, mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    let points: Vec<(f64, f64)> = grid.map(|x| (x, f(x))).collect();
    let lowest = (0..points.len()).min_by(|a, b| points[*a].1.total_cmp(&points[*b].1));
    let i = lowest.unwrap_or(0);
    let low = points[i.saturating_sub(1)].0;
    let high = points[(i + 1).min(points.len() - 1)].0;
    brent(low, points[i], high, f)
}

fn brent(mut low: f64, start: (f64, f64), mut high: f64, mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    let golden = (3.0 - 5.0_f64.sqrt()) / 2.0;
    // The least point, the second and the third.
    let (mut x, mut w, mut v) = (start, start, start);
    let (mut step, mut before) = (0.0_f64, 0.0_f64);
    for _ in 0..MOST_STEPS {
        let middle = f64::midpoint(low, high);
        if (x.0 - middle).abs() <= 2.0 * REST - (high - low) / 2.0 {
            break;
        }
        let r = (x.0 - w.0) * (x.1 - v.1);
        let q = (x.0 - v.0) * (x.1 - w.1);
        let p = (x.0 - v.0) * q - (x.0 - w.0) * r;
        let q = 2.0 * (q - r);
        let (p, q) = if q > 0.0 { (-p, q) } else { (p, -q) };
        let parabola = p.abs() < (q * before / 2.0).abs() && p > q * (low - x.0) && p < q * (high - x.0);
        if parabola {
            (before, step) = (step, p / q);
        } else {
            before = if x.0 < middle { high - x.0 } else { low - x.0 };
            step = golden * before;
        }
        let taken = if step.abs() >= REST { step } else { REST.copysign(step) };
        let u = x.0 + taken;
        let u = (u, f(u));
        if u.1 <= x.1 {
            if u.0 < x.0 {
                high = x.0;
            } else {
                low = x.0;
            }
            (v, w, x) = (w, x, u);
        } else {
            if u.0 < x.0 {
                low = u.0;
            } else {
                high = u.0;
            }
            if u.1 <= w.1 || w.0 == x.0 {
                (v, w) = (w, u);
            } else if u.1 <= v.1 || v.0 == x.0 || v.0 == w.0 {
                v = u;
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::least;

    #[test]
    fn minima_by_hand() {
        let grid = || (0..10).map(f64::from);
        let (x, value) = least(grid(), |x| (x - 3.3).powi(4) + 2.0);
        // A minimum of fourth order is flat.
        assert!((x - 3.3).abs() < 1e-3 && (value - 2.0).abs() < 1e-12);
        let (x, _) = least(grid(), |x| (x - 6.7).powi(2));
        assert!((x - 6.7).abs() < 1e-6, "{x}");
        // At an end.
        let (x, _) = least(grid(), |x| x);
        assert!(x < 1e-6, "{x}");
    }
}
