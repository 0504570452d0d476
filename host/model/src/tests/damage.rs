//! Scenes that are damaged at random: never a panic.

use super::*;

/// Cuts a text into words, numbers, marks and blanks.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let class = |c: char| match c {
        'a'..='z' | 'A'..='Z' | '0'..='9' | '_' | '.' | '-' | '+' => 0,
        ' ' => 1,
        _ => 2,
    };
    for c in text.chars() {
        match tokens.last_mut() {
            Some(last) if class(c) < 2 && last.chars().next().map(class) == Some(class(c)) => last.push(c),
            _ => tokens.push(c.into()),
        }
    }
    tokens
}

#[test]
fn damaged_texts_never_panic() {
    let replacements = [
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "1",
        "1e300",
        "-1e300",
        "1e-300",
        "5e-324",
        "99999999999999999999",
        "true",
        "\"\"",
        "\"x\"",
        "[]",
        "{}",
        "[[]]",
        "[nan]",
        "1970-01-01",
        "=",
        "[",
        "]",
        "\"",
        "\u{0}",
        "\u{feff}",
        "\u{1f980}",
        "'''",
        "0x7fffffffffffffff",
        "4294967296",
        "18446744073709551615",
        "equilibrium",
        "-0.0",
        "\\",
        "..",
        "1.7976931348623157e308",
    ];
    let huge = format!("[{}]", "0.1,".repeat(20_000));
    let deep = "[".repeat(5_000);
    let mut numbers = Numbers(5);
    let sources: Vec<Vec<String>> = ["cube", "prism-ideal", "pick-cube"]
        .into_iter()
        .flat_map(|name| [tokens(text(name)), tokens(&load(name, &[]).unwrap().effective_toml())])
        .chain([tokens(&{
            let mut file = load("cube", &[]).unwrap().file;
            file.object.shape = ShapeFile::Hull {
                points_m: Polyhedron::cuboid([0.048; 3])
                    .unwrap()
                    .vertices_m
                    .iter()
                    .map(|&v| v.into())
                    .collect(),
            };
            Scene::build(file).unwrap().effective_toml()
        })])
        .collect();
    let (mut accepted, mut refused) = (0, 0);
    for round in 0..2000 {
        let mut tokens = sources[round % sources.len()].clone();
        for _ in 0..1 + numbers.below(3) {
            let at = numbers.below(tokens.len());
            match numbers.below(8) {
                0 => {
                    tokens.remove(at);
                }
                1 => tokens.insert(at, tokens[at].clone()),
                2 => {
                    let other = numbers.below(tokens.len());
                    tokens.swap(at, other);
                }
                3 => tokens.truncate(at.max(1)),
                4 if round % 50 == 0 => {
                    tokens[at] = if numbers.below(2) == 0 { huge.clone() } else { deep.clone() }
                }
                _ => tokens[at] = replacements[numbers.below(replacements.len())].into(),
            }
        }
        match parse(&tokens.concat()) {
            Ok(scene) => {
                accepted += 1;
                assert!(scene.start.angles_rad.iter().all(|angle| angle.is_finite()));
                assert!(scene.inertia_kg_m2.iter().all(|v| v.is_finite()));
                assert_touches(&scene);
            }
            Err(error) => {
                refused += 1;
                let line = error.to_string();
                assert!(!line.contains('\n') && line.len() < 900, "{line}");
            }
        }
    }
    println!("{accepted} damaged texts accepted, {refused} refused");
    assert!(accepted > 100 && refused > 100);
}
