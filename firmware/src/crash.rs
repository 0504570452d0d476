//! The last panic or hard fault, kept in RAM over the reset that follows it.
//!
//! RAM keeps its contents over every reset but a power cycle. The record lies in the section `.uninit`, which start-up
//! neither clears nor loads, and a checksum tells it from whatever RAM holds after power-on.
#![allow(unsafe_code)]

use blindgrasp_shared::identity::{Crash, CrashKind};
use core::arch::naked_asm;
#[cfg(not(feature = "no-panic"))]
use core::panic::PanicInfo;
use core::ptr::addr_of_mut;
use cortex_m::peripheral::SCB;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// Of file names and of the record: slow and small, for it is used once.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// The words that are kept: kind, program counter, link register, line, hash of the file's name; and a checksum of
/// them.
type Words = [u32; 6];

const PANIC: u32 = 1;
const HARD_FAULT: u32 = 2;

#[unsafe(link_section = ".uninit.crash")]
static mut KEPT: Words = [0; 6];

/// The crash before this boot, if it was one that ended the last run. It is told once.
pub fn take() -> Option<Crash> {
    let kept = addr_of_mut!(KEPT);
    // SAFETY: `KEPT` is valid for reads and writes, any bits are a `Words`, and no one else has a reference to it. It
    // is volatile because its value comes from before the reset.
    let words = unsafe { kept.read_volatile() };
    // SAFETY: as above.
    unsafe { kept.write_volatile([0; 6]) };
    let [kind, program_counter, link_register, line, file_hash, sum] = words;
    if sum != checksum(&words) {
        return None;
    }
    let kind = match kind {
        PANIC => CrashKind::Panic,
        HARD_FAULT => CrashKind::HardFault,
        _ => return None,
    };
    Some(Crash { kind, program_counter, link_register, line, file_hash })
}

/// Keeps a record and resets.
fn keep_and_reset(mut words: Words) -> ! {
    words[5] = checksum(&words);
    // SAFETY: as in `take`; nothing else runs any more.
    unsafe { addr_of_mut!(KEPT).write_volatile(words) };
    SCB::sys_reset()
}

/// CRC-32 of all words but the last.
fn checksum(words: &Words) -> u32 {
    let mut digest = CRC.digest();
    for word in words.iter().take(5) {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

#[cfg(not(feature = "no-panic"))]
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    let (line, file_hash) =
        info.location().map_or((0, 0), |at| (at.line(), CRC.checksum(at.file().as_bytes())));
    keep_and_reset([PANIC, 0, 0, line, file_hash, 0])
}

/// The hard fault handler. Every other fault escalates to it, since none is enabled.
///
/// It takes the program counter and the link register from what the processor pushed, then gives the stack up and
/// starts a new one: the fault may be that there is no stack left. Then what was pushed is lost, and both are zero.
///
/// # Safety
/// Entered by the processor only.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "ldr r2, =_stack_end",
        "movs r0, #0",
        "movs r1, #0",
        "cmp sp, r2",
        "blo 2f",
        "ldr r0, [sp, #24]",
        "ldr r1, [sp, #20]",
        "2:",
        "ldr r2, =_stack_start",
        "mov sp, r2",
        "b {record}",
        record = sym record_hard_fault,
    )
}

extern "C" fn record_hard_fault(program_counter: u32, link_register: u32) -> ! {
    keep_and_reset([HARD_FAULT, program_counter, link_register, 0, 0, 0])
}
