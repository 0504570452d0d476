//! Whatever numbers a scene file has: it is refused in words, or it runs, and what comes out is numbers.

use blindgrasp::model::Scene;
use blindgrasp::sim::Simulation;
use blindgrasp_tests::random::Draw;
use std::path::Path;

/// Numbers that have broken programs before.
const ODD: [&str; 12] =
    ["0", "-1", "1", "1e-300", "1e300", "-0.0", "nan", "inf", "-inf", "5e-324", "1e-9", "9007199254740993"];

/// Replaces a random number of a scene by an odd one, or by itself a few powers of ten larger or smaller.
fn damaged(text: &str, draw: &mut Draw) -> String {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let words: Vec<&str> = text.split_inclusive([' ', '\n', ',', '[', ']']).collect();
    let bare = |word: &str| word.trim_end_matches([' ', '\n', ',', '[', ']']).to_owned();
    let numbers: Vec<usize> = (0..words.len()).filter(|&i| is_number(&bare(words[i]))).collect();
    let chosen = numbers[draw.count(0..=numbers.len() - 1)];
    let old = bare(words[chosen]);
    let new = if draw.chance(0.4) {
        ODD[draw.count(0..=ODD.len() - 1)].to_owned()
    } else {
        let factor = 10_f64.powi(draw.count(0..=8) as i32 - 4);
        format!("{:?}", old.parse::<f64>().unwrap_or(1.0) * factor)
    };
    let mut text = String::new();
    for (i, word) in words.iter().enumerate() {
        text += &if i == chosen { word.replacen(&old, &new, 1) } else { (*word).to_owned() };
    }
    text
}

#[test]
fn scenes_with_odd_numbers_are_refused_or_run() {
    let (mut refused, mut held, mut lost) = (0, 0, 0);
    let mut draw = Draw::new(5);
    for name in ["cube", "prism-ideal"] {
        let whole = Scene::load(name, &["duration_s=0.02".to_owned()]).expect("built in").effective_toml();
        for _ in 0..400 {
            let text = damaged(&whole, &mut draw);
            let text = damaged(&text, &mut draw);
            let scene =
                match Scene::parse(&text, "random.toml", Path::new("."), &["duration_s=0.02".to_owned()]) {
                    Ok(scene) => scene,
                    Err(error) => {
                        let message = error.to_string();
                        assert!(message.contains("random.toml") && message.lines().count() == 1, "{message}");
                        refused += 1;
                        continue;
                    }
                };
            // What the scene lets pass, the tick may still refuse, for its own bounds.
            let simulation = match Simulation::new(&scene) {
                Ok(simulation) => simulation,
                Err(error) => {
                    println!("{error}");
                    refused += 1;
                    continue;
                }
            };
            let run = simulation.run();
            for sample in &run.samples {
                assert!(
                    sample.speeds_rad_s.iter().chain(&sample.torques_nm).all(|v| v.is_finite()),
                    "{text}"
                );
                assert!(sample.position_m.iter().all(|v| v.is_finite()), "{text}");
            }
            if run.summary.grasp_held { held += 1 } else { lost += 1 }
        }
    }
    println!("scenes with odd numbers: {refused} refused, {held} held, {lost} lost");
    assert!(refused > 100 && held > 100 && lost > 0, "the numbers are odd, but not all of them are nonsense");
}
