//! Sums of doubles without rounding.

use super::double_double::two_product;
use serde::{Deserialize, Serialize};

/// Limbs of 32 bits: 2098 for the doubles from 2^-1074 to 2^1024, 78 more for the number of terms.
const LIMBS: usize = 68;
/// Additions that a limb of 64 bits takes before carries must be propagated. Each adds less than 2^32, and two sums at
/// this limit can still be merged.
const LIMIT: u32 = 1 << 29;
const MANTISSA: u64 = (1 << 52) - 1;
const LOW: i64 = 0xffff_ffff;

/// The exact sum of doubles: a fixed-point number of 2176 bits in units of 2^-1074.
///
/// This is the small superaccumulator of Neal (2015), "Fast exact summation using small and large superaccumulators".
/// An addition is exact, so the sum does not depend on the order of its terms or on how partial sums were merged.
/// Equality and the serialised bytes depend on the number alone: sign, index of the first digit, and digits of 32 bits
/// without zeros at either end.
#[derive(Clone, Serialize, Deserialize)]
#[serde(into = "Canonical", try_from = "Canonical")]
pub struct ExactSum {
    /// Digits in base 2^32, lowest first, with carries that are still to be propagated.
    limbs: [i64; LIMBS],
    /// Bound on every limb's size, in units of 2^32.
    pending: u32,
}

impl Default for ExactSum {
    fn default() -> Self {
        Self {
            limbs: [0; LIMBS],
            pending: 0,
        }
    }
}

impl ExactSum {
    /// Adds x.
    ///
    /// # Panics
    /// In debug builds, if x is not finite; in release builds the sum is then meaningless.
    #[inline(always)]
    pub fn add(&mut self, x: f64) {
        let (mantissa, exponent) = parts(x);
        self.add_scaled(mantissa, exponent);
    }

    /// Adds `mantissa 2^(max(exponent, 1) - 1075)`.
    #[inline(always)]
    fn add_scaled(&mut self, mantissa: i64, exponent: usize) {
        if self.pending == LIMIT {
            self.carry();
        }
        self.pending += 1;
        let position = exponent.saturating_sub(1);
        let (limb, shift) = (position / 32, position % 32);
        let (sign, size) = (mantissa >> 63, mantissa.unsigned_abs());
        let low = size << shift;
        let high = (size >> 1) >> (63 - shift);
        let signed = |digit: u64| (digit.cast_signed() ^ sign) - sign;
        self.limbs[limb] += signed(low & 0xffff_ffff);
        self.limbs[limb + 1] += signed(low >> 32);
        self.limbs[limb + 2] += signed(high);
    }

    /// Adds `x y` without rounding: its rounded value and the rounding error, by fused multiply-add.
    ///
    /// Exact if the product is zero or above 2^-969. Below that, the rounding error is itself rounded to 2^-1074.
    ///
    /// # Panics
    /// In debug builds, if the product is not finite.
    #[inline(always)]
    pub fn add_product(&mut self, x: f64, y: f64) {
        let (high, low) = two_product(x, y);
        self.add(high);
        self.add(low);
    }

    /// Adds another sum.
    pub fn merge(&mut self, other: &Self) {
        for (limb, other) in self.limbs.iter_mut().zip(&other.limbs) {
            *limb += other;
        }
        self.pending += other.pending;
        if self.pending > LIMIT {
            self.carry();
        }
    }

    /// Propagates the carries: every limb except the last, which has the sign, is brought into [0, 2^32).
    fn carry(&mut self) {
        let mut carry = 0;
        for limb in &mut self.limbs[..LIMBS - 1] {
            let whole = *limb + carry;
            *limb = whole & LOW;
            carry = whole >> 32;
        }
        self.limbs[LIMBS - 1] += carry;
        self.pending = 1;
    }

    /// Sign and size of the sum.
    fn magnitude(&self) -> (bool, [u32; LIMBS]) {
        let mut digits = [0; LIMBS];
        let mut carry = 0;
        for (digit, limb) in digits.iter_mut().zip(&self.limbs) {
            let whole = limb + carry;
            *digit = (whole & LOW) as u32;
            carry = whole >> 32;
        }
        let negative = carry < 0;
        if negative {
            let mut carry = true;
            for digit in &mut digits {
                (*digit, carry) = (!*digit).overflowing_add(u32::from(carry));
            }
        }
        (negative, digits)
    }

