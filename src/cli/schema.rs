//! `asobench schema`: prints the meaning of every key of an experiment file, for editors and as a page.

use super::error::Error;
use super::output::{Lines, print, print_json};
use crate::estimator::EstimatorName;
use crate::study::Measure;
use crate::study::file::{Key, StudyKind, schema};
use serde_json::Value;

/// Print the JSON schema of experiment files, for editors
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Print a page instead: every key with its type, default and meaning, and the options of every method
    #[arg(long)]
    markdown: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Error> {
    if arguments.markdown {
        print(&page(&schema()))
    } else {
        print_json(&schema())
    }
}

const HEAD: &str = "\
# Every key of an experiment file

`asobench schema --markdown` prints this page, `asobench schema` the same for editors. The [index](README.md) leads to \
the guides; [methods.md](methods.md) says what each method computes.

`q^-1` delays by one sample. \"Null\" stands for a key that is not given.
";

/// Returns the page: sections for the keys of the file, settings, measures, the tables of the schema, and the methods.
fn page(schema: &Value) -> String {
    let mut text = Lines(HEAD.to_owned());
    section(&mut text, "The file", &schema["properties"], &[]);
    for (title, kind) in [
        ("Settings", StudyKind::Discrete),
        ("Settings in continuous time", StudyKind::Continuous),
    ] {
        settings(&mut text, title, kind);
    }
    for (title, kind) in [
        ("Measures", StudyKind::Discrete),
        ("Measures in continuous time", StudyKind::Continuous),
    ] {
        measures(&mut text, title, kind);
    }
    let definitions = schema["$defs"].as_object().into_iter().flatten();
    for (name, definition) in definitions {
        let properties = &definition["properties"];
        // Skip tables that only `run` writes.
        if properties.is_object() && name != "Needs" && name != "SeriesTable" {
            table(&mut text, &title(name), definition);
            for form in definition["oneOf"].as_array().into_iter().flatten() {
                let mut keys = form["properties"].as_object().into_iter().flatten();
                let tag = keys.find_map(|(key, of)| Some(format!("{key} = {}", of.get("const")?)));
                let title = format!("{}: `{}`", title(name), tag.unwrap_or_default());
                table(&mut text, &title, form);
            }
        }
    }
    for method in EstimatorName::ALL {
        options(&mut text, *method);
    }
    text.0
}

/// Appends a section for the options of a method.
fn options(text: &mut Lines, method: EstimatorName) {
    text.line(format_args!("\n## Method `{method}`\n\n{}", cell(method.about())));
    for (i, option) in method.options().iter().enumerate() {
        if i == 0 {
            text.line("\n| option | default | meaning |\n|---|---|---|");
        }
        let default = match &option.default {
            Value::Null => String::new(),
            value => format!("`{value}`"),
        };
        let about = cell(&option.about);
        text.line(format_args!("| `{}` | {} | {about} |", option.key, cell(&default)));
    }
}

/// Appends a section for a table of the file: what it is, and its keys.
fn table(text: &mut Lines, title: &str, definition: &Value) {
    let required = definition["required"].as_array().into_iter().flatten();
    let required: Vec<&str> = required.filter_map(Value::as_str).collect();
    section(text, title, &definition["properties"], &required);
    if let Some(about) = definition["description"].as_str() {
        let place = text.0.rfind("| key |").unwrap_or(text.0.len());
        text.0.insert_str(place, &format!("{}\n\n", cell(about)));
    }
}

/// Turns "ClaimTable" into "Claim".
fn title(name: &str) -> String {
    let mut words = String::new();
    for (i, letter) in name.trim_end_matches("Table").char_indices() {
        if i > 0 && letter.is_uppercase() {
            words.push(' ');
        }
        words.push(if i > 0 { letter.to_ascii_lowercase() } else { letter });
    }
    words
}

