//! Firmware images, judged without a probe: what is flashed, and what is refused for which reason.

use crate::elf;

use blindgrasp::device::image::{ExpectedHand, Firmware, Footprint, Kind, Memory, Refused};
use blindgrasp_shared::identity::Image;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use elf::{Elf, FLASH, RAM, RAM_END, RESET, Segment, identity, image};

/// Memory as a chip may have it: 1 MiB of flash in sectors of 16, 64 and 128 KiB, 64 KiB of RAM beside the core,
/// 112 + 16 KiB of RAM.
fn memory() -> Memory {
    let sizes = [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128];
    let sectors = sizes.iter().scan(0x0800_0000, |end, kib| {
        let begin = *end;
        *end += kib * 1024;
        Some(begin..*end)
    });
    let ram = vec![0x2001_C000..0x2002_0000, 0x1000_0000..0x1001_0000, 0x2000_0000..0x2001_C000];
    Memory::new(0x0800_0000..0x0810_0000, sectors.collect(), ram)
}

/// Checks that a refusal has all of these words.
fn assert_told<T: std::fmt::Debug>(judged: Result<T, Refused>, words: &[&str]) {
    let error = judged.expect_err("refused").to_string();
    for word in words {
        assert!(error.contains(word), "no `{word}` in: {error}");
    }
}

fn refused(bytes: &[u8], words: &[&str]) {
    assert_told(Firmware::parse(bytes), words);
}

fn footprint(elf: &Elf) -> Result<Footprint, Refused> {
    let file = elf.bytes();
    Firmware::parse(&file).expect("an image").footprint(&memory())
}

fn misfit(elf: &Elf, words: &[&str]) {
    assert_told(footprint(elf), words);
}

fn purpose(image: &Image<'_>, hand: Option<&ExpectedHand>) -> Result<(), Refused> {
    let file = Elf::good(image).bytes();
    Firmware::parse(&file).expect("an image").check_purpose(Kind::Hand, hand)
}

#[test]
fn a_good_image_is_understood() {
    let elf = Elf::good(&image());
    let file = elf.bytes();
    let firmware = Firmware::parse(&file).expect("an image");
    assert_eq!(firmware.image, image());
    assert_eq!(firmware.rtt_control_block, Some(u64::from(RAM) + 16));
    assert_eq!((firmware.saved.clone(), firmware.device), (None, None));
    let mut telling = elf.clone();
    telling.symbols.push(("_chip_device".to_owned(), 0x413, false));
    assert_eq!(Firmware::parse(&telling.bytes()).expect("an image").device, Some(0x413));
    let code = elf.segments[0].bytes.len() as u64;
    let stored: Vec<_> = firmware.stored().map(|(address, bytes)| (address, bytes.len() as u64)).collect();
    assert_eq!(stored, [(u64::from(FLASH), code), (u64::from(FLASH) + code, 64)]);
    let footprint = firmware.footprint(&memory()).expect("it fits");
    let expected = Footprint {
        flash_used_bytes: code + 64,
        flash_bytes: 1024 * 1024,
        ram_used_bytes: 4096,
        // The RAM beside the core is not used.
        ram_bytes: 128 * 1024,
        stack_bytes: 124 * 1024,
    };
    assert_eq!(footprint, expected);
}

/// An image that keeps a range of flash for saved parameters, with its second segment stored somewhere.
fn saving([start, end]: [u32; 2], stored: u32) -> Elf {
    let mut elf = Elf::good(&image());
    elf.symbols.push(("_saved_start".to_owned(), start, false));
    elf.symbols.push(("_saved_end".to_owned(), end, false));
    elf.segments[1].stored = stored;
    elf
}

#[test]
fn an_image_that_reaches_into_saved_parameters_is_refused() {
    const BEGIN: u32 = FLASH + 0xC_0000;
    const END: u32 = FLASH + 0x10_0000;
    let length = Elf::good(&image()).segments[1].bytes.len() as u32;
    let fits = footprint(&saving([BEGIN, END], BEGIN - length)).expect("it ends before them");
    assert_eq!(fits.flash_bytes, 768 * 1024);
    for stored in [BEGIN - length + 1, BEGIN, END - length] {
        misfit(
            &saving([BEGIN, END], stored),
            &["0x080c0000 to 0x08100000", "_saved_start", "make the image smaller"],
        );
    }
    // Not in them, but in the sector that they begin in.
    misfit(
        &saving([BEGIN + 0x1000, END], BEGIN),
        &[
            "0x080c1000 to 0x08100000 by its symbols",
            "at 0x080c0000, 0x080c0000 to 0x080e0000 would be erased",
        ],
    );
    // An image without the symbols has none, and may be stored anywhere.
    let mut none = saving([BEGIN, END], BEGIN);
    none.symbols.truncate(1);
    assert_eq!(footprint(&none).expect("there are none").flash_bytes, 1024 * 1024);
}

