//! Trials of one cell in packs: the rows are as from [`super::trial::Trial`].

use crate::design::{CURVE_TRIALS, Measure, Plan};
use crate::outcome::curves::Waiting;
use crate::outcome::rows::Flags;
use crate::outcome::spent::Watch;
use crate::outcome::trials::Trials;
use asobench_identification::real::MOST_LANES;
use asobench_lanes::Isa;
use asobench_lanes::pack::{Lanes, Measured, Pack};
use std::ops::Range;

/// Buffers to run trials of one cell, a pack at a time.
pub struct PackTrial<'e> {
    pack: Box<dyn Pack + 'e>,
    /// e_x(k) of the first and the last output.
    curves: [Waiting; 2],
    /// e_x(k) of a pack.
    errors: Vec<Lanes>,
}

impl<'e> Plan<'e> {
    /// Makes the buffers to run trials.
    ///
    /// # Panics
    /// If this machine does not have the instructions.
    pub fn pack(self, isa: Isa) -> PackTrial<'e> {
        let curve = if self.0.wanted.curves { self.0.horizon } else { 0 };
        PackTrial {
            pack: self.0.pack(isa),
            curves: [(); 2].map(|()| Waiting::new(curve)),
            errors: Vec::new(),
        }
    }

    /// Draws, estimates and measures the first pack of trials, to time its kernels.
    ///
    /// # Panics
    /// If this machine does not have the instructions.
    pub fn first_pack(self, isa: Isa) -> Box<dyn Pack + 'e> {
        let mut pack = self.0.pack(isa);
        pack.draw(0..pack.lanes() as u64);
        pack.estimate();
        pack.measure();
        pack
    }
}

impl PackTrial<'_> {
    /// Returns the number of trials in a pack.
    pub fn lanes(&self) -> usize {
        self.pack.lanes()
    }

    /// Runs trials and appends the requested results.
    pub fn run_into(&mut self, trials: Range<u64>, to: &mut Trials) {
        let mut from = trials.start;
        while from < trials.end {
            let end = trials.end.min(from + self.lanes() as u64);
            self.run_pack(from..end, to);
            from = end;
        }
        self.count_curves(to);
    }

    /// Runs up to a pack of trials.
    fn run_pack(&mut self, trials: Range<u64>, to: &mut Trials) {
        let count = (trials.end - trials.start) as usize;
        let mut watch = Watch::start();
        self.pack.draw(trials.clone());
        to.spent.simulation += watch.lap();
        to.fallbacks += self.pack.estimate();
        to.spent.estimation += watch.lap();
        self.pack.measure();
        self.emit(trials.start, count, to);
        to.spent.measures += watch.lap();
        if to.curves.is_some() && trials.start < CURVE_TRIALS {
            let counted = count.min((CURVE_TRIALS - trials.start) as usize);
            let measured = self.pack.measured();
            let ends = [&measured[0], &measured[measured.len() - 1]];
            for (last, (waiting, output)) in [false, true].into_iter().zip(self.curves.iter_mut().zip(ends)) {
                self.pack.state_errors(last, &mut self.errors);
                let asked = ((1_u16 << counted) - 1) as u8;
                waiting.add(&self.errors, self.pack.lanes(), output.observed & asked);
            }
            if self.curves[0].is_full() {
                self.count_curves(to);
            }
            to.spent.statistics += watch.lap();
        }
    }

    /// Counts the waiting errors.
    fn count_curves(&mut self, to: &mut Trials) {
        if let Some(curves) = &mut to.curves {
            for (last, waiting) in [false, true].into_iter().zip(&mut self.curves) {
                curves.add_waiting(last, waiting);
            }
        }
    }

    /// Appends the rows of a pack.
    fn emit(&self, first: u64, count: usize, to: &mut Trials) {
        let (kept, outputs) = to.rows.next(first);
        for (output, rows) in self.pack.measured().iter().zip(outputs) {
            for lane in 0..count {
                let has = |bits: u8| bits >> lane & 1 == 1;
                let unstable = has(output.known).then(|| has(output.unstable));
                let flags = Flags::new(unstable, has(output.unstable_so_far));
                rows.push(flags, output.failures[lane]);
            }
            let [values, parameters] = rows.columns();
            for (column, &measure) in values.iter_mut().zip(kept) {
                column.extend_from_slice(&value(output, measure)[..count]);
            }
            for (column, errors) in parameters.iter_mut().zip(&output.coefficients) {
                column.extend_from_slice(&errors[..count]);
            }
        }
    }
}

/// Returns a measure of an output; NaN for those that lanes do not compute.
fn value(of: &Measured, measure: Measure) -> &Lanes {
    const NONE: Lanes = [f64::NAN; MOST_LANES];
    let errors = &of.errors;
    match measure {
        Measure::Ea => &errors.relative[0],
        Measure::Eb => &errors.relative[1],
        Measure::Eh => &errors.relative[2],
        Measure::Ex0 => &errors.relative[3],
        Measure::EaPrinted => &errors.as_printed[0],
        Measure::EbPrinted => &errors.as_printed[1],
        Measure::EhPrinted => &errors.as_printed[2],
        Measure::Ex0Printed => &errors.as_printed[3],
        Measure::ExMax => &errors.state[0],
        Measure::ExRms => &errors.state[1],
        Measure::ExMaxPrinted => &errors.state_as_printed[0],
        Measure::ExRmsPrinted => &errors.state_as_printed[1],
        Measure::RmsState => &errors.state_absolute,
        Measure::ImpulseResponse => &of.impulse_response,
        Measure::FreshFit => &of.fresh_fit,
        Measure::Condition => &of.condition,
        Measure::SpectralRadius => &of.radius,
        Measure::Change => &of.change,
        _ => &NONE,
    }
}
