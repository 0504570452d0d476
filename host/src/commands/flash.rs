//! `blindgrasp flash`: firmware onto a microcontroller, over a debug probe.

use super::{Outcome, progress};
use crate::terminal;
use anyhow::{Context, bail};
use blindgrasp::device::flash::logs::Logs;
use blindgrasp::device::flash::monitor::{self, Event};
use blindgrasp::device::flash::probe::{attach, choose, describe, with_options};
use blindgrasp::device::flash::{Chip, Phase, Progress, download};
use blindgrasp::device::image::{BUILD_HINT, ExpectedHand, Firmware, Footprint, Kind};
use blindgrasp::device::options::Level;
use blindgrasp::device::{interrupt, options};
use blindgrasp::files;
use blindgrasp::model::HandModel;
use clap::Args;
use probe_rs::probe::list::Lister;
use serde::Serialize;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// Check a firmware image and write it to the hand's microcontroller over a debug probe
///
/// Before anything is erased, the image is checked: that it fits the chip, would start there, and is for this hand. The
/// joints must be without power: a controller that is halted leaves the amplifiers at their last command.
///
/// Exit code 0: flashed, or nothing against it (--dry-run); 2: refused or failed, with the reason.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The image, an ELF file [default: the one of its kind that was built last in target/]
    image: Option<PathBuf>,
    /// Refuse an image that is not of this kind
    #[arg(long, value_enum, default_value_t = Kind::Hand)]
    kind: Kind,
    /// Refuse an image that is not for this hand, given by its file
    #[arg(long, value_name = "FILE")]
    hand: Option<PathBuf>,
    /// The microcontroller, as probe-rs calls it
    #[arg(long, value_name = "NAME", default_value = "STM32F405RGTx")]
    chip: String,
    /// The debug probe, where several are connected: VID:PID or VID:PID:SERIAL
    #[arg(long, value_name = "SELECTOR")]
    probe: Option<String>,
    /// Read the flash back and compare it with the image (the default)
    #[arg(long, overrides_with = "no_verify")]
    verify: bool,
    /// Do not read the flash back
    #[arg(long)]
    no_verify: bool,
    /// Set the chip's brown-out level too: an option byte, which the firmware only tells. On a read-protected chip this is
    /// refused, before anything is erased
    #[arg(long, value_enum, value_name = "LEVEL")]
    brown_out: Option<Level>,
    /// Then show what the firmware logs, until Ctrl-C
    #[arg(long, conflicts_with = "json")]
    monitor: bool,
    /// Only check the image; no probe is needed
    #[arg(long, conflicts_with = "monitor")]
    dry_run: bool,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

/// Larger files are no images of a microcontroller, bytes.
const LARGEST_FILE_BYTES: u64 = 256 << 20;

/// The report that is printed.
#[derive(Serialize)]
struct Report<'a> {
    image: String,
    chip: &'a str,
    kind: &'a str,
    hand: &'a str,
    hand_hash: String,
    /// `true` if `--hand` gave a hand that the image was compared with.
    hand_checked: bool,
    interface_version: u16,
    firmware_version: &'a str,
    build_hash: String,
    joint_count: u8,
    fingertip_count: u8,
    period_us: u32,
    flash: Use,
    ram: Use,
    stack_bytes: u64,
    flashed: bool,
    verified: bool,
    /// The brown-out level before, and as it was set.
    brown_out: Option<[String; 2]>,
}

#[derive(Serialize)]
struct Use {
    used_bytes: u64,
    available_bytes: u64,
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let path = match &arguments.image {
        Some(path) => path.clone(),
        None => newest_image(arguments.kind)?,
    };
    let file = read(&path)?;
    let about = || format!("image {}", path.display());
    let firmware = Firmware::parse(&file).with_context(about)?;
    let expected = arguments.hand.as_deref().map(expected_hand).transpose()?;
    firmware.check_purpose(arguments.kind, expected.as_ref()).with_context(about)?;
    let chip = Chip::by_name(&arguments.chip)?;
    let footprint = chip.check(&firmware).with_context(|| format!("{} on {}", about(), chip.name()))?;
    let follow = if arguments.monitor { Some(follower(&firmware, &file).with_context(about)?) } else { None };

