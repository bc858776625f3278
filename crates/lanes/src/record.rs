//! Records of trials in lock step: the bits of [`asobench_identification::data::Process::realise`].

use super::{order, splat};
use asobench_identification::data::ProcessSettings;
use asobench_identification::plant::StateSpace;
use asobench_identification::plant::inlined::simulate;
use asobench_identification::real::{MOST_LANES, Real, Word};
use asobench_identification::signal::noise::{DRAW_PAIRS, Draw};
use asobench_identification::signal::normal::{radius_square, turn};
use asobench_identification::signal::{Input, NoiseFilter, ProcessVariances, Purpose, RandomSigns, state_of};

/// The generator xoshiro256++, with a stream in each lane.
#[derive(Clone, Copy)]
pub(super) struct Streams<R: Real>([R::Word; 4]);

impl<R: Real> Streams<R> {
    pub(super) fn new(seed: u64, trials: &[u64; MOST_LANES], purpose: Purpose) -> Self {
        Self(R::run(
            #[inline(always)]
            || state_of(seed, R::Word::load(trials), purpose),
        ))
    }

    #[inline(always)]
    fn next(&mut self) -> R::Word {
        let [s0, s1, s2, s3] = self.0;
        let sum = s0.plus(s3);
        let word = (sum.left::<23>() | sum.right::<41>()).plus(s0);
        let (s2, s3) = (s2 ^ s0, s3 ^ s1);
        self.0 = [
            s0 ^ s3,
            s1 ^ s2,
            s2 ^ s1.left::<17>(),
            s3.left::<45>() | s3.right::<19>(),
        ];
        word
    }

    /// Does [`Input::fill`].
    pub(super) fn fill(self, input: &Input, u: &mut [R]) {
        R::run(
            #[inline(always)]
            || match input {
                Input::Signs(signs) => self.fill_signs(*signs, u),
                Input::Gaussian { amplitude } => {
                    Normals::new(self).fill(u);
                    for u in u {
                        *u = *u * R::splat(*amplitude);
                    }
                }
                Input::Samples(samples) => {
                    for (u, sample) in u.iter_mut().zip(samples.iter().cycle()) {
                        *u = R::splat(*sample);
                    }
                }
                // Plans do not cover these inputs; return no number instead of a wrong one.
                Input::Filtered { .. } | Input::Binary { .. } => u.fill(R::splat(f64::NAN)),
            },
        );
    }

    /// Does [`RandomSigns::fill`].
    #[inline(always)]
    fn fill_signs(mut self, signs: RandomSigns, u: &mut [R]) {
        let (fresh, back) = signs.sequence.fresh(u.len());
        let amplitude = R::splat(signs.amplitude).to_bits();
        for block in u[..fresh].chunks_mut(64) {
            let mut minus = self.next() ^ R::Word::splat(u64::MAX);
            for u in block {
                *u = R::from_bits(amplitude ^ minus.left::<63>());
                minus = minus.right::<1>();
            }
        }
        for k in fresh..u.len() {
            u[k] = u[k - back];
        }
    }
}

/// Standard normal numbers of [`asobench_identification::signal::normal::fill_standard_normal`]. The radii of a block
/// are computed before its angles: each loop is short enough for a processor to overlap several iterations.
struct Normals<R: Real> {
    streams: Streams<R>,
    radius_squares: [R; DRAW_PAIRS],
    angles: [R::Word; DRAW_PAIRS],
}

impl<R: Real> Normals<R> {
    #[inline(always)]
    fn new(streams: Streams<R>) -> Self {
        Self {
            streams,
            radius_squares: [R::zero(); DRAW_PAIRS],
            angles: [R::Word::splat(0); DRAW_PAIRS],
        }
    }
}

impl<R: Real> Draw<R> for Normals<R> {
    #[inline(always)]
    fn begin(&mut self, pairs: usize) {
        // A local variable stays in registers.
        let mut streams = self.streams;
        for (radius, angle) in self.radius_squares[..pairs].iter_mut().zip(&mut self.angles) {
            *radius = radius_square(streams.next());
            *angle = streams.next();
        }
        self.streams = streams;
    }

