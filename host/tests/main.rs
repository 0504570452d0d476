//! The command as its users meet it, and the host's crates put together.

#[cfg(feature = "monitor")]
mod any_device;
mod broken;
mod command_line;
mod console;
mod elf;
#[cfg(feature = "parquet")]
mod export;
#[cfg(all(unix, feature = "parquet", feature = "sweep"))]
mod files;
mod flash;
mod folder;
mod hand;
mod hand_check;
mod image;
#[cfg(feature = "monitor")]
mod monitor;
#[cfg(feature = "paper")]
mod paper;
mod patient;
mod pick_up;
mod pil;
mod python_client;
mod python_sweep;
mod record;
mod recorded;
mod recording;
mod replay;
mod scene_new;
#[cfg(all(feature = "parquet", feature = "sweep"))]
mod sweep;
mod your_own_hand;