    let mut report = report(&path, &chip, &firmware, &footprint, expected.is_some());
    if arguments.dry_run {
        return print(&report, arguments.json);
    }
    let info = choose(&Lister::new(), arguments.probe.as_deref())?;
    eprintln!("blindgrasp: probe {}; the joints must be without power", describe(&info));
    let mut session = attach(&info, &chip, firmware.device)?;
    if arguments.brown_out.is_some() {
        with_options(&mut session, &chip, |core| options::unprotected(core).map(|_| ()))?;
    }
    let line = progress::Progress::new();
    let verify = arguments.verify || !arguments.no_verify;
    let written = download(&mut session, &chip, &firmware, verify, |progress| show_phase(&line, progress));
    drop(line);
    written?;
    if let Some(level) = arguments.brown_out {
        let before = with_options(&mut session, &chip, |core| options::set_brown_out(core, level))?;
        report.brown_out = Some([before.to_string(), level.to_string()]);
    }
    monitor::start(&mut session, firmware.rtt_control_block)?;
    (report.flashed, report.verified) = (true, verify);
    let outcome = print(&report, arguments.json)?;
    if let Some((control_block, logs)) = follow {
        let stop = stop_at_interrupt();
        eprintln!("blindgrasp: logs of the firmware, with the time of this host in UTC; Ctrl-C ends");
        // The same probe, by its serial number: it may come back elsewhere on the bus.
        let connect = || attach(&info, &chip, firmware.device).ok();
        monitor::follow(session, connect, control_block, &logs, &stop, show)?;
    }
    Ok(outcome)
}

/// The image of a kind that was built last, by either toolchain.
fn newest_image(kind: Kind) -> anyhow::Result<PathBuf> {
    let here = std::env::current_dir().context("cannot tell the current directory")?;
    let target = match std::env::var_os("CARGO_TARGET_DIR") {
        Some(directory) => here.join(directory),
        None => here.ancestors().find(|at| at.join("Cargo.lock").is_file()).unwrap_or(&here).join("target"),
    };
    let candidates = [target.clone(), target.join("debian")]
        .map(|directory| directory.join("thumbv7em-none-eabihf/firmware").join(kind.name()));
    let built = |path: &PathBuf| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    let newest = candidates.iter().filter_map(|path| Some((built(path)?, path))).max();
    let Some((_, path)) = newest else {
        bail!("there is no image at {}; build one with {BUILD_HINT}", candidates[0].display());
    };
    Ok(path.clone())
}

fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    let about = || format!("cannot read the image {}", path.display());
    if fs::metadata(path).with_context(about)?.len() > LARGEST_FILE_BYTES {
        bail!("{} is not an image of a microcontroller; give the ELF file that cargo links", path.display());
    }
    files::read(path).with_context(about)
}

/// Returns the follower of the firmware's logs, if it has what that needs.
fn follower(firmware: &Firmware<'_>, file: &[u8]) -> anyhow::Result<(u64, Logs)> {
    let logs = Logs::parse(file)?;
    let control_block = firmware.rtt_control_block.context(
        "the image has no symbol _SEGGER_RTT, so that its logs cannot be found; do not strip it of symbols",
    )?;
    Ok((control_block, logs))
}

/// The hand of a file, with the hash that firmware built for it has.
fn expected_hand(path: &Path) -> anyhow::Result<ExpectedHand> {
    let text = path.to_str().context("the path after --hand is not UTF-8")?;
    let model = HandModel::load(text)?;
    Ok(ExpectedHand { hash: model.hash(), name: model.name })
}

