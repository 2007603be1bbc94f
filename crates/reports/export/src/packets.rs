//! A console's display as CCSDS space packets, for ground systems that know these: picture by picture, from the object that
//! `holdsafe watch --json` prints, one packet a unit and one of the console's own.
//!
//! Primary header by CCSDS 133.0-B-2; the secondary header is a CDS time code (301.0-B-4, level 1, 16-bit days, milliseconds) of the moment at
//! which the picture is sent. The user data are the table [`UNIT`] or [`CONSOLE`], big-endian, every value with its freshness or age beside it;
//! [`xtce`] describes them to a ground system. A silent console gives no packets. Sending them is left to the caller.

pub mod xtce;

use std::collections::BTreeMap;

use arbitrary_int::{u11, u14};
use serde::Deserialize;
use spacepackets::SpHeader;
use spacepackets::time::cds::CdsTime;
use spacepackets::time::unix_to_ccsds_days;
use wire::id::UnitId;
use wire::mode::Guard;

use crate::display::{self, Aged};
use crate::{Micros, ViewError};

/// Application process identifier (APID) of the console's own packet; those of units follow it, by the unit's number.
pub const CONSOLE_APID: u16 = 0x40;
/// Length of the time code with its preamble (P-field), bytes.
pub const TIME: usize = 7;
/// Value in place of a time or an age that is unknown or does not apply.
pub const NONE: u32 = u32::MAX;
/// Microseconds of a day.
const DAY: u64 = 86_400_000_000;
/// Freshness of a value, by number.
pub const FRESHNESS: [&str; 4] = ["FRESH", "LATE", "STALE", "LOST"];
/// Words for a condition that may not apply, by number.
pub const HOLDS: [&str; 3] = ["NO", "YES", "NOT_TOLD"];

/// Encoding of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldEncoding {
    /// Unsigned, of a given number of bits.
    Unsigned(u8),
    /// Two's complement, 32 bits.
    Signed,
    /// Eight bits, with these words by number.
    Named(&'static [&'static str]),
    /// One bit a guard in the order of [`Guard::ALL`], the first highest, in 32.
    Guards,
}

/// A value in a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// Encoding.
    pub kind: FieldEncoding,
    /// Unit of measurement; empty without one.
    pub unit: &'static str,
    /// Meaning.
    pub words: &'static str,
}

const fn field(name: &'static str, kind: FieldEncoding, unit: &'static str, words: &'static str) -> Field {
    Field { name, kind, unit, words }
}

/// Names of modes by number.
const MODES: [&str; 5] = ["IDLE", "READY", "PREPARE_TO_ACT", "DEGRADED", "HOLD_SAFE"];

/// User data of a unit's packet.
pub const UNIT: [Field; 22] = [
    field("mode", FieldEncoding::Named(&MODES), "", "mode as displayed"),
    field("freshness", FieldEncoding::Named(&FRESHNESS), "", "freshness of the unit's report"),
    field("age", FieldEncoding::Unsigned(32), "ms", "age of the unit's report; 4294967295 is unknown"),
    field("failing", FieldEncoding::Guards, "", "guards that fail"),
    field("place_freshness", FieldEncoding::Named(&FRESHNESS), "", "freshness of the place"),
    field("place_age", FieldEncoding::Unsigned(32), "ms", "age of the place; 4294967295 is unknown"),
    field("x", FieldEncoding::Signed, "mm", "place on the map, east"),
    field("y", FieldEncoding::Signed, "mm", "place on the map, north"),
    field("speed", FieldEncoding::Signed, "mm/s", "speed on the map"),
    field("progress", FieldEncoding::Unsigned(16), "permille", "progress of the route"),
    field("authority", FieldEncoding::Named(&HOLDS), "", "authority is held"),
    field("authority_left", FieldEncoding::Unsigned(32), "ms", "time until it expires; 4294967295 without authority"),
    field(
        "contact_left",
        FieldEncoding::Unsigned(32),
        "ms",
        "time to the end of the planned contact; 4294967295 without a plan",
    ),
    field("contact_next", FieldEncoding::Unsigned(32), "ms", "time to the next one; 4294967295 without one"),
    field("charge", FieldEncoding::Unsigned(16), "permille", "charge of the battery; 65535 is not told"),
    field("sunlit", FieldEncoding::Named(&HOLDS), "", "the sun shines on the panels"),
    field("up", FieldEncoding::Signed, "mm", "height above the world's origin; 2147483647 is not told"),
    field("attitude_w", FieldEncoding::Signed, "1e-9", "attitude, body axes along the world's; 2147483647 is not told"),
    field("attitude_x", FieldEncoding::Signed, "1e-9", "attitude"),
    field("attitude_y", FieldEncoding::Signed, "1e-9", "attitude"),
    field("attitude_z", FieldEncoding::Signed, "1e-9", "attitude"),
    field("tracks_fresh", FieldEncoding::Unsigned(8), "", "tracks displayed as fresh"),
];

