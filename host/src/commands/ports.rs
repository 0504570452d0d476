//! The ports that there are, for whoever has named none, or a wrong one.

use anyhow::anyhow;
use blindgrasp::device::talk::TalkError;

/// The port that was named.
///
/// # Errors
/// Which there are, if none was.
pub(super) fn given(port: Option<&str>) -> anyhow::Result<&str> {
    port.ok_or_else(|| anyhow!("which port? Name it with --port; {}", all()))
}

/// Why nobody answers, with the ports that there are.
pub(super) fn explained(error: TalkError) -> anyhow::Error {
    match error {
        TalkError::NobodyThere(..) => anyhow!("{error}; {}", all()),
        _ => error.into(),
    }
}

/// All ports, in words.
pub(super) fn all() -> String {
    let mut ports = serial2::SerialPort::available_ports().unwrap_or_default();
    ports.sort();
    let names: Vec<String> = ports.iter().map(|port| port.display().to_string()).collect();
    match names.as_slice() {
        [] => "this machine has no serial ports".to_owned(),
        names => format!("this machine has the serial ports {}", names.join(", ")),
    }
}
