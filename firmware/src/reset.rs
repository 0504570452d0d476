//! Why the microcontroller was reset.

use blindgrasp_shared::identity::ResetCause;

/// The flags of `RCC_CSR` (RM0090 7.3.21), and what each tells.
const CAUSES: [(u32, ResetCause); 7] = [
    // Power-on sets the flags of brown-out and of the pin too; every reset sets the pin's. Hence the order.
    (1 << 27, ResetCause::PowerOn),
    (1 << 25, ResetCause::BrownOut),
    (1 << 29, ResetCause::IndependentWatchdog),
    (1 << 30, ResetCause::WindowWatchdog),
    (1 << 31, ResetCause::LowPower),
    (1 << 28, ResetCause::Software),
    (1 << 26, ResetCause::Pin),
];

/// The cause of the last reset, from the register `RCC_CSR`. In QEMU the register reads zero: unknown.
pub fn cause(csr: u32) -> ResetCause {
    let found = CAUSES.iter().find(|(flag, _)| csr & flag != 0);
    found.map_or(ResetCause::Unknown, |&(_, cause)| cause)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pin_is_the_cause_only_when_nothing_else_is() {
        const PIN: u32 = 1 << 26;
        assert_eq!(cause(PIN), ResetCause::Pin);
        assert_eq!(cause(PIN | 1 << 25 | 1 << 27), ResetCause::PowerOn);
        assert_eq!(cause(PIN | 1 << 25), ResetCause::BrownOut);
        assert_eq!(cause(PIN | 1 << 28), ResetCause::Software);
        assert_eq!(cause(PIN | 1 << 29), ResetCause::IndependentWatchdog);
        assert_eq!(cause(PIN | 1 << 30), ResetCause::WindowWatchdog);
        assert_eq!(cause(PIN | 1 << 31), ResetCause::LowPower);
        // LSION and LSIRDY, and RMVF, are no causes.
        assert_eq!(cause(0b11 | 1 << 24), ResetCause::Unknown);
    }
}
