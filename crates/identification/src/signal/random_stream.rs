//! Random streams: one xoshiro256++ generator per (seed, trial, purpose).
//!
//! A stream depends on these three alone: not on the cell, the noise level, the window or the thread. So the same trial
//! has the same input and the same unscaled noise in every cell (common random numbers: comparisons are paired). Any
//! trial can be drawn on its own, and a longer record only reads further into the same streams.

use crate::real::Word;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// The generator of every stream: xoshiro256++ of Blackman and Vigna (2021), period 2^256 - 1.
pub type Stream = Xoshiro256PlusPlus;

/// The use of a stream's numbers. Each purpose has its own numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// The input r: the signs, or the normal numbers.
    Input = 1,
    /// The white sequence that drives the noise filter.
    NoiseDrive = 2,
    /// The stationary draw of the noise filter's state before k = 0.
    NoiseStart = 3,
    /// Random plants.
    Plant = 4,
    /// The measurement noise of the input.
    InputNoise = 5,
    /// A fresh input, on which models are compared with the plant.
    FreshInput = 6,
    /// The process noise.
    ProcessNoise = 7,
    /// Random initial states.
    InitialState = 8,
    /// White disturbances in continuous time.
    Disturbance = 9,
    /// Random phases of disturbances in continuous time.
    DisturbancePhase = 10,
    /// The seeds given to programs, so that they learn nothing else.
    Program = 11,
}

/// Computes the finaliser of SplitMix64 (Steele, Lea and Flood 2014, variant 13 of Stafford), a bijection of 64 bits.
#[inline(always)]
fn mix<W: Word>(z: W) -> W {
    let z = (z ^ z.right::<30>()).times(W::splat(0xbf58_476d_1ce4_e5b9));
    let z = (z ^ z.right::<27>()).times(W::splat(0x94d0_49bb_1331_11eb));
    z ^ z.right::<31>()
}

/// Returns the stream of one purpose in one trial.
///
/// For a fixed purpose, four Feistel rounds with SplitMix64's finaliser map (seed, trial) one to one onto the first 128
/// bits of the generator's state. Hence two streams of one purpose never start alike. The other 128 bits are mixed from
/// these.
pub fn stream(seed: u64, trial: u64, purpose: Purpose) -> Stream {
    let mut state = [0; 32];
    for (bytes, word) in state.chunks_exact_mut(8).zip(state_of(seed, trial, purpose)) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    Stream::from_seed(state)
}

/// Returns the generator's state of [`stream`], for one or several trials.
#[inline(always)]
pub fn state_of<W: Word>(seed: u64, trial: W, purpose: Purpose) -> [W; 4] {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let key = W::splat(mix(GOLDEN.wrapping_mul(purpose as u64)));
    let (mut left, mut right) = (W::splat(seed), trial);
    for round in 1..=4_u64 {
        let constant = W::splat(round.wrapping_mul(GOLDEN));
        let next = left ^ mix(right.plus(key).plus(constant));
        (left, right) = (right, next);
    }
    [left, right, mix(left.plus(key)), mix(right.plus(key))]
}
