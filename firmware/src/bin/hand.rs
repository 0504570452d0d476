//! The image with real joints.
#![cfg_attr(target_os = "none", no_std, no_main)]
// The framework's macro writes some.
#![cfg_attr(target_os = "none", allow(unsafe_code))]

#[cfg(target_os = "none")]
#[rtic::app(device = blindgrasp_firmware::board::pac, peripherals = true)]
mod app {
    use blindgrasp_firmware::Chosen;
    use blindgrasp_firmware::board::boot::Interrupts;
    use blindgrasp_firmware::board::dma::{Receiving, Sending};
    use blindgrasp_firmware::board::{Buses, serial, supply};
    use blindgrasp_firmware::boards::Board;
    use blindgrasp_firmware::model::IMAGE_HAND;
    use blindgrasp_firmware::queue::Queues;
    use blindgrasp_firmware::start::{self, Memory};
    use blindgrasp_firmware::tasks::{ControlTask, IdleTask};
    use blindgrasp_firmware::{report, schedule};

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        line: serial::Interrupt,
        /// On hardware.
        receiving: Option<Receiving>,
        sending: Option<Sending>,
        control: ControlTask<Chosen>,
        idle: IdleTask<Chosen>,
    }

    #[init(local = [memory: Memory = Memory::new(), queues: Queues = Queues::new(), buses: Buses = Buses::new()])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        let board = Chosen::new(cx.device);
        let timer_hz = start::timer_hz::<Chosen>(board.found());
        let (control, idle, interrupts) =
            start::hand(board, &IMAGE_HAND, cx.local.memory, cx.local.queues, cx.local.buses);
        let Interrupts { line, receiving, sending } = interrupts;
        schedule::start_cycle_counter(&mut cx.core.DCB, &mut cx.core.DWT);
        let period_us = control.control.device().params().config().period_us;
        schedule::start(&mut cx.core.SYST, timer_hz, period_us);
        (Shared {}, Local { line, receiving, sending, control, idle })
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
    #[task(binds = SysTick, priority = 2, local = [control])]
    fn control(cx: control::Context) {
        cx.local.control.run();
    }

    /// The supply sags: the amplifiers lose their power now, and the next tick finds the fault.
    #[task(binds = PVD, priority = 4)]
    fn supply_low(_: supply_low::Context) {
        Chosen::amplifiers_off();
        supply::sagged();
    }

    /// The line has fallen silent, or a byte had an error; emulated, a byte came.
    #[task(binds = USART2, priority = 3, local = [line])]
    fn line(cx: line::Context) {
        cx.local.line.serve();
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
    #[idle(local = [idle])]
    fn idle(cx: idle::Context) -> ! {
        let idle = cx.local.idle;
        loop {
            if let Some(errors) = idle.poll() {
                report::line(&errors);
            }
            // Without interrupts, so that one that comes after the look is not slept through: it ends the sleep, and is
            // served after it.
            cortex_m::interrupt::free(|_| {
                if idle.is_idle() {
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
