//! Processor in the loop without a processor: the protocol against a device in this process, and QEMU's process against
//! programs that only look like QEMU. What needs QEMU itself is in `tests/`.

#[cfg(unix)]
mod command;
mod device;
#[path = "../elf/mod.rs"]
#[allow(dead_code, reason = "only a good image is needed here")]
mod elf;
mod faults;
mod protocol;
#[cfg(unix)]
mod qemu;
