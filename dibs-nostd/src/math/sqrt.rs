//! The square root, correctly rounded, by a hardware instruction if there is one.
//!
//! `core` has no stable square root, and the portable software version takes tens of instructions on a Cortex-M7 whose
//! FPU needs one. All versions below round correctly, so that host and target agree in every bit.

// Requirements: A-11, P-01

#![allow(unsafe_code)]

/// The square root of `x`, correctly rounded; NaN for a negative number or NaN.
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    imp::sqrt(x)
}

/// A hard-float ABI promises the FPU's single-precision square root.
///
/// The compiler knows C's function by this name. When it optimises, it replaces the call by the instruction on FPU
/// registers, which inline assembly cannot name in stable Rust; only a negative number still calls the function. On
/// targets without a C library Rust's runtime provides it, portable and correctly rounded too.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
mod imp {
    // SAFETY: this is the C standard's `float sqrtf(float)`. It touches no memory but, at most, `errno`.
    unsafe extern "C" {
        safe fn sqrtf(x: f32) -> f32;
    }

    #[inline(always)]
    pub(super) fn sqrt(x: f32) -> f32 {
        sqrtf(x)
    }
}

#[cfg(target_arch = "x86_64")]
mod imp {
    use core::arch::x86_64::{_mm_cvtss_f32, _mm_set_ss, _mm_sqrt_ss};

    #[inline(always)]
    pub(super) fn sqrt(x: f32) -> f32 {
        // SAFETY: SSE belongs to the x86-64 baseline, so every such processor has these instructions.
        unsafe { _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(x))) }
    }
}

#[cfg(not(any(all(target_arch = "arm", target_abi = "eabihf"), target_arch = "x86_64")))]
mod imp {
    #[inline(always)]
    pub(super) fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn rounds_as_the_portable_root_does() {
        for bits in (0..=u32::MAX).step_by(6_151) {
            let x = f32::from_bits(bits);
            let (ours, portable) = (super::sqrt(x), libm::sqrtf(x));
            assert!(
                ours.to_bits() == portable.to_bits() || (ours.is_nan() && portable.is_nan()),
                "sqrt({x:e}) is {ours:e}, not {portable:e}"
            );
        }
    }
}