    /// Returns the sum rounded to the nearest double, ties to even; infinite if it is out of range.
    pub fn value(&self) -> f64 {
        let (negative, digits) = self.magnitude();
        let size = round(&digits);
        if negative { -size } else { size }
    }

    /// Returns the sum as two doubles: the nearest double, and the double nearest to the remainder, which is at most
    /// half a unit in the last place of the first.
    pub fn value_dd(&self) -> (f64, f64) {
        let high = self.value();
        if !high.is_finite() {
            return (high, 0.0);
        }
        let mut rest = self.clone();
        rest.add(-high);
        (high, rest.value())
    }
}

/// The signed mantissa and the exponent bits: `x = mantissa 2^(max(exponent, 1) - 1075)`.
#[inline(always)]
fn parts(x: f64) -> (i64, usize) {
    debug_assert!(x.is_finite());
    let bits = x.to_bits();
    let exponent = (bits >> 52) & 0x7ff;
    let mantissa = (bits & MANTISSA) | (u64::from(exponent != 0) << 52);
    let sign = bits.cast_signed() >> 63;
    ((mantissa.cast_signed() ^ sign) - sign, exponent as usize)
}

/// The most terms that are added at once.
pub(super) const BLOCK: usize = 256;

/// Terms side by side, so that an addition need not wait for the one before it.
pub(super) const WAYS: usize = 8;

/// Terms that are added at once; unused places are zero.
pub(super) type Terms = [[f64; WAYS]; BLOCK / WAYS];

/// No terms.
pub(super) const NO_TERMS: Terms = [[0.0; WAYS]; BLOCK / WAYS];

impl ExactSum {
    /// Adds up to 256 terms, and leaves nothing of them.
    ///
    /// This is the error-free vector transformation of Rump, Ogita and Oishi (2008), "Accurate floating-point summation
    /// part I", section 3. If all `|x| < 2^m` and `sigma = 2^(m + 9)`, then `q = (sigma + x) - sigma` is x rounded to a
    /// multiple of `2^-53 sigma`, and `x - q` is exact. The q of 256 terms have a sum below sigma, so they are added
    /// without rounding too. The rest of x is at most `2^-53 sigma`, and is treated alike with `2^-44 sigma`, until
    /// nothing is left: for terms of like size after two or three rounds.
    ///
    /// # Panics
    /// In debug builds, if a term is not finite.
    #[inline(always)]
    pub(super) fn add_block(&mut self, terms: &mut [[f64; WAYS]]) {
        debug_assert!(terms.len() <= BLOCK / WAYS);
        let mut largest = [0.0; WAYS];
        for terms in &*terms {
            for i in 0..WAYS {
                let size = terms[i].abs();
                largest[i] = if largest[i] < size { size } else { largest[i] };
            }
        }
        let largest = largest.into_iter().fold(0.0, f64::max);
        let mut exponent = (largest.to_bits() >> 52).max(1) + 10;
        if exponent > 2046 {
            self.add_huge(terms.as_flattened_mut());
            return;
        }
        let mut left = largest > 0.0;
        while left {
            // Below the normal range every number is a multiple of 2^-53 sigma.
            let sigma = |exponent: u64| f64::from_bits(exponent.max(1) << 52);
            let [first, second] = [sigma(exponent), sigma(exponent.saturating_sub(44))];
            let mut sums = [[0.0; WAYS]; 2];
            let mut rest = [0; WAYS];
            for terms in terms.iter_mut() {
                for i in 0..WAYS {
                    let q = (first + terms[i]) - first;
                    let after = terms[i] - q;
                    let next = (second + after) - second;
                    sums[0][i] += q;
                    sums[1][i] += next;
                    terms[i] = after - next;
                    rest[i] |= terms[i].to_bits() << 1;
                }
            }
            for sum in sums {
                self.add(sum.iter().sum());
            }
            left = rest.into_iter().any(|rest| rest != 0);
            exponent = exponent.saturating_sub(88);
        }
    }

    /// Adds terms that have no larger power of two in the range of doubles.
    #[cold]
    fn add_huge(&mut self, terms: &mut [f64]) {
        for x in terms {
            self.add(std::mem::take(x));
        }
    }
}

