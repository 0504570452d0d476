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

/// Stack that an image must leave, bytes: a frame of the floating-point exception entry (104) for each of the few levels
/// of priority, with room for what their functions keep.
pub const LEAST_STACK_BYTES: u64 = 1024;

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

    fn ram_with(&self, address: u64) -> Option<&Range<u64>> {
        self.ram.iter().find(|range| range.contains(&address))
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
    /// The initial stack pointer.
    pub stack_pointer: u64,
    /// Address of the first instruction.
    pub reset_address: u64,
}

/// The hand that an image should be for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpectedHand {
    /// Its name.
    pub name: String,
    /// [`Image::hand_hash`].
    pub hash: u32,
}

/// The reason for which a file is no firmware image of blindgrasp.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// It is not an ELF file.
    #[error("this is not an ELF file; give the file that cargo links, not a .bin or .hex made from it")]
    NotElf,
    /// It breaks off, or is inconsistent.
    #[error("the ELF file is cut short or damaged ({0}); build it again")]
    Damaged(String),
    /// It is for another processor.
    #[error(
        "this is built for {0}, not for a 32-bit little-endian Arm; build it with --target thumbv7em-none-eabihf"
    )]
    OtherMachine(Machine),
    /// It is an object file or a library.
    #[error("this ELF file is not linked as a program; give the file that cargo links")]
    NotAProgram,
    /// No segment has bytes.
    #[error(
        "there is nothing to load in this ELF file; does the linker script (link.x, memory.x) reach the linker?"
    )]
    NothingToLoad,
    /// Two segments want the same flash.
    #[error("the segments at {first:#010x} and {second:#010x} overlap; check the linker script")]
    Overlap {
        /// Physical address of one.
        first: u64,
        /// And of the other.
        second: u64,
    },
    /// There is no identity in it.
    #[error("this is not a firmware of blindgrasp: there is no identity in it; build one with {BUILD_HINT}")]
    NoIdentity,
    /// There is one that cannot be read.
    #[error(
        "the identity in this image cannot be read: it is from another version of blindgrasp; build it again with {BUILD_HINT}"
    )]
    UnreadableIdentity,
    /// There are several that differ.
    #[error(
        "there is more than one identity in this image: `{first}` and `{second}`; build it again with {BUILD_HINT}"
    )]
    SeveralIdentities {
        /// Kind and hand of one.
        first: String,
        /// And of another.
        second: String,
    },
}

/// The command that builds an image.
pub const BUILD_HINT: &str = "`tests/firmware-toolchain cargo build -p blindgrasp-firmware --profile firmware --target thumbv7em-none-eabihf`";

/// The machine that an ELF file is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Machine {
    /// The `e_machine` of its header.
    pub code: u16,
    /// `true` if it is of 64 bits.
    pub wide: bool,
    /// `true` if it is little-endian.
    pub little_endian: bool,
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.code {
            elf::EM_386 => write!(f, "x86"),
            elf::EM_X86_64 => write!(f, "x86-64"),
            elf::EM_AARCH64 => write!(f, "64-bit Arm"),
            elf::EM_ARM => write!(f, "Arm"),
            elf::EM_RISCV => write!(f, "RISC-V"),
            code => write!(f, "the machine {code}"),
        }?;
        let bits = if self.wide { 64 } else { 32 };
        write!(f, " ({bits}-bit, {}-endian)", if self.little_endian { "little" } else { "big" })
    }
}

