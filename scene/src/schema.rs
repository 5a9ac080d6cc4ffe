//! The JSON Schema of scenario files, for editors and generators of other people.

use crate::file::ScenarioFile;

/// The JSON Schema of a scenario file, as pretty-printed JSON with a final newline.
#[must_use]
pub fn json_schema() -> String {
    let schema = schemars::schema_for!(ScenarioFile);
    let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    text.push('\n');
    text
}
