//! Files, arguments and the end of the emulation, asked of QEMU by a breakpoint instruction (Arm, "Semihosting for
//! AArch32 and AArch64", IHI/DUI 0471). Without a debugger that instruction is a hard fault on hardware, so this is
//! only used by the image `pil`, and by it only when emulated.
#![allow(unsafe_code)]

use cortex_m_semihosting::syscall;

const SYS_OPEN: usize = 0x01;
const SYS_WRITE: usize = 0x05;
const SYS_READ: usize = 0x06;
const SYS_GET_CMDLINE: usize = 0x15;
const SYS_EXIT: usize = 0x18;
const SYS_EXIT_EXTENDED: usize = 0x20;
/// Reason of an exit: the application is done.
const APPLICATION_EXIT: usize = 0x20026;

/// The mode in which a file is opened: `fopen`'s "rb" and "wb".
#[derive(Clone, Copy)]
pub enum Access {
    /// For reading.
    Read = 1,
    /// For writing.
    Write = 5,
}

/// An open file.
pub struct File {
    handle: usize,
}

impl File {
    /// Opens a file. A named pipe is open once its other end is.
    pub fn open(path: &str, access: Access) -> Option<Self> {
        let mut name = [0_u8; 256];
        name.get_mut(..path.len())?.copy_from_slice(path.as_bytes());
        // The last byte has to be left as the end.
        if path.len() == name.len() {
            return None;
        }
        let block = [name.as_ptr() as usize, access as usize, path.len()];
        // SAFETY: the name ends with a zero, lives as long as the call, and its length is right.
        let handle = unsafe { syscall(SYS_OPEN, &block) };
        (handle != usize::MAX).then_some(Self { handle })
    }

    /// The file `:tt`: QEMU's standard output.
    pub fn standard_output() -> Option<Self> {
        Self::open(":tt", Access::Write)
    }

    /// Reads what there is, at least a byte; nothing at the end of the file.
    pub fn read<'b>(&mut self, buffer: &'b mut [u8]) -> &'b [u8] {
        let block = [self.handle, buffer.as_mut_ptr() as usize, buffer.len()];
        // SAFETY: the buffer is valid for writes of its length for as long as the call lasts.
        let missing = unsafe { syscall(SYS_READ, &block) };
        buffer.get(..buffer.len().saturating_sub(missing)).unwrap_or(&[])
    }

    /// Writes all of it; tells whether that could be done.
    pub fn write(&mut self, bytes: &[u8]) -> bool {
        let block = [self.handle, bytes.as_ptr() as usize, bytes.len()];
        // SAFETY: the bytes are valid for reads of their length for as long as the call lasts.
        unsafe { syscall(SYS_WRITE, &block) == 0 }
    }
}

/// The arguments of `-semihosting-config arg=...`, with spaces between them; `None` if they do not fit the buffer.
pub fn arguments(buffer: &mut [u8]) -> Option<&str> {
    let mut block = [buffer.as_mut_ptr() as usize, buffer.len()];
    // SAFETY: the buffer is valid for writes of its length; the call changes `block`, which is not used but to read the
    // length that it then has.
    let failed = unsafe { syscall(SYS_GET_CMDLINE, &mut block) } != 0;
    // SAFETY: `block` is valid; it was changed behind the compiler's back.
    let [_, length] = unsafe { (&raw const block).read_volatile() };
    if failed {
        return None;
    }
    core::str::from_utf8(buffer.get(..length)?).ok()
}

/// Ends QEMU with an exit code.
pub fn exit(code: u32) -> ! {
    let block = [APPLICATION_EXIT, code as usize];
    loop {
        // SAFETY: the block is as the call wants it.
        unsafe { syscall(SYS_EXIT_EXTENDED, &block) };
        // An emulator without the extended call knows only success.
        // SAFETY: this call takes no block.
        unsafe { cortex_m_semihosting::syscall1(SYS_EXIT, APPLICATION_EXIT) };
    }
}