/// The double nearest to a number in units of 2^-1074.
fn round(digits: &[u32; LIMBS]) -> f64 {
    let Some(last) = digits.iter().rposition(|digit| *digit != 0) else {
        return 0.0;
    };
    let top = 32 * last + 31 - digits[last].leading_zeros() as usize;
    let lowest = top.saturating_sub(52);
    let (limb, shift) = (lowest / 32, lowest % 32);
    let digit = |limb: usize| u128::from(digits.get(limb).copied().unwrap_or(0));
    let window = digit(limb) | (digit(limb + 1) << 32) | (digit(limb + 2) << 64);
    let mut mantissa = (window >> shift) as u64;
    if lowest > 0 {
        let (limb, shift) = ((lowest - 1) / 32, (lowest - 1) % 32);
        let half = (digits[limb] >> shift) & 1 == 1;
        let below = digits[limb] & ((1 << shift) - 1) != 0;
        let sticky = below || digits[..limb].iter().any(|digit| *digit != 0);
        mantissa += u64::from(half && (sticky || mantissa & 1 == 1));
    }
    // A leading bit of the mantissa, if there is one, raises the exponent by one.
    let bits = ((lowest as u64) << 52) + mantissa;
    f64::from_bits(bits.min(f64::INFINITY.to_bits()))
}

impl PartialEq for ExactSum {
    fn eq(&self, other: &Self) -> bool {
        self.magnitude() == other.magnitude()
    }
}

impl Eq for ExactSum {}

impl std::fmt::Debug for ExactSum {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("ExactSum").field(&self.value_dd()).finish()
    }
}

/// The canonical stored form of a sum.
#[derive(Serialize, Deserialize)]
struct Canonical {
    negative: bool,
    /// Index of the lowest digit that is not zero.
    first: u8,
    /// Digits up to the highest that is not zero.
    digits: Vec<u32>,
}

impl From<ExactSum> for Canonical {
    fn from(sum: ExactSum) -> Self {
        let (negative, digits) = sum.magnitude();
        let nonzero = |digit: &u32| *digit != 0;
        match (digits.iter().position(nonzero), digits.iter().rposition(nonzero)) {
            (Some(first), Some(last)) => Self {
                negative,
                first: first as u8,
                digits: digits[first..=last].to_vec(),
            },
            _ => Self {
                negative: false,
                first: 0,
                digits: Vec::new(),
            },
        }
    }
}

/// A stored sum that is not in the canonical form.
#[derive(Debug, thiserror::Error)]
#[error("not an exact sum: digits beyond the range of doubles, or zeros at their ends")]
struct NotCanonical;

impl TryFrom<Canonical> for ExactSum {
    type Error = NotCanonical;

