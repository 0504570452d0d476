//! Parts of documents that tests make: compared with what is there, and rewritten on demand.

use crate::images::root;
use std::sync::Mutex;

/// Tests of one program run at once, and may have parts of the same document.
static WRITING: Mutex<()> = Mutex::new(());

/// A table in Markdown.
pub fn table<const N: usize>(head: [&str; N], rows: &[[String; N]]) -> String {
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let mut text = line(head.to_vec()) + &format!("|{}\n", "---|".repeat(N));
    for row in rows {
        text += &line(row.iter().map(String::as_str).collect());
    }
    text
}

/// Compares the part of a document between `<!-- NAME: ... -->` and `<!-- end of NAME -->` with what it has to be. With
/// `BLINDGRASP_BLESS=1` in the environment it is written there instead.
///
/// # Panics
/// If it is something else, or if the document has no such part.
pub fn check(document: &str, name: &str, text: &str) {
    let _writing = WRITING.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let path = root().join(document);
    let whole = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{document}: {error}"));
    let (begin, end) = (format!("<!-- {name}:"), format!("<!-- end of {name} -->"));
    let part = whole.find(&begin).and_then(|at| {
        let from = at + whole[at..].find("-->\n")? + 4;
        Some((from, from + whole[from..].find(&end)?))
    });
    let (from, to) =
        part.unwrap_or_else(|| panic!("{document} has no part between `{begin} ... -->` and `{end}`"));
    let wanted = format!("\n{}\n\n", text.trim());
    if whole[from..to] == wanted {
        return;
    }
    if std::env::var("BLINDGRASP_BLESS").is_ok_and(|bless| bless == "1") {
        let written = std::fs::write(&path, format!("{}{wanted}{}", &whole[..from], &whole[to..]));
        written.unwrap_or_else(|error| panic!("{document}: {error}"));
        return;
    }
    let differ = wanted.lines().zip(whole[from..to].lines()).find(|(new, old)| new != old);
    panic!(
        "{document}, part `{name}`, is not what the code does:\n{differ:#?}\nrun this test with BLINDGRASP_BLESS=1 and \
         look at the difference"
    );
}

/// Compares a file with what it has to be. With `BLINDGRASP_BLESS=1` in the environment it is written instead.
pub fn check_file(path: &str, text: &str) {
    let there = std::fs::read_to_string(root().join(path)).unwrap_or_default();
    if there == text {
        return;
    }
    if std::env::var("BLINDGRASP_BLESS").is_ok_and(|bless| bless == "1") {
        std::fs::write(root().join(path), text).unwrap_or_else(|error| panic!("{path}: {error}"));
        return;
    }
    let differ = text.lines().zip(there.lines()).find(|(new, old)| new != old);
    panic!("{path} is not what the code does:\n{differ:#?}\nrun this test with BLINDGRASP_BLESS=1");
}
