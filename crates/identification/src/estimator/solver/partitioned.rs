//! Stages 3 and 10: the inverse of G by two n x n inverses.

use super::linear::Inverter;
use super::rank::{Equilibration, check_rank, maximum};
use super::{Instruments, Solution, SolveInstruments, SolveLeastSquares, Stage10};
use crate::estimator::information::Information;
use crate::estimator::{FailureKind, Window};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// Computes `p = C r` with `C = [M1 + M1 G12 M2 G21 M1, -M1 G12 M2; -M2 G21 M1, M2]`, `M1 = G11^-1` and
/// `M2 = (G22 - G21 M1 G12)^-1`.
///
/// The condition is the worst of three: of G, of G11 as a pivot of G (|G| |M1|), and of the Schur complement. All are
/// scaled by G's equilibration. There is no pivoting between the blocks. If G11 is near singular and G is not, digits
/// are lost that LU keeps. This cannot happen in least squares, but it can with instruments.
pub struct Partitioned {
    order: usize,
    stage10: Stage10,
    information: Information,
    inverter: Inverter,
    equilibration: Equilibration,
    blocks: Blocks,
    /// C, 2n x 2n.
    inverse: Mat<f64>,
}

/// The n x n matrices on the way to C.
struct Blocks {
    m1: Mat<f64>,
    m2: Mat<f64>,
    /// `M1 G12`.
    m1_g12: Mat<f64>,
    /// `G21 M1`.
    g21_m1: Mat<f64>,
    /// `M2 G21 M1`.
    m2_g21_m1: Mat<f64>,
    /// The Schur complement `G22 - G21 M1 G12`.
    schur: Mat<f64>,
}

fn multiply(out: &mut Mat<f64>, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    matmul(out, Accum::Replace, a, b, 1.0, Par::Seq);
}

impl Partitioned {
    /// Makes buffers for order n; `stage10` is the reading of E2.
    pub fn new(order: usize, stage10: Stage10) -> Self {
        let square = || Mat::zeros(order, order);
        Self {
            order,
            stage10,
            information: Information::new(order),
            inverter: Inverter::new(order),
            equilibration: Equilibration::new(2 * order, 2 * order),
            blocks: Blocks {
                m1: square(),
                m2: square(),
                m1_g12: square(),
                g21_m1: square(),
                m2_g21_m1: square(),
                schur: square(),
            },
            inverse: Mat::zeros(2 * order, 2 * order),
        }
    }

    /// Computes stage 3's C of the present G, with its condition number.
    fn invert(&mut self, condition: &mut f64) -> Result<(), FailureKind> {
        let n = self.order;
        let g = self.information.matrix();
        self.equilibration.of(g)?;
        let (g11, g12, g21, g22) = g.split_at(n, n);
        let Blocks {
            m1,
            m2,
            m1_g12,
            g21_m1,
            m2_g21_m1,
            schur,
        } = &mut self.blocks;
        self.inverter.invert(g11, m1.as_mut())?;
        multiply(m1_g12, m1.as_ref(), g12);
        multiply(g21_m1, g21, m1.as_ref());
        schur.copy_from(g22);
        matmul(schur.as_mut(), Accum::Add, g21, m1_g12.as_ref(), -1.0, Par::Seq);
        self.inverter.invert(schur.as_ref(), m2.as_mut())?;
        multiply(m2_g21_m1, m2.as_ref(), g21_m1.as_ref());

        let (mut c11, c12, mut c21, mut c22) = self.inverse.as_mut().split_at_mut(n, n);
        c11.copy_from(&*m1);
        matmul(c11, Accum::Add, m1_g12.as_ref(), m2_g21_m1.as_ref(), 1.0, Par::Seq);
        matmul(c12, Accum::Replace, m1_g12.as_ref(), m2.as_ref(), -1.0, Par::Seq);
        for j in 0..n {
            for i in 0..n {
                c21[(i, j)] = -m2_g21_m1[(i, j)];
            }
        }
        c22.copy_from(&*m2);
        let scales = &self.equilibration;
        let norm = scales.norm1(g, 0);
        let inverse_norm = maximum(
            scales.inverse_norm1(self.inverse.as_ref(), 0),
            scales.inverse_norm1(m1.as_ref(), 0),
        );
        let of_schur = scales.norm1(schur.as_ref(), n) * scales.inverse_norm1(m2.as_ref(), n);
        *condition = maximum(norm * inverse_norm, of_schur);
        check_rank(*condition, n)
    }

    /// Replaces C by stage 10 as printed, erratum E2: block rows swapped and indices wrong, with the same M1, M2.
    fn print_as(&mut self, stage10: Stage10) {
        let n = self.order;
        let (g11, g12, _, g22) = self.information.matrix().split_at(n, n);
        let (left, middle) = match stage10 {
            Stage10::Corrected => return,
            // [-M2 G22 M1, M2; M1 + M1 G11 M2 G22 M1, -M1 G11 M2]
            Stage10::AsPrinted => (g22, g11),
            // [-M2 G22 M1, M2; M1 + M1 G12 M2 G11 M1, -M1 G12 M2]
            Stage10::AsPrinted2024 => (g11, g12),
        };
        let (m1, m2) = (&self.blocks.m1, &self.blocks.m2);
        let m1_middle_m2 = m1 * middle * m2;
        let (mut c11, mut c12, mut c21, mut c22) = self.inverse.as_mut().split_at_mut(n, n);
        c11.copy_from(-(m2 * g22 * m1));
        c12.copy_from(m2);
        c21.copy_from(m1 + &m1_middle_m2 * left * m1);
        c22.copy_from(-m1_middle_m2);
    }

    /// Computes `p = C r`.
    fn multiply_rhs(&self, p: &mut [f64]) {
        p.fill(0.0);
        for (j, r) in self.information.rhs().iter().enumerate() {
            for (p, c) in p.iter_mut().zip(self.inverse.col_as_slice(j)) {
                *p += c * r;
            }
        }
    }
}

impl SolveLeastSquares for Partitioned {
    fn least_squares(&mut self, window: Window<'_>, solution: &mut Solution) -> Result<(), FailureKind> {
        self.information.least_squares(window);
        self.invert(&mut solution.condition)?;
        self.multiply_rhs(&mut solution.p);
        Ok(())
    }
}

impl SolveInstruments for Partitioned {
    fn instruments(
        &mut self,
        window: Window<'_>,
        instruments: Instruments<'_>,
        solution: &mut Solution,
    ) -> Result<(), FailureKind> {
        self.information.instruments(window, instruments);
        self.invert(&mut solution.condition)?;
        self.print_as(self.stage10);
        self.multiply_rhs(&mut solution.p);
        Ok(())
    }

    /// The inverse is not needed.
    fn begin(&mut self, window: Window<'_>, _: &mut Solution) {
        self.information.least_squares(window);
    }
}
