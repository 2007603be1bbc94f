//! The schema of a platform file, and the commented file that `scenario new --platform` starts with: the ground platform's numbers,
//! with the origin of each.

use schemars::generate::SchemaSettings;

use super::Platform;
use crate::Name;

/// JSON Schema of a platform file; draft 7, which TOML editors know.
pub fn platform_schema() -> serde_json::Value {
    SchemaSettings::draft07().into_generator().into_root_schema_for::<Platform>().to_value()
}

/// A platform to start from: it passes `scenario check --platform` as it is.
pub fn platform_template(name: &Name) -> String {
    let named = TEMPLATE.replace("\"ground\"", &format!("\"{}\"", name.as_str()));
    named.replacen("# The ground platform.", "# A platform, with the ground platform's numbers.", 1)
}

/// The ground platform, whose file is its own template.
const TEMPLATE: &str = include_str!("../../../../../platforms/ground.toml");