/// User data of the console's packet.
pub const CONSOLE: [Field; 4] = [
    field("alarms", FieldEncoding::Unsigned(16), "", "alarms that stand"),
    field("refusals", FieldEncoding::Unsigned(32), "", "messages refused so far, by gateway and console"),
    field("sessions_lost", FieldEncoding::Unsigned(32), "", "sessions at the broker lost so far"),
    field("silent", FieldEncoding::Unsigned(8), "", "units that are awaited and not heard"),
];

#[derive(Deserialize)]
struct Picture {
    units: Vec<Unit>,
    alarms: Vec<Alarm>,
    refusals: Vec<Times>,
    sessions_lost: Vec<Times>,
    silent: Vec<String>,
}

#[derive(Deserialize)]
struct Alarm {
    standing: bool,
}

#[derive(Deserialize)]
struct Times {
    times: u64,
}

#[derive(Deserialize)]
struct Unit {
    unit: String,
    state: Aged<State>,
    place: Aged<Place>,
    tracks: Vec<Aged<serde::de::IgnoredAny>>,
}

#[derive(Deserialize)]
struct State {
    mode: String,
    failing: Vec<String>,
    authority: Option<Held>,
    speed_mm_s: i32,
    progress_permille: u16,
    motion: Option<Motion>,
    contact: Option<Contact>,
}

#[derive(Deserialize)]
struct Held {
    left_ms: u64,
}

#[derive(Deserialize)]
struct Motion {
    up_mm: i32,
    charge_permille: u16,
    attitude: Option<[f64; 4]>,
    sunlit: Option<bool>,
}

#[derive(Deserialize)]
struct Contact {
    left_ms: u64,
    next_ms: Option<u64>,
}

#[derive(Deserialize)]
struct Place {
    x_mm: i32,
    y_mm: i32,
}

/// Makes packets, each counted within its application process.
#[derive(Debug, Default)]
pub struct Packets {
    counts: BTreeMap<u16, u16>,
}

impl Packets {
    /// The packets of a picture that is sent at `wall_us`, microseconds of Unix time.
    ///
    /// # Errors
    /// When it is no picture, or longer than [`display::LONGEST`].
    pub fn look(&mut self, wall_us: Micros, picture: &str) -> Result<Vec<u8>, ViewError> {
        let read: Picture = display::read("packets", picture)?;
        let mut bytes = self.packet(wall_us, CONSOLE_APID, &CONSOLE, &console(&read));
        for unit in &read.units {
            let named = UnitId::all().find(|unit_id| unit_id.name() == unit.unit);
            let number = named.ok_or_else(|| ViewError::Message {
                topic: "packets".to_owned(),
                why: format!("a unit expected, got {}", unit.unit),
            })?;
            bytes.extend(self.packet(wall_us, apid(number), &UNIT, &values(unit)));
        }
        Ok(bytes)
    }

    fn packet(&mut self, wall_us: Micros, apid: u16, fields: &[Field], values: &[i64]) -> Vec<u8> {
        let count = self.counts.entry(apid).or_default();
        let mut header = SpHeader::new_for_unseg_tm(u11::new(apid), u14::new(*count), 0);
        *count = (*count + 1) % (1 << 14);
        let mut data = time(wall_us).to_vec();
        debug_assert_eq!(fields.len(), values.len(), "a value for each field");
        for (field, value) in fields.iter().zip(values) {
            put(&mut data, field.kind, *value);
        }
        header.set_sec_header_flag();
        header.data_len = (data.len() - 1) as u16;
        let mut bytes = header.to_vec();
        bytes.extend(data);
        bytes
    }
}

