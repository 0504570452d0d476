//! The baud rate generator of an STM32F4's USART (RM0090 30.3.4): a divider of the bus clock, in sixteenths of a bit, or in
//! eighths where it is too fast for sixteenths.

/// The settings of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Divider {
    /// The register BRR.
    pub register: u16,
    /// Each bit is sampled eight times, not sixteen.
    pub by_eight: bool,
}

impl Divider {
    /// Returns the settings for a rate, if it can be had to 1 %.
    pub const fn new(bus_hz: u32, baud: u32) -> Option<Self> {
        if baud == 0 {
            return None;
        }
        // Clocks a bit.
        let clocks = (bus_hz + baud / 2) / baud;
        if clocks < 8 || clocks > 0xffff || (clocks * baud).abs_diff(bus_hz) > bus_hz / 100 {
            return None;
        }
        let by_eight = clocks < 16;
        // The lower four bits count sixteenths; of eighths there are three bits, and the fourth is zero.
        let register = if by_eight { ((clocks >> 3) << 4) | (clocks & 7) } else { clocks };
        Some(Self { register: register as u16, by_eight })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_shared::link::rate::{FASTER_BAUDS, FIRST_BAUD};

    /// APB1 of the board.
    const BUS_HZ: u32 = 42_000_000;

    /// The rate that the generator makes, as the manual says: bus / (8 x (2 - OVER8) x USARTDIV).
    fn made_baud(Divider { register, by_eight }: Divider) -> f64 {
        let (mantissa, fraction) = (f64::from(register >> 4), f64::from(register & 0xf));
        let (times, parts) = if by_eight { (8.0, 8.0) } else { (16.0, 16.0) };
        f64::from(BUS_HZ) / (times * (mantissa + fraction / parts))
    }

    #[test]
    fn every_rate_of_the_line_is_divided_exactly() {
        for baud in FASTER_BAUDS.into_iter().chain([FIRST_BAUD]) {
            let divider = Divider::new(BUS_HZ, baud).unwrap();
            assert_eq!(made_baud(divider), f64::from(baud));
            assert!(!divider.by_eight || divider.register & 8 == 0);
        }
    }

    #[test]
    fn what_can_not_be_had_is_refused_and_the_rest_is_near() {
        for baud in (1200..6_000_000).step_by(977) {
            match Divider::new(BUS_HZ, baud) {
                Some(divider) => {
                    assert!((made_baud(divider) / f64::from(baud) - 1.0).abs() < 0.0102, "{baud}")
                }
                None => assert!(baud > 1_000_000 / 2, "{baud}"),
            }
        }
        assert_eq!((Divider::new(BUS_HZ, 0), Divider::new(BUS_HZ, 6_000_000)), (None, None));
    }
}
