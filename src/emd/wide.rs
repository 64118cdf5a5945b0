//! Runs a kernel with the widest vector instructions that this processor has.
//!
//! A kernel is a value with a `run` method; it goes in, its result comes out. On a processor without
//! fused multiply-add, a kernel that asks for it rounds otherwise. Imports nothing.

/// A piece of numeric work. `run`, and all that it calls, must be `#[inline(always)]`: only what is
/// inlined into the entry points below is compiled for their instruction sets.
pub trait Kernel {
    type Output;
    /// Does the work; `FUSED` says whether there are instructions for [`super::Real::mul_add`].
    fn run<const FUSED: bool>(self) -> Self::Output;
}

/// Whether every processor of the build's own target fuses.
const ALWAYS_FUSED: bool = cfg!(any(target_arch = "aarch64", target_feature = "fma"));

/// Runs `kernel` with AVX-512 or AVX2 where the processor has it, and with the build's own target otherwise.
#[inline]
pub fn widest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if has_avx512() {
            // SAFETY: the line above has just found all features that `with_avx512` requires.
            return unsafe { with_avx512(kernel) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the line above has just found the two features that `with_avx2` requires.
            return unsafe { with_avx2(kernel) };
        }
    }
    kernel.run::<ALWAYS_FUSED>()
}

/// What every AVX-512 processor since 2017 has (x86-64-v4).
#[cfg(target_arch = "x86_64")]
#[inline]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512cd")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl,avx2,fma")]
fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<true>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<true>()
}