    #[inline(always)]
    fn pair(&mut self, index: usize, to: &mut [R]) {
        let [first, second] = turn(self.radius_squares[index], self.angles[index]);
        to[0] = first;
        if let Some(last) = to.get_mut(1) {
            *last = second;
        }
    }
}

/// The same numbers, computing the radius of the next pair beside the angle of this one. Neither waits for the other,
/// but the constants of both are needed at once.
struct OneAhead<R: Real> {
    streams: Streams<R>,
    radius_square: R,
    angle: R::Word,
}

impl<R: Real> OneAhead<R> {
    #[inline(always)]
    fn new(mut streams: Streams<R>) -> Self {
        Self {
            radius_square: radius_square(streams.next()),
            angle: streams.next(),
            streams,
        }
    }
}

impl<R: Real> Draw<R> for OneAhead<R> {
    #[inline(always)]
    fn begin(&mut self, _: usize) {}

    #[inline(always)]
    fn pair(&mut self, _: usize, to: &mut [R]) {
        let [first, second] = turn(self.radius_square, self.angle);
        *self = Self::new(self.streams);
        to[0] = first;
        if let Some(last) = to.get_mut(1) {
            *last = second;
        }
    }
}

/// Records of the trials of one cell: the window, and what the rest is computed from.
pub struct Record<R, const N: usize> {
    n: usize,
    window: usize,
    /// The input, up to the horizon.
    pub u: Vec<R>,
    /// The measured output in the window.
    pub y: Vec<R>,
    /// The noise, up to the horizon, after the samples that it remembers.
    v: Vec<R>,
    memory: usize,
    /// The noise's scale.
    pub(crate) scale: R,
    /// The true plant.
    pub(crate) a: [R; N],
    pub(crate) b: [R; N],
    pub(crate) x0: [R; N],
    /// The true state after the window.
    pub(crate) x_window: [R; N],
}

/// The data common to all records of a cell.
pub struct RecordSource<'a> {
    /// The settings of the process.
    pub settings: &'a ProcessSettings,
    /// The true plant.
    pub plant: &'a StateSpace,
    /// The filter of the noise.
    pub noise: &'a NoiseFilter,
    /// The variances that scale the noise.
    pub variances: ProcessVariances,
    /// The seed of the study.
    pub seed: u64,
    /// The noise level, in per cent.
    pub eta: f64,
    /// The number of samples N that are estimated from.
    pub window: usize,
}

impl<R: Real, const N: usize> Record<R, N> {
    /// Makes buffers for records of `horizon` samples.
    pub fn new(source: &RecordSource<'_>, horizon: usize) -> Self {
        let zeros = |samples| vec![R::zero(); samples];
        let (plant, window, memory) = (source.plant, source.window, source.noise.memory());
        Self {
            n: plant.order(),
            window,
            u: zeros(horizon),
            y: zeros(window),
            v: zeros(memory + horizon),
            memory,
            scale: R::zero(),
            a: splat(plant.a()),
            b: splat(plant.b()),
            x0: splat(&source.settings.x0),
            x_window: [R::zero(); N],
        }
    }

    /// Returns the unscaled noise f, up to the horizon.
    pub(crate) fn noise(&self) -> &[R] {
        &self.v[self.memory..]
    }

    /// Draws a trial in each lane.
    pub fn draw(&mut self, source: &RecordSource<'_>, trials: &[u64; MOST_LANES]) {
        let streams = |purpose| Streams::<R>::new(source.seed, trials, purpose);
        let memory = self.memory;
        let (input, start, drive) = (
            streams(Purpose::Input),
            streams(Purpose::NoiseStart),
            streams(Purpose::NoiseDrive),
        );
        let v = &mut self.v[..];
        input.fill(&source.settings.input, &mut self.u);
        R::run(
            #[inline(always)]
            || {
                Normals::new(start).fill(&mut v[..memory]);
                source.noise.start(&mut v[..memory]);
                if R::REGISTERS < 32 {
                    source.noise.colour_as_drawn(v, Normals::new(drive));
                } else {
                    source.noise.colour_as_drawn(v, OneAhead::new(drive));
                }
            },
        );
        self.simulate();
        self.measure(source);
    }

