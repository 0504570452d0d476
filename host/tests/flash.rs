//! `blindgrasp flash` as a user meets it, as far as that goes without a microcontroller.

#[cfg(feature = "probe")]
use crate::elf;

use crate::folder::Folder;

#[cfg(not(feature = "probe"))]
#[test]
fn a_build_without_probes_says_how_to_get_one_with_them() {
    let folder = Folder::new();
    for arguments in [&["flash"][..], &["flash", "image", "--dry-run", "--json", "--verify"]] {
        folder.refused(arguments, &["cargo run --release --features probe -- flash"]);
    }
}

#[cfg(feature = "probe")]
mod with_probes {
    use super::Folder;
    use super::elf::{Elf, FLASH, RAM, RAM_END, Segment, image};
    use blindgrasp::device::flash::Chip;
    use blindgrasp::device::flash::logs::{Line, Logs};
    use blindgrasp::device::flash::probe::{choose, contradiction};
    use blindgrasp_shared::identity::Image;
    use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem, ProbeLister};
    use probe_rs::probe::{
        DebugProbe, DebugProbeError, DebugProbeInfo, DebugProbeSelector, Probe, ProbeCreationError,
        ProbeFactory,
    };
    use serde_json::{Value, json};
    use std::fmt;

    /// No probe has this selector, so that no test ever flashes what happens to be connected.
    const NO_PROBE: &str = "dead:beef:blindgrasp-test";

    /// The chip that is meant where nothing else is said, by the command's help.
    fn default_chip() -> String {
        let help = Folder::new().run(&["flash", "--help"]).stdout;
        let help = String::from_utf8(help).expect("UTF-8");
        let (_, chip) = help.split_once("--chip <NAME>").expect("the option");
        let (_, default) = chip.split_once("[default: ").expect("its default");
        default.split_once(']').expect("the end of it").0.to_owned()
    }

    #[test]
    fn a_dry_run_tells_what_the_image_is_and_takes() {
        let folder = Folder::new();
        let path = folder.write("hand", Elf::good(&image()).bytes());
        let output = folder.run(&["flash", &path, "--dry-run", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stderr.is_empty());
        let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        let flash_bytes = Elf::good(&image()).segments[0].bytes.len() + 64;
        let expected = json!({
            "image": path,
            "chip": default_chip(),
            "kind": "hand",
            "hand": "three-finger",
            "hand_hash": "01234567",
            "hand_checked": false,
            "interface_version": image().interface_version,
            "firmware_version": "0.1.0",
            "build_hash": "89abcdef",
            "joint_count": 12,
            "fingertip_count": 3,
            "period_us": 1000,
            "flash": { "used_bytes": flash_bytes, "available_bytes": 1024 * 1024 },
            "ram": { "used_bytes": 4096, "available_bytes": 128 * 1024 },
            "stack_bytes": 124 * 1024,
            "flashed": false,
            "verified": false,
            "brown_out": null,
        });
        assert_eq!(report, expected);

        let output = folder.run(&["flash", &path, "--dry-run"]);
        let table = String::from_utf8(output.stdout).expect("UTF-8");
        for words in [
            "three-finger (01234567",
            "12 joints",
            "of 1024.0 KiB",
            "4.0 KiB of 128.0 KiB (3.1 %)",
            "124.0 KiB",
            "checked only",
        ] {
            assert!(table.contains(words), "no `{words}` in: {table}");
        }
    }

    #[test]
    fn the_image_that_was_built_last_is_the_default() {
        let folder = Folder::new();
        folder.refused(
            &["flash", "--dry-run"],
            &["no image", "thumbv7em-none-eabihf/firmware/hand", "tests/firmware-toolchain cargo build"],
        );
        let path = folder.write("debian/thumbv7em-none-eabihf/firmware/hand", Elf::good(&image()).bytes());
        let output = folder.run(&["flash", "--dry-run", "--json"]);
        let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(report["image"], Value::from(path));
    }

    #[test]
    fn images_are_refused_with_the_reason() {
        let folder = Folder::new();
        let refuse = |bytes: &[u8], words: &[&str]| {
            let path = folder.write("image", bytes);
            for more in [&["--dry-run"][..], &["--probe", NO_PROBE]] {
                folder.refused(&[&["flash", &path], more].concat(), words);
            }
        };
        let good = Elf::good(&image());
        refuse(b"not an image", &["image", "not an ELF file"]);
        refuse(
            &Elf::good(&Image { kind: "pil", ..image() }).bytes(),
            &["this is the image `pil`, not `hand`"],
        );
        let mut large = good.clone();
        large.segments[0].bytes.resize(1024 * 1024, 0);
        large.segments[0].memory_bytes = 1024 * 1024;
        large.segments[1].stored = FLASH + 1024 * 1024;
        refuse(
            &large.bytes(),
            &[
                &format!("on {}", default_chip()),
                "64 bytes would be stored at 0x08100000",
                "make the image smaller",
            ],
        );
        let mut saving = good.clone();
        for (name, at) in [("_saved_start", FLASH + 0xC_0000), ("_saved_end", FLASH + 0x10_0000)] {
            saving.symbols.push((name.to_owned(), at, false));
        }
        saving.segments[1].stored = FLASH + 0xB_FFFC;
        refuse(
            &saving.bytes(),
            &["reaches into the flash of saved parameters", "to 0x080e0000 would be erased"],
        );
    }

    #[test]
    fn files_and_chips_that_are_not_there_are_named() {
        let folder = Folder::new();
        let path = folder.write("image", Elf::good(&image()).bytes());
        folder.refused(&["flash", "nowhere/hand", "--dry-run"], &["cannot read the image nowhere/hand"]);
        folder.refused(&["flash", "/", "--dry-run"], &["cannot read the image /: it is a folder"]);
        let default = default_chip();
        // Without its package, and then without its flash.
        let family = default.strip_suffix("Tx").expect("a package");
        let misspelt = format!("{}X", &family[..family.len() - 1]);
        let chip = |name| ["flash", path.as_str(), "--dry-run", "--chip", name];
        folder
            .refused(&chip(&misspelt), &[&format!("no chip is called `{misspelt}`; did you mean {family}?")]);
        folder.refused(&chip("abacus"), &["no chip is called `abacus`", "https://probe.rs/targets"]);
        folder.refused(&chip("GD32VF103CB"), &["no Arm core"]);
    }

    #[test]
    fn a_smaller_chip_is_told_apart() {
        // STM32F401RB: 128 KiB of flash, 64 KiB of RAM.
        let folder = Folder::new();
        let path = folder.write("image", Elf::good(&image()).bytes());
        let small = ["flash", path.as_str(), "--dry-run", "--chip", "STM32F401RBTx"];
        folder.refused(&small, &["stack pointer 0x20020000", "--chip"]);
        let path = folder.write("small", Elf::good(&image()).with_word(0, RAM + 0x1_0000).bytes());
        let small = ["flash", path.as_str(), "--dry-run", "--json", "--chip", "STM32F401RBTx"];
        let report: Value = serde_json::from_slice(&folder.run(&small).stdout).expect("one JSON object");
        assert_eq!(report["flash"]["available_bytes"], 128 * 1024);
        assert_eq!(report["ram"]["available_bytes"], 64 * 1024);
    }

    #[test]
    fn the_hand_of_the_image_is_compared_with_the_file() {
        let folder = Folder::new();
        let path = folder.write("image", Elf::good(&Image { hand: "another", ..image() }).bytes());
        let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/hands/three-finger.toml");
        let arguments = ["flash", path.as_str(), "--dry-run", "--hand", model];
        folder.refused(&arguments, &["for the hand `another`, not for `three-finger`"]);
        let path = folder.write("image", Elf::good(&image()).bytes());
        let arguments = ["flash", path.as_str(), "--dry-run", "--hand", model];
        folder.refused(&arguments, &["hash 01234567", "build the image again"]);
        let arguments = ["flash", path.as_str(), "--dry-run", "--hand", "nowhere.toml"];
        folder.refused(&arguments, &["nowhere.toml"]);
    }

    #[test]
    fn without_a_probe_that_is_said() {
        let folder = Folder::new();
        let path = folder.write("image", Elf::good(&image()).bytes());
        // Which of the two depends on what is connected to this machine.
        folder.refused(&["flash", &path, "--probe", NO_PROBE], &["no debug probe"]);
        let arguments = ["flash", &path, "--brown-out", "3", "--probe", NO_PROBE];
        folder.refused(&arguments, &["no debug probe"]);
    }

    #[test]
    fn monitoring_needs_logs_in_the_image() {
        let folder = Folder::new();
        let path = folder.write("image", Elf::good(&image()).bytes());
        folder.refused(&["flash", &path, "--monitor", "--probe", NO_PROBE], &["no defmt logs"]);
        let mut elf = with_logs("rzcobs");
        elf.symbols.remove(0);
        let path = folder.write("image", elf.bytes());
        folder.refused(&["flash", &path, "--monitor", "--probe", NO_PROBE], &["_SEGGER_RTT"]);
    }

    #[test]
    fn probe_rs_itself_would_write_where_nothing_may_be_written() {
        // Which is why it is not asked alone: bytes there can be written once, and never again.
        let chip = Chip::by_name(&default_chip()).expect("known");
        let mut elf = Elf::good(&image());
        elf.segments.push(Segment {
            stored: 0x1FFF_7800,
            used: 0x1FFF_7800,
            bytes: vec![0; 4],
            memory_bytes: 4,
        });
        let file = elf.bytes();
        let firmware = blindgrasp::device::image::Firmware::parse(&file).expect("an image");
        assert!(chip.check(&firmware).is_err_and(|error| error.to_string().contains("stored at 0x1fff7800")));
        assert_eq!(chip.memory().flash, 0x0800_0000..0x0810_0000);
        assert!(chip.memory().ram.contains(&(u64::from(RAM)..u64::from(RAM_END))));
    }

    #[test]
    fn the_sectors_that_are_erased_are_known() {
        let chip = Chip::by_name(&default_chip()).expect("known");
        let flash: Vec<_> = chip
            .memory()
            .sectors
            .iter()
            .filter(|sector| chip.memory().flash.contains(&sector.start))
            .collect();
        let sizes: Vec<u64> = flash.iter().map(|sector| (sector.end - sector.start) / 1024).collect();
        assert_eq!(sizes, [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128]);
        assert_eq!((flash[0].start, flash[11].end), (0x0800_0000, 0x0810_0000));
    }

    #[test]
    fn another_chip_is_recognised() {
        let kib = |size: u64| size * 1024;
        let expected = Some(0x413);
        // Revision in the high half.
        assert_eq!(contradiction(expected, kib(1024), 0x1007_6413, 1024), None);
        assert_eq!(contradiction(expected, kib(1024), 0x2000_6411, 1024), None);
        assert_eq!(contradiction(expected, kib(512), 0x1007_6413, 1024), None);
        let found = contradiction(expected, kib(1024), 0x1007_6413, 512).expect("other");
        assert_eq!(found, "one with 512 KiB of flash in place of 1024");
        let found = contradiction(expected, kib(512), 0x1001_6433, 512).expect("other");
        assert_eq!(found, "a device 0x433, where the image is for a device 0x413");
        let found = contradiction(expected, kib(1024), 0, 0).expect("other");
        assert!(found.contains("a device 0x000"), "{found}");
        // An image that does not say what it is for.
        assert_eq!(contradiction(None, kib(512), 0x1001_6433, 512), None);
        assert!(contradiction(None, kib(1024), 0x1001_6433, 512).is_some());
    }

    /// Probes that are only listed.
    #[derive(Debug)]
    struct Listed(Vec<ProbeListItem>);

    impl ProbeLister for Listed {
        fn open(&self, _: &DebugProbeSelector) -> Result<Probe, DebugProbeError> {
            Err(DebugProbeError::ProbeCouldNotBeCreated(ProbeCreationError::NotFound))
        }

        fn list_with_access(&self, _: Option<&DebugProbeSelector>) -> Vec<ProbeListItem> {
            self.0.clone()
        }
    }

    #[derive(Debug)]
    struct Maker;

    impl fmt::Display for Maker {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "listed")
        }
    }

    impl ProbeFactory for Maker {
        fn open(&self, _: &DebugProbeSelector) -> Result<Box<dyn DebugProbe>, DebugProbeError> {
            Err(DebugProbeError::ProbeCouldNotBeCreated(ProbeCreationError::NotFound))
        }

        fn list_probes(&self) -> Vec<ProbeListItem> {
            Vec::new()
        }
    }

    fn listed(serials: &[&str], accessibility: Accessibility) -> Lister {
        let item = |serial: &&str| ProbeListItem {
            info: DebugProbeInfo::new(
                "STLink V2-1",
                0x0483,
                0x374b,
                Some((*serial).to_owned()),
                &Maker,
                None,
                false,
            ),
            accessibility,
        };
        Lister::with_lister(Box::new(Listed(serials.iter().map(item).collect())))
    }

    #[test]
    fn the_probe_that_is_meant_is_found() {
        let usable = |serials| listed(serials, Accessibility::Accessible);
        let refused = |probes: &Lister, selector: Option<&str>, words: &str| {
            let error = choose(probes, selector).expect_err(words).to_string();
            assert!(error.contains(words), "no `{words}` in: {error}");
        };
        refused(&usable(&[]), None, "no debug probe found");
        refused(&usable(&[]), Some("0483:374b"), "no debug probe found");
        assert_eq!(choose(&usable(&["A"]), None).expect("one").serial_number.as_deref(), Some("A"));

        let two = usable(&["A", "B"]);
        refused(&two, None, "--probe: 0483:374b:A (STLink V2-1); 0483:374b:B");
        refused(&two, Some("0483:374b"), "2 debug probes are connected");
        let chosen = choose(&two, Some("0483:374b:B")).expect("the second");
        assert_eq!(chosen.serial_number.as_deref(), Some("B"));
        refused(&two, Some("0483:374b:C"), "no debug probe is `0483:374b:C`; connected are: 0483:374b:A");
        for text in ["", "stlink", "0483", "0483:xyz", "0483:374b-x"] {
            refused(&two, Some(text), &format!("`{text}` does not select a probe"));
        }

        let forbidden = listed(&["A"], Accessibility::PermissionDenied);
        let error = choose(&forbidden, None).expect_err("no permission").to_string();
        assert!(error.contains("0483:374b:A") && error.contains("udev"), "{error}");
    }

    /// An image that logs: `info` 1 with a number, `error` 2, and a time stamp of microseconds.
    fn with_logs(encoding: &str) -> Elf {
        let entry = |tag: &str, data: &str, address: u32| {
            let symbol = json!({ "package": "p", "tag": tag, "data": data, "disambiguator": address.to_string(), "crate_name": "p" });
            (symbol.to_string(), address, true)
        };
        let mut elf = Elf::good(&image());
        elf.symbols.extend([
            ("_defmt_version_ = 4".to_owned(), 0, false),
            (format!("_defmt_encoding_ = {encoding}"), 0, false),
            entry("defmt_info", "joint {=u8} is ready", 1),
            entry("defmt_error", "stopped", 2),
            entry("defmt_timestamp", "{=u32:us}", 3),
        ]);
        elf
    }

    fn lines(logs: &Logs, chunks: &[&[u8]]) -> (Vec<String>, u64) {
        let mut decoder = logs.decoder();
        let mut lines = Vec::new();
        for chunk in chunks {
            decoder.push(chunk, |line: Line| lines.push(line.to_string()));
        }
        (lines, decoder.damaged_frames())
    }

    /// Reverse zero-compressing COBS of a frame of at most seven bytes, one of them zero: the bytes that are not zero,
    /// then a byte that says which are.
    fn rzcobs(frame: &[u8]) -> Vec<u8> {
        let mut bytes: Vec<u8> = frame.iter().copied().filter(|&byte| byte != 0).collect();
        let zero = |index: usize| frame.get(index).copied().unwrap_or(0) == 0;
        bytes.push((0..7).map(|index| u8::from(zero(index)) << index).sum());
        bytes.push(0);
        bytes
    }

    #[test]
    fn logs_are_decoded_as_they_come() {
        let frames = [[1, 0, 0x40, 0x42, 0x0f, 0, 7].as_slice(), &[2, 0, 0x80, 0x84, 0x1e, 0]];
        let expected = ["1.000000 info  joint 7 is ready", "2.000000 error stopped"];

        let logs = Logs::parse(&with_logs("raw").bytes()).expect("a table");
        assert_eq!(lines(&logs, &[&frames.concat()]), (expected.map(str::to_owned).to_vec(), 0));

        let logs = Logs::parse(&with_logs("rzcobs").bytes()).expect("a table");
        let stream = [rzcobs(frames[0]), rzcobs(frames[1])].concat();
        for cut in 0..stream.len() {
            let (start, end) = stream.split_at(cut);
            assert_eq!(
                lines(&logs, &[start, end]),
                (expected.map(str::to_owned).to_vec(), 0),
                "cut at {cut}"
            );
        }
    }

    #[test]
    fn damaged_logs_are_counted_and_the_next_line_is_right() {
        let logs = Logs::parse(&with_logs("rzcobs").bytes()).expect("a table");
        let good = rzcobs(&[2, 0, 0x80, 0x84, 0x1e, 0]);
        // A line that is not in the table, and one whose beginning was overwritten.
        let unknown = rzcobs(&[9, 0, 1, 1, 1, 0]);
        let cut = rzcobs(&[1, 0, 0x40, 0x42, 0x0f, 0, 7]).split_off(3);
        let (lines, damaged_frames) = lines(&logs, &[&unknown, &good, &cut, &good]);
        assert_eq!((lines.len(), damaged_frames), (2, 2), "{lines:?}");
        assert!(lines.iter().all(|line| line.ends_with("error stopped")), "{lines:?}");
    }

    #[test]
    fn an_image_without_logs_or_with_newer_ones_is_refused() {
        let without = Logs::parse(&Elf::good(&image()).bytes()).err().expect("no logs").to_string();
        assert!(without.contains("no defmt logs"), "{without}");
        let mut newer = with_logs("rzcobs");
        newer.symbols[1].0 = "_defmt_version_ = 99".to_owned();
        let Err(error) = Logs::parse(&newer.bytes()) else { panic!("decoded") };
        assert!(error.to_string().contains("99"), "{error}");
        assert!(!error.to_string().contains('\n'), "{error}");
    }
}
