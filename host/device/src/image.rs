//! Firmware images: ELF files, read and judged before anything is erased.
//!
//! - The **identity** of an image says what it is and for which hand: [`Image`], found in the bytes that are loaded.
//! - Only **segments** count (`PT_LOAD`): where their bytes are stored (physical address), and where they are used
//!   (virtual address). Initialised variables are stored in flash and used in RAM, where start-up code copies them.
//! - The **vector table** is at the start of flash, from where the microcontroller boots: the initial stack pointer, then
//!   the address of the first instruction (Armv7-M Architecture Reference Manual, B1.5.3).

use blindgrasp_shared::identity::Image;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use blindgrasp_wire::printable;
use object::elf;
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, FileKind, Object, ObjectSymbol};
use std::fmt;
use std::ops::Range;

/// A firmware image.
#[derive(Clone, Debug)]
pub struct Firmware<'a> {
    /// Its own description.
    pub image: Image<'a>,
    /// The memory that it occupies, by physical address; none overlap in flash.
    pub segments: Vec<Segment<'a>>,
    /// Address of the control block of SEGGER's Real-Time Transfer, through which it logs.
    pub rtt_control_block: Option<u64>,
    /// Flash where it keeps what outlives flashing, saved parameters, by the symbols `_saved_start` and `_saved_end` of its
    /// `memory.x`.
    pub saved: Option<Range<u64>>,
    /// The device that it is for, as the chip calls itself, by the symbol `_chip_device` of its `memory.x`.
    pub device: Option<u32>,
}

/// A piece of memory that a firmware occupies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment<'a> {
    /// Address where its bytes are stored.
    pub physical_address: u64,
    /// Address where the firmware uses them.
    pub virtual_address: u64,
    /// The bytes that are stored; empty for variables that start as zero.
    pub bytes: &'a [u8],
    /// Number of bytes of memory that it takes where it is used.
    pub memory_bytes: u64,
}

impl Segment<'_> {
    /// Returns the addresses where its bytes are stored.
    pub fn stored(&self) -> Range<u64> {
        self.physical_address..self.physical_address + self.bytes.len() as u64
    }

    /// Returns the addresses that it takes where it is used.
    pub fn used(&self) -> Range<u64> {
        self.virtual_address..self.virtual_address + self.memory_bytes
    }
}

/// The memory of a chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    /// The flash that it boots from.
    pub flash: Range<u64>,
    /// RAM, in order; no two ranges touch.
    pub ram: Vec<Range<u64>>,
    /// Sectors of the flash: what is written to one erases all of it.
    pub sectors: Vec<Range<u64>>,
}

impl Memory {
    /// Ranges of RAM that touch become one.
    pub fn new(flash: Range<u64>, sectors: Vec<Range<u64>>, mut ram: Vec<Range<u64>>) -> Self {
        ram.sort_by_key(|range| range.start);
        let mut merged: Vec<Range<u64>> = Vec::with_capacity(ram.len());
        for range in ram {
            match merged.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => merged.push(range),
            }
        }
        Self { flash, ram: merged, sectors }
    }

    /// Returns the addresses that are erased before something is stored: its sectors.
    fn erased(&self, stored: &Range<u64>) -> Range<u64> {
        let touched = self.sectors.iter().filter(|sector| overlap(sector, stored));
        touched.fold(stored.clone(), |all, sector| all.start.min(sector.start)..all.end.max(sector.end))
    }
}

/// The part of a chip's memory that a firmware takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Bytes that are stored in flash.
    pub flash_used_bytes: u64,
    /// Bytes of flash, without what is kept for saved parameters.
    pub flash_bytes: u64,
    /// Bytes of variables, without the stack.
    pub ram_used_bytes: u64,
    /// Bytes of the RAM that holds variables or the stack.
    pub ram_bytes: u64,
    /// Bytes that the stack can take before it meets variables or the end of RAM.
    pub stack_bytes: u64,
}

/// The hand that an image should be for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpectedHand {
    /// Its name.
    pub name: String,
    /// [`Image::hand_hash`].
    pub hash: u32,
}

