//! Chips, as probe-rs knows them.

use crate::image::{Firmware, FitError, Footprint, Memory};
use probe_rs::config::{FlashProperties, MemoryRegion, Registry, RegistryError, SectorDescription};
use probe_rs::flashing::{FlashError, FlashLoader};
use probe_rs::{Architecture, Target};
use std::ops::Range;

/// Most names that are suggested in place of an unknown one.
const SUGGESTIONS: usize = 8;

/// A chip that probe-rs can flash.
#[derive(Clone, Debug)]
pub struct Chip {
    target: Target,
    memory: Memory,
}

/// The reason for which a chip is not to be flashed, or not with this image.
#[derive(Debug, thiserror::Error)]
pub enum ChipError {
    /// probe-rs knows no such chip.
    #[error("no chip is called `{name}`{}", suggestion(.similar))]
    Unknown {
        /// The name that was asked for.
        name: String,
        /// Similar names.
        similar: Vec<String>,
    },
    /// Its description cannot be read.
    #[error("the description of the chip `{0}` cannot be used")]
    Description(String, #[source] RegistryError),
    /// It has no Arm core.
    #[error("the chip `{0}` has no Arm core, so that no firmware of blindgrasp runs on it; check --chip")]
    NotArm(String),
    /// It has no flash to boot from.
    #[error("the chip `{0}` has no flash that it boots from; check --chip")]
    NoFlash(String),
    /// The image does not fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// probe-rs would not write a part of the image.
    #[error("what the image holds at {address:#010x} cannot be flashed")]
    Refused {
        /// The address.
        address: u64,
        /// The cause.
        source: FlashError,
    },
}

fn suggestion(similar: &[String]) -> String {
    match similar {
        [] => "; give its full name, as https://probe.rs/targets has it".to_owned(),
        names => format!("; did you mean {}?", names.join(", ")),
    }
}

impl Chip {
    /// Looks a chip up in probe-rs' own list.
    ///
    /// # Errors
    /// If there is none of this name, or it is of no use for firmware of blindgrasp.
    pub fn by_name(name: &str) -> Result<Self, ChipError> {
        let registry = Registry::from_builtin_families();
        let target = registry.get_target_by_name(name).map_err(|error| match error {
            RegistryError::ChipNotFound(_) | RegistryError::ChipNotUnique(..) => {
                ChipError::Unknown { name: name.to_owned(), similar: similar(&registry, name) }
            }
            error => ChipError::Description(name.to_owned(), error),
        })?;
        if target.architecture() != Architecture::Arm {
            return Err(ChipError::NotArm(target.name));
        }
        let memory = memory(&target).ok_or_else(|| ChipError::NoFlash(target.name.clone()))?;
        Ok(Self { target, memory })
    }

    /// Its full name.
    pub fn name(&self) -> &str {
        &self.target.name
    }

    /// Its memory.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// probe-rs' description.
    pub(super) fn target(&self) -> &Target {
        &self.target
    }

    /// Checks that an image fits, by our own rules and by probe-rs'.
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self, firmware: &Firmware<'_>) -> Result<Footprint, ChipError> {
        let footprint = firmware.footprint(&self.memory)?;
        self.loader(firmware)?;
        Ok(footprint)
    }

    /// The image, ready to be written. probe-rs would write to RAM and to one-time-programmable memory too, which is why
    /// our own rules come first.
    pub(super) fn loader(&self, firmware: &Firmware<'_>) -> Result<FlashLoader, ChipError> {
        firmware.footprint(&self.memory)?;
        let mut loader = self.target.flash_loader();
        for (address, bytes) in firmware.stored() {
            loader.add_data(address, bytes).map_err(|source| ChipError::Refused { address, source })?;
        }
        Ok(loader)
    }
}

/// Names that start like this one.
fn similar(registry: &Registry, name: &str) -> Vec<String> {
    for length in (4..=name.chars().count()).rev() {
        let start: String = name.chars().take(length).collect();
        let mut names = registry.search_chips(&start);
        if !names.is_empty() {
            names.dedup();
            names.truncate(SUGGESTIONS);
            return names;
        }
    }
    Vec::new()
}

fn memory(target: &Target) -> Option<Memory> {
    let nvm: Vec<_> = target.memory_map.iter().filter_map(MemoryRegion::as_nvm_region).collect();
    let boot = nvm
        .iter()
        .find(|region| region.is_boot_memory())
        .or_else(|| nvm.iter().find(|region| region.is_executable()))?;
    // Banks that follow each other are one flash.
    let mut flash = boot.range.clone();
    while let Some(next) = nvm.iter().find(|region| region.range.start == flash.end && region.is_executable())
    {
        flash.end = next.range.end;
    }
    let sectors = target.flash_algorithms.iter().flat_map(|algorithm| sectors(&algorithm.flash_properties));
    let ram = target.memory_map.iter().filter_map(MemoryRegion::as_ram_region);
    let ram = ram.filter(|region| !region.is_alias).map(|region| region.range.clone()).collect();
    Some(Memory::new(flash, sectors.collect(), ram))
}

/// The sectors that an algorithm erases. They are described by where the first of each size is, from the start on.
fn sectors(flash: &FlashProperties) -> Vec<Range<u64>> {
    let Range { start, end } = flash.address_range;
    let firsts = &flash.sectors;
    let ends = firsts.iter().skip(1).map(|next| start + next.address).chain([end]);
    let alike = |(first, end): (&SectorDescription, u64)| {
        let begins = (start + first.address..end).step_by(first.size.max(1) as usize);
        begins.map(|begin| begin..begin + first.size).collect::<Vec<_>>()
    };
    firsts.iter().zip(ends).flat_map(alike).collect()
}