fn report<'a>(
    path: &Path,
    chip: &'a Chip,
    firmware: &'a Firmware<'_>,
    footprint: &Footprint,
    hand_checked: bool,
) -> Report<'a> {
    let image = &firmware.image;
    Report {
        image: path.display().to_string(),
        chip: chip.name(),
        kind: image.kind,
        hand: image.hand,
        hand_hash: format!("{:08x}", image.hand_hash),
        hand_checked,
        interface_version: image.interface_version,
        firmware_version: image.firmware_version,
        build_hash: format!("{:08x}", image.build_hash),
        joint_count: image.joint_count,
        fingertip_count: image.fingertip_count,
        period_us: image.period_us,
        flash: Use { used_bytes: footprint.flash_used_bytes, available_bytes: footprint.flash_bytes },
        ram: Use { used_bytes: footprint.ram_used_bytes, available_bytes: footprint.ram_bytes },
        stack_bytes: footprint.stack_bytes,
        flashed: false,
        verified: false,
        brown_out: None,
    }
}

fn print(report: &Report<'_>, json: bool) -> anyhow::Result<Outcome> {
    let text = if json { serde_json::to_string(report)? + "\n" } else { describe_report(report) };
    terminal::print(&text).context("cannot print the result")?;
    Ok(Outcome::Shown)
}

/// The report as a table.
fn describe_report(report: &Report<'_>) -> String {
    let kib = |bytes: u64| format!("{:.1} KiB", bytes as f64 / 1024.0);
    let share = |share: &Use| {
        let percent = 100.0 * share.used_bytes as f64 / share.available_bytes as f64;
        format!("{} of {} ({percent:.1} %)", kib(share.used_bytes), kib(share.available_bytes))
    };
    let hand = match report.hand_checked {
        true => "as in --hand",
        false => "not compared; --hand FILE does",
    };
    let state = match (report.flashed, report.verified) {
        (false, _) => "checked only",
        (true, true) => "flashed, verified, started",
        (true, false) => "flashed, not verified, started",
    };
    let lines = [
        ("image", report.image.clone()),
        ("hand", format!("{} ({}, {hand})", report.hand, report.hand_hash)),
        (
            "firmware",
            format!(
                "{} ({}), interface {}",
                report.firmware_version, report.build_hash, report.interface_version
            ),
        ),
        (
            "controls",
            format!(
                "{} joints, {} fingertips, every {} us",
                report.joint_count, report.fingertip_count, report.period_us
            ),
        ),
        ("chip", report.chip.to_owned()),
        ("flash", share(&report.flash)),
        ("RAM, static", share(&report.ram)),
        ("RAM for the stack", kib(report.stack_bytes)),
        ("state", state.to_owned()),
    ];
    let brown_out =
        report.brown_out.iter().map(|[before, now]| ("brown-out reset", format!("{now}, {before} before")));
    lines.into_iter().chain(brown_out).map(|(name, value)| format!("{name:<22}{value}\n")).collect()
}

fn show_phase(line: &progress::Progress, Progress { phase, done_bytes, total_bytes }: Progress) {
    let phase = match phase {
        Phase::Erase => "erasing",
        Phase::Program => "writing",
        Phase::Verify => "verifying",
    };
    line.show(done_bytes, total_bytes, |percent| {
        format!("{percent:>3} % of {} kB, {phase}", total_bytes / 1000)
    });
}

/// A flag that Ctrl-C sets.
fn stop_at_interrupt() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let handle = Arc::clone(&stop);
    interrupt::listen_by(move |_| handle.store(true, Ordering::Relaxed));
    stop
}

fn show(event: Event) -> io::Result<()> {
    match event {
        Event::Line(line) => terminal::print(&format!("{} {line}\n", time_of_day())),
        Event::Note(text) => {
            eprintln!("blindgrasp: {} {text}", time_of_day());
            Ok(())
        }
    }
}

/// Of this host, UTC.
fn time_of_day() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let (s, ms) = (now.as_secs() % 86_400, now.subsec_millis());
    format!("{:02}:{:02}:{:02}.{ms:03}", s / 3600, s / 60 % 60, s % 60)
}
