//! Every key of a scene and of an object stands in docs/scenes.md, and every key of a hand in docs/hands.md: names, values,
//! defaults and words are those of the structs that the files are read into.

use blindgrasp::model::file::{
    Actuators, CapsuleFile, ContactFile, Control, FileKey, FingertipFile, Friction, HandFile, JointFile,
    MoveFile, ObjectFile, PlantSettings, PoseFile, PostureFile, PushFile, SceneFile, Sensors, ShakeFile,
    ShapeFile, StartFile, TableFile, TurnFile,
};
use blindgrasp::model::{Scene, mesh};
use blindgrasp::sim::Simulation;
use blindgrasp_shared::control::{GAINS, LAWS};
use blindgrasp_tests::generated;
use blindgrasp_tests::images::root;
use serde::de::{self, DeserializeOwned, Deserializer, Visitor};
use serde::ser::Serialize;
use serde_json::{Map, Value, json};

const DOCUMENT: &str = "docs/scenes.md";
const HEAD: [&str; 4] = ["key", "value", "unless given", "what"];

/// A format that has nothing but a question: by which names a struct knows its fields, or an enum its kinds.
struct Names<'a>(&'a mut &'static [&'static str]);

impl<'de> Deserializer<'de> for Names<'_> {
    type Error = de::value::Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
        Err(de::Error::custom("there is nothing to read"))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        *self.0 = fields;
        self.deserialize_any(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        kinds: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        *self.0 = kinds;
        self.deserialize_any(visitor)
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map identifier ignored_any
    }
}

fn names<T: DeserializeOwned>() -> &'static [&'static str] {
    let mut names: &'static [&'static str] = &[];
    let read = T::deserialize(Names(&mut names));
    assert!(read.is_err() && !names.is_empty());
    names
}

/// A type of Rust in the words of somebody who writes a file.
fn value(rust: &str) -> &'static str {
    let inner = rust.strip_prefix("Option<").and_then(|inner| inner.strip_suffix('>')).unwrap_or(rust);
    match inner {
        "f64" => "number",
        "u32" | "usize" => "whole number",
        "bool" => "`true` or `false`",
        "String" => "text",
        "[f64; 3]" => "3 numbers",
        "[f64; 4]" => "4 numbers",
        "Vec<f64>" => "numbers",
        "Vec<[f64; 2]>" => "list of 2 numbers each",
        "Vec<[f64; 3]>" => "list of 3 numbers each",
        "Vec<[usize; 3]>" => "list of 3 whole numbers each",
        "InertiaFile" => "3 or 6 numbers",
        "BTreeMap<String, f64>" => "names with numbers",
        "Indentation" => "number or text",
        "ContactLaw" | "AttitudeError" => "text",
        "HandFile" | "ObjectFile" => "text or table",
        "Vec<ContactFile>" | "Vec<PushFile>" | "Vec<TableFile>" | "Vec<MoveFile>" | "Vec<TurnFile>"
        | "Vec<ShakeFile>" | "Vec<StepFile>" => "tables",
        "PoseFile" | "StartFile" | "Control" | "Sensors" | "Actuators" | "Friction" | "PlantSettings"
        | "ShapeFile" => "table",
        unknown => panic!("no words for the type {unknown}"),
    }
}

fn words(text: &str) -> String {
    text.trim().trim_end_matches('.').to_owned()
}

/// Returns what `T` is read into from these entries, written again.
fn effective<T: DeserializeOwned + Serialize>(entries: &Map<String, Value>) -> Result<Value, String> {
    let read: T =
        serde_json::from_value(Value::Object(entries.clone())).map_err(|error| error.to_string())?;
    serde_json::to_value(read).map_err(|error| error.to_string())
}

