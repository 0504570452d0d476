//! Chips, as probe-rs knows them.

use crate::image::{Firmware, Footprint, Memory};
use anyhow::{Context, Result, bail};
use probe_rs::config::{FlashProperties, MemoryRegion, Registry, RegistryError, SectorDescription};
use probe_rs::flashing::FlashLoader;
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

impl Chip {
    /// Looks a chip up in probe-rs' own list.
    ///
    /// # Errors
    /// If there is none of this name, or it is of no use for firmware of blindgrasp.
    pub fn by_name(name: &str) -> Result<Self> {
        let registry = Registry::from_builtin_families();
        let target = match registry.get_target_by_name(name) {
            Ok(target) => target,
            Err(RegistryError::ChipNotFound(_) | RegistryError::ChipNotUnique(..)) => {
                match similar(&registry, name).join(", ").as_str() {
                    "" => bail!(
                        "no chip is called `{name}`; give its full name, as https://probe.rs/targets has it"
                    ),
                    names => bail!("no chip is called `{name}`; did you mean {names}?"),
                }
            }
            Err(error) => {
                return Err(error)
                    .with_context(|| format!("the description of the chip `{name}` cannot be used"));
            }
        };
        let name = &target.name;
        if target.architecture() != Architecture::Arm {
            bail!(
                "the chip `{name}` has no Arm core, so that no firmware of blindgrasp runs on it; check --chip"
            );
        }
        let memory = memory(&target)
            .with_context(|| format!("the chip `{name}` has no flash that it boots from; check --chip"))?;
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
    pub fn check(&self, firmware: &Firmware<'_>) -> Result<Footprint> {
        let footprint = firmware.footprint(&self.memory)?;
        self.loader(firmware)?;
        Ok(footprint)
    }

    /// The image, ready to be written. probe-rs would write to RAM and to one-time-programmable memory too, which is why
    /// our own rules come first.
    pub(super) fn loader(&self, firmware: &Firmware<'_>) -> Result<FlashLoader> {
        firmware.footprint(&self.memory)?;
        let mut loader = self.target.flash_loader();
        for (address, bytes) in firmware.stored() {
            loader
                .add_data(address, bytes)
                .with_context(|| format!("what the image holds at {address:#010x} cannot be flashed"))?;
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
