//! No firmware, but a proof: the control task alone, with a panic handler that calls what does not exist. It links only
//! if nothing on the way of the control task can panic. It is never run.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(target_os = "none", allow(unsafe_code))]

#[cfg(target_os = "none")]
mod proof {
    use blindgrasp_firmware::Chosen;
    use blindgrasp_firmware::tasks::ControlTask;
    use core::hint::black_box;
    use core::panic::PanicInfo;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        loop {
            // SAFETY: this is never run.
            let task: &mut ControlTask<Chosen> = unsafe { &mut *black_box(core::ptr::null_mut()) };
            task.run();
        }
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        unsafe extern "C" {
            fn the_control_task_can_panic() -> !;
        }
        // SAFETY: it can't be called, for it does not exist.
        unsafe { the_control_task_can_panic() }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
