//! The image for processor in the loop: the same firmware, with its joints at the other end of the link.
//!
//! In QEMU, the arguments of `-semihosting-config` say how the host is reached:
//!
//! | arguments | |
//! |---|---|
//! | `fifo IN OUT` | two named pipes; the one to read is opened first. Ends QEMU when the host closes it |
//! | `uart` | USART2, as on hardware |
//! | `bench` | not at all: the module `bench` of the library |
//!
//! On hardware it is always USART2: there is no one to ask.
#![cfg_attr(target_os = "none", no_std, no_main)]
// The framework's macro writes some.
#![cfg_attr(target_os = "none", allow(unsafe_code))]

#[cfg(target_os = "none")]
#[rtic::app(device = blindgrasp_firmware::board::pac, peripherals = true)]
mod app {
    use blindgrasp_firmware::board::serial::{Interrupt, Line};
    use blindgrasp_firmware::boards::Board;
    use blindgrasp_firmware::control::Control;
    use blindgrasp_firmware::link::Port;
    use blindgrasp_firmware::model::IMAGE_PIL;
    use blindgrasp_firmware::pil::{Lockstep, Way};
    use blindgrasp_firmware::semihosting::{self, Access, File};
    use blindgrasp_firmware::start::{self, Memory};
    use blindgrasp_firmware::{Chosen, bench, schedule};
    use cortex_m::peripheral::SYST;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        interrupt: Interrupt,
        line: Line,
        control: &'static mut Control,
        timer: SYST,
        is_emulated: bool,
    }

    #[init(local = [memory: Memory = Memory::new()])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        let board = Chosen::new(cx.device);
        let is_emulated = board.found().is_emulated();
        let (control, line, interrupts) = start::pil(board, &IMAGE_PIL, cx.local.memory);
        schedule::start_cycle_counter(&mut cx.core.DCB, &mut cx.core.DWT);
        (Shared {}, Local { interrupt: interrupts.line, line, control, timer: cx.core.SYST, is_emulated })
    }

    /// A byte from the line.
    #[task(binds = USART2, priority = 1, local = [interrupt])]
    fn byte(cx: byte::Context) {
        cx.local.interrupt.serve();
    }

    /// Everything else: there is no time here that anything would have to be done in.
    #[idle(local = [line, control, timer, is_emulated])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources { line, control, timer, is_emulated, .. } = cx.local;
        let mut buffer = [0; 512];
        let arguments = if *is_emulated { semihosting::arguments(&mut buffer) } else { Some("uart") };
        let mut arguments = arguments.unwrap_or("").split_ascii_whitespace();
        let done = match (arguments.next(), arguments.next(), arguments.next()) {
            (Some("uart"), None, None) => {
                run(Waiting(line), control);
                Ok(())
            }
            (Some("fifo"), Some(from), Some(to)) => pipes(from, to).map(|pipes| run(pipes, control)),
            (Some("bench"), None, None) => bench::run(timer, control),
            _ => Err("the arguments have to be `fifo IN OUT`, `uart` or `bench`"),
        };
        // The line never hangs up, so this is QEMU.
        match done {
            Ok(()) => semihosting::exit(0),
            Err(reason) => {
                if let Some(mut output) = File::standard_output() {
                    let _ = output.write(b"pil: ") && output.write(reason.as_bytes()) && output.write(b"\n");
                }
                semihosting::exit(1)
            }
        }
    }

    fn run(way: impl Way, control: &mut Control) {
        Lockstep::new(way, control, schedule::cycle_count).run();
    }

    /// USART2, waited for.
    struct Waiting<'l>(&'l mut Line);

    impl Way for Waiting<'_> {
        fn receive(&mut self) -> Option<u8> {
            loop {
                if let Some(byte) = self.0.receive() {
                    return Some(byte);
                }
            }
        }

        fn send(&mut self, bytes: &[u8]) -> Option<()> {
            let mut rest = bytes;
            while !rest.is_empty() {
                rest = rest.get(self.0.send(rest)..)?;
            }
            Some(())
        }
    }

    /// Two named pipes.
    struct Pipes {
        from: File,
        to: File,
        /// The bytes that were read, of which some were taken.
        buffer: [u8; 512],
        taken: usize,
        length: usize,
    }

    fn pipes(from: &str, to: &str) -> Result<Pipes, &'static str> {
        let from = File::open(from, Access::Read).ok_or("the pipe to read from could not be opened")?;
        let to = File::open(to, Access::Write).ok_or("the pipe to write to could not be opened")?;
        Ok(Pipes { from, to, buffer: [0; 512], taken: 0, length: 0 })
    }

    impl Way for Pipes {
        fn receive(&mut self) -> Option<u8> {
            if self.taken == self.length {
                self.length = self.from.read(&mut self.buffer).len();
                self.taken = 0;
            }
            let byte = *self.buffer.get(..self.length)?.get(self.taken)?;
            self.taken += 1;
            Some(byte)
        }

        fn send(&mut self, bytes: &[u8]) -> Option<()> {
            self.to.write(bytes).then_some(())
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is an image for a microcontroller: build it with --target thumbv7em-none-eabihf");
    std::process::exit(2);
}
