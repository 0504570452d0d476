//! Output to the terminal. Names and words from files, recordings and devices are in it: whatever they hold, a terminal is told
//! nothing but text. Control characters, and those that turn the direction of text, are shown as `\u001b`, which is also how
//! JSON writes them.

use std::fmt::{Arguments, Write as _};
use std::io::{self, IsTerminal as _, Write};

/// Prints a line to stderr, in place of the standard library's macro, in every module below: none can forget to.
macro_rules! eprintln {
    ($($argument:tt)*) => { $crate::terminal::note(format_args!($($argument)*)) };
}

/// Prints a line to stderr.
pub(crate) fn note(line: Arguments<'_>) {
    // A terminal may be gone: nobody to tell, and no reason to panic.
    let _ = writeln!(Plain::new(io::stderr().lock()), "{line}");
}

/// Prints a text to stdout.
///
/// # Errors
/// What the system says.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut stdout = Plain::new(io::stdout().lock());
    stdout.write_all(text.as_bytes())?;
    stdout.flush()
}

/// Stdout for a document: bytes as they are, but for a terminal.
pub(crate) fn document() -> Box<dyn Write + Send> {
    let stdout = io::stdout();
    if stdout.is_terminal() { Box::new(Plain::new(stdout)) } else { Box::new(stdout) }
}

/// Lets text through, and shows what is none.
struct Plain<W> {
    to: W,
    /// The beginning of a character that has not come whole.
    begun: Vec<u8>,
}

impl<W: Write> Plain<W> {
    fn new(to: W) -> Self {
        Self { to, begun: Vec::new() }
    }
}

fn is_text(c: char) -> bool {
    let turns = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    matches!(c, '\n' | '\t') || !(c.is_control() || turns)
}

impl<W: Write> Write for Plain<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.begun.extend_from_slice(bytes);
        let mut shown = String::with_capacity(self.begun.len());
        for chunk in self.begun.utf8_chunks() {
            for c in chunk.valid().chars() {
                if is_text(c) {
                    shown.push(c);
                } else {
                    // None of them needs more digits.
                    let _ = write!(shown, "\\u{:04x}", u32::from(c));
                }
            }
            if !chunk.invalid().is_empty() {
                shown.push(char::REPLACEMENT_CHARACTER);
            }
        }
        // What may go on with the next bytes waits for them.
        let waiting = match std::str::from_utf8(&self.begun) {
            Err(error) if error.error_len().is_none() => {
                shown.pop();
                self.begun[error.valid_up_to()..].to_vec()
            }
            _ => Vec::new(),
        };
        self.begun = waiting;
        self.to.write_all(shown.as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(pieces: &[&[u8]]) -> String {
        let mut shown = Vec::new();
        let mut plain = Plain::new(&mut shown);
        for piece in pieces {
            plain.write_all(piece).unwrap();
        }
        String::from_utf8(shown).unwrap()
    }

    #[test]
    fn only_text_gets_through_however_it_is_cut() {
        let told = "a\x1b[2J\u{9b}31m\rb\u{202e}c\tü€😀\n";
        let shown = "a\\u001b[2J\\u009b31m\\u000db\\u202ec\tü€😀\n";
        assert_eq!(plain(&[told.as_bytes()]), shown);
        let bytes: Vec<&[u8]> = told.as_bytes().chunks(1).collect();
        assert_eq!(plain(&bytes), shown);
        assert_eq!(plain(&[b"a\xff", b"b\xe2\x82", b"\xacc"]), "a\u{fffd}b€c");
    }
}
