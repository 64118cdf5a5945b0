//! Every operation at every level of this machine against plain arrays.

use super::{Kernel, LANES, Lanes, Portable, Real, SimdLevel};
use crate::math::rng::{normal, seeded};

type Row<T> = [T; LANES];

/// Results of the operations that have one right answer, by name, and of the two that may round
/// differently.
struct Answers<T> {
    exact: Vec<(&'static str, Row<T>)>,
    bits: [u16; 3],
    mul_add: Row<T>,
    sum_nodes: Row<T>,
}

/// All operations on three vectors.
struct Operations<'a, T>([&'a Row<T>; 3]);

impl<T: Real> Kernel<T> for Operations<'_, T> {
    type Output = Answers<T>;
    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) -> Answers<T> {
        let [a, b, c] = self.0.map(|row| L::load(row));
        let (a_gt_b, b_gt_c) = (a.gt(b), b.gt(c));
        let both = L::and(a_gt_b, b_gt_c);
        let whole = a.max(L::constant(-100.0)).min(L::constant(100.0)).floor();
        // Larger than the smallest normal number, smaller than infinity, not NaN.
        let positive = a.abs().min(L::constant(1e30)).max(L::constant(1e-30));
        let (exponent, mantissa) = positive.split_exponent();
        let exact = [
            ("splat", L::splat(self.0[0][3])),
            ("load and store", a),
            ("add", a + b),
            ("sub", a - b),
            ("mul", a * b),
            ("neg", -a),
            ("div", a.div(b)),
            ("sqrt", a.sqrt()),
            ("max", a.max(b)),
            ("min", a.min(b)),
            ("abs", a.abs()),
            ("floor", a.floor()),
            ("copysign", a.copysign(b)),
            ("select", L::select(a_gt_b, a, c)),
            ("and", L::select(both, a, c)),
            ("exp2i", whole.exp2i()),
            ("exponent", exponent),
            ("mantissa", mantissa),
            ("repeat4", L::repeat4(&self.0[0][5..])),
            ("spread4", L::spread4(&self.0[0][5..])),
            ("constant", L::constant(0.1)),
            ("sum_components", a.sum_components()),
        ];
        Answers {
            exact: exact.map(|(name, v)| (name, stored(v))).to_vec(),
            bits: [L::bits(a_gt_b), L::bits(b_gt_c), L::bits(both)],
            mul_add: stored(a.mul_add(b, c)),
            sum_nodes: stored(L::sum_nodes(a, b, c, a * b)),
        }
    }
}

#[inline(always)]
fn stored<L: Lanes>(v: L) -> Row<L::Real> {
    let mut row = [L::Real::default(); LANES];
    v.store(&mut row);
    row
}

struct Transpose<'a, T>(&'a mut [Row<T>; LANES]);

impl<T: Real> Kernel<T> for Transpose<'_, T> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes<Real = T>>(self) {
        let mut m = [L::constant(0.0); LANES];
        for (v, row) in m.iter_mut().zip(&*self.0) {
            *v = L::load(row);
        }
        L::transpose(&mut m);
        for (v, row) in m.iter().zip(self.0) {
            v.store(row);
        }
    }
}

/// Triples of vectors: ordinary numbers, then all pairs of special ones.
fn inputs<T: Real>() -> Vec<[Row<T>; 3]> {
    let mut rng = seeded(1, "lanes");
    let mut row = |scale: f64| -> Row<T> { std::array::from_fn(|_| T::from_f64(scale * normal(&mut rng))) };
    let mut all: Vec<_> = [1.0, 1e-3, 30.0, 1e6].into_iter().map(|s| [row(s), row(1.0), row(s)]).collect();
    let special = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        -2.5,
        1e-40,
        -3e-39,
        1e38,
        -8_388_609.0,
        4_294_967_296.0,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
        std::f64::consts::SQRT_2,
        std::f64::consts::FRAC_1_SQRT_2,
    ];
    for shift in 0..LANES {
        let rotated = |by: usize| std::array::from_fn(|i| T::from_f64(special[(i + by) % LANES]));
        all.push([rotated(0), rotated(shift), rotated(3 * shift + 1)]);
    }
    all
}

/// The number's bits; one value for all NaN, of which sign and payload are nobody's business.
fn bits<T: Real>(row: &Row<T>) -> [u64; LANES] {
    row.map(|v| if v.to_f64().is_nan() { u64::MAX } else { v.to_f64().to_bits() })
}

