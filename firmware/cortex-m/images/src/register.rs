//! A register of a peripheral.

use core::marker::PhantomData;

/// A `T` at an address.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Register<T> {
    address: usize,
    holds: PhantomData<T>,
}

impl<T: Copy> Register<T> {
    /// The register at `address`.
    ///
    /// # Safety
    /// There must be one of the size of `T`, and neither reading nor writing it may change
    /// memory that Rust knows of.
    pub(crate) const unsafe fn at(address: usize) -> Self {
        Self {
            address,
            holds: PhantomData,
        }
    }

    /// Its content.
    pub(crate) fn read(self) -> T {
        let register = core::ptr::with_exposed_provenance::<T>(self.address);
        // SAFETY: there is a register (`at`).
        unsafe { register.read_volatile() }
    }

    /// Puts `value` into it.
    pub(crate) fn write(self, value: T) {
        let register = core::ptr::with_exposed_provenance_mut::<T>(self.address);
        // SAFETY: there is a register (`at`).
        unsafe { register.write_volatile(value) }
    }
}
