//! `rearrange schema`: the JSON Schema of scenario files, for editors.

use crate::exit::{Exit, Outcome};
use crate::output;

/// Prints the schema.
pub(crate) fn main() -> Outcome {
    output::print(&scene::json_schema())?;
    Ok(Exit::Success)
}