/// Appends a table of keys.
fn section(text: &mut Lines, title: &str, properties: &Value, required: &[&str]) {
    text.line(format_args!(
        "\n## {title}\n\n| key | type | default | meaning |\n|---|---|---|---|"
    ));
    for (key, of) in properties.as_object().into_iter().flatten() {
        if of.get("const").is_some() {
            continue;
        }
        let default = match of.get("default") {
            _ if required.contains(&key.as_str()) => "must be given".to_owned(),
            None | Some(Value::Null) => String::new(),
            // Blanks let a list break over lines.
            Some(value) => format!("`{}`", value.to_string().replace("\",\"", "\", \"")),
        };
        let about = cell(of["description"].as_str().unwrap_or_default());
        text.line(format_args!(
            "| `{key}` | {} | {} | {about} |",
            kind(of),
            cell(&default)
        ));
    }
}

fn settings(text: &mut Lines, title: &str, kind: StudyKind) {
    text.line(format_args!(
        "\n## {title}\n\nA number or a text each; a list, or a range such as `{{ linspace = [0, 1, 5] }}`, makes an \
         axis of the grid.\n\n| key | default | meaning |\n|---|---|---|"
    ));
    for key in Key::ALL.iter().filter(|key| key.is_of(kind)) {
        let default = key.default_of(kind);
        let default = default.map_or_else(String::new, |value| format!("`{}`", serde_json::json!(value)));
        text.line(format_args!("| `{key}` | {default} | {} |", cell(key.about())));
    }
}

fn measures(text: &mut Lines, title: &str, kind: StudyKind) {
    text.line(format_args!(
        "\n## {title}\n\n| measure | unit | meaning |\n|---|---|---|"
    ));
    for measure in Measure::ALL.iter().filter(|measure| measure.is_of(kind)) {
        let (unit, about) = (measure.entry().unit, cell(measure.about()));
        text.line(format_args!("| `{measure}` | {unit} | {about} |"));
    }
}

/// Describes a schema's type in words.
fn kind(of: &Value) -> String {
    if let Some(path) = of["$ref"].as_str() {
        let name = path.rsplit('/').next().unwrap_or_default();
        return match name {
            "Axis" => "value, list or range".to_owned(),
            "Scalar" => "number or text".to_owned(),
            "Key" => "setting".to_owned(),
            _ => title(name).to_lowercase(),
        };
    }
    if let Some(value) = of.get("const") {
        return format!("`{value}`");
    }
    if let Some(choices) = of["anyOf"].as_array().or_else(|| of["oneOf"].as_array()) {
        let kinds: Vec<String> = choices.iter().map(kind).filter(|kind| kind != "null").collect();
        return kinds.join(" or ");
    }
    let name = |name: &str| match name {
        "string" => "text".to_owned(),
        "integer" => "whole number".to_owned(),
        "boolean" => "true or false".to_owned(),
        "array" => format!("list of {}", plural(&kind(&of["items"]))),
        "object" => match of.get("additionalProperties") {
            Some(of @ Value::Object(_)) => format!("tables by name: {}", kind(of)),
            _ => "table".to_owned(),
        },
        other => other.to_owned(),
    };
    match &of["type"] {
        Value::String(of) => name(of),
        Value::Array(all) => {
            let all = all.iter().filter_map(Value::as_str).filter(|name| *name != "null");
            all.map(name).collect::<Vec<_>>().join(" or ")
        }
        _ => "any".to_owned(),
    }
}

fn plural(kind: &str) -> String {
    match kind {
        "any" => "values".to_owned(),
        "text" | "number" | "whole number" | "table" | "claim" | "setting" | "measure" | "method" | "observer"
        | "slope" | "bound" | "wave" | "filter" => format!("{kind}s"),
        kind => kind.to_owned(),
    }
}

/// Returns a text for a cell of a table: without line ends, and with its bars escaped.
fn cell(text: &str) -> String {
    text.split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .replace('|', "\\|")
}
