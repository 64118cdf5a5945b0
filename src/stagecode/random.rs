//! numpy's random number generators, bit for bit.
//!
//! A seed comes in, the same stream as numpy's goes out: PCG64 seeded through `SeedSequence` behind
//! `default_rng`, MT19937 behind `np.random.seed` and `RandomState`. Uniform numbers, integers, choices and
//! permutations are bit-equal to numpy's, and so are normal numbers up to the last bit of the platform's
//! `log` and `exp`; only the exponential of `default_rng` is merely equal in law. Python's own `random` runs
//! on the same MT19937, seeded its way. Imports the tables.

use super::ziggurat_tables::{FI, KI, WI};

/// A generator with its bit stream.
pub struct Random {
    bits: Bits,
    /// MT19937's normals come in pairs; the second waits here.
    spare_normal: Option<f64>,
    /// Whether it is one of Python's `random`, which draws other things from the same bits.
    pythons: bool,
}

enum Bits {
    Pcg64 { state: u128, increment: u128, spare: Option<u32> },
    Mt19937 { key: Box<[u32; 624]>, next: usize },
}

/// numpy's `SeedSequence`: any number of words in, well-mixed words out.
fn seed_sequence(entropy: &[u32], words: usize) -> Vec<u32> {
    const POOL: usize = 4;
    let mut constant = 0x43b0_d7e5_u32;
    let mut hash = |value: u32| {
        let value = value ^ constant;
        constant = constant.wrapping_mul(0x931e_8875);
        let value = value.wrapping_mul(constant);
        value ^ (value >> 16)
    };
    let mix = |x: u32, y: u32| {
        let value = x.wrapping_mul(0xca01_f9dd).wrapping_sub(y.wrapping_mul(0x4973_f715));
        value ^ (value >> 16)
    };
    let mut pool: [u32; POOL] = std::array::from_fn(|i| hash(entropy.get(i).copied().unwrap_or(0)));
    for source in 0..POOL {
        for target in (0..POOL).filter(|&t| t != source) {
            pool[target] = mix(pool[target], hash(pool[source]));
        }
    }
    for &word in entropy.iter().skip(POOL) {
        pool.iter_mut().for_each(|target| *target = mix(*target, hash(word)));
    }
    let mut constant = 0x8b51_f9dd_u32;
    (0..words)
        .map(|i| {
            let value = pool[i % POOL] ^ constant;
            constant = constant.wrapping_mul(0x58f3_8ded);
            let value = value.wrapping_mul(constant);
            value ^ (value >> 16)
        })
        .collect()
}

const PCG_MULTIPLIER: u128 = 0x2360_ed05_1fc6_5da4_4385_df64_9fcc_f645;

impl Random {
    /// `np.random.default_rng(seed)`.
    pub fn pcg64(seed: u64) -> Self {
        Self::pcg64_of(&[seed])
    }

    /// `np.random.default_rng([seed, ..])`: the words of all seeds one after another.
    pub fn pcg64_of(seeds: &[u64]) -> Self {
        let words_of = |seed: u64| {
            if seed >> 32 == 0 { vec![seed as u32] } else { vec![seed as u32, (seed >> 32) as u32] }
        };
        let entropy: Vec<u32> = seeds.iter().flat_map(|&seed| words_of(seed)).collect();
        let words = seed_sequence(&entropy, 8);
        let word = |i: usize| u128::from(words[2 * i]) | u128::from(words[2 * i + 1]) << 32;
        let (start, stream) = (word(0) << 64 | word(1), word(2) << 64 | word(3));
        let increment = stream << 1 | 1;
        let state = increment.wrapping_add(start).wrapping_mul(PCG_MULTIPLIER).wrapping_add(increment);
        Self { bits: Bits::Pcg64 { state, increment, spare: None }, spare_normal: None, pythons: false }
    }

    /// `np.random.RandomState(seed)`, and what `np.random.seed(seed)` sets.
    pub fn legacy(seed: u32) -> Self {
        let mut key = Box::new([0u32; 624]);
        let mut word = seed;
        for (i, slot) in key.iter_mut().enumerate() {
            *slot = word;
            word = 1_812_433_253_u32.wrapping_mul(word ^ (word >> 30)).wrapping_add(i as u32 + 1);
        }
        Self { bits: Bits::Mt19937 { key, next: 624 }, spare_normal: None, pythons: false }
    }

