//! The probe that is meant, and a session on the right chip.

use super::Chip;
use crate::options::{OptionsError, Words};
use anyhow::{Context, Result, anyhow, bail};
use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::probe::{DebugProbeInfo, DebugProbeSelector, Probe};
use probe_rs::{Core, MemoryInterface, Permissions, Session};
use std::time::Duration;

/// Longest time that halting may take.
const HALT_TIMEOUT: Duration = Duration::from_millis(500);

/// The probe that is meant: the one that is selected, or the only one.
///
/// # Errors
/// If there is none, or more than one.
pub fn choose(lister: &Lister, selector: Option<&str>) -> Result<DebugProbeInfo> {
    let all = lister.list_all_with_access();
    if all.is_empty() {
        bail!(
            "no debug probe found (ST-Link, J-Link, CMSIS-DAP, ...); check that its USB cable carries data and, on Linux, that \
             udev rules let you use it (https://probe.rs/docs/getting-started/probe-setup)"
        );
    }
    let wanted: Option<DebugProbeSelector> = match selector {
        None => None,
        Some(text) => Some(text.parse().ok().with_context(|| {
            format!("`{text}` does not select a probe; write VID:PID or VID:PID:SERIAL in hexadecimal, such as 0483:374b")
        })?),
    };
    let is_meant =
        |item: &&ProbeListItem| wanted.as_ref().is_none_or(|wanted| wanted.matches_probe(&item.info));
    let meant: Vec<_> = all.iter().filter(is_meant).collect();
    match meant.as_slice() {
        [] => bail!(
            "no debug probe is `{}`; connected are: {}",
            selector.unwrap_or_default(),
            describe_all(all.iter())
        ),
        [one] if one.accessibility == Accessibility::PermissionDenied => bail!(
            "the debug probe {} is there, but you may not use it; install the udev rules of \
             https://probe.rs/docs/getting-started/probe-setup and plug it in again",
            describe(&one.info)
        ),
        [one] => Ok(one.info.clone()),
        several => bail!(
            "{} debug probes are connected; choose one with --probe: {}",
            several.len(),
            describe_all(several.iter().copied())
        ),
    }
}

fn describe_all<'a>(items: impl Iterator<Item = &'a ProbeListItem>) -> String {
    items.map(|item| describe(&item.info)).collect::<Vec<_>>().join("; ")
}

/// Its selector, and what it calls itself.
pub fn describe(info: &DebugProbeInfo) -> String {
    format!("{} ({})", DebugProbeSelector::from(info), info.identifier)
}

/// Connects to a chip, and checks that it is the device that the image expects, if there is one, with as much flash as it
/// should have. A chip that does not answer is tried again with its reset held, which helps against firmware that sleeps or has
/// its debug pins in use.
///
/// # Errors
/// If it is not there, or another one.
pub fn attach(info: &DebugProbeInfo, chip: &Chip, expected: Option<u32>) -> Result<Session> {
    let mut probe = open(info)?;
    let voltage = match probe.get_target_voltage() {
        Ok(Some(voltage_v)) => format!(" (its supply is at {voltage_v:.2} V)"),
        _ => String::new(),
    };
    let permissions = Permissions::default;
    let mut session = match probe.attach(chip.target().clone(), permissions()) {
        Ok(session) => session,
        Err(first) => {
            open(info)?.attach_under_reset(chip.target().clone(), permissions()).map_err(|second| {
                let (probe, chip, under_reset) = (describe(info), chip.name(), anyhow!(second));
                anyhow!(first).context(format!(
                    "the debug probe {probe} finds no {chip}{voltage}; check supply, SWDIO, SWCLK, ground and reset, and --chip \
                     (under reset: {under_reset:#})"
                ))
            })?
        }
    };
    check_device(&mut session, chip, expected)?;
    Ok(session)
}

fn open(info: &DebugProbeInfo) -> Result<Probe> {
    info.open().with_context(|| {
        format!("the debug probe {} cannot be opened; is another program using it?", describe(info))
    })
}

