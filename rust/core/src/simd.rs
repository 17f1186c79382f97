//! The widest vectors of the machine, chosen at run time: the one file with feature-dependent calls.
//!
//! No fused multiply-add is switched on, so that all paths give the same bits.

/// Work that is worth compiling twice. `run` is to be `#[inline(always)]`, and what it calls too.
pub trait Kernel {
    /// What comes of it.
    type Out;

    /// Does it.
    fn run(self) -> Self::Out;

    /// The same where the machine has AVX2.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn run_wide(self, _wide: Wide) -> Self::Out
    where
        Self: Sized,
    {
        self.run()
    }
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
    kernel.run_wide(Wide(()))
}

/// As [`Kernel`], for work that puts lanes in another order: compilers make no vector code of that.
pub trait MovingKernel {
    /// What comes of it.
    type Out;

    /// Does it.
    fn run<M: Moves>(self, moves: M) -> Self::Out;
}

/// Eight lanes in another order.
pub trait Moves: Copy {
    /// Lane by lane the one of `values` that `order` names; of larger numbers the last three bits count.
    fn ordered(self, values: [u32; 8], order: &[u32; 8]) -> [u32; 8];
}

/// As [`vectorized`].
#[inline(always)]
pub fn moving<K: MovingKernel>(kernel: K) -> K::Out {
    vectorized(Moving(kernel))
}

struct Moving<K>(K);

impl<K: MovingKernel> Kernel for Moving<K> {
    type Out = K::Out;

    #[inline(always)]
    fn run(self) -> K::Out {
        self.0.run(Portable)
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn run_wide(self, wide: Wide) -> K::Out {
        self.0.run(wide)
    }
}

/// Moves on any machine.
#[derive(Clone, Copy)]
struct Portable;

impl Moves for Portable {
    #[inline(always)]
    fn ordered(self, values: [u32; 8], order: &[u32; 8]) -> [u32; 8] {
        order.map(|place| values[place as usize % 8])
    }
}

/// Proof that the machine has AVX2.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub struct Wide(());

#[cfg(target_arch = "x86_64")]
impl Moves for Wide {
    #[inline(always)]
    fn ordered(self, values: [u32; 8], order: &[u32; 8]) -> [u32; 8] {
        use std::arch::x86_64::{__m256i, _mm256_permutevar8x32_epi32};
        // SAFETY: there is a proof of AVX2, and eight numbers of 32 bits are 256 bits, whatever they are.
        #[allow(unsafe_code)]
        unsafe {
            let values = std::mem::transmute::<[u32; 8], __m256i>(values);
            let order = std::mem::transmute::<[u32; 8], __m256i>(*order);
            std::mem::transmute::<__m256i, [u32; 8]>(_mm256_permutevar8x32_epi32(values, order))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Turned([u32; 8], [u32; 8]);

    impl MovingKernel for Turned {
        type Out = [u32; 8];

        #[inline(always)]
        fn run<M: Moves>(self, moves: M) -> [u32; 8] {
            moves.ordered(self.0, &self.1)
        }
    }

    #[test]
    fn lanes_go_where_they_are_told_on_any_machine() {
        let (values, order) = ([10, 11, 12, 13, 14, 15, 16, 17], [7, 0, 3, 3, 1, 8, 2, 6]);
        let expected = [17, 10, 13, 13, 11, 10, 12, 16];
        assert_eq!(moving(Turned(values, order)), expected);
        assert_eq!(Turned(values, order).run(Portable), expected);
    }

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
