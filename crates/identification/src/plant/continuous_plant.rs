//! Continuous-time plants in any coordinates.

use faer::{Mat, MatRef};

use super::balance::Equilibrated;
use super::observability::observability_rank;

/// The plant `x' = A x + B u`, `y = C'x + delta` with one input and one output. A is n x n, B and C have length n, and
/// (A, C) is observable.
#[derive(Clone, Debug, PartialEq)]
pub struct ContinuousPlant {
    a: Mat<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

/// Why matrices do not form a plant, or cannot transform one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct ContinuousPlantError(String);

impl ContinuousPlant {
    /// Makes the plant from the rows `a` of A, and from B and C.
    ///
    /// # Errors
    /// If the shapes do not fit, an entry is not finite, or (A, C) is unobservable in the sense of
    /// [`observability_rank`].
    pub fn new(a: &[Vec<f64>], b: Vec<f64>, c: Vec<f64>) -> Result<Self, ContinuousPlantError> {
        let n = a.len();
        let wrong = (1..).zip(a).find(|(_, row)| row.len() != n);
        if let Some((row, length)) = wrong.map(|(row, of)| (row, of.len())).or((n == 0).then_some((0, 0))) {
            return Err(ContinuousPlantError(format!(
                "A must be n x n with n >= 1: row {row} of {n} has {length} entries"
            )));
        }
        Self::from_matrix(Mat::from_fn(n, n, |i, j| a[i][j]), b, c)
    }

    fn from_matrix(a: Mat<f64>, b: Vec<f64>, c: Vec<f64>) -> Result<Self, ContinuousPlantError> {
        let order = a.nrows();
        let not_finite = |what: &str| ContinuousPlantError(format!("{what} must hold finite numbers"));
        for (what, vector) in [("B", &b), ("C", &c)] {
            if vector.len() != order {
                return Err(ContinuousPlantError(format!(
                    "{what} must have {order} entries, one per row of A, not {}",
                    vector.len()
                )));
            }
            if !vector.iter().all(|v| v.is_finite()) {
                return Err(not_finite(what));
            }
        }
        if !a.is_all_finite() {
            return Err(not_finite("A"));
        }
        let rank = observability_rank(a.as_ref(), &c);
        if rank < order {
            return Err(ContinuousPlantError(format!(
                "the state cannot be observed: the observability matrix of (A, C) has rank {rank}, and the order is \
                 {order}"
            )));
        }
        Ok(Self { a, b, c })
    }

    /// Returns the example of Bobtsov et al. 2023, an undamped oscillator at 3 rad/s: `A = [0 1; -9 0]`, `B = (0, 1)`,
    /// `C = (5, 0)`.
    pub fn bobtsov2023() -> Self {
        Self {
            a: faer::mat![[0.0, 1.0], [-9.0, 0.0]],
            b: vec![0.0, 1.0],
            c: vec![5.0, 0.0],
        }
    }

    /// Returns the order n.
    pub fn order(&self) -> usize {
        self.b.len()
    }

    /// Returns A, n x n.
    pub fn a(&self) -> MatRef<'_, f64> {
        self.a.as_ref()
    }

    /// Returns B, of length n.
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// Returns C, of length n.
    pub fn c(&self) -> &[f64] {
        &self.c
    }

    /// Returns the same plant in the coordinates `T x`: `(T A T^-1, T B, T^-T C)`, T n x n.
    ///
    /// # Errors
    /// If T is not n x n or singular to working precision, in units of its own rows and columns.
    pub fn transformed(&self, t: MatRef<'_, f64>) -> Result<Self, ContinuousPlantError> {
        let order = self.order();
        let refusal = ContinuousPlantError(format!(
            "a change of coordinates needs a nonsingular {order} x {order} matrix"
        ));
        if t.nrows() != order || t.ncols() != order || !t.is_all_finite() {
            return Err(refusal);
        }
        let lu = Equilibrated::new(t);
        if !(lu.condition() < 1.0 / f64::EPSILON) {
            return Err(refusal);
        }
        let inverse = lu.solve(Mat::<f64>::identity(order, order).as_ref());
        let multiply =
            |m: MatRef<'_, f64>, v: &[f64]| (0..order).map(|i| (0..order).map(|j| m[(i, j)] * v[j]).sum()).collect();
        Self::from_matrix(
            t * &self.a * &inverse,
            multiply(t, &self.b),
            multiply(inverse.transpose(), &self.c),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    #[test]
    fn the_example_is_a_plant() {
        let a = [vec![0.0, 1.0], vec![-9.0, 0.0]];
        let plant = ContinuousPlant::new(&a, vec![0.0, 1.0], vec![5.0, 0.0]).unwrap();
        assert_eq!(plant, ContinuousPlant::bobtsov2023());
        assert_eq!(plant.order(), 2);
    }

    #[test]
    fn refusals() {
        let refused = |a: &[Vec<f64>], b: &[f64], c: &[f64], part: &str| {
            let refusal = ContinuousPlant::new(a, b.to_vec(), c.to_vec()).unwrap_err().to_string();
            assert!(refusal.contains(part), "{refusal}");
        };
        refused(&[], &[], &[], "row 0 of 0 has 0 entries");
        refused(
            &[vec![1.0, 2.0], vec![3.0]],
            &[1.0; 2],
            &[1.0; 2],
            "row 2 of 2 has 1 entries",
        );
        refused(
            &[vec![1.0]],
            &[1.0; 2],
            &[1.0],
            "B must have 1 entries, one per row of A, not 2",
        );
        refused(&[vec![f64::NAN]], &[1.0], &[1.0], "A must hold finite numbers");
        refused(&[vec![1.0]], &[1.0], &[0.0], "has rank 0, and the order is 1");
    }

    /// A chain of integrators in units that differ by 1e20 is observable.
    #[test]
    fn units_do_not_matter() {
        let a = [vec![0.0, 1e-10, 0.0], vec![0.0, 0.0, 1e10], vec![0.0; 3]];
        assert!(ContinuousPlant::new(&a, vec![0.0; 3], vec![1e-200, 0.0, 0.0]).is_ok());
        let a = [vec![0.0, 1.0], vec![-1e20, 0.0]];
        assert!(ContinuousPlant::new(&a, vec![0.0; 2], vec![1.0, 0.0]).is_ok());
    }

    /// T and then T^-1 change nothing; C'A^k B does not depend on the coordinates.
    #[test]
    fn transformation_keeps_markov_parameters() {
        let plant = ContinuousPlant::bobtsov2023();
        let t = mat![[2.0, 1.0], [-1.0, 3.0]];
        let other = plant.transformed(t.as_ref()).unwrap();
        let markov = |p: &ContinuousPlant| {
            let (mut v, mut out) = (p.b().to_vec(), vec![]);
            for _ in 0..4 {
                out.push(p.c().iter().zip(&v).map(|(c, v)| c * v).sum::<f64>());
                v = (0..2).map(|i| (0..2).map(|j| p.a()[(i, j)] * v[j]).sum()).collect();
            }
            out
        };
        for (p, q) in markov(&plant).iter().zip(markov(&other)) {
            assert!((p - q).abs() < 1e-12);
        }
        assert!(plant.transformed(mat![[1.0, 2.0], [2.0, 4.0]].as_ref()).is_err());
        assert!(plant.transformed(mat![[1.0]].as_ref()).is_err());
    }
}