/// The cell that says what a key is unless it is given: found out by leaving it out of the least that can be read.
fn unless_given<T: DeserializeOwned + Serialize>(name: &str, least: &Map<String, Value>) -> String {
    let mut without = least.clone();
    without.remove(name);
    match effective::<T>(&without) {
        Err(error) => {
            assert!(error.starts_with(&format!("missing field `{name}`")), "{name}: {error}");
            "has to be given".into()
        }
        Ok(whole) => match &whole[name] {
            // What is left out when it is written is told in words.
            Value::Null => String::new(),
            table if table.is_object() => String::new(),
            value => shown(value),
        },
    }
}

/// A value as a file has it.
fn shown(value: &Value) -> String {
    format!("`{}`", value.to_string().replace(',', ", "))
}

fn row(name: &str, value: &str, unless_given: String, what: &str) -> [String; 4] {
    [format!("`{name}`"), value.to_owned(), unless_given, words(what)]
}

/// The table of a struct, which can be read from these entries.
fn table<T: DeserializeOwned + Serialize>(keys: &[FileKey], least: &Value) -> String {
    let least = least.as_object().expect("a table");
    let names = names::<T>();
    assert_eq!(names.len(), keys.len(), "{names:?}");
    let rows = names.iter().zip(keys);
    let rows: Vec<_> = rows
        .map(|(name, key)| row(name, value(key.value), unless_given::<T>(name, least), key.words))
        .collect();
    generated::table(HEAD, &rows)
}

/// The table of `[control]`, whose gains are declared by their laws.
fn control(least: &Value) -> String {
    let least = least.as_object().expect("a table");
    let gain = |gain: &blindgrasp_shared::control::Gain| {
        let what = format!("{} ({})", gain.words, gain.unit);
        row(gain.key, "number", unless_given::<Control>(gain.key, least), &what)
    };
    let laws: Vec<String> = LAWS.iter().map(|(name, what)| format!("`{name}` ({what})")).collect();
    let all = json!(LAWS.iter().map(|(name, _)| name).collect::<Vec<_>>());
    assert_eq!(effective::<Control>(least), {
        let given: Map<String, Value> =
            least.clone().into_iter().chain([("laws".into(), all.clone())]).collect();
        effective::<Control>(&given)
    });
    let what = format!("Laws that may act: {}. A law whose gains are all zero does nothing", laws.join(", "));
    let others = Control::KEYS
        .iter()
        .map(|key| row(key.field, value(key.value), unless_given::<Control>(key.field, least), key.words));
    let rows = GAINS.iter().map(gain).chain([row("laws", "list of texts", shown(&all), &what)]);
    generated::table(HEAD, &rows.chain(others).collect::<Vec<_>>())
}

/// The tables of shapes, each with an example that has no more than it needs.
fn shapes() -> String {
    let points = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    let regular = json!({"sides": 5, "side_m": 0.03, "height_m": 0.05});
    let least = [
        json!({"size_m": [0.1, 0.1, 0.1]}),
        regular.clone(),
        json!({"corners_m": [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]], "height_m": 0.1}),
        json!({"points_m": points}),
        regular,
        json!({"vertices_m": points, "triangles": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]}),
    ];
    let names = names::<ShapeFile>();
    assert_eq!((names.len(), ShapeFile::KINDS.len()), (least.len(), least.len()));
    let mut text = String::new();
    for ((name, kind), least) in names.iter().zip(ShapeFile::KINDS).zip(least) {
        let read = |entries: &Map<String, Value>| {
            let shape: Result<ShapeFile, _> = serde_json::from_value(json!({*name: entries}));
            let shape = shape.map_err(|error| error.to_string())?;
            Ok::<_, String>(serde_json::to_value(shape).expect("a shape")[*name].clone())
        };
        let least = least.as_object().expect("a table");
        let is_mesh = *name == "mesh";
        let of_file = mesh::FILE_KEYS.iter().filter(|_| is_mesh).map(|key| {
            let unless = if key.field == "scale" { "`1.0`" } else { "has to be given, or both below" };
            row(key.field, value(key.value), unless.into(), key.words)
        });
        let rows = kind.keys.iter().map(|key| {
            let mut without = least.clone();
            without.remove(key.field);
            let unless = match read(&without) {
                Err(error) if error == format!("missing field `{}`", key.field) => {
                    if is_mesh { "has to be given, or a file" } else { "has to be given" }.into()
                }
                Err(error) => panic!("{name}.{}: {error}", key.field),
                Ok(whole) if whole[key.field].is_null() => String::new(),
                Ok(whole) => shown(&whole[key.field]),
            };
            // Serde knows it by this name.
            let given = least.clone().into_iter().chain([(key.field.to_owned(), json!("?"))]).collect();
            assert!(read(&given).is_err_and(|error| !error.contains("unknown field")), "{}", key.field);
            row(key.field, value(key.value), unless, key.words)
        });
        let table = generated::table(HEAD, &of_file.chain(rows).collect::<Vec<_>>());
        text += &format!("### `[shape.{name}]`\n\n{}.\n\n{table}\n", words(kind.words));
    }
    text
}

