//! Description of the packets in XTCE 1.2 (OMG formal/18-10-04, CCSDS 660.0-B-2), by which a ground system reads them.
//!
//! Made of the same tables as the packets. It tells a ground system the values to mark: DEGRADED, HOLD_SAFE, a guard that fails, and a value that is not
//! fresh; and that a packet comes at least twice a second, so that a silent console's values expire there.

use std::fmt::Write;

use wire::id::UnitId;
use wire::mode::Guard;

use super::{CONSOLE, CONSOLE_APID, FRESHNESS, Field, FieldEncoding, HOLDS, MODES, UNIT, apid};

/// Units that a console displays.
const UNITS: [UnitId; 3] = [UnitId::A, UnitId::B, UnitId::C];
/// Bits of [`FieldEncoding::Guards`] that no guard has.
const SPARE: usize = 32 - Guard::ALL.len();

/// Primary header and time code: name, bits, meaning.
const HEADER: [(&str, usize, &str); 10] = [
    ("version", 3, "0"),
    ("type", 1, "0: telemetry"),
    ("secondary_header", 1, "1"),
    ("apid", 11, "application process"),
    ("sequence_flags", 2, "3: unsegmented"),
    ("sequence_count", 14, "within the application process"),
    ("length", 16, "bytes behind the primary header, less one"),
    ("time_code", 8, "64: CDS, epoch 1958, 16-bit days, milliseconds"),
    ("day", 16, "days since 1 January 1958"),
    ("time_of_day", 32, "milliseconds"),
];

/// A parameter: name, type, meaning.
type Parameter = (String, String, String);

/// Text of the XTCE document.
pub fn document() -> String {
    let mut text = String::from(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<SpaceSystem name="holdsafe" xmlns="http://www.omg.org/spec/XTCE/20180204" shortDescription="The display of a holdsafe console">
"#,
    );
    let header = HEADER.map(|(name, bits, words)| (name.to_owned(), format!("u{bits}"), words.to_owned()));
    let container = "      <SequenceContainer name=\"packet\" abstract=\"true\">\n";
    telemetry(&mut text, &types(), &header, container, "");
    system(&mut text, "console", CONSOLE_APID, &CONSOLE);
    UNITS.into_iter().for_each(|unit| system(&mut text, unit.node().name(), apid(unit), &UNIT));
    text + "</SpaceSystem>\n"
}

/// A subsystem with the packet of one application process.
fn system(text: &mut String, name: &str, apid: u16, fields: &[Field]) {
    push(text, format_args!("<SpaceSystem name=\"{name}\">"));
    let parameters: Vec<Parameter> = fields.iter().flat_map(parameters).collect();
    let container = format!(
        "      <SequenceContainer name=\"{name}_packet\">\n        <DefaultRateInStream minimumValue=\"2\"/>\n"
    );
    let base = format!(
        "        <BaseContainer containerRef=\"/holdsafe/packet\"><RestrictionCriteria>\
         <Comparison parameterRef=\"/holdsafe/apid\" value=\"{apid}\"/></RestrictionCriteria></BaseContainer>\n"
    );
    telemetry(text, "", &parameters, &container, &base);
    push(text, format_args!("</SpaceSystem>"));
}

/// Parameters, and one container that they fill in their order.
fn telemetry(text: &mut String, types: &str, parameters: &[Parameter], container: &str, base: &str) {
    push(text, format_args!("  <TelemetryMetaData>\n{types}    <ParameterSet>"));
    for (name, of, words) in parameters {
        push(
            text,
            format_args!(
                "      <Parameter name=\"{name}\" parameterTypeRef=\"/holdsafe/{of}\" shortDescription=\"{words}\"/>"
            ),
        );
    }
    push(text, format_args!("    </ParameterSet>\n    <ContainerSet>\n{container}        <EntryList>"));
    for (name, ..) in parameters {
        push(text, format_args!("          <ParameterRefEntry parameterRef=\"{name}\"/>"));
    }
    push(
        text,
        format_args!(
            "        </EntryList>\n{base}      </SequenceContainer>\n    </ContainerSet>\n  </TelemetryMetaData>"
        ),
    );
}

