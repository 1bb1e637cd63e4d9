//! `cargo xtask keys`: the keys of configuration files as tables for the book, out of the structures that read them. What a key means is
//! the comment above its field.

use std::fmt::Write;
use std::fs;
use std::io;

use crate::command_line::workspace;
use crate::failure::Failure;

/// A table of a configuration file: its heading, and the item that reads it.
type Table = (&'static str, &'static str, &'static str);

const EXPERIMENT: &str = "crates/experiment/src/configuration.rs";
const SETTINGS: &str = "crates/synthetic/src/settings.rs";
const EFFECTS: &str = "crates/synthetic/src/effects.rs";
const SENSOR_MAP: &str = "crates/synthetic/src/effects/sensor_map.rs";
const MAPPING: &str = "crates/chainwave/src/import/mapping.rs";

/// Files, and their tables in the order of the page.
const FILES: [(&str, &[Table]); 3] = [
    (
        "experiment.toml",
        &[
            ("At the top", EXPERIMENT, "struct Experiment"),
            ("`[chain]`", "crates/experiment/src/configuration/chain.rs", "struct Chain"),
            ("`[striker]`", EXPERIMENT, "struct Striker"),
            ("`[camera]`", "crates/experiment/src/configuration/camera.rs", "struct Camera"),
            ("`[camera.ruler]`", "crates/experiment/src/configuration/camera.rs", "struct Ruler"),
            ("`[camera.marks]`", "crates/experiment/src/configuration/camera.rs", "struct Marks"),
            ("`[tracking]`", "crates/experiment/src/configuration/tracking.rs", "struct Tracking"),
            ("`[trigger]`", EXPERIMENT, "struct Trigger"),
            ("`[analysis]`", "crates/experiment/src/configuration/analysis.rs", "struct Analysis"),
            ("`[synthetic]`: what is filmed", EXPERIMENT, "struct Synthetic"),
            ("`[synthetic.chain]`", "crates/experiment/src/configuration/true_chain.rs", "struct TrueChain"),
            ("`[synthetic.rings]`", "crates/experiment/src/configuration/rings.rs", "struct FilmedRings"),
            ("`[synthetic.specimen]`", SETTINGS, "struct Specimen"),
            ("`[synthetic.specimen.ring]`", SETTINGS, "struct Ring"),
            ("`[synthetic.specimen.marker]`", SETTINGS, "struct Marker"),
            ("`[synthetic.specimen.rods]`", SETTINGS, "struct Rods"),
            ("`[synthetic.specimen.tones]`", SETTINGS, "struct Tones"),
            ("`[synthetic.camera]`", SETTINGS, "struct Camera"),
            ("`[synthetic.camera.sensor]`", SETTINGS, "struct Sensor"),
            ("`[synthetic.camera.optics]`", "crates/synthetic/src/optics.rs", "struct Optics"),
            ("`[synthetic.camera.lighting]`", "crates/synthetic/src/lighting.rs", "struct Lighting"),
            ("`[synthetic.camera.effects]`", EFFECTS, "struct Effects"),
            ("`[synthetic.camera.effects.fixed_pattern]`", SENSOR_MAP, "struct FixedPattern"),
            (
                "`[synthetic.camera.effects.line_noise]`",
                "crates/synthetic/src/effects/line_noise.rs",
                "struct LineNoise",
            ),
            (
                "`[synthetic.camera.effects.out_of_plane]`",
                "crates/synthetic/src/effects/out_of_plane.rs",
                "struct OutOfPlane",
            ),
            ("`[synthetic.camera.effects.defective_pixels]`", SENSOR_MAP, "struct DefectivePixels"),
            (
                "`[synthetic.camera.effects.reflections]`",
                "crates/synthetic/src/effects/reflections.rs",
                "struct Reflections",
            ),
            (
                "`[synthetic.camera.effects.shadow]`",
                "crates/synthetic/src/effects/shadow.rs",
                "struct Shadow",
            ),
            ("`[synthetic.camera.effects.defocus]`", EFFECTS, "struct Defocus"),
            ("`[synthetic.camera.effects.shake]`", "crates/synthetic/src/effects/shake.rs", "struct Shake"),
            (
                "`[synthetic.camera.effects.scale]`",
                "crates/synthetic/src/effects/scale_error.rs",
                "struct ScaleError",
            ),
            (
                "`[[synthetic.faults]]`, by `kind`",
                "crates/experiment/src/configuration/fault.rs",
                "enum Fault",
            ),
        ],
    ),
    (
        "MAPPING.toml of `import`",
        &[
            ("At the top", MAPPING, "struct Mapping"),
            ("`[chain]`", MAPPING, "struct Chain"),
            ("`[layout]`", "crates/chainwave/src/import/layout.rs", "struct Layout"),
            ("`[time]`", MAPPING, "struct Time"),
            ("`[displacement]`", MAPPING, "struct Displacement"),
            ("`[sigma]`", MAPPING, "struct Sigma"),
        ],
    ),
    ("STYLE.toml of `figures`", &[("At the top", "crates/figures/src/style.rs", "struct Style")]),
];

/// Prints the tables.
pub(crate) fn run() -> Result<(), Failure> {
    print!("{}", page()?);
    Ok(())
}

fn page() -> Result<String, Failure> {
    let mut page = String::new();
    for (file, tables) in FILES {
        let _ = writeln!(page, "\n## {file}"); // Writing to a text cannot fail.
        for (heading, path, item) in tables {
            let failed = |source| Failure::File { path: path.into(), source };
            let source = fs::read_to_string(workspace().join(path)).map_err(failed)?;
            let nothing =
                || failed(io::Error::new(io::ErrorKind::InvalidData, format!("no {item} with keys")));
            let keys = keys(&source, item).filter(|keys| !keys.is_empty()).ok_or_else(nothing)?;
            let _ = writeln!(page, "\n### {heading}\n\n| key | value | |\n|---|---|---|");
            keys.iter().for_each(|key| page.push_str(&key.row()));
        }
    }
    Ok(page)
}

/// A key of a table, or a kind that keys belong to.
#[derive(Debug, PartialEq, Eq)]
struct Key {
    name: String,
    /// The type of its field; none of a kind.
    of_type: Option<String>,
    may_be_left_out: bool,
    comment: String,
}

impl Key {
    fn row(&self) -> String {
        let Self { name, of_type, may_be_left_out, comment } = self;
        let brackets = if *may_be_left_out { ["(", ")"] } else { ["", ""] };
        let value = of_type.as_deref().map(value).unwrap_or_default();
        let [open, close] = brackets;
        format!("| {open}`{name}`{close} | {value} | {} |\n", comment.replace('|', "\\|"))
    }
}

/// The fields of an item in their order; of an enumeration each variant, and then its fields. None where there is no such item.
fn keys(source: &str, item: &str) -> Option<Vec<Key>> {
    let (before, item) = source.split_once(&format!("{item} {{\n"))?;
    let item = item.split("\n}").next()?;
    let above = before.rsplit("\n\n").next().unwrap_or_default();
    let all_may = above.contains("deny_unknown_fields, default)");
    let mut keys = Vec::new();
    let (mut comment, mut attributes) = (String::new(), String::new());
    for line in item.lines().map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            comment = format!("{comment} {}", text.trim()).trim().to_owned();
        } else if line.starts_with("#[") {
            attributes.push_str(line);
        } else if let Some(variant) = line.strip_suffix(" {") {
            let name = format!("kind = \"{}\"", snake_case(variant));
            keys.push(Key {
                name,
                of_type: None,
                may_be_left_out: false,
                comment: std::mem::take(&mut comment),
            });
        } else if let Some((name, of_type)) = line.strip_suffix(',').and_then(|line| line.split_once(": ")) {
            let may_be_left_out =
                all_may || of_type.starts_with("Option<") || attributes.contains("(default");
            let name = name.rsplit(' ').next().unwrap_or(name).to_owned();
            let comment = std::mem::take(&mut comment);
            keys.push(Key { name, of_type: Some(of_type.to_owned()), may_be_left_out, comment });
            attributes.clear();
        }
    }
    Some(keys)
}

