//! The data matrices of stages 1 and 8, row by row.
//!
//! The rows of Phi are `phi(k) = (-y(k-1) ... -y(k-n), u(k-1) ... u(k-n))` for k = n ... N-1. The instruments Z have
//! yhat instead of y. The two halves of stage 1 are stacked into these rows, so sums over the halves are sums over all
//! rows.

use faer::MatMut;

/// Writes rows `first`, `first + 1`, ... of the data matrix (`N - n` rows, 2n columns) into `block`.
///
/// `output` is y for the regressors (stage 1) and yhat for the instruments (stage 8). `input` is u, or for instruments
/// the signal from which they are formed.
///
/// # Panics
/// If `block` does not have 2n columns or reaches beyond the last row, or the signals differ in length.
pub fn fill_rows(output: &[f64], input: &[f64], order: usize, first: usize, mut block: MatMut<'_, f64>) {
    let rows = block.nrows();
    assert!(output.len() == input.len());
    assert!(block.ncols() == 2 * order && first + rows + order <= output.len());
    for i in 0..order {
        // Row r is k = n + first + r; column i holds lag i + 1.
        let from = order + first - 1 - i;
        let mut outputs = block.rb_mut().col_mut(i);
        for (row, output) in output[from..from + rows].iter().enumerate() {
            outputs[row] = -output;
        }
        let mut inputs = block.rb_mut().col_mut(order + i);
        for (row, input) in input[from..from + rows].iter().enumerate() {
            inputs[row] = *input;
        }
    }
}

use faer::reborrow::ReborrowMut;