#[test]
fn the_document_has_every_key_of_a_scene() {
    let hand = HandFile::load("three-finger").expect("a hand");
    let object = ObjectFile::load("cube").expect("an object");
    let pose = json!({"position_m": [0.0, 0.0, 0.1]});
    let gains = json!({"force_n": 5.0, "attitude_stiffness_nm": 5e-3});
    let nothing = json!({});
    let scene = json!({
        "schema": 1, "name": "least", "duration_s": 1.0, "hand": hand, "object": object, "pose": pose, "contact": [],
        "control": gains
    });
    let span = |mut entries: Value| {
        entries["from_s"] = json!(1.0);
        entries["for_s"] = json!(1.0);
        entries
    };
    let push = span(json!({}));
    let sections = [
        ("The file", table::<SceneFile>(SceneFile::KEYS, &scene)),
        ("`[pose]`", table::<PoseFile>(PoseFile::KEYS, &pose)),
        ("`[[contact]]`", table::<ContactFile>(ContactFile::KEYS, &nothing)),
        ("`[start]`", table::<StartFile>(StartFile::KEYS, &nothing)),
        ("`[control]`", control(&gains)),
        ("`[sensors]`", table::<Sensors>(Sensors::KEYS, &nothing)),
        ("`[actuators]`", table::<Actuators>(Actuators::KEYS, &nothing)),
        ("`[friction]`", table::<Friction>(Friction::KEYS, &nothing)),
        ("`[plant]`", table::<PlantSettings>(PlantSettings::KEYS, &nothing)),
        ("`[[plant.table]]`", table::<TableFile>(TableFile::KEYS, &json!({"point_m": [0.0, 0.0, 0.0]}))),
        (
            "`[[plant.table.move]]`",
            table::<MoveFile>(MoveFile::KEYS, &span(json!({"by_m": [0.0, 0.0, 0.0]}))),
        ),
        (
            "`[[plant.turn]]`",
            table::<TurnFile>(TurnFile::KEYS, &span(json!({"gravity_m_s2": [0.0, 0.0, 0.0]}))),
        ),
        (
            "`[[plant.shake]]`",
            table::<ShakeFile>(
                ShakeFile::KEYS,
                &span(json!({"amplitude_m_s2": [0.0, 0.0, 0.0], "frequency_hz": 1.0})),
            ),
        ),
        ("`[[plant.push]]`", table::<PushFile>(PushFile::KEYS, &push)),
    ];
    let text: String =
        sections.iter().map(|(heading, table)| format!("### {heading}\n\n{table}\n")).collect();
    generated::check(DOCUMENT, "scene keys", &text);
}

#[test]
fn the_document_has_every_key_of_an_object() {
    let least = json!({"schema": 1, "name": "least", "shape": {"box": {"size_m": [0.1, 0.1, 0.1]}}});
    let file = table::<ObjectFile>(ObjectFile::KEYS, &least);
    generated::check(DOCUMENT, "object keys", &format!("### The object's file\n\n{file}\n{}", shapes()));
}