/// The reason for which an image does not fit a chip.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FitError {
    /// It would be stored where the chip keeps nothing.
    #[error(
        "{} bytes would be stored at {:#010x}, which is not in this chip's flash ({:#010x} to {:#010x}); \
        check memory.x and --chip", .stored.end - .stored.start, .stored.start, .flash.start, .flash.end
    )]
    NotInFlash {
        /// The addresses that would be stored to.
        stored: Range<u64>,
        /// The chip's flash.
        flash: Range<u64>,
    },
    /// It is larger than the flash.
    #[error(
        "the image needs {needed_bytes} bytes of flash, this chip has {available_bytes}; make it smaller, or check --chip"
    )]
    FlashTooSmall {
        /// From the start of flash to the end of the image.
        needed_bytes: u64,
        /// The bytes that there are.
        available_bytes: u64,
    },
    /// Saved parameters would be lost.
    #[error(
        "the image reaches into the flash of saved parameters, {:#010x} to {:#010x} by its symbols _saved_start and \
        _saved_end: to store {} bytes at {:#010x}, {:#010x} to {:#010x} would be erased; make the image smaller, or check \
        memory.x",
        .saved.start, .saved.end, .stored.end - .stored.start, .stored.start, .erased.start, .erased.end
    )]
    ReachesSaved {
        /// The addresses that would be stored to.
        stored: Range<u64>,
        /// The sectors of that.
        erased: Range<u64>,
        /// The addresses of saved parameters.
        saved: Range<u64>,
    },
    /// Parameters would be saved where the chip keeps nothing.
    #[error(
        "the image saves parameters at {:#010x} to {:#010x}, which is not in this chip's flash ({:#010x} to {:#010x}); \
        check memory.x and --chip", .saved.start, .saved.end, .flash.start, .flash.end
    )]
    SavedNotInFlash {
        /// The addresses of saved parameters.
        saved: Range<u64>,
        /// The chip's flash.
        flash: Range<u64>,
    },
    /// Variables are where the chip has no memory.
    #[error("variables are at {address:#010x}, where this chip has no RAM; check memory.x and --chip")]
    NotInRam {
        /// The address where they start.
        address: u64,
    },
    /// There are more variables than RAM.
    #[error(
        "the variables need {needed_bytes} bytes of RAM, this chip has {available_bytes} at {start:#010x}; make them fewer, or check --chip"
    )]
    RamTooSmall {
        /// From the start of this RAM to the end of the variables.
        needed_bytes: u64,
        /// The bytes that there are.
        available_bytes: u64,
        /// The address where this RAM starts.
        start: u64,
    },
    /// Nothing is stored where the chip boots.
    #[error("there is no vector table at {0:#010x}, where this chip boots; check memory.x")]
    NoVectorTable(u64),
    /// The first word is no stack pointer.
    #[error(
        "the vector table starts with the stack pointer {0:#010x}, which is not a multiple of 8 in RAM; check memory.x and --chip"
    )]
    BadStackPointer(u64),
    /// The stack has too little room.
    #[error(
        "{room_bytes} bytes are left for the stack below {stack_pointer:#010x}, at least {LEAST_STACK_BYTES} must be; make the variables fewer"
    )]
    NoRoomForStack {
        /// The bytes that are left.
        room_bytes: u64,
        /// The address where the stack starts.
        stack_pointer: u64,
    },
    /// The second word does not lead to an instruction of the image.
    #[error(
        "the reset vector is {0:#010x}, which is not a Thumb instruction (an odd address) of this image; check the linker script"
    )]
    BadResetVector(u64),
}

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

/// The reason for which an image, though it is one, is not the right one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PurposeError {
    /// It speaks another version of the interface.
    #[error(
        "the image speaks version {0} of the interface, this tool version {INTERFACE_VERSION}; build both from the same sources"
    )]
    OtherInterface(u16),
    /// It is not the image that is wanted.
    #[error("this is the image `{image}`, not `{wanted}`, which {}", .wanted.words())]
    OtherKind {
        /// Its own name of its kind.
        image: String,
        /// The kind that it should be.
        wanted: Kind,
    },
    /// It is for another hand.
    #[error(
        "the image is for the hand `{image}`, not for `{expected}`; build it for that hand with the environment variable HAND"
    )]
    OtherHand {
        /// The hand that it is for.
        image: String,
        /// The hand that it should be for.
        expected: String,
    },
    /// It is for another version of the hand.
    #[error(
        "the image is for the hand `{hand}` with the hash {image:08x}, but the file's is {expected:08x}: it was changed since; build the image again"
    )]
    ChangedHand {
        /// Name of both.
        hand: String,
        /// Hash in the image.
        image: u32,
        /// Hash of the file.
        expected: u32,
    },
}