    fn try_from(stored: Canonical) -> Result<Self, NotCanonical> {
        let (first, count) = (usize::from(stored.first), stored.digits.len());
        let ends = [stored.digits.first(), stored.digits.last()];
        let zero_form = count > 0 || (first == 0 && !stored.negative);
        if first + count > LIMBS || ends.contains(&Some(&0)) || !zero_form {
            return Err(NotCanonical);
        }
        let mut sum = Self::default();
        for (limb, digit) in sum.limbs[first..].iter_mut().zip(&stored.digits) {
            let digit = i64::from(*digit);
            *limb = if stored.negative { -digit } else { digit };
        }
        sum.pending = 1;
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sum(terms: impl IntoIterator<Item = f64>) -> ExactSum {
        let mut sum = ExactSum::default();
        for x in terms {
            sum.add(x);
        }
        sum
    }

    fn bytes(sum: &ExactSum) -> Vec<u8> {
        postcard::to_stdvec(sum).unwrap()
    }

    /// The sum by blocks, the last one filled up with zeros.
    fn by_blocks(terms: &[f64]) -> ExactSum {
        let mut sum = ExactSum::default();
        for terms in terms.chunks(BLOCK) {
            let mut block = NO_TERMS;
            block.as_flattened_mut()[..terms.len()].copy_from_slice(terms);
            sum.add_block(&mut block[..terms.len().div_ceil(WAYS)]);
        }
        sum
    }

    /// Any finite double.
    fn finite() -> impl Strategy<Value = f64> {
        any::<u64>()
            .prop_map(f64::from_bits)
            .prop_filter("finite", |x| x.is_finite())
    }

    /// Python's math.fsum: Shewchuk's expansion of partial sums, rounded to nearest even at the
    /// end. The terms must not overflow on the way.
    fn fsum(terms: &[f64]) -> f64 {
        let mut partials: Vec<f64> = Vec::new();
        for &term in terms {
            let mut x = term;
            let mut kept = Vec::new();
            for &y in &partials {
                let (large, small) = if x.abs() < y.abs() { (y, x) } else { (x, y) };
                let high = large + small;
                let low = small - (high - large);
                if low != 0.0 {
                    kept.push(low);
                }
                x = high;
            }
            kept.push(x);
            partials = kept;
        }
        let mut high = partials.pop().unwrap_or(0.0);
        let mut low = 0.0;
        while let Some(y) = partials.pop() {
            let x = high;
            high = x + y;
            low = y - (high - x);
            if low != 0.0 {
                break;
            }
        }
        if let Some(next) = partials.last()
            && ((low < 0.0 && *next < 0.0) || (low > 0.0 && *next > 0.0))
        {
            let (twice, x) = (2.0 * low, high + 2.0 * low);
            if twice == x - high {
                high = x;
            }
        }
        high
    }

    #[test]
    fn ill_conditioned_sums() {
        let max = f64::MAX;
        let tiny = f64::from_bits(1);
        assert_eq!(sum([]).value(), 0.0);
        assert_eq!(sum([1e308, 1.0, -1e308]).value(), 1.0);
        assert_eq!(sum([max, max, -max, tiny, -max]).value(), tiny);
        assert_eq!(sum([max, max]).value(), f64::INFINITY);
        assert_eq!(sum([-max, -max]).value(), f64::NEG_INFINITY);
        assert_eq!(sum([0.1; 10]).value(), 1.0);
        assert_eq!(sum([-0.0]).value().to_bits(), 0);
        // Ties go to even; anything below the tie decides it.
        let half = f64::EPSILON / 2.0;
        assert_eq!(sum([1.0, half]).value(), 1.0);
        assert_eq!(sum([1.0, half, tiny]).value(), 1.0 + f64::EPSILON);
        assert_eq!(sum([1.0, f64::EPSILON, half]).value(), 1.0 + 2.0 * f64::EPSILON);
        // The largest double plus half its unit in the last place rounds to infinity, anything less does not.
        let unit = 2.0_f64.powi(970);
        assert_eq!(sum([max, unit]).value(), f64::INFINITY);
        assert_eq!(sum([max, unit, -tiny]).value(), max);
        assert_eq!(sum([1.0, 1e-20, 1e-40]).value_dd(), (1.0, 1e-20));
        // The remainder is just below half a unit and rounds up to it.
        let odd = 1.0 + f64::EPSILON;
        assert_eq!(sum([odd, half, -tiny]).value_dd(), (odd, half));
        assert_eq!(sum([1e-310, -1e-300]).value(), 1e-310 - 1e-300);
    }

    #[test]
    fn carries_run_when_limbs_are_full() {
        let mut total = sum([f64::MAX, -1.0]);
        // 40 doublings: 2^40 additions.
        for _ in 0..40 {
            let copy = total.clone();
            total.merge(&copy);
        }
        let mut back = total.clone();
        for _ in 0..70 {
            back.carry();
        }
        assert_eq!(total, back);
        // -2^40 remains when the large terms are subtracted again.
        let mut large = sum([-f64::MAX]);
        for _ in 0..40 {
            let copy = large.clone();
            large.merge(&copy);
        }
        total.merge(&large);
        assert_eq!(total.value(), -(2.0_f64.powi(40)));
    }

    #[test]
    fn products_are_exact() {
        let mut squares = ExactSum::default();
        // 0.1^2 - (fl(0.1^2) + rest) = 0
        squares.add_product(0.1, 0.1);
        squares.add_product(-0.1, 0.1);
        assert_eq!(squares, ExactSum::default());
        // (2^53 - 1)^2 = 2^106 - 2^54 + 1
        let x = 2.0_f64.powi(53) - 1.0;
        squares.add_product(x, x);
        squares.add(-(2.0_f64.powi(106)));
        squares.add(2.0_f64.powi(54));
        assert_eq!(squares.value(), 1.0);
    }

    #[test]
    fn storage_is_compact_and_checked() {
        assert_eq!(bytes(&ExactSum::default()), [0, 0, 0]);
        // 1.0 is one digit.
        assert!(bytes(&sum([1.0])).len() <= 8);
        assert_eq!(bytes(&sum([1.0])), bytes(&sum([-1.0, 3.0, -1.0])));
        // Zeros at an end, digits out of range, a negative zero.
        for digits in [
            (false, 0_u8, vec![0_u32, 1]),
            (false, 0, vec![1, 0]),
            (false, 67, vec![1, 1]),
            (true, 0, vec![]),
        ] {
            let bytes = postcard::to_stdvec(&digits).unwrap();
            assert!(postcard::from_bytes::<ExactSum>(&bytes).is_err());
        }
    }

    proptest! {
        /// Terms of all sizes, which take more rounds than two.
        #[test]
        fn by_blocks_it_is_the_same_sum(terms in prop::collection::vec(finite(), 0..600)) {
            prop_assert_eq!(bytes(&by_blocks(&terms)), bytes(&sum(terms)));
        }

        /// Terms of one size, as many as a block takes, of one sign: nothing may be rounded where sums are largest.
        #[test]
        fn by_blocks_of_large_sums(
            terms in prop::collection::vec(0.5..1.0_f64, BLOCK),
            scale in -1074..1024_i32,
        ) {
            let (a, b) = (scale / 2, scale - scale / 2);
            let scaled = |x: f64| x * 2.0_f64.powi(a) * 2.0_f64.powi(b);
            let terms: Vec<f64> = terms.into_iter().map(scaled).collect();
            prop_assert_eq!(bytes(&by_blocks(&terms)), bytes(&sum(terms)));
        }

        /// Terms are m 2^e with |m| < 2^53 and 0 <= e < 60. Their sum in units of 2^-60 is a 128-bit integer, whose
        /// conversion to a double is correctly rounded. `scale` moves the terms over the whole range.
        #[test]
        fn agrees_with_integers(
            terms in prop::collection::vec((-(1_i64 << 53)..(1 << 53), 0..60_u32), 0..60),
            scale in -1074..850_i32,
        ) {
            let exact: i128 = terms.iter().map(|(m, e)| i128::from(*m) << e).sum();
            // 2^scale in two factors, both in range.
            let (a, b) = (scale / 2, scale - scale / 2);
            let scaled = |x: f64| x * 2.0_f64.powi(a) * 2.0_f64.powi(b);
            let found = sum(terms.iter().map(|(m, e)| scaled((i128::from(*m) << e) as f64)));
            // Scaling rounds only below the normal range; integers times 2^-1074 are never rounded.
            prop_assert_eq!(found.value().to_bits(), scaled(exact as f64 + 0.0).to_bits());
        }

        #[test]
        fn agrees_with_fsum(terms in prop::collection::vec(finite(), 0..40)) {
            let terms: Vec<f64> = terms.iter().map(|x| x * 2.0_f64.powi(-8)).collect();
            prop_assert_eq!(sum(terms.iter().copied()).value(), fsum(&terms));
        }

        #[test]
        fn order_and_grouping_do_not_matter(
            terms in prop::collection::vec(finite(), 1..40).prop_flat_map(|terms| {
                (Just(terms.clone()), Just(terms).prop_shuffle())
            }),
            cut in 0..40_usize,
        ) {
            let (terms, shuffled) = terms;
            let whole = sum(terms);
            let cut = cut.min(shuffled.len());
            let mut merged = sum(shuffled[cut..].iter().copied());
            merged.merge(&sum(shuffled[..cut].iter().copied()));
            prop_assert_eq!(&whole, &merged);
            prop_assert_eq!(bytes(&whole), bytes(&merged));
            let (high, low) = whole.value_dd();
            prop_assert_eq!(merged.value_dd(), (high, low));
            // The remainder is at most half a unit in the last place. It may be rounded up to the half itself; high +
            // low in doubles is then a tie and need not equal high.
            let unit = high.abs().next_up() - high.abs();
            prop_assert!(!high.is_finite() || low.abs() <= 0.5 * unit);
            let read: ExactSum = postcard::from_bytes(&bytes(&whole)).unwrap();
            prop_assert_eq!(&read, &whole);
            prop_assert_eq!(bytes(&read), bytes(&whole));
            prop_assert!(bytes(&whole).len() <= 3 + 5 * LIMBS);
        }
    }
}
