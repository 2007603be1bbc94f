//! Properties in words, from the judge's table.

use oracle::PROPERTIES;

/// Name and statement of the property that is called `name`; none where there is no such property.
pub fn property_statement(name: &str) -> Option<(&'static str, &'static str)> {
    let row = PROPERTIES.iter().find(|row| row.name == name)?;
    Some((row.name, row.statement))
}
