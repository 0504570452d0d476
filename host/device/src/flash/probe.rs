//! The probe that is meant, and a session on the right chip.

use super::Chip;
use crate::options::{OptionsError, Words};
use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::probe::{DebugProbeError, DebugProbeInfo, DebugProbeSelector, Probe};
use probe_rs::{Core, MemoryInterface, Permissions, Session};
use std::fmt::Write as _;
use std::time::Duration;

/// Longest time that halting may take.
const HALT_TIMEOUT: Duration = Duration::from_millis(500);

/// The reason for which there is no session.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// The text that was asked for is not a selector.
    #[error(
        "`{0}` does not select a probe; write VID:PID or VID:PID:SERIAL in hexadecimal, such as 0483:374b"
    )]
    BadSelector(String),
    /// No probe is connected.
    #[error(
        "no debug probe found (ST-Link, J-Link, CMSIS-DAP, ...); check that its USB cable carries data and, on Linux, that \
        udev rules let you use it (https://probe.rs/docs/getting-started/probe-setup)"
    )]
    None,
    /// Probes are connected, but not that one.
    #[error("no debug probe is `{selector}`; connected are: {}", .connected.join("; "))]
    NoSuchProbe {
        /// The text that was asked for.
        selector: String,
        /// The probes that are connected.
        connected: Vec<String>,
    },
    /// There is more than one.
    #[error("{} debug probes are connected; choose one with --probe: {}", .0.len(), .0.join("; "))]
    Several(Vec<String>),
    /// This user may not use it.
    #[error(
        "the debug probe {0} is there, but you may not use it; install the udev rules of \
        https://probe.rs/docs/getting-started/probe-setup and plug it in again"
    )]
    NoPermission(String),
    /// It does not open.
    #[error("the debug probe {probe} cannot be opened; is another program using it?")]
    Open {
        /// The probe.
        probe: String,
        /// The cause.
        source: DebugProbeError,
    },
    /// The chip does not answer as it should.
    #[error(
        "the debug probe {probe} finds no {chip}{voltage}; check supply, SWDIO, SWCLK, ground and reset, and --chip \
        (under reset: {under_reset})"
    )]
    Attach {
        /// The probe.
        probe: String,
        /// The chip.
        chip: String,
        /// The supply voltage that the probe measures.
        voltage: String,
        /// The error of the second try, with reset held.
        under_reset: String,
        /// The error of the first.
        source: Box<probe_rs::Error>,
    },
    /// Another chip answers.
    #[error(
        "the connected chip is {found}; nothing was erased; check --chip, which is {chip}, and which board is connected"
    )]
    OtherChip {
        /// The chip that it should be.
        chip: String,
        /// The chip that it is.
        found: String,
    },
    /// Its option bytes may be laid out in another way.
    #[error(
        "--brown-out knows the option bytes of devices {OPTION_DEVICE:#05x} alone (reference manual RM0090), and not those of \
        {0}; nothing was changed"
    )]
    OtherOptions(String),
    /// Its option bytes are not as they should be.
    #[error(transparent)]
    Options(#[from] OptionsError<probe_rs::Error>),
    /// It breaks off.
    #[error("the chip {0} stopped answering; check the wiring")]
    Lost(String, #[source] Box<probe_rs::Error>),
}

/// The probe that is meant: the one that is selected, or the only one.
///
/// # Errors
/// If there is none, or more than one.
pub fn choose(lister: &Lister, selector: Option<&str>) -> Result<DebugProbeInfo, ProbeError> {
    let all = lister.list_all_with_access();
    if all.is_empty() {
        return Err(ProbeError::None);
    }
    let matching: Vec<_> = match selector {
        None => all.clone(),
        Some(text) => {
            let wanted: DebugProbeSelector =
                text.parse().map_err(|_| ProbeError::BadSelector(text.to_owned()))?;
            all.iter().filter(|item| wanted.matches_probe(&item.info)).cloned().collect()
        }
    };
    match matching.as_slice() {
        [] => {
            let selector = selector.unwrap_or_default().to_owned();
            Err(ProbeError::NoSuchProbe { selector, connected: describe_all(&all) })
        }
        [one] if one.accessibility == Accessibility::PermissionDenied => {
            Err(ProbeError::NoPermission(describe(&one.info)))
        }
        [one] => Ok(one.info.clone()),
        several => Err(ProbeError::Several(describe_all(several))),
    }
}

fn describe_all(items: &[ProbeListItem]) -> Vec<String> {
    items.iter().map(|item| describe(&item.info)).collect()
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
pub fn attach(info: &DebugProbeInfo, chip: &Chip, expected: Option<u32>) -> Result<Session, ProbeError> {
    let mut probe = open(info)?;
    let voltage = match probe.get_target_voltage() {
        Ok(Some(voltage_v)) => format!(" (its supply is at {voltage_v:.2} V)"),
        _ => String::new(),
    };
    let permissions = Permissions::default;
    let mut session = match probe.attach(chip.target().clone(), permissions()) {
        Ok(session) => session,
        Err(source) => match open(info)?.attach_under_reset(chip.target().clone(), permissions()) {
            Ok(session) => session,
            Err(second) => {
                return Err(ProbeError::Attach {
                    probe: describe(info),
                    chip: chip.name().to_owned(),
                    voltage,
                    under_reset: chain(&second),
                    source: Box::new(source),
                });
            }
        },
    };
    check_device(&mut session, chip, expected)?;
    Ok(session)
}

fn open(info: &DebugProbeInfo) -> Result<Probe, ProbeError> {
    info.open().map_err(|source| ProbeError::Open { probe: describe(info), source })
}

/// An error with its causes, in one line.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let _ = write!(text, ": {error}");
        cause = error.source();
    }
    text
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
) -> Result<T, ProbeError> {
    let lost = |error| ProbeError::Lost(chip.name().to_owned(), Box::new(error));
    if !has_idcode(chip) {
        return Err(ProbeError::OtherOptions(chip.name().to_owned()));
    }
    let mut core = session.core(0).map_err(lost)?;
    let found = device(core.read_word_32(DBGMCU_IDCODE).map_err(lost)?);
    if found != OPTION_DEVICE {
        return Err(ProbeError::OtherOptions(format!("a device {found:#05x}")));
    }
    core.halt(HALT_TIMEOUT).map_err(lost)?;
    Ok(act(&mut Halted(&mut core))?)
}

/// Returns `true` if it has the two registers that are looked at where those of an STM32F4 are.
fn has_idcode(chip: &Chip) -> bool {
    chip.name().to_ascii_uppercase().starts_with("STM32F4")
}

fn check_device(session: &mut Session, chip: &Chip, expected: Option<u32>) -> Result<(), ProbeError> {
    let lost = |error| ProbeError::Lost(chip.name().to_owned(), Box::new(error));
    if !has_idcode(chip) {
        return Ok(());
    }
    let mut core = session.core(0).map_err(lost)?;
    let idcode = core.read_word_32(DBGMCU_IDCODE).map_err(lost)?;
    let flash_kib = core.read_word_16(FLASH_SIZE_KIB).map_err(lost)?;
    let flash = &chip.memory().flash;
    match contradiction(expected, flash.end - flash.start, idcode, flash_kib) {
        Some(found) => Err(ProbeError::OtherChip { chip: chip.name().to_owned(), found }),
        None => Ok(()),
    }
}
