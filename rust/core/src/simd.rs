//! The widest vectors of the machine, chosen at run time: the one file with a feature-dependent call.
//!
//! No fused multiply-add is switched on, so that all paths give the same bits.

/// Work that is worth compiling twice. `run` is to be `#[inline(always)]`, and what it calls too.
pub trait Kernel {
    /// What comes of it.
    type Out;

    /// Does it.
    fn run(self) -> Self::Out;
}

/// Runs `kernel`, compiled for AVX2 and the bit counts that come with it where the machine has them.
#[inline(always)]
pub fn vectorized<K: Kernel>(kernel: K) -> K::Out {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2")
        && std::arch::is_x86_feature_detected!("bmi1")
        && std::arch::is_x86_feature_detected!("popcnt")
    {
        // SAFETY: the machine has what the function asks for.
        #[allow(unsafe_code)]
        return unsafe { with_avx2(kernel) };
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,popcnt")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Out {
    kernel.run()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Squares<'a>(&'a [f64; 64]);

    impl Kernel for Squares<'_> {
        type Out = [f32; 64];

        #[inline(always)]
        fn run(self) -> Self::Out {
            self.0.map(|x| (x * 0.3 + 0.7 * x * x) as f32)
        }
    }

    #[test]
    fn wide_and_portable_paths_give_the_same_bits() {
        let numbers: [f64; 64] = std::array::from_fn(|i| (i as f64).sin() * 1e3 + 0.1);
        assert_eq!(vectorized(Squares(&numbers)), Squares(&numbers).run());
    }
}