    /// `random.Random(seed)`: MT19937 with the words of the seed mixed into its state.
    pub fn python(seed: u64) -> Self {
        let mut made = Self::legacy(19_650_218);
        made.pythons = true;
        let Bits::Mt19937 { key, .. } = &mut made.bits else { return made };
        let words = if seed >> 32 == 0 { vec![seed as u32] } else { vec![seed as u32, (seed >> 32) as u32] };
        let (mut i, mut j) = (1, 0);
        let mixed = |key: &[u32; 624], i: usize, factor: u32| {
            key[i] ^ (key[i - 1] ^ key[i - 1] >> 30).wrapping_mul(factor)
        };
        let next = |key: &mut [u32; 624], i: &mut usize| {
            *i += 1;
            if *i == 624 {
                key[0] = key[623];
                *i = 1;
            }
        };
        for _ in 0..624 {
            key[i] = mixed(key, i, 1_664_525).wrapping_add(words[j]).wrapping_add(j as u32);
            next(key, &mut i);
            j = (j + 1) % words.len();
        }
        for _ in 0..623 {
            key[i] = mixed(key, i, 1_566_083_941).wrapping_sub(i as u32);
            next(key, &mut i);
        }
        key[0] = 0x8000_0000;
        made
    }

    /// Whether this is one of Python's `random`.
    pub fn is_pythons(&self) -> bool {
        self.pythons
    }

    /// The normal number that waits, if one does.
    pub fn take_spare(&mut self) -> Option<f64> {
        self.spare_normal.take()
    }

    /// Keeps the second normal number of a pair.
    pub fn keep_spare(&mut self, normal: f64) {
        self.spare_normal = Some(normal);
    }

    /// `count` random bits, at most 64, the low word first, as Python draws them.
    pub fn bits(&mut self, count: u32) -> u64 {
        match count {
            0 => 0,
            1..=32 => u64::from(self.next_u32() >> (32 - count)),
            _ => u64::from(self.next_u32()) | u64::from(self.next_u32() >> (64 - count.min(64))) << 32,
        }
    }

    /// Uniform among 0 .. `n` as Python draws it: as many bits as `n` has, until they are below it.
    pub fn below(&mut self, n: u64) -> u64 {
        loop {
            let draw = self.bits(64 - n.leading_zeros());
            if draw < n || n == 0 {
                return draw;
            }
        }
    }

    /// Whether this is a `RandomState` rather than a `Generator`.
    pub fn is_legacy(&self) -> bool {
        matches!(self.bits, Bits::Mt19937 { .. })
    }

    fn next_u32(&mut self) -> u32 {
        match &mut self.bits {
            Bits::Mt19937 { key, next } => mt_next(key, next),
            Bits::Pcg64 { state, increment, spare } => spare.take().unwrap_or_else(|| {
                let both = pcg_next(state, *increment);
                *spare = Some((both >> 32) as u32);
                both as u32
            }),
        }
    }

