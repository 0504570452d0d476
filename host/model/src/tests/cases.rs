//! Mistakes in a file that was right, and what has to be said of each: paragraphs of a text.

/// A paragraph.
#[derive(Default)]
pub(crate) struct Case {
    /// The file that is changed, where it is not always the same: the line `of NAME`.
    pub(crate) of: Option<&'static str>,
    /// Replacements: the old text (`-`), the new one (`+`), and in how many places (`-2`).
    pub(crate) edits: Vec<(String, String, usize)>,
    /// The message (`=`), and the place that it is said of where it needs a name (`@`).
    pub(crate) said: Vec<(Option<&'static str>, &'static str)>,
}

impl Case {
    /// Makes the mistakes in a text.
    pub(crate) fn make(&self, good: &str) -> String {
        self.edits.iter().fold(good.to_owned(), |text, (from, to, places)| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, *places)
        })
    }

    /// Compares what is said of a text with one mistake.
    pub(crate) fn check(&self, good: &str, message: impl Fn(&str) -> String) {
        assert_eq!(message(&self.make(good)), self.said[0].1, "{:?}", self.edits);
    }
}

/// The cases of a text.
pub(crate) fn cases(text: &'static str) -> impl Iterator<Item = Case> {
    text.split("\n\n").map(case).filter(|case| !case.said.is_empty())
}

fn case(paragraph: &'static str) -> Case {
    let mut case = Case::default();
    let (mut before, mut place) = ('#', None);
    for line in paragraph.lines() {
        let (mark, words) = line.split_once(' ').unwrap_or((line, ""));
        let kind = mark.chars().next().unwrap_or('#');
        match (kind, case.edits.last_mut()) {
            ('-', Some((from, ..))) if before == '-' => *from = format!("{from}\n{words}"),
            ('-', _) => case.edits.push((words.to_owned(), String::new(), mark[1..].parse().unwrap_or(1))),
            ('+', Some((_, to, _))) if before == '+' => *to = format!("{to}\n{words}"),
            ('+', Some((_, to, _))) => words.clone_into(to),
            ('@', _) => place = Some(words),
            ('=', _) => case.said.push((place.take(), words)),
            ('o', _) => case.of = Some(words),
            ('#', _) => {}
            _ => panic!("no line of a case: {line}"),
        }
        before = kind;
    }
    case
}
