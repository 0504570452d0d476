//! Probe of size.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![allow(unsafe_code)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod on_target {
    use blindgrasp_firmware::model::{CONFIG, FINGERS, HAND, JOINTS};
    use blindgrasp_shared::tick::Params;
    use core::hint::black_box;

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        loop {}
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let params: Result<Params<f32, JOINTS, FINGERS>, _> = Params::new(HAND.clone(), &CONFIG);
        loop {
            black_box(&params);
        }
    }
}