/// DBGMCU_IDCODE of the STM32F4 (RM0090, 38.6.1): the device in its low 12 bits.
const DBGMCU_IDCODE: u64 = 0xE004_2000;
/// Size of the flash, KiB (RM0090, 39.2).
const FLASH_SIZE_KIB: u64 = 0x1FFF_7A22;

/// The device whose option register is known: [`options`](crate::options).
const OPTION_DEVICE: u32 = 0x413;

/// The device of a chip, from the word at DBGMCU_IDCODE.
fn device(idcode: u32) -> u32 {
    match idcode & 0xFFF {
        // The first silicon of that one (errata sheet ES0182, 2.1.1).
        0x411 => 0x413,
        device => device,
    }
}

/// Returns the contradiction between a connected chip and the one that is meant; nothing if it may be. `expected` is
/// what the image says of it.
///
/// `idcode` is the word at DBGMCU_IDCODE, `flash_kib` the half-word that tells the size of the flash.
pub fn contradiction(expected: Option<u32>, flash_bytes: u64, idcode: u32, flash_kib: u16) -> Option<String> {
    let found = device(idcode);
    if let Some(expected) = expected.filter(|&expected| expected != found) {
        return Some(format!("a device {found:#05x}, where the image is for a device {expected:#05x}"));
    }
    let smaller = u64::from(flash_kib) * 1024 < flash_bytes;
    smaller.then(|| format!("one with {flash_kib} KiB of flash in place of {}", flash_bytes / 1024))
}

/// A halted core as what option bytes are read and written through.
pub struct Halted<'a, 'b>(pub &'a mut Core<'b>);

impl Words for Halted<'_, '_> {
    type Error = probe_rs::Error;

    fn read(&mut self, address: u64) -> Result<u32, probe_rs::Error> {
        self.0.read_word_32(address)
    }

    fn write(&mut self, address: u64, word: u32) -> Result<(), probe_rs::Error> {
        self.0.write_word_32(address, word)
    }
}

/// Looks at the option bytes of a chip that has them as an STM32F4 does, with its core halted, or changes them.
///
/// # Errors
/// It is another chip, or what `act` says.
pub fn with_options<T>(
    session: &mut Session,
    chip: &Chip,
    act: impl FnOnce(&mut Halted<'_, '_>) -> Result<T, OptionsError<probe_rs::Error>>,
) -> Result<T> {
    let other = |chip: String| {
        anyhow!(
            "--brown-out knows the option bytes of devices {OPTION_DEVICE:#05x} alone (reference manual RM0090), and not those of \
             {chip}; nothing was changed"
        )
    };
    if !has_idcode(chip) {
        return Err(other(chip.name().to_owned()));
    }
    let lost = || lost(chip);
    let mut core = session.core(0).with_context(lost)?;
    let found = device(core.read_word_32(DBGMCU_IDCODE).with_context(lost)?);
    if found != OPTION_DEVICE {
        return Err(other(format!("a device {found:#05x}")));
    }
    core.halt(HALT_TIMEOUT).with_context(lost)?;
    Ok(act(&mut Halted(&mut core))?)
}

fn lost(chip: &Chip) -> String {
    format!("the chip {} stopped answering; check the wiring", chip.name())
}

/// Returns `true` if it has the two registers that are looked at where those of an STM32F4 are.
fn has_idcode(chip: &Chip) -> bool {
    chip.name().to_ascii_uppercase().starts_with("STM32F4")
}

fn check_device(session: &mut Session, chip: &Chip, expected: Option<u32>) -> Result<()> {
    if !has_idcode(chip) {
        return Ok(());
    }
    let lost = || lost(chip);
    let mut core = session.core(0).with_context(lost)?;
    let idcode = core.read_word_32(DBGMCU_IDCODE).with_context(lost)?;
    let flash_kib = core.read_word_16(FLASH_SIZE_KIB).with_context(lost)?;
    let flash = &chip.memory().flash;
    if let Some(found) = contradiction(expected, flash.end - flash.start, idcode, flash_kib) {
        let chip = chip.name();
        bail!(
            "the connected chip is {found}; nothing was erased; check --chip, which is {chip}, and which board is connected"
        );
    }
    Ok(())
}