#[test]
fn parameters_that_the_chip_has_no_flash_for_are_refused() {
    for saved in
        [[FLASH + 0xF_0000, FLASH + 0x11_0000], [RAM, RAM + 4096], [FLASH + 0xE_0000, FLASH + 0xC_0000]]
    {
        let words = ["saves parameters at", "not in this chip's flash", "check memory.x and --chip"];
        misfit(&saving(saved, FLASH + 0x1_0000), &words);
    }
}

#[test]
fn memory_that_touches_is_one() {
    assert_eq!(memory().ram, [0x1000_0000..0x1001_0000, 0x2000_0000..0x2002_0000]);
}

#[test]
fn what_is_no_elf_file_is_refused() {
    for bytes in [&b""[..], b"\x7fEL", b"MZ and so on", &[0xff; 5000]] {
        refused(bytes, &["not an ELF file"]);
    }
}

#[test]
fn a_file_cut_short_anywhere_is_refused() {
    let file = Elf::good(&image()).bytes();
    for length in 4..file.len() {
        refused(&file[..length], &["cut short or damaged"]);
    }
}

#[test]
fn a_file_with_random_damage_is_judged_without_a_panic() {
    let good = Elf::good(&image()).bytes();
    let mut random = fastrand::Rng::with_seed(1);
    let (mut refused, mut accepted) = (0, 0);
    for _ in 0..5000 {
        let mut file = good.clone();
        for _ in 0..random.usize(1..8) {
            // Half of them in the headers.
            let end = if random.bool() { 148 } else { file.len() };
            file[random.usize(..end)] = random.choice([0, 1, 0x7f, 0x80, 0xff]).unwrap_or(0);
        }
        let judged = Firmware::parse(&file).is_ok_and(|firmware| {
            let _ = firmware.check_purpose(Kind::Hand, None);
            firmware.footprint(&memory()).is_ok()
        });
        *if judged { &mut accepted } else { &mut refused } += 1;
    }
    assert!(refused > 1000 && accepted > 100, "{refused} refused, {accepted} accepted");
}

#[test]
fn an_image_for_another_processor_is_refused() {
    // The program that runs this test, on most machines.
    let mut wide = vec![0; 64];
    wide[..8].copy_from_slice(b"\x7fELF\x02\x01\x01\0");
    (wide[16], wide[18], wide[20], wide[52]) = (2, 62, 1, 64);
    let mut big = Elf::good(&image()).bytes();
    big[5] = 2;
    for other in [Elf { machine: 3, ..Elf::good(&image()) }.bytes(), wide, big] {
        refused(&other, &["not built for a 32-bit little-endian Arm", "--target thumbv7em-none-eabihf"]);
    }
}

#[test]
fn an_object_file_is_refused() {
    refused(&Elf { kind: 1, ..Elf::good(&image()) }.bytes(), &["not linked as a program"]);
}

#[test]
fn an_image_must_have_one_identity() {
    let mut elf = Elf::good(&image());
    elf.segments[0].bytes.truncate(0x200);
    refused(&elf.bytes(), &["there is no identity in it", "cargo build"]);
    // The beginning of one alone.
    elf.segments[0].bytes.extend(Image::MAGIC);
    elf.segments[0].memory_bytes = elf.segments[0].bytes.len() as u32;
    elf.segments.truncate(1);
    refused(&elf.bytes(), &["cannot be read: it is from another version"]);

    let twice = |second: &Image<'_>| {
        let mut elf = Elf::good(&image());
        elf.segments[1].bytes = identity(second);
        elf.segments[1].memory_bytes = 200;
        elf
    };
    assert!(Firmware::parse(&twice(&image()).bytes()).is_ok());
    let pil = Image { kind: "pil", ..image() };
    refused(&twice(&pil).bytes(), &["`hand for three-finger` and `pil for three-finger`"]);
}

#[test]
fn an_identity_that_is_not_loaded_does_not_count() {
    let mut file = {
        let mut elf = Elf::good(&image());
        elf.segments[0].bytes.truncate(0x200);
        elf.bytes()
    };
    file.extend(identity(&image()));
    refused(&file, &["there is no identity in it"]);
}

#[test]
fn an_image_without_anything_to_load_is_refused() {
    let mut elf = Elf::good(&image());
    elf.segments.drain(..2);
    refused(&elf.bytes(), &["nothing to load"]);
}

