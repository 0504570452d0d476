//! Causes of a reset of the microcontroller, and the supply voltage that causes one.

use blindgrasp_shared::identity::{BrownOut, ResetCause};

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

/// Level of the brown-out reset, from the register `FLASH_OPTCR` (RM0090 3.9.10): `BOR_LEV` in bits 3 and 2.
pub fn brown_out(optcr: u32) -> BrownOut {
    match optcr >> 2 & 0b11 {
        0b00 => BrownOut::Level3,
        0b01 => BrownOut::Level2,
        0b10 => BrownOut::Level1,
        _ => BrownOut::Off,
    }
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

    #[test]
    fn the_brown_out_level_is_two_bits_of_the_options() {
        // As it comes from the factory: no read or write protection, no brown-out reset.
        assert_eq!(brown_out(0x0FFF_AAED), BrownOut::Off);
        for (bits, level) in [(0, BrownOut::Level3), (1, BrownOut::Level2), (2, BrownOut::Level1)] {
            assert_eq!(brown_out(0x0FFF_AAED & !0b1100 | bits << 2), level);
            assert_eq!(brown_out(bits << 2), level);
        }
    }
}