/// The reason for which an image is refused, with what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refused(String);

type Result<T> = std::result::Result<T, Refused>;

fn refuse<T>(reason: impl Into<String>) -> Result<T> {
    Err(Refused(reason.into()))
}

/// The command that builds an image.
pub const BUILD_HINT: &str = "`tests/firmware-toolchain cargo build -p blindgrasp-firmware --profile firmware --target thumbv7em-none-eabihf`";

/// The images of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Kind {
    /// Drives the joints of a hand
    Hand,
    /// Processor in the loop: its joints are simulated, at the other end of the line
    Pil,
}

impl Kind {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hand => "hand",
            Self::Pil => "pil",
        }
    }

    /// Returns the purpose of an image in words.
    const fn words(self) -> &'static str {
        match self {
            Self::Hand => "drives the joints of a hand",
            Self::Pil => "takes its joints from `blindgrasp pil`",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl<'a> Firmware<'a> {
    /// Reads the bytes of an ELF file.
    ///
    /// # Errors
    /// If they are no firmware image of blindgrasp.
    pub fn parse(file: &'a [u8]) -> Result<Self> {
        const OTHER_PROCESSOR: &str =
            "this is not built for a 32-bit little-endian Arm; build it with --target thumbv7em-none-eabihf";
        if !file.starts_with(&elf::ELFMAG) {
            return refuse(
                "this is not an ELF file; give the file that cargo links, not a .bin or .hex made from it",
            );
        }
        let is_little = file.get(5) == Some(&elf::ELFDATA2LSB);
        if FileKind::parse(file).map_err(damaged)? != FileKind::Elf32 || !is_little {
            return refuse(OTHER_PROCESSOR);
        }
        let parsed = ElfFile32::<Endianness>::parse(file).map_err(damaged)?;
        let (header, endian) = (parsed.elf_header(), parsed.endian());
        if header.e_machine(endian) != elf::EM_ARM {
            return refuse(OTHER_PROCESSOR);
        }
        if header.e_type(endian) != elf::ET_EXEC {
            return refuse("this ELF file is not linked as a program; give the file that cargo links");
        }
        let segments = segments(&parsed, file)?;
        let image = identity(&segments)?;
        let symbol = |name| {
            let mut symbols = parsed.symbols();
            symbols.find(|symbol| !symbol.is_undefined() && symbol.name() == Ok(name)).map(|s| s.address())
        };
        let device = symbol("_chip_device").and_then(|device| device.try_into().ok());
        let saved = symbol("_saved_start").zip(symbol("_saved_end")).map(|(start, end)| start..end);
        Ok(Self { image, segments, rtt_control_block: symbol("_SEGGER_RTT"), saved, device })
    }

    /// Returns the address and bytes of everything that is stored in flash.
    pub fn stored(&self) -> impl Iterator<Item = (u64, &'a [u8])> {
        self.segments
            .iter()
            .filter(|segment| !segment.bytes.is_empty())
            .map(|s| (s.physical_address, s.bytes))
    }

    /// Checks that this is the image that is wanted, and for the given hand.
    ///
    /// # Errors
    /// Why not.
    pub fn check_purpose(&self, kind: Kind, hand: Option<&ExpectedHand>) -> Result<()> {
        let Image { interface_version, hand_hash, .. } = self.image;
        if interface_version != INTERFACE_VERSION {
            return refuse(format!(
                "the image speaks version {interface_version} of the interface, this tool version {INTERFACE_VERSION}; build \
                 both from the same sources"
            ));
        }
        if self.image.kind != kind.name() {
            let (image, words) = (printable(self.image.kind), kind.words());
            return refuse(format!("this is the image `{image}`, not `{kind}`, which {words}"));
        }
        match hand {
            Some(hand) if self.image.hand != hand.name => refuse(format!(
                "the image is for the hand `{}`, not for `{}`; build it for that hand with the environment variable HAND",
                printable(self.image.hand),
                hand.name
            )),
            Some(hand) if hand_hash != hand.hash => refuse(format!(
                "the image is for the hand `{}` with the hash {hand_hash:08x}, but the file's is {:08x}: it was changed since; \
                 build the image again",
                hand.name, hand.hash
            )),
            _ => Ok(()),
        }
    }

    /// Checks that it fits a chip and would start there.
    ///
    /// # Errors
    /// Why not.
    pub fn footprint(&self, memory: &Memory) -> Result<Footprint> {
        let flash = &memory.flash;
        for stored in self.segments.iter().map(Segment::stored).filter(|stored| !stored.is_empty()) {
            if !is_within(&stored, flash) {
                return refuse(format!(
                    "{} bytes would be stored at {:#010x}, which is not all in this chip's flash ({:#010x} to {:#010x}); make the \
                     image smaller, or check memory.x and --chip",
                    stored.end - stored.start,
                    stored.start,
                    flash.start,
                    flash.end
                ));
            }
        }
        let saved_bytes = self.saved_bytes(memory)?;
        let variables: Vec<_> =
            self.segments.iter().map(Segment::used).filter(|used| !is_within(used, flash)).collect();
        if let Some(used) = variables.iter().find(|used| !memory.ram.iter().any(|ram| is_within(used, ram))) {
            return refuse(format!(
                "variables are at {:#010x} to {:#010x}, where this chip has no RAM; make them fewer, or check memory.x and --chip",
                used.start, used.end
            ));
        }
        let stack_pointer = self.stack_pointer(memory)?;
        let has_stack = |ram: &&Range<u64>| ram.contains(&(stack_pointer - 1));
        let in_use =
            |ram: &&Range<u64>| has_stack(ram) || variables.iter().any(|used| ram.contains(&used.start));
        // The stack grows downwards, to variables or to the end of RAM.
        let bottom = memory.ram.iter().find(has_stack).map_or(stack_pointer, |ram| ram.start);
        let below = variables.iter().filter(|used| used.start < stack_pointer);
        let limit = below.map(|used| used.end.min(stack_pointer)).fold(bottom, u64::max);
        Ok(Footprint {
            flash_used_bytes: self.stored().map(|(_, bytes)| bytes.len() as u64).sum(),
            flash_bytes: flash.end - flash.start - saved_bytes,
            ram_used_bytes: variables.iter().map(|used| used.end - used.start).sum(),
            ram_bytes: memory.ram.iter().filter(in_use).map(|ram| ram.end - ram.start).sum(),
            stack_bytes: stack_pointer - limit,
        })
    }

    /// Bytes of flash for saved parameters, of which storing the image erases none.
    fn saved_bytes(&self, memory: &Memory) -> Result<u64> {
        let Some(saved) = &self.saved else { return Ok(0) };
        let flash = &memory.flash;
        if saved.start > saved.end || !is_within(saved, flash) {
            return refuse(format!(
                "the image saves parameters at {:#010x} to {:#010x}, which is not in this chip's flash ({:#010x} to {:#010x}); \
                 check memory.x and --chip",
                saved.start, saved.end, flash.start, flash.end
            ));
        }
        for stored in self.segments.iter().map(Segment::stored).filter(|stored| !stored.is_empty()) {
            let erased = memory.erased(&stored);
            if overlap(&erased, saved) {
                return refuse(format!(
                    "the image reaches into the flash of saved parameters, {:#010x} to {:#010x} by its symbols _saved_start and \
                     _saved_end: to store {} bytes at {:#010x}, {:#010x} to {:#010x} would be erased; make the image smaller, or \
                     check memory.x",
                    saved.start,
                    saved.end,
                    stored.end - stored.start,
                    stored.start,
                    erased.start,
                    erased.end
                ));
            }
        }
        Ok(saved.end - saved.start)
    }

    /// The initial stack pointer, if the chip would start: it is in RAM, one past the stack's first byte, and the second word
    /// leads to an instruction.
    fn stack_pointer(&self, memory: &Memory) -> Result<u64> {
        let start = memory.flash.start;
        let table = self.segments.iter().find(|segment| segment.physical_address == start);
        let word = |index: usize| -> Option<u64> {
            let bytes = table?.bytes.get(4 * index..)?.first_chunk()?;
            Some(u64::from(u32::from_le_bytes(*bytes)))
        };
        let Some((stack_pointer, reset)) = word(0).zip(word(1)) else {
            return refuse(format!(
                "there is no vector table at {start:#010x}, where this chip boots; check memory.x"
            ));
        };
        let in_ram = stack_pointer > 0 && memory.ram.iter().any(|ram| ram.contains(&(stack_pointer - 1)));
        if !in_ram || stack_pointer % 8 != 0 {
            return refuse(format!(
                "the vector table starts with the stack pointer {stack_pointer:#010x}, which is not a multiple of 8 in RAM; check \
                 memory.x and --chip"
            ));
        }
        if reset % 2 == 0 || !self.segments.iter().any(|segment| segment.stored().contains(&reset)) {
            return refuse(format!(
                "the reset vector is {reset:#010x}, which is not a Thumb instruction (an odd address) of this image; check the \
                 linker script"
            ));
        }
        Ok(stack_pointer)
    }
}

fn is_within(part: &Range<u64>, all: &Range<u64>) -> bool {
    all.start <= part.start && part.end <= all.end
}

fn overlap(one: &Range<u64>, other: &Range<u64>) -> bool {
    one.start < other.end && other.start < one.end
}

fn damaged(error: impl fmt::Display) -> Refused {
    Refused(format!("the ELF file is cut short or damaged ({error}); build it again"))
}

fn segments<'a>(parsed: &ElfFile32<'a, Endianness>, file: &'a [u8]) -> Result<Vec<Segment<'a>>> {
    let endian = parsed.endian();
    let mut segments = Vec::new();
    for header in parsed.elf_program_headers() {
        if header.p_type(endian) != elf::PT_LOAD || header.p_memsz(endian) == 0 {
            continue;
        }
        let physical_address = u64::from(header.p_paddr(endian));
        let at = format!("the segment at {physical_address:#010x}");
        let bytes =
            header.data(endian, file).map_err(|()| damaged(format!("the bytes of {at} are missing")))?;
        let memory_bytes = u64::from(header.p_memsz(endian));
        if bytes.len() as u64 > memory_bytes {
            return Err(damaged(format!("{at} is larger than its memory")));
        }
        let virtual_address = u64::from(header.p_vaddr(endian));
        segments.push(Segment { physical_address, virtual_address, bytes, memory_bytes });
    }
    if segments.iter().all(|segment| segment.bytes.is_empty()) {
        return refuse(
            "there is nothing to load in this ELF file; does the linker script (link.x, memory.x) reach the linker?",
        );
    }
    Ok(segments)
}

/// The one identity in all that is loaded.
fn identity<'a>(segments: &[Segment<'a>]) -> Result<Image<'a>> {
    let mut found: Option<Image<'a>> = None;
    let mut reason = "this is not a firmware of blindgrasp: there is no identity in it; build one";
    for segment in segments {
        let mut rest = segment.bytes;
        while let Some(at) = rest.windows(Image::MAGIC.len()).position(|window| window == Image::MAGIC) {
            reason = "the identity in this image cannot be read: it is from another version of blindgrasp; build it again";
            let here = rest.get(at..).unwrap_or_default();
            match (Image::decode(here), found) {
                (Some(image), None) => found = Some(image),
                (Some(image), Some(first)) if image != first => {
                    let name = |image: Image<'_>| printable(&format!("{} for {}", image.kind, image.hand));
                    return refuse(format!(
                        "there is more than one identity in this image: `{}` and `{}`; build it again with {BUILD_HINT}",
                        name(first),
                        name(image)
                    ));
                }
                _ => {}
            }
            rest = here.get(Image::MAGIC.len()..).unwrap_or_default();
        }
    }
    found.ok_or_else(|| Refused(format!("{reason} with {BUILD_HINT}")))
}
