//! Probe of size.
#![cfg_attr(target_os = "none", no_std, no_main)]
#[cfg(not(target_os = "none"))]
fn main() {}
#[cfg(target_os = "none")]
mod on_target {
    use blindgrasp_firmware::model::{CONFIG, HAND};
    use core::hint::black_box;
    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        loop {}
    }
    #[cortex_m_rt::entry]
    fn main() -> ! {
        let params = black_box((&HAND, &CONFIG));
        loop {
            black_box(&params);
        }
    }
}
