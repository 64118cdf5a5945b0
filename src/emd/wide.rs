//! Runs a kernel with the widest vector instructions that this processor has.
//!
//! A kernel is a value with a `run` method; it goes in, its result comes out, the same bits with and
//! without vectors. Imports nothing.

/// A piece of numeric work. `run`, and all that it calls, must be `#[inline(always)]`: only what is
/// inlined into the entry point below is compiled for its instruction set.
pub trait Kernel {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs `kernel` with AVX2 where the processor has it, and with the build's own target otherwise.
#[inline]
pub fn widest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the line above has just found the one feature that `with_avx2` requires.
        return unsafe { with_avx2(kernel) };
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}