    /// Computes the noise-free output in the window, in place of the measured one.
    fn simulate(&mut self) {
        let (u, y0) = (&self.u[..self.window], &mut self.y[..self.window]);
        let (a, b) = (&self.a, &self.b);
        self.x_window = R::run(
            #[inline(always)]
            || {
                let n = order::<N>(self.n);
                let mut x = self.x0;
                simulate(
                    &a[..n],
                    &b[..n],
                    &mut x[..n],
                    u,
                    #[inline(always)]
                    |k, x| y0[k] = x[0],
                );
                x
            },
        );
    }

    fn measure(&mut self, source: &RecordSource<'_>) {
        let level = source.settings.level;
        let f = &self.v[self.memory..self.memory + self.window];
        let scale = level.scale(source.eta, &self.y, f, source.variances);
        self.scale = scale;
        let noisy = level.over.noisy(self.window, self.u.len());
        let y = &mut self.y;
        R::run(
            #[inline(always)]
            || {
                for (y, f) in y.iter_mut().zip(f) {
                    *y = scale.mul_add(*f, *y);
                }
            },
        );
        self.v[self.memory + noisy..].fill(R::zero());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::tested;
    use crate::{Call, Isa, lane};
    use asobench_identification::data::{NoiseColour, Process, Realisation};
    use asobench_identification::plant::random_stable;
    use asobench_identification::signal::{LevelOf, LevelOver, LevelReading, Sequence, stream};
    use std::array::from_fn;

    /// The numbers that a lane drew: u, y of the window, f, and the scale followed by the state after the window.
    type Drawn = [Vec<f64>; 4];

    struct Draw<'a> {
        source: &'a RecordSource<'a>,
        horizon: usize,
        trials: [u64; MOST_LANES],
    }

    impl Call for Draw<'_> {
        type Output = Vec<Drawn>;