impl<'a> Firmware<'a> {
    /// Reads the bytes of an ELF file.
    ///
    /// # Errors
    /// If they are no firmware image of blindgrasp.
    pub fn parse(file: &'a [u8]) -> Result<Self, ImageError> {
        if !file.starts_with(&elf::ELFMAG) {
            return Err(ImageError::NotElf);
        }
        let machine = machine(file)?;
        let arm = Machine { code: elf::EM_ARM, wide: false, little_endian: true };
        if machine != arm {
            return Err(ImageError::OtherMachine(machine));
        }
        let parsed = ElfFile32::<Endianness>::parse(file).map_err(damaged)?;
        if parsed.elf_header().e_type(parsed.endian()) != elf::ET_EXEC {
            return Err(ImageError::NotAProgram);
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
    pub fn check_purpose(&self, kind: Kind, hand: Option<&ExpectedHand>) -> Result<(), PurposeError> {
        let image = &self.image;
        if image.interface_version != INTERFACE_VERSION {
            return Err(PurposeError::OtherInterface(image.interface_version));
        }
        if image.kind != kind.name() {
            return Err(PurposeError::OtherKind { image: printable(image.kind), wanted: kind });
        }
        let Some(hand) = hand else { return Ok(()) };
        if image.hand != hand.name {
            return Err(PurposeError::OtherHand {
                image: printable(image.hand),
                expected: hand.name.clone(),
            });
        }
        if image.hand_hash != hand.hash {
            let (hand, expected) = (hand.name.clone(), hand.hash);
            return Err(PurposeError::ChangedHand { hand, image: image.hand_hash, expected });
        }
        Ok(())
    }

    /// Checks that it fits a chip and would start there.
    ///
    /// # Errors
    /// Why not.
    pub fn footprint(&self, memory: &Memory) -> Result<Footprint, FitError> {
        for segment in &self.segments {
            check_stored(segment, &memory.flash)?;
        }
        let saved_bytes = self.saved_bytes(memory)?;
        let variables = self.variables(memory)?;
        let (stack_pointer, reset_address) = self.vectors(memory)?;
        let stack_bytes = stack_room(stack_pointer, memory, &variables)?;
        let in_use = |ram: &&Range<u64>| {
            ram.contains(&(stack_pointer - 1)) || variables.iter().any(|used| ram.contains(&used.start))
        };
        Ok(Footprint {
            flash_used_bytes: self.stored().map(|(_, bytes)| bytes.len() as u64).sum(),
            flash_bytes: memory.flash.end - memory.flash.start - saved_bytes,
            ram_used_bytes: variables.iter().map(|used| used.end - used.start).sum(),
            ram_bytes: memory.ram.iter().filter(in_use).map(|ram| ram.end - ram.start).sum(),
            stack_bytes,
            stack_pointer,
            reset_address,
        })
    }

    /// Bytes of flash for saved parameters, of which storing the image erases none.
    fn saved_bytes(&self, memory: &Memory) -> Result<u64, FitError> {
        let Some(saved) = self.saved.clone() else { return Ok(0) };
        let flash = memory.flash.clone();
        if !(flash.start <= saved.start && saved.start <= saved.end && saved.end <= flash.end) {
            return Err(FitError::SavedNotInFlash { saved, flash });
        }
        for segment in self.segments.iter().filter(|segment| !segment.bytes.is_empty()) {
            let (stored, erased) = (segment.stored(), memory.erased(&segment.stored()));
            if overlap(&erased, &saved) {
                return Err(FitError::ReachesSaved { stored, erased, saved });
            }
        }
        Ok(saved.end - saved.start)
    }

    /// Returns the addresses of variables, each range within one RAM.
    fn variables(&self, memory: &Memory) -> Result<Vec<Range<u64>>, FitError> {
        let outside_flash =
            |used: &Range<u64>| !(memory.flash.start <= used.start && used.end <= memory.flash.end);
        let variables: Vec<_> = self.segments.iter().map(Segment::used).filter(outside_flash).collect();
        for used in &variables {
            let ram = memory.ram_with(used.start).ok_or(FitError::NotInRam { address: used.start })?;
            if used.end > ram.end {
                return Err(FitError::RamTooSmall {
                    needed_bytes: used.end - ram.start,
                    available_bytes: ram.end - ram.start,
                    start: ram.start,
                });
            }
        }
        Ok(variables)
    }

    /// Initial stack pointer, and address of the first instruction.
    fn vectors(&self, memory: &Memory) -> Result<(u64, u64), FitError> {
        let start = memory.flash.start;
        let table = self.segments.iter().find(|segment| segment.physical_address == start);
        let word = |index: usize| -> Option<u64> {
            let bytes = table?.bytes.get(4 * index..)?.first_chunk()?;
            Some(u64::from(u32::from_le_bytes(*bytes)))
        };
        let (stack_pointer, reset) = word(0).zip(word(1)).ok_or(FitError::NoVectorTable(start))?;
        // The stack grows downwards: it starts one past its first byte.
        let in_ram = stack_pointer > 0 && memory.ram_with(stack_pointer - 1).is_some();
        if !in_ram || stack_pointer % 8 != 0 {
            return Err(FitError::BadStackPointer(stack_pointer));
        }
        let address = reset & !1;
        let loaded = |segment: &Segment<'_>| {
            segment.physical_address == segment.virtual_address && segment.stored().contains(&address)
        };
        if reset % 2 == 0 || !self.segments.iter().any(loaded) {
            return Err(FitError::BadResetVector(reset));
        }
        Ok((stack_pointer, address))
    }
}

fn overlap(one: &Range<u64>, other: &Range<u64>) -> bool {
    one.start < other.end && other.start < one.end
}

fn damaged(error: impl fmt::Display) -> ImageError {
    ImageError::Damaged(error.to_string())
}

fn machine(file: &[u8]) -> Result<Machine, ImageError> {
    fn read<H: FileHeader<Endian = Endianness>>(file: &[u8], wide: bool) -> object::Result<Machine> {
        let header = H::parse(file)?;
        let endian = header.endian()?;
        Ok(Machine { code: header.e_machine(endian), wide, little_endian: endian == Endianness::Little })
    }
    match FileKind::parse(file).map_err(damaged)? {
        FileKind::Elf32 => read::<elf::FileHeader32<Endianness>>(file, false),
        FileKind::Elf64 => read::<elf::FileHeader64<Endianness>>(file, true),
        _ => return Err(ImageError::NotElf),
    }
    .map_err(damaged)
}

fn segments<'a>(parsed: &ElfFile32<'a, Endianness>, file: &'a [u8]) -> Result<Vec<Segment<'a>>, ImageError> {
    let endian = parsed.endian();
    let mut segments = Vec::new();
    for header in parsed.elf_program_headers() {
        if header.p_type(endian) != elf::PT_LOAD || header.p_memsz(endian) == 0 {
            continue;
        }
        let physical_address = u64::from(header.p_paddr(endian));
        let bytes = header.data(endian, file).map_err(|()| {
            damaged(format_args!("the bytes of the segment at {physical_address:#010x} are missing"))
        })?;
        let segment = Segment {
            physical_address,
            virtual_address: u64::from(header.p_vaddr(endian)),
            bytes,
            memory_bytes: u64::from(header.p_memsz(endian)),
        };
        if segment.bytes.len() as u64 > segment.memory_bytes {
            return Err(damaged(format_args!(
                "the segment at {physical_address:#010x} is larger than its memory"
            )));
        }
        segments.push(segment);
    }
    segments.sort_by_key(|segment| segment.physical_address);
    let mut stored = segments.iter().filter(|segment| !segment.bytes.is_empty());
    let mut last = stored.next().ok_or(ImageError::NothingToLoad)?;
    for next in stored {
        if next.physical_address < last.stored().end {
            let (first, second) = (last.physical_address, next.physical_address);
            return Err(ImageError::Overlap { first, second });
        }
        last = next;
    }
    Ok(segments)
}

/// The one identity in all that is loaded.
fn identity<'a>(segments: &[Segment<'a>]) -> Result<Image<'a>, ImageError> {
    let mut found: Option<Image<'a>> = None;
    let mut marked = false;
    for segment in segments {
        let mut rest = segment.bytes;
        while let Some(at) = rest.windows(Image::MAGIC.len()).position(|window| window == Image::MAGIC) {
            marked = true;
            let here = rest.get(at..).unwrap_or_default();
            match (Image::decode(here), found) {
                (Some(image), None) => found = Some(image),
                (Some(image), Some(first)) if image != first => {
                    let name = |image: Image<'_>| printable(&format!("{} for {}", image.kind, image.hand));
                    return Err(ImageError::SeveralIdentities { first: name(first), second: name(image) });
                }
                _ => {}
            }
            rest = here.get(Image::MAGIC.len()..).unwrap_or_default();
        }
    }
    found.ok_or(if marked { ImageError::UnreadableIdentity } else { ImageError::NoIdentity })
}

