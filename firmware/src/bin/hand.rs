//! The image with real joints.
#![cfg_attr(target_os = "none", no_std, no_main)]
// The framework's macro writes some.
#![cfg_attr(target_os = "none", allow(unsafe_code))]

#[cfg(target_os = "none")]
#[rtic::app(device = blindgrasp_firmware::board::pac, peripherals = true)]
mod app {
    use blindgrasp_firmware::board::boot::Boot;
    use blindgrasp_firmware::board::dma::{Receiving, Sending};
    use blindgrasp_firmware::board::serial::{self, Interrupt, Line};
    use blindgrasp_firmware::board::supply;
    use blindgrasp_firmware::board::{self, Buses, HandJoints};
    use blindgrasp_firmware::control::{Control, HandBurst, Timing, task};
    use blindgrasp_firmware::link::Link;
    use blindgrasp_firmware::model::IMAGE_HAND;
    use blindgrasp_firmware::queue::{ControlEnd, Queues, StoreEnd};
    use blindgrasp_firmware::report::{self, LineReport};
    use blindgrasp_firmware::{saved, schedule};
    use blindgrasp_shared::store::Store;
    use core::mem::MaybeUninit;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        interrupt: Interrupt,
        /// On hardware.
        receiving: Option<Receiving>,
        sending: Option<Sending>,
        control: &'static mut Control,
        joints: HandJoints,
        queues: ControlEnd<'static>,
        last: Timing,
        /// On hardware.
        watchdog: Option<board::Watchdog>,
        link: Link<'static, Line>,
        /// On hardware, with the hash of the hand.
        store: Option<(Store<board::SavedFlash>, u32)>,
        store_end: StoreEnd<'static>,
    }

    #[init(local = [all_queues: Queues = Queues::new(), buses: Buses = Buses::new(), burst: HandBurst = HandBurst::new(), place: MaybeUninit<Control> = MaybeUninit::uninit()])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        let device = cx.device;
        supply::start(&device.PWR, &device.EXTI, &device.RCC);
        let mut boot = Boot::new(device.RCC, &device.DBGMCU, device.FLASH);
        report::start(&boot, &IMAGE_HAND);
        let (line_pins, joint_pins) = board::pins(device.GPIOA, device.GPIOB, device.GPIOC, &mut boot.rcc);
        // The outputs are off: the pins have just become some.
        let (flash, mut store) = (boot.flash.take(), None);
        let restore = |hash, params: &mut _| {
            let (found, restored) = saved::restore(flash?, hash, params)?;
            store = Some((found, hash));
            Some(restored)
        };
        let control = boot.control(&IMAGE_HAND, restore, cx.local.burst, cx.local.place);
        let dma = (!boot.is_emulated()).then_some(device.DMA1);
        let rcc = &mut boot.rcc;
        let joints = board::joints(device.SPI1, device.SPI2, joint_pins, cx.local.buses, rcc);
        let (interrupt, line, streams) = serial::start(device.USART2, dma, line_pins, rcc)
            .expect("the board's baud rate can be had from its clock");
        let (receiving, sending) = streams.unzip();
        let (queues, link_end, store_end) = cx.local.all_queues.split();
        let period_us = control.device().params().config().period_us;

        let watchdog = (!boot.is_emulated()).then(|| board::watchdog(device.IWDG, &device.DBGMCU));
        schedule::start_cycle_counter(&mut cx.core.DCB, &mut cx.core.DWT);
        schedule::start(&mut cx.core.SYST, period_us, boot.is_emulated());
        let local = Local {
            interrupt,
            receiving,
            sending,
            control,
            joints,
            queues,
            last: Timing::default(),
            watchdog,
            link: Link::new(line, link_end),
            store,
            store_end,
        };
        (Shared {}, local)
    }

    /// The control task.
    ///
    /// - **Starts** it: SysTick, every millisecond (the period of the hand's configuration).
    /// - **Deadline**: the next start. Within it, 12 joints take about 0.36 ms on the buses (reckoned in `board`), the tick
    ///   about 0.1 ms. Nothing but the line's interrupts get in between: some 50 cycles, once for each frame that is received
    ///   or sent.
    /// - **Late**: the turn is finished, and the next one begins at once; starts beyond that one are lost. The next tick
    ///   is told, counts it, and makes it a fault when there are too many.
    /// - **Never ends**: nobody feeds the watchdog, and the hand is reset.
    #[task(binds = SysTick, priority = 2, local = [control, joints, queues, last, watchdog])]
    fn control(cx: control::Context) {
        let control::LocalResources { control, joints, queues, last, watchdog, .. } = cx.local;
        *last = task(control, joints, queues, *last);
        // What the turn wrote may have come after the interrupt.
        if supply::is_low() {
            board::amplifiers_off();
        }
        if let Some(watchdog) = watchdog {
            watchdog.feed();
        }
    }

    /// The supply sags: the amplifiers lose their power now, and the next tick finds the fault.
    #[task(binds = PVD, priority = 4)]
    fn supply_low(_: supply_low::Context) {
        board::amplifiers_off();
        supply::sagged();
    }

    /// The line has fallen silent, or a byte had an error; emulated, a byte came.
    #[task(binds = USART2, priority = 3, local = [interrupt])]
    fn line(cx: line::Context) {
        cx.local.interrupt.serve();
    }

    /// A lap of what is received. Before the control task: the next lap must not end uncounted.
    #[task(binds = DMA1_STREAM5, priority = 3, local = [receiving])]
    fn received(cx: received::Context) {
        if let Some(receiving) = cx.local.receiving {
            receiving.serve();
        }
    }

    /// The end of a transfer that sends, or something to send. Before the control task: the line goes on during it.
    #[task(binds = DMA1_STREAM6, priority = 3, local = [sending])]
    fn sent(cx: sent::Context) {
        if let Some(sending) = cx.local.sending {
            sending.serve();
        }
    }

    /// All that has time: frames, what is saved, and logs.
    #[idle(local = [link, store, store_end, report: LineReport = LineReport::new()])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources { link, store, store_end, report, .. } = cx.local;
        loop {
            link.poll(schedule::ticks());
            store_end.poll(store);
            report.poll(link.counters());
            // Without interrupts, so that one that comes after the look is not slept through: it ends the sleep, and is
            // served after it.
            cortex_m::interrupt::free(|_| {
                if link.is_idle() {
                    cortex_m::asm::wfi();
                }
            });
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is an image for a microcontroller: build it with --target thumbv7em-none-eabihf");
    std::process::exit(2);
}