/// What a user writes for a type: a table where it is none of the plain ones.
fn value(of_type: &str) -> String {
    let within = |start: &str| of_type.strip_prefix(start).and_then(|rest| rest.strip_suffix('>'));
    if let Some(inner) = within("Option<") {
        return value(inner);
    }
    if let Some(inner) = within("Vec<") {
        return format!("a list, each {}", value(inner));
    }
    if let Some(inner) = within("Pattern<") {
        return format!("{}, or one each", value(inner));
    }
    let plain = match of_type {
        "f64" => "a number",
        "Positive" => "a number above 0",
        "NotNegative" => "a number, 0 or above",
        "usize" | "u32" | "u64" | "i32" | "i64" => "a whole number",
        "bool" => "`true` or `false`",
        "PathBuf" => "a file",
        "[f64; 2]" => "`[x, y]`",
        "[[f64; 2]; 2]" => "`[[x, y], [x, y]]`",
        "[String; 2]" => "two names",
        "String" => "a text",
        name if name.ends_with("Name") || NAMES.contains(&name) => "a name",
        _ => "a table",
    };
    plain.to_owned()
}

/// Types of which one is chosen by its name.
const NAMES: [&str; 12] = [
    "Axis",
    "ColourMap",
    "DecimalSign",
    "Direction",
    "Interpolation",
    "Packing",
    "Program",
    "RawGeometry",
    "Separator",
    "ShakeOnset",
    "ShapeChoice",
    "Zero",
];

fn snake_case(name: &str) -> String {
    let mut words = String::new();
    for (index, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && index > 0 {
            words.push('_');
        }
        words.extend(letter.to_lowercase());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "\
/// Else.
struct Other {
    a: f64,
}

/// Fault.
#[serde(tag = \"kind\", deny_unknown_fields)]
pub enum Fault {
    /// Frames
    /// were lost.
    DroppedFrames {
        /// The first.
        first: usize,
    },
}

/// Camera.
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Columns | rows.
    pub width_px: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    pub(crate) blur: bool,
    packing: Packing,
}
";

    #[test]
    fn keys_are_fields_with_their_comments() {
        let rows = |item: &str| -> Vec<String> { keys(SOURCE, item).unwrap().iter().map(Key::row).collect() };
        let camera = [
            "| (`width_px`) | a list, each `[x, y]` | Columns \\| rows. |\n",
            "| (`blur`) | `true` or `false` |  |\n",
            "| `packing` | a name |  |\n",
        ];
        assert_eq!(rows("struct Camera"), camera);
        let fault = [
            "| `kind = \"dropped_frames\"` |  | Frames were lost. |\n",
            "| `first` | a whole number | The first. |\n",
        ];
        assert_eq!(rows("enum Fault"), fault);
        assert_eq!(keys(SOURCE, "struct Missing"), None);
    }

    #[test]
    fn every_table_is_there_and_every_key_is_explained() {
        let page = page().unwrap();
        let mute: Vec<&str> = page.lines().filter(|line| line.ends_with("|  |")).collect();
        assert!(mute.is_empty(), "{mute:#?}");
        for key in ["`read_noise_counts`", "(`hot_fraction`)", "`kind = \"missing_view\"`", "`separator`"] {
            assert!(page.contains(key), "{key}");
        }
    }
}
