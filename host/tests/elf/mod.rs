//! ELF files made byte by byte, so that each can be wrong in its own way.

use blindgrasp_shared::identity::Image;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;

/// Start of flash.
pub(crate) const FLASH: u32 = 0x0800_0000;
/// Start of RAM.
pub(crate) const RAM: u32 = 0x2000_0000;
/// One past its end.
pub(crate) const RAM_END: u32 = 0x2002_0000;
/// The address of the code of [`Elf::good`].
pub(crate) const RESET: u32 = FLASH + 0x188;

/// A segment with its addresses, its bytes, and the memory that it takes.
#[derive(Clone)]
pub(crate) struct Segment {
    pub(crate) stored: u32,
    pub(crate) used: u32,
    pub(crate) bytes: Vec<u8>,
    pub(crate) memory_bytes: u32,
}

/// A 32-bit ELF file.
#[derive(Clone)]
pub(crate) struct Elf {
    pub(crate) machine: u16,
    pub(crate) kind: u16,
    pub(crate) segments: Vec<Segment>,
    /// Name, value, and whether it is in the section `.defmt` (in none otherwise: absolute).
    pub(crate) symbols: Vec<(String, u32, bool)>,
}

/// The identity of an image `hand` for the three-fingered hand.
pub(crate) fn image() -> Image<'static> {
    Image {
        interface_version: INTERFACE_VERSION,
        kind: "hand",
        hand: "three-finger",
        hand_hash: 0x0123_4567,
        firmware_version: "0.1.0",
        build_hash: 0x89ab_cdef,
        joint_count: 12,
        fingertip_count: 3,
        period_us: 1000,
    }
}

/// The bytes of an identity.
pub(crate) fn identity(image: &Image<'_>) -> Vec<u8> {
    let mut buffer = [0; 256];
    let length = image.encode(&mut buffer).expect("a short identity");
    buffer[..length].to_vec()
}

impl Elf {
    /// Returns a firmware as the linker makes it: vectors, code and constants; variables that start with a value, and
    /// others.
    pub(crate) fn good(image: &Image<'_>) -> Self {
        let mut flash = vec![0; 0x188];
        flash[..4].copy_from_slice(&RAM_END.to_le_bytes());
        flash[4..8].copy_from_slice(&(RESET | 1).to_le_bytes());
        flash.extend([0xfe, 0xe7].repeat(100));
        flash.extend(identity(image));
        flash.resize(flash.len().next_multiple_of(8), 0);
        let data = FLASH + flash.len() as u32;
        let code = Segment { stored: FLASH, used: FLASH, memory_bytes: flash.len() as u32, bytes: flash };
        Self {
            machine: 40,
            kind: 2,
            segments: vec![
                code,
                Segment { stored: data, used: RAM, bytes: vec![7; 64], memory_bytes: 64 },
                Segment { stored: RAM + 64, used: RAM + 64, bytes: vec![], memory_bytes: 4032 },
            ],
            symbols: vec![("_SEGGER_RTT".to_owned(), RAM + 16, false)],
        }
    }

    /// Overwrites a word of the first segment.
    pub(crate) fn with_word(mut self, index: usize, word: u32) -> Self {
        self.segments[0].bytes[4 * index..4 * index + 4].copy_from_slice(&word.to_le_bytes());
        self
    }

    /// The file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        const HEADER: usize = 52;
        const PROGRAM_HEADER: usize = 32;
        let mut body: Vec<u8> = Vec::new();
        let mut headers = Vec::new();
        let start = HEADER + PROGRAM_HEADER * self.segments.len();
        for segment in &self.segments {
            let offset = (start + body.len()) as u32;
            let length = segment.bytes.len() as u32;
            let fields = [1, offset, segment.used, segment.stored, length, segment.memory_bytes, 7, 4];
            headers.extend(fields.iter().flat_map(|field: &u32| field.to_le_bytes()));
            body.extend(&segment.bytes);
        }

        let names = b"\0.defmt\0.symtab\0.strtab\0";
        let mut strings = vec![0];
        let mut symbols = vec![0; 16];
        for (name, value, in_defmt) in &self.symbols {
            symbols.extend((strings.len() as u32).to_le_bytes());
            symbols.extend(value.to_le_bytes());
            symbols.extend(0_u32.to_le_bytes());
            // A global object; section 1, or absolute.
            symbols.extend([0x11, 0]);
            symbols.extend(if *in_defmt { 1_u16 } else { 0xfff1 }.to_le_bytes());
            strings.extend(name.as_bytes());
            strings.push(0);
        }
        let mut sections = vec![[0_u32; 10]];
        let mut section = |name: u32, kind: u32, bytes: &[u8], link: u32, info: u32, entry: u32| {
            body.resize(body.len().next_multiple_of(4), 0);
            let offset = (start + body.len()) as u32;
            sections.push([name, kind, 0, 0, offset, bytes.len() as u32, link, info, 1, entry]);
            body.extend(bytes);
        };
        // Without logs it has no name.
        let defmt = u32::from(self.symbols.iter().any(|(_, _, in_defmt)| *in_defmt));
        section(defmt, 1, &[0; 64], 0, 0, 0);
        section(8, 2, &symbols, 3, 1, 16);
        section(16, 3, &strings, 0, 0, 0);
        section(16, 3, names, 0, 0, 0);
        body.resize(body.len().next_multiple_of(4), 0);
        let section_table = (start + body.len()) as u32;

        let mut file = b"\x7fELF\x01\x01\x01".to_vec();
        file.resize(16, 0);
        file.extend(self.kind.to_le_bytes());
        file.extend(self.machine.to_le_bytes());
        file.extend(
            [1, RESET | 1, HEADER as u32, section_table, 0x0500_0400].iter().flat_map(|f| f.to_le_bytes()),
        );
        let counts = [HEADER, PROGRAM_HEADER, self.segments.len(), 40, sections.len(), sections.len() - 1];
        file.extend(counts.iter().flat_map(|&count| (count as u16).to_le_bytes()));
        file.extend(headers);
        file.extend(body);
        file.extend(sections.iter().flatten().flat_map(|field| field.to_le_bytes()));
        file
    }
}
