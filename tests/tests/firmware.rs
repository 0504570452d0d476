//! The images for the microcontroller, read from their ELF: no way to a panic from the control task, no double
//! precision, no allocator, no semihosting where it would stop a real board, room to spare, and stack enough.
//!
//!     cargo test --release -p blindgrasp-tests --features firmware --test firmware

use blindgrasp_tests::images::{DEFAULT_HAND, kept_image, root};
use blindgrasp_tests::thumb::{Function, Image};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, elf};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use std::sync::OnceLock;

/// Flash of an image, bytes.
const MOST_FLASH: u64 = 128 * 1024;
/// Variables of an image, without the stack, bytes.
const MOST_RAM: u64 = 96 * 1024;
/// By how much a size may differ from the one that is written down, bytes: compilers differ, and so do the paths in the
/// messages of panics.
const SIZE_SLACK: u64 = 1024;
/// The interrupts of the image `hand` that do its work.
const CONTROL_TASK: &str = "SysTick";
const LINE_TASKS: [&str; 3] = ["USART2", "DMA1_STREAM5", "DMA1_STREAM6"];

/// ELF of an image for the default hand.
fn elf(kind: &'static str) -> &'static [u8] {
    static HAND: OnceLock<Vec<u8>> = OnceLock::new();
    static PIL: OnceLock<Vec<u8>> = OnceLock::new();
    let cell = if kind == "hand" { &HAND } else { &PIL };
    cell.get_or_init(|| fs::read(kept_image(kind, DEFAULT_HAND)).expect("an image"))
}

/// Flash and static RAM, bytes.
fn sizes(elf: &[u8]) -> (u64, u64) {
    let file = object::File::parse(elf).expect("an ELF");
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        let flags = |all: u32| sh_flags & u64::from(all) == u64::from(all);
        // What is in memory at all; what comes from flash; what can be written.
        if flags(elf::SHF_ALLOC) && section.size() > 0 {
            let initialised = section.kind() != SectionKind::UninitializedData;
            flash += if initialised { section.size() } else { 0 };
            ram += if flags(elf::SHF_WRITE) { section.size() } else { 0 };
        }
    }
    (flash, ram)
}

#[test]
fn the_control_task_reaches_no_panic_and_no_double_precision() {
    let image = Image::read(elf("hand"));
    let mut tasks = LINE_TASKS.map(|task| image.address(task)).to_vec();
    tasks.push(image.address(CONTROL_TASK));
    let reached = image.reached(&tasks);
    println!("functions reached from {CONTROL_TASK} and {LINE_TASKS:?}: {}", reached.len());
    assert!(reached.len() > 20, "too few to be true: {reached:?}");
    let names: Vec<&String> = image.functions.values().map(|function| &function.name).collect();
    assert!(names.iter().any(|name| name.contains("panicking")), "the image has panics, but by other names");
    for (address, way) in reached {
        let function = &image.functions[&address];
        let name = &function.name;
        assert!(!name.contains("panicking") && !name.contains("unwrap_failed"), "a panic: {way:#?}");
        assert!(!name.contains("__aeabi_d") && !name.contains("f64"), "double precision: {way:#?}");
        assert_eq!(function.indirect_calls, 0, "a call that can't be followed: {way:#?}");
        assert!(function.odd.is_empty(), "{:?}: {way:#?}", function.odd);
    }
}

#[test]
fn there_is_no_allocator_and_no_semihosting_on_a_real_board() {
    for kind in ["hand", "pil"] {
        let file = object::File::parse(elf(kind)).expect("an ELF");
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or("");
            assert!(!name.contains("__rust_alloc") && !name.contains("__rdl_alloc"), "{kind}: {name}");
        }
    }
    // BKPT 0xAB asks a debugger for something; without one it is a hard fault.
    let asking = |kind| {
        let image = Image::read(elf(kind));
        let stops = |function: &Function| function.odd.iter().any(|odd| odd.starts_with("bkpt"));
        image.functions.into_values().filter(stops).collect::<Vec<_>>()
    };
    assert!(asking("hand").is_empty(), "{:?}", asking("hand"));
    assert!(asking("pil").iter().any(|function| function.odd.contains(&"bkpt 0xab".to_owned())));
}