        fn with<R: Real, const N: usize>(self) -> Vec<Drawn> {
            let mut record = Record::<R, N>::new(self.source, self.horizon);
            // Draws other trials first, to check that nothing of them remains.
            record.draw(self.source, &[7; MOST_LANES]);
            record.draw(self.source, &self.trials);
            let n = self.source.plant.order();
            let of_lane = |l: usize| {
                let all = |values: &[R]| values.iter().map(|x| x.lane(l)).collect::<Vec<f64>>();
                let end: [f64; N] = lane(&record.x_window, l);
                let rest = [&[record.scale.lane(l)], &end[..n]].concat();
                [all(&record.u), all(&record.y), all(record.noise()), rest]
            };
            (0..R::LANES).map(of_lane).collect()
        }
    }

    fn bits(values: &[f64]) -> Vec<u64> {
        // An impossible noise level gives NaN, whose payload is irrelevant.
        let plain = |x: &f64| if x.is_nan() { f64::NAN } else { *x };
        values.iter().map(|x| plain(x).to_bits()).collect()
    }

    fn colours() -> Vec<NoiseColour> {
        let mut filters = vec![
            (vec![1.0], vec![1.0]),
            // Memory 0, but not unit gain.
            (vec![0.7], vec![1.0]),
            // Moving averages.
            (vec![1.0, 0.4, -0.2], vec![1.0]),
            (vec![0.0, 1.0], vec![1.0]),
            // ARMA filters, with either polynomial the longer one.
            (vec![1.0, 0.5], vec![1.0, -0.9]),
            (vec![0.3, -0.2, 0.1, 0.4], vec![1.0, -1.1, 0.4]),
            (vec![2.0, 1.0], vec![1.0, 0.1, -0.2, 0.3, 0.1]),
        ];
        for order in [1, 2, 3, 4, 5, 6, 7, 9] {
            let plant = random_stable(order, 0.95, &mut stream(3, order as u64, Purpose::Plant));
            filters.push((vec![1.0], plant.denominator()));
        }
        let filters = filters
            .into_iter()
            .map(|(c, d)| NoiseFilter::new(&c, &d).expect("a stable filter").into());
        let mut colours: Vec<NoiseColour> = filters.collect();
        colours.push(NoiseColour::InverseDenominator);
        colours
    }

    fn levels() -> [LevelReading; 7] {
        from_fn(|i| LevelReading {
            over: LevelOver::ALL[i / 2],
            of: [LevelOf::NoiseFree, LevelOf::Measured][i % 2],
        })
    }

    fn check(process: &Process, eta: f64, window: usize, horizon: usize, isas: &[Isa]) {
        let (plant, noise, variances) = process.open_loop().expect("an open loop");
        let source = RecordSource {
            settings: process.settings(),
            plant,
            noise,
            variances,
            seed: 11,
            eta,
            window,
        };
        let trials = from_fn(|l| [0, 5, 6, 1 << 40, 9, 1000, 2, u64::MAX][l]);
        let n = plant.order();
        let mut reference = Realisation::default();
        let expected: Vec<Drawn> = trials
            .iter()
            .map(|&trial| {
                process.realise(11, trial, eta, window, horizon, &mut reference);
                let Realisation { u, y, f, .. } = &reference;
                // The state after the window is in a record that is one sample longer.
                let mut state = Realisation::default();
                process.realise(11, trial, eta, window, window + 1, &mut state);
                let end = &state.states[window * n..(window + 1) * n];
                let rest = [&[reference.scale], end].concat();
                [u.clone(), y[..window].to_vec(), f.clone(), rest]
            })
            .collect();
        for &isa in isas {
            let draw = Draw {
                source: &source,
                horizon,
                trials,
            };
            for (l, found) in isa.dispatch(n, draw).iter().enumerate() {
                for (part, what) in ["u", "y", "f", "scale and state"].iter().enumerate() {
                    let same = bits(&found[part]) == bits(&expected[l][part]);
                    assert!(same, "{isa}, order {n}, lane {l}: {what} of {process:?}");
                }
            }
        }
    }

    /// Every order, colour, input and reading of the noise level.
    #[test]
    fn records_have_the_bits_of_the_process() {
        let isas = tested();
        for order in [1, 2, 3, 4, 6, 8, 12, 24] {
            let plant = random_stable(order, 0.9, &mut stream(1, order as u64, Purpose::Plant));
            let x0: Vec<f64> = (0..order).map(|i| 1.0 - 0.3 * i as f64).collect();
            for (i, colour) in colours().into_iter().enumerate() {
                let signs = |sequence| {
                    Input::Signs(RandomSigns {
                        amplitude: 10.0,
                        sequence,
                    })
                };
                let inputs = [
                    signs(Sequence::Independent),
                    signs(Sequence::Periodic127),
                    signs(Sequence::Held127),
                    Input::Gaussian { amplitude: 0.3 },
                    Input::Samples([3.0, -1.0, 0.5, 0.0, 7.0].into()),
                ];
                let given = |input: &Input| matches!(input, Input::Samples(_));
                for (input, level) in inputs
                    .into_iter()
                    .flat_map(|input| levels().map(|level| (input.clone(), level)))
                    .filter(|(input, level)| !given(input) || level.over != LevelOver::Process)
                {
                    let (plant, x0) = (plant.clone(), x0.clone());
                    let process = Process::new(plant, x0, input, colour.clone(), level);
                    let process = process.expect("a valid process");
                    // Odd and even lengths, because normal numbers come in pairs; longer than a period.
                    let window = 3 * order + 40 + i % 2;
                    check(&process, 10.018, window, window + 101 - i % 3, &isas);
                    if order == 2 {
                        for eta in [0.0, 99.9, 100.0] {
                            check(&process, eta, window, window, &isas);
                        }
                    }
                }
            }
        }
    }
}