fn agree_with_plain_arrays<T: Real>(plain: impl Fn([&Row<T>; 3]) -> Answers<T>) {
    for level in SimdLevel::available() {
        for [a, b, c] in &inputs::<T>() {
            let (got, want) = (T::dispatch(level, Operations([a, b, c])), plain([a, b, c]));
            for ((name, got), (_, want)) in got.exact.iter().zip(&want.exact) {
                assert_eq!(bits(got), bits(want), "{level:?} {name}: {got:?} instead of {want:?}");
            }
            assert_eq!(got.bits, want.bits, "{level:?} masks of {a:?} {b:?} {c:?}");
            for k in 0..LANES {
                let row = [*a, *b, *c, want.exact[4].1][k / 4].map(T::to_f64);
                let nodes = [row[k % 4], row[4 + k % 4], row[8 + k % 4], row[12 + k % 4]];
                let size: f64 = nodes.iter().map(|v| v.abs()).sum();
                if size < 1e38 {
                    let (got, want) = (got.sum_nodes[k].to_f64(), nodes.iter().sum::<f64>());
                    assert!((got - want).abs() <= 2e-7 * size, "{level:?} sum_nodes: {got} {want}");
                }
            }
        }
    }
}

#[test]
fn every_operation_agrees_with_plain_arrays_in_f32() {
    agree_with_plain_arrays(|rows| Operations(rows).run::<Portable<f32>>());
}

#[test]
fn every_operation_agrees_with_plain_arrays_in_f64() {
    agree_with_plain_arrays(|rows| Operations(rows).run::<Portable<f64>>());
}

#[test]
fn multiply_add_rounds_once_in_vectors_and_twice_in_plain_arrays() {
    for level in SimdLevel::available() {
        for [a, b, c] in &inputs::<f32>() {
            let got = f32::dispatch(level, Operations([a, b, c])).mul_add;
            let want = std::array::from_fn(|i| match level {
                SimdLevel::Scalar => a[i] * b[i] + c[i],
                _ => a[i].mul_add(b[i], c[i]),
            });
            assert_eq!(bits(&got), bits::<f32>(&want), "{level:?}");
        }
        for [a, b, c] in &inputs::<f64>() {
            let got = f64::dispatch(level, Operations([a, b, c])).mul_add;
            let want = std::array::from_fn(|i| a[i] * b[i] + c[i]);
            assert_eq!(bits(&got), bits::<f64>(&want), "{level:?}");
        }
    }
}

#[test]
fn all_vector_levels_sum_nodes_in_the_same_order() {
    for [a, b, c] in &inputs::<f32>() {
        for level in SimdLevel::available().filter(|level| *level != SimdLevel::Scalar) {
            let got = f32::dispatch(level, Operations([a, b, c])).sum_nodes;
            let d: Row<f32> = std::array::from_fn(|i| a[i] * b[i]);
            let want: Row<f32> = std::array::from_fn(|i| {
                let (v, k) = ([a, b, c, &d][i / 4], i % 4);
                (v[k] + v[8 + k]) + (v[4 + k] + v[12 + k])
            });
            assert_eq!(bits(&got), bits(&want), "{level:?}");
        }
    }
}

fn check_transpose<T: Real>() {
    for level in SimdLevel::available() {
        let before: [Row<T>; LANES] =
            std::array::from_fn(|i| std::array::from_fn(|j| T::from_f64((LANES * i + j) as f64)));
        let mut after = before;
        T::dispatch(level, Transpose(&mut after));
        for i in 0..LANES {
            for j in 0..LANES {
                assert!(after[i][j] == before[j][i], "{level:?}: row {i}, column {j}");
            }
        }
    }
}

#[test]
fn transpose_swaps_rows_and_columns() {
    check_transpose::<f32>();
    check_transpose::<f64>();
}

#[test]
fn levels_build_on_one_another() {
    assert!(SimdLevel::Scalar.is_available() && SimdLevel::best().is_available());
    let available: Vec<_> = SimdLevel::available().collect();
    let x86_64 = [SimdLevel::Scalar, SimdLevel::Avx2, SimdLevel::Avx512];
    assert!(x86_64.starts_with(&available) || available == [SimdLevel::Scalar, SimdLevel::Neon]);
    assert_eq!(available.last(), Some(&SimdLevel::best()));
}

#[test]
fn a_level_that_the_machine_lacks_is_refused() {
    let run = |level| std::panic::catch_unwind(|| f32::dispatch(level, Operations([&[1.0; LANES]; 3])));
    for level in [SimdLevel::Scalar, SimdLevel::Avx2, SimdLevel::Avx512, SimdLevel::Neon] {
        assert_eq!(run(level).is_ok(), level.is_available(), "{level:?}");
    }
}
