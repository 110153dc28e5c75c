//! A register of a peripheral.

/// 32 bits at an address.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Register(usize);

impl Register {
    /// The register at `address`.
    ///
    /// # Safety
    /// There must be one, and neither reading nor writing it may change
    /// memory that Rust knows of.
    pub(crate) const unsafe fn at(address: usize) -> Self {
        Self(address)
    }

    /// What is in it.
    pub(crate) fn read(self) -> u32 {
        let register = core::ptr::with_exposed_provenance::<u32>(self.0);
        // SAFETY: there is a register (`at`).
        unsafe { register.read_volatile() }
    }

    /// Puts `value` into it.
    pub(crate) fn write(self, value: u32) {
        let register = core::ptr::with_exposed_provenance_mut::<u32>(self.0);
        // SAFETY: there is a register (`at`).
        unsafe { register.write_volatile(value) }
    }
}