/// Application process identifier (APID) of a unit's packets.
pub fn apid(unit: UnitId) -> u16 {
    CONSOLE_APID + 1 + unit.node().index() as u16
}

/// The time code of a moment of Unix time.
fn time(wall_us: Micros) -> [u8; TIME] {
    let days = unix_to_ccsds_days((wall_us / DAY) as i64);
    let code = CdsTime::new_with_u16_days(days.clamp(0, i64::from(u16::MAX)) as u16, (wall_us % DAY / 1_000) as u32);
    let mut bytes = [0; TIME];
    code.write_to_slice(&mut bytes).expect("invariant: the short form has this length");
    bytes
}

/// Appends a value, clamped to the range of its field.
fn put(data: &mut Vec<u8>, kind: FieldEncoding, value: i64) {
    match kind {
        FieldEncoding::Unsigned(8) | FieldEncoding::Named(_) => data.push(value.clamp(0, 0xff) as u8),
        FieldEncoding::Unsigned(16) => data.extend((value.clamp(0, 0xffff) as u16).to_be_bytes()),
        FieldEncoding::Unsigned(_) | FieldEncoding::Guards => {
            data.extend((value.clamp(0, i64::from(u32::MAX)) as u32).to_be_bytes())
        }
        FieldEncoding::Signed => {
            data.extend((value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32).to_be_bytes())
        }
    }
}

/// A time in milliseconds, or [`NONE`].
fn ms(time: Option<u64>) -> i64 {
    // At most `NONE - 1`: a long time must not read as an unknown one.
    time.map_or(i64::from(NONE), |ms| ms.min(u64::from(NONE) - 1) as i64)
}

/// Index of a word; the number of words for an unknown one.
fn number(words: &[&str], word: &str) -> i64 {
    words.iter().position(|known| known.eq_ignore_ascii_case(word)).unwrap_or(words.len()) as i64
}

fn holds(condition: Option<bool>) -> i64 {
    condition.map_or(2, i64::from)
}

fn failing(names: &[String]) -> i64 {
    let failing = |guard: &Guard| names.iter().any(|name| name == guard.name());
    let bits = Guard::ALL.iter().enumerate().filter(|(_, guard)| failing(guard));
    bits.map(|(index, _)| 1 << (31 - index)).sum()
}

fn console(picture: &Picture) -> [i64; CONSOLE.len()] {
    let sum = |all_times: &[Times]| {
        all_times.iter().fold(0u64, |sum, times| sum.saturating_add(times.times)).min(u64::from(NONE)) as i64
    };
    let standing = picture.alarms.iter().filter(|alarm| alarm.standing).count() as i64;
    [standing, sum(&picture.refusals), sum(&picture.sessions_lost), picture.silent.len() as i64]
}

fn values(unit: &Unit) -> [i64; UNIT.len()] {
    let (state, place) = (&unit.state.value, &unit.place.value);
    let (motion, contact) = (state.motion.as_ref(), state.contact.as_ref());
    let attitude = motion.and_then(|motion| motion.attitude);
    let [w, x, y, z] = attitude.map_or([i64::from(i32::MAX); 4], |q| q.map(|part| libm::round(part * 1e9) as i64));
    [
        number(&MODES, &state.mode),
        number(&FRESHNESS, &unit.state.freshness),
        ms(unit.state.age_ms),
        failing(&state.failing),
        number(&FRESHNESS, &unit.place.freshness),
        ms(unit.place.age_ms),
        i64::from(place.x_mm),
        i64::from(place.y_mm),
        i64::from(state.speed_mm_s),
        i64::from(state.progress_permille),
        i64::from(state.authority.is_some()),
        ms(state.authority.as_ref().map(|held| held.left_ms)),
        ms(contact.map(|contact| contact.left_ms)),
        ms(contact.and_then(|contact| contact.next_ms)),
        motion.map_or(i64::from(u16::MAX), |motion| i64::from(motion.charge_permille)),
        holds(motion.and_then(|motion| motion.sunlit)),
        motion.map_or(i64::from(i32::MAX), |motion| i64::from(motion.up_mm)),
        w,
        x,
        y,
        z,
        unit.tracks.iter().filter(|track| track.freshness == "fresh").count() as i64,
    ]
}

#[cfg(test)]
mod tests {
    use spacepackets::CcsdsPacket;
    use wire::mode::Mode;