/// A field's parameters: one, or one a guard.
fn parameters(field: &Field) -> Vec<Parameter> {
    let Field { name, kind, unit, words } = *field;
    let text = match kind {
        FieldEncoding::Unsigned(bits) => format!("u{bits}"),
        FieldEncoding::Signed => "i32".to_owned(),
        FieldEncoding::Named(known) if known == MODES => "mode".to_owned(),
        FieldEncoding::Named(known) if known == FRESHNESS => "freshness".to_owned(),
        FieldEncoding::Named(_) => "holds".to_owned(),
        FieldEncoding::Guards => {
            let each = |guard: &Guard| {
                (format!("{name}_{}", guard.name()), "fails".to_owned(), format!("the guard {} fails", guard.name()))
            };
            let spare = (format!("{name}_spare"), format!("u{SPARE}"), "0".to_owned());
            return Guard::ALL.iter().map(each).chain([spare]).collect();
        }
    };
    let words = if unit.is_empty() { words.to_owned() } else { format!("{words}, {unit}") };
    vec![(name.to_owned(), text, words)]
}

fn types() -> String {
    let mut text = String::from("    <ParameterTypeSet>\n");
    let mut widths: Vec<usize> = HEADER.iter().map(|(_, bits, _)| *bits).chain([SPARE]).collect();
    widths.sort_unstable();
    widths.dedup();
    for bits in widths {
        push(
            &mut text,
            format_args!(
                "      <IntegerParameterType name=\"u{bits}\" signed=\"false\">\
                 <IntegerDataEncoding sizeInBits=\"{bits}\"/></IntegerParameterType>"
            ),
        );
    }
    text += "      <IntegerParameterType name=\"i32\" signed=\"true\">\
             <IntegerDataEncoding sizeInBits=\"32\" encoding=\"twosComplement\"/></IntegerParameterType>\n";
    enumerated(&mut text, "mode", 8, &MODES, &[("DEGRADED", "warning"), ("HOLD_SAFE", "critical")]);
    enumerated(&mut text, "freshness", 8, &FRESHNESS, &[("LATE", "watch"), ("STALE", "warning"), ("LOST", "critical")]);
    enumerated(&mut text, "holds", 8, &HOLDS, &[]);
    enumerated(&mut text, "fails", 1, &HOLDS[..2], &[("YES", "warning")]);
    text + "    </ParameterTypeSet>\n"
}

fn enumerated(text: &mut String, name: &str, bits: u8, words: &[&str], alarms: &[(&str, &str)]) {
    push(
        text,
        format_args!(
            "      <EnumeratedParameterType name=\"{name}\">\n        <IntegerDataEncoding sizeInBits=\"{bits}\"/>\n        \
             <EnumerationList>"
        ),
    );
    for (value, word) in words.iter().enumerate() {
        push(text, format_args!("          <Enumeration value=\"{value}\" label=\"{word}\"/>"));
    }
    push(text, format_args!("        </EnumerationList>"));
    if !alarms.is_empty() {
        push(text, format_args!("        <DefaultAlarm>\n          <EnumerationAlarmList>"));
        for (word, level) in alarms {
            push(
                text,
                format_args!("            <EnumerationAlarm alarmLevel=\"{level}\" enumerationLabel=\"{word}\"/>"),
            );
        }
        push(text, format_args!("          </EnumerationAlarmList>\n        </DefaultAlarm>"));
    }
    push(text, format_args!("      </EnumeratedParameterType>"));
}

fn push(text: &mut String, line: core::fmt::Arguments<'_>) {
    writeln!(text, "{line}").expect("invariant: a String takes every text");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With `HOLDSAFE_RENEW` set it is written again; then read the diff.
    #[test]
    fn committed_description_is_that_of_the_packets() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/operator/holdsafe.xtce.xml");
        if std::env::var_os("HOLDSAFE_RENEW").is_some() {
            std::fs::write(path, document()).unwrap();
        }
        assert!(std::fs::read_to_string(path).unwrap() == document(), "{path} is not what the code gives");
    }
}
