//! The ports that there are, for whoever has named none, or a wrong one.

use anyhow::anyhow;
use blindgrasp::device::talk::TalkError;
use blindgrasp::device::transport::ports_in_words;

/// The port that was named.
///
/// # Errors
/// Which there are, if none was.
pub(super) fn given(port: Option<&str>) -> anyhow::Result<&str> {
    port.ok_or_else(|| anyhow!("which port? Name it with --port; {}", ports_in_words()))
}

/// Returns the error of a silent port, with the ports that there are.
pub(super) fn explained(error: TalkError) -> anyhow::Error {
    match error {
        TalkError::NobodyThere(..) => anyhow!("{error}; {}", ports_in_words()),
        _ => error.into(),
    }
}