#[test]
fn the_stack_is_twice_what_the_interrupts_need() {
    let image = Image::read(elf("hand"));
    let (control, way) = image.deepest(image.address(CONTROL_TASK));
    // They have one priority, so that none interrupts another.
    let line = LINE_TASKS.map(|task| image.deepest(image.address(task)).0).into_iter().max().unwrap_or(0);
    // On the way into each of the two, the processor pushes 26 words, with those of the FPU (RM 0403E B1.5.7).
    let interrupts = control + line + 2 * 26 * 4;
    println!("control task: {control} bytes of stack, {CONTROL_TASK} by way of {way:#?}");
    println!("line tasks: {line}; both with what the processor pushes: {interrupts}");
    let file = object::File::parse(elf("hand")).expect("an ELF");
    let symbol = |name| file.symbols().find(|s| s.name() == Ok(name)).map(|s| s.address());
    let start = symbol("_stack_start").expect("the top of the stack");
    let variables = file.section_by_name(".data").expect("variables").address();
    let reserved = start - 0x2000_0000;
    assert!(start <= variables, "the stack lies above variables that it could run into");
    assert!(2 * u64::from(interrupts) < reserved, "{interrupts} of {reserved}");
}

/// Nothing but the start reads a hand's parameters, and moves them about; the largest hand that the board can have is the worst.
#[test]
fn the_stack_has_room_for_the_start_of_a_hand_with_16_joints() {
    let image = fs::read(kept_image("hand", "models/hands/allegro-like.toml")).expect("an image");
    let functions = Image::read(&image);
    let (start, way) = functions.deepest(functions.address("main"));
    println!("start: {start} bytes of stack, by way of {way:#?}");
    let file = object::File::parse(&*image).expect("an ELF");
    let symbol = |name| file.symbols().find(|s| s.name() == Ok(name)).map(|s| s.address());
    let reserved = symbol("_stack_start").zip(symbol("_stack_end")).map(|(start, end)| start - end);
    assert!(u64::from(start) < reserved.expect("both ends"), "{start} of {reserved:?}");
}

/// Returns the sizes of the images, as they are written down.
fn measured() -> BTreeMap<String, u64> {
    let mut measured = BTreeMap::new();
    for kind in ["hand", "pil"] {
        let (flash, ram) = sizes(elf(kind));
        measured.insert(format!("{kind}_flash_bytes"), flash);
        measured.insert(format!("{kind}_ram_bytes"), ram);
    }
    let image = Image::read(elf("hand"));
    measured.insert("hand_control_stack_bytes".into(), image.deepest(image.address(CONTROL_TASK)).0.into());
    measured
}

#[test]
fn sizes_are_within_limits_and_as_written_down() {
    let measured = measured();
    let mut text = String::from(
        "# What the images for the three-fingered hand take, without the stack. Written by\n\
         # BLINDGRASP_BLESS=1 cargo test --release -p blindgrasp-tests --features firmware --test firmware\n",
    );
    for (name, value) in &measured {
        let _ = writeln!(text, "{name} = {value}");
        println!("{name} = {value}");
        let most = if name.ends_with("flash_bytes") { MOST_FLASH } else { MOST_RAM };
        assert!(*value <= most, "{name}: {value} of {most}");
    }
    let path = root().join("tests/data/firmware-sizes.toml");
    if std::env::var_os("BLINDGRASP_BLESS").is_some() {
        fs::write(&path, text).expect("the snapshot can be written");
    }
    let written = fs::read_to_string(&path).expect("the snapshot is there");
    for (name, value) in measured {
        let line = written.lines().find_map(|line| line.strip_prefix(&format!("{name} = ")));
        let line: u64 =
            line.and_then(|line| line.parse().ok()).unwrap_or_else(|| panic!("{name} is missing"));
        assert!(
            value.abs_diff(line) <= SIZE_SLACK,
            "{name} is {value}, written down is {line}: if that is meant, run this with BLINDGRASP_BLESS=1"
        );
    }
}

/// The check above reads the code; this one asks the linker. An image of the control path alone, whose panic handler calls
/// what does not exist, links only if the panic handler is not needed.
#[test]
fn an_image_of_the_tick_alone_links_without_a_panic_handler() {
    let output = Command::new("tests/firmware-toolchain")
        .args(["cargo", "build", "--quiet", "--locked", "-p", "blindgrasp-firmware", "--bin", "no-panic"])
        .args(["--features", "no-panic", "--profile", "firmware", "--target", "thumbv7em-none-eabihf"])
        .env("HAND", DEFAULT_HAND)
        .current_dir(root())
        .output()
        .expect("tests/firmware-toolchain runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
}