fn check_stored(segment: &Segment<'_>, flash: &Range<u64>) -> Result<(), FitError> {
    let stored = segment.stored();
    if stored.is_empty() || (flash.start <= stored.start && stored.end <= flash.end) {
        return Ok(());
    }
    // An image that is too large ends in a segment across the end, or in one that starts just there.
    if (flash.start..=flash.end).contains(&stored.start) {
        let (needed_bytes, available_bytes) = (stored.end - flash.start, flash.end - flash.start);
        return Err(FitError::FlashTooSmall { needed_bytes, available_bytes });
    }
    Err(FitError::NotInFlash { stored, flash: flash.clone() })
}

/// Returns the room below the stack.
fn stack_room(stack_pointer: u64, memory: &Memory, variables: &[Range<u64>]) -> Result<u64, FitError> {
    let bottom = memory.ram_with(stack_pointer - 1).map_or(stack_pointer, |ram| ram.start);
    let limit = variables
        .iter()
        .filter(|used| used.start < stack_pointer)
        .map(|used| used.end.min(stack_pointer))
        .fold(bottom, u64::max);
    let room_bytes = stack_pointer - limit;
    if room_bytes < LEAST_STACK_BYTES {
        return Err(FitError::NoRoomForStack { room_bytes, stack_pointer });
    }
    Ok(room_bytes)
}
