//! Processor in the loop without a processor: the protocol against a device in this process, and QEMU's process against
//! programs that only look like QEMU. What needs QEMU itself is in `tests/`.

#[cfg(unix)]
mod command;
mod device;
mod faults;
mod protocol;
#[cfg(unix)]
mod qemu;