    use super::*;
    use crate::display::LONGEST;

    const SHOWN: &str = r#"{"version":1,"at_us":9,"max_speed_mm_s":3000,"silent":["unit-b"],
        "refusals":[{"times":4},{"times":18446744073709551615}],"sessions_lost":[],"alarms":[{"standing":true},{"standing":false}],
        "units":[{"unit":"unit-a",
            "state":{"freshness":"STALE","age_ms":700,"value":{"mode":"HOLD_SAFE","failing":["depth","lease"],"authority":null,
                "speed_mm_s":-5,"progress_permille":12,"motion":{"up_mm":3000,"charge_permille":900,"attitude":[0.6,0.0,-0.8,0.0],"sunlit":false},
                "contact":{"left_ms":0,"next_ms":30500}}},
            "place":{"freshness":"LOST","age_ms":null,"value":{"x_mm":1000,"y_mm":-2000,"yaw_mrad":0}},
            "tracks":[{"freshness":"fresh","age_ms":4,"value":{}},{"freshness":"LATE","age_ms":400,"value":{}}]}]}"#;

    /// The packets in `bytes`: header, and user data behind the time code.
    fn read(mut bytes: &[u8]) -> Vec<(SpHeader, Vec<u8>)> {
        let mut found = Vec::new();
        while !bytes.is_empty() {
            let (header, rest) = SpHeader::from_be_bytes(bytes).unwrap();
            let (data, rest) = rest.split_at(header.packet_len() - SpHeader::LENGTH);
            assert!(header.sec_header_flag() && data[0] == 0x40, "{data:?}");
            found.push((header, data[TIME..].to_vec()));
            bytes = rest;
        }
        found
    }

    #[test]
    fn packets_are_one_of_the_console_and_one_of_each_unit() {
        let mut packets = Packets::default();
        let first = read(&packets.look(0, SHOWN).unwrap());
        let second = read(&packets.look(0, SHOWN).unwrap());
        let apids: Vec<u16> = first.iter().map(|(header, _)| header.apid().value()).collect();
        assert_eq!(apids, [CONSOLE_APID, apid(UnitId::A)]);
        assert_eq!([first[1].0.seq_count().value(), second[1].0.seq_count().value()], [0, 1]);
        assert_eq!(first[0].1, [0, 1, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0, 1], "alarms, refusals to the limit, silent");
    }

    #[test]
    fn values_stand_where_the_table_says() {
        let (_, data) = read(&Packets::default().look(0, SHOWN).unwrap()).remove(1);
        let word = |at: usize| i32::from_be_bytes(data[at..at + 4].try_into().unwrap());
        assert_eq!(data[..2], [4, 2], "HOLD_SAFE, STALE");
        assert_eq!([word(2), word(6), word(15), word(19), word(23)], [700, 0x4100_0000, 1000, -2000, -5]);
        assert_eq!(&data[11..15], [0xff; 4], "the age of the place is unknown");
        assert_eq!([word(34), word(38), word(45)], [0, 30_500, 3000]);
        assert_eq!([word(49), word(53), word(57), word(61)], [600_000_000, 0, -800_000_000, 0]);
        assert_eq!((data[44], data[65], data.len()), (0, 1, 66), "no sun; one fresh track");
    }

    /// The epoch of Unix is day 4383 of CCSDS.
    #[test]
    fn time_code_counts_days_since_1958() {
        assert_eq!(time(0), [0x40, 0x11, 0x1f, 0, 0, 0, 0]);
        assert_eq!(time(DAY + 2_500), [0x40, 0x11, 0x20, 0, 0, 0, 2]);
        assert_eq!(time(u64::MAX)[..3], [0x40, 0xff, 0xff]);
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        let unknown = SHOWN.replace("\"unit-a\"", "\"sim\"");
        for bad in ["", "{}", "[]", unknown.as_str(), &"x".repeat(LONGEST + 1)] {
            assert!(Packets::default().look(0, bad).is_err());
        }
    }

    #[test]
    fn names_of_modes_are_those_of_the_unit() {
        let modes = [Mode::Idle, Mode::Ready, Mode::PrepareToAct, Mode::Degraded, Mode::HoldSafe];
        assert_eq!(modes.map(Mode::name), MODES);
    }
}