/// The settings that people ask for first, each with what it is for.
const USEFUL: [(&str, &[&str], &str); 10] = [
    ("cube", &["plant.gravity_on_object=true"], "give the object its weight"),
    ("cube", &["plant.gravity_on_object=true", "object.mass_kg=0.05"], "take a heavier object"),
    ("cube", &["control.force_n=10"], "grasp more firmly"),
    ("cube-ideal", &["control.attitude_stiffness_nm=0"], "grasp by normal forces alone, without `u_st`"),
    ("cube", &["friction.scale=0.1"], "take friction from the joints; 0 leaves none"),
    ("prism-ideal", &["control.damping_scale=2"], "damp the joints more"),
    ("cube", &["pose.rotation_rpy_rad.3=0.2"], "turn the object (rad); `pose.position_m` shifts it"),
    (
        "cube",
        &["hand.joint.*.encoder_counts_per_turn=200"],
        "change any key of the hand, of one joint or of all",
    ),
    ("cube", &["actuators.output_delay_ticks=20"], "delay the torques, as a slow bus does (ticks of 1 ms)"),
    (
        "cube",
        &["plant.push=[{from_s=2.0,for_s=0.5,force_n=[0.0,0.2,0.0]}]"],
        "push the object for half a second",
    ),
];

#[test]
fn the_document_has_the_most_useful_settings_with_what_they_do() {
    let row = |(scene, settings, purpose): &(&str, &[&str], &str)| {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
        let scene = Scene::load(scene, &settings).unwrap_or_else(|error| panic!("{error}"));
        let summary = Simulation::new(&scene).expect("a scene that can be simulated").run().summary;
        let outcome = match (summary.lost_at_s, &summary.lost_reason, summary.settle_time_s) {
            (Some(lost_at_s), Some(reason), _) => format!("**lost** at {lost_at_s:.2} s: {reason}"),
            (_, _, Some(t_s)) => format!("held, at rest from {t_s:.2} s"),
            _ => format!("held, not at rest after {:.0} s", summary.duration_s),
        };
        let command: Vec<String> =
            settings.iter().map(|setting| format!("--set {}", quoted(setting))).collect();
        [
            (*purpose).to_owned(),
            format!("`sim {} {}`", scene.name, command.join(" ")),
            format!("{outcome}; needs a friction of {:.2}", summary.friction_demand_max),
        ]
    };
    let rows: Vec<[String; 3]> = USEFUL.iter().map(row).collect();
    generated::check(DOCUMENT, "useful settings", &generated::table(["to", "command", "result"], &rows));
}

/// A setting as a shell takes it.
fn quoted(setting: &str) -> String {
    if setting.contains(['*', '[', '{']) { format!("'{setting}'") } else { setting.to_owned() }
}

#[test]
fn the_examples_of_the_document_are_settings() {
    for setting in
        ["contact.2.point_m.3=0.001", "hand.joint.*.coulomb_friction_nm=1e-3", "object.mass_kg=0.02"]
    {
        let page = std::fs::read_to_string(root().join(DOCUMENT)).expect("the page");
        assert!(page.contains(&format!("`--set {setting}`")), "{setting}");
        Scene::load("cube", &[setting.to_owned()]).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Hands have more to say of each key than a struct has, so their tables are written by hand.
#[test]
fn the_document_of_hands_leaves_out_no_key() {
    let page = std::fs::read_to_string(root().join("docs/hands.md")).expect("the page");
    let plain = [
        names::<HandFile>(),
        names::<JointFile>(),
        names::<FingertipFile>(),
        names::<CapsuleFile>(),
        names::<PostureFile>(),
    ]
    .concat();
    let table = |name: &str| page.contains(&format!("`[{name}]`")) || page.contains(&format!("`[[{name}]]`"));
    let missing: Vec<_> =
        plain.into_iter().filter(|name| !page.contains(&format!("`{name}`")) && !table(name)).collect();
    assert!(missing.is_empty(), "docs/hands.md does not have {missing:?}");
}