    fn next_u64(&mut self) -> u64 {
        match &mut self.bits {
            Bits::Mt19937 { key, next } => {
                let high = u64::from(mt_next(key, next));
                high << 32 | u64::from(mt_next(key, next))
            }
            Bits::Pcg64 { state, increment, .. } => pcg_next(state, *increment),
        }
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        match &mut self.bits {
            Bits::Mt19937 { key, next } => {
                let (a, b) = (mt_next(key, next) >> 5, mt_next(key, next) >> 6);
                (f64::from(a) * 67_108_864.0 + f64::from(b)) / 9_007_199_254_740_992.0
            }
            Bits::Pcg64 { state, increment, .. } => {
                (pcg_next(state, *increment) >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
            }
        }
    }

    /// Standard normal: the polar method for `RandomState`, the ziggurat for `Generator`.
    pub fn normal(&mut self) -> f64 {
        if !self.is_legacy() {
            return self.ziggurat();
        }
        if let Some(waiting) = self.spare_normal.take() {
            return waiting;
        }
        loop {
            let (x, y) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let r2 = x * x + y * y;
            if r2 < 1.0 && r2 != 0.0 {
                let f = (-2.0 * r2.ln() / r2).sqrt();
                self.spare_normal = Some(f * x);
                return f * y;
            }
        }
    }

    fn ziggurat(&mut self) -> f64 {
        const R: f64 = 3.654_152_885_361_009;
        const INVERSE_R: f64 = 0.273_661_237_329_758_3;
        loop {
            let draw = self.next_u64();
            let layer = (draw & 0xff) as usize;
            let size = draw >> 9 & 0x000f_ffff_ffff_ffff;
            let x = size as f64 * f64::from_bits(WI[layer]);
            let x = if draw >> 8 & 1 == 1 { -x } else { x };
            if size < KI[layer] {
                return x;
            }
            if layer == 0 {
                loop {
                    let tail = -INVERSE_R * (-self.uniform()).ln_1p();
                    let y = -(-self.uniform()).ln_1p();
                    if y + y > tail * tail {
                        return if size >> 8 & 1 == 1 { -(R + tail) } else { R + tail };
                    }
                }
            }
            let (above, below) = (f64::from_bits(FI[layer - 1]), f64::from_bits(FI[layer]));
            if (above - below) * self.uniform() + below < (-0.5 * x * x).exp() {
                return x;
            }
        }
    }

    /// Standard exponential, by inversion. Bit-equal for `RandomState`, equal in law for `Generator`.
    pub fn exponential(&mut self) -> f64 {
        -(1.0 - self.uniform()).ln()
    }

    /// Uniform among 0 ..= `last`, as `integers` and `randint` draw: by rejection under a mask for
    /// `RandomState`, by Lemire's multiplication for `Generator`.
    pub fn below_or_at(&mut self, last: u64) -> u64 {
        match (self.is_legacy(), last) {
            (_, 0) => 0,
            (true, _) => self.masked(last),
            (false, 0xffff_ffff) => u64::from(self.next_u32()),
            (false, u64::MAX) => self.next_u64(),
            (false, _) => match u32::try_from(last) {
                Ok(last) => u64::from(self.lemire_32(last)),
                Err(_) => self.lemire_64(last),
            },
        }
    }

    /// Uniform among 0 ..= `last`: draws are cut to the bits that `last` has and rejected above it.
    fn masked(&mut self, last: u64) -> u64 {
        let mask = u64::MAX.checked_shr(last.leading_zeros()).unwrap_or(0);
        loop {
            let draw = if last <= u64::from(u32::MAX) { u64::from(self.next_u32()) } else { self.next_u64() };
            if draw & mask <= last {
                return draw & mask;
            }
        }
    }

    fn lemire_32(&mut self, last: u32) -> u32 {
        let count = u64::from(last) + 1;
        let mut product = u64::from(self.next_u32()) * count;
        if (product as u32 as u64) < count {
            let threshold = (u64::from(u32::MAX) - u64::from(last)) % count;
            while (product as u32 as u64) < threshold {
                product = u64::from(self.next_u32()) * count;
            }
        }
        (product >> 32) as u32
    }

    fn lemire_64(&mut self, last: u64) -> u64 {
        let count = u128::from(last) + 1;
        let mut product = u128::from(self.next_u64()) * count;
        if u128::from(product as u64) < count {
            let threshold = u128::from(u64::MAX - last) % count;
            while u128::from(product as u64) < threshold {
                product = u128::from(self.next_u64()) * count;
            }
        }
        (product >> 64) as u64
    }

    /// Shuffles items from the back, as `shuffle` and `permutation` do.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            let j = self.masked(i as u64) as usize;
            items.swap(i, j);
        }
    }

    /// Shuffles the items from the back down to `first`, as `choice` does: numpy draws the places here the
    /// way it draws integers.
    pub fn shuffle_tail<T>(&mut self, items: &mut [T], first: usize) {
        for i in (first.max(1)..items.len()).rev() {
            let j = self.below_or_at(i as u64) as usize;
            items.swap(i, j);
        }
    }
}

fn pcg_next(state: &mut u128, increment: u128) -> u64 {
    *state = state.wrapping_mul(PCG_MULTIPLIER).wrapping_add(increment);
    ((*state >> 64) as u64 ^ *state as u64).rotate_right((*state >> 122) as u32)
}

fn mt_next(key: &mut [u32; 624], next: &mut usize) -> u32 {
    if *next == 624 {
        for i in 0..624 {
            let y = key[i] & 0x8000_0000 | key[(i + 1) % 624] & 0x7fff_ffff;
            key[i] = key[(i + 397) % 624] ^ (y >> 1) ^ if y & 1 == 1 { 0x9908_b0df } else { 0 };
        }
        *next = 0;
    }
    let mut y = key[*next];
    *next += 1;
    y ^= y >> 11;
    y ^= y << 7 & 0x9d2c_5680;
    y ^= y << 15 & 0xefc6_0000;
    y ^ y >> 18
}