#[test]
fn only_the_image_for_this_hand_is_flashed() {
    let hand = ExpectedHand { name: "three-finger".to_owned(), hash: 0x0123_4567 };
    assert_eq!(purpose(&image(), None), Ok(()));
    assert_eq!(purpose(&image(), Some(&hand)), Ok(()));

    let other = ExpectedHand { name: "two-finger".to_owned(), ..hand.clone() };
    assert_told(purpose(&image(), Some(&other)), &["for the hand `three-finger`, not for `two-finger`"]);
    let changed = ExpectedHand { hash: 0x0123_4568, ..hand };
    assert_told(purpose(&image(), Some(&changed)), &["hash 01234567, but the file's is 01234568"]);

    let pil = Image { kind: "pil", ..image() };
    assert_told(purpose(&pil, None), &["this is the image `pil`, not `hand`, which drives the joints"]);
    let odd = Image { kind: "boot\n", ..image() };
    assert_told(purpose(&odd, None), &["this is the image `boot\\n`"]);
    let file = Elf::good(&pil).bytes();
    assert_eq!(Firmware::parse(&file).expect("an image").check_purpose(Kind::Pil, None), Ok(()));
    let newer = Image { interface_version: INTERFACE_VERSION + 1, ..image() };
    assert_told(purpose(&newer, None), &[&format!("speaks version {}", INTERFACE_VERSION + 1)]);
}

#[test]
fn flash_is_filled_to_the_last_byte_and_no_further() {
    let filled = |size: u32| {
        let mut elf = Elf::good(&image());
        elf.segments[0].bytes.resize(size as usize - 64, 0);
        elf.segments[0].memory_bytes = size - 64;
        elf.segments[1].stored = FLASH + size - 64;
        elf
    };
    let full = footprint(&filled(1024 * 1024)).expect("it fits");
    assert_eq!(full.flash_used_bytes, full.flash_bytes);
    misfit(&filled(1024 * 1024 + 4), &["64 bytes would be stored at 0x080fffc4", "make the image smaller"]);
}

#[test]
fn nothing_is_stored_outside_the_flash_that_the_chip_boots_from() {
    // RAM, which forgets; and the one-time-programmable bytes, which never do.
    for stored in [RAM, 0x1FFF_7800] {
        let mut elf = Elf::good(&image());
        elf.segments[1].stored = stored;
        let words = format!(
            "stored at {stored:#010x}, which is not all in this chip's flash (0x08000000 to 0x08100000)"
        );
        misfit(&elf, &[&words]);
    }
}

#[test]
fn variables_must_fit() {
    let with = |used: u32, memory_bytes: u32| {
        let mut elf = Elf::good(&image());
        elf.segments.push(Segment { stored: used, used, bytes: vec![], memory_bytes });
        elf
    };
    misfit(&with(RAM + 4096, 124 * 1024 + 8), &["0x20001000 to 0x20020008, where this chip has no RAM"]);
    misfit(&with(0x3000_0000, 8), &["0x30000000 to 0x30000008, where this chip has no RAM"]);
    let all_but = |bytes: u32| footprint(&with(RAM + 4096, 124 * 1024 - bytes)).expect("it fits").stack_bytes;
    assert_eq!((all_but(1024), all_but(0)), (1024, 0));
    // The stack would start in the middle of them.
    let amid = footprint(&Elf::good(&image()).with_word(0, RAM + 512)).expect("it fits");
    assert_eq!(amid.stack_bytes, 0);
}

#[test]
fn a_stack_below_the_variables_is_understood() {
    // As flip-link lays it out: a stack that runs over leaves the RAM and faults.
    let mut elf = Elf::good(&image()).with_word(0, RAM_END - 4096);
    elf.segments[1].used = RAM_END - 4096;
    elf.segments[2].used = RAM_END - 4096 + 64;
    let footprint = footprint(&elf).expect("it fits");
    assert_eq!((footprint.ram_used_bytes, footprint.stack_bytes), (4096, 124 * 1024));
    // Nothing below it.
    let elf = Elf::good(&image()).with_word(0, RAM);
    misfit(&elf, &["stack pointer 0x20000000"]);
}

#[test]
fn the_vector_table_must_lead_into_the_image() {
    let good = || Elf::good(&image());
    for stack_pointer in [0, 4, RAM_END + 8, RAM_END - 4, 0xffff_fff8] {
        misfit(
            &good().with_word(0, stack_pointer),
            &[&format!("starts with the stack pointer {stack_pointer:#010x}")],
        );
    }
    // Without the Thumb bit; in RAM; beyond what is loaded; nowhere.
    for reset in [RESET, RAM | 1, FLASH + 0x1_0001, 0, 1, 0xffff_ffff] {
        misfit(&good().with_word(1, reset), &[&format!("the reset vector is {reset:#010x}")]);
    }
    let mut elsewhere = good();
    for segment in &mut elsewhere.segments[..2] {
        segment.stored += 0x4000;
    }
    misfit(&elsewhere, &["no vector table at 0x08000000"]);
    let mut short = good();
    let rest = short.segments[0].bytes.split_off(4);
    short.segments[0].memory_bytes = 4;
    let memory_bytes = rest.len() as u32;
    short.segments.push(Segment { stored: FLASH + 4, used: FLASH + 4, bytes: rest, memory_bytes });
    misfit(&short, &["no vector table at 0x08000000"]);
}
