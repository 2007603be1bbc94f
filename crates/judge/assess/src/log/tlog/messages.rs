//! The MAVLink messages that are read: their fields in the order of the wire, and the byte by which a checksum tells a definition.
//!
//! Written after the published definitions (`common.xml`) for the few messages that carry an input of the guards. A test derives each extra byte
//! from the fields here, so that a false field, type or order is noticed. A message that is not listed is counted and skipped.

/// A message.
pub(super) struct Definition {
    /// Number.
    pub(super) id: u32,
    /// Name, as topics carry it.
    pub(super) name: &'static str,
    /// Byte that its checksum covers beside the frame (`CRC_EXTRA`).
    pub(super) extra: u8,
    /// Fields of every version, `type name;` in the order of the wire.
    pub(super) fields: &'static str,
    /// Fields that later versions add behind these; the extra byte does not cover them.
    pub(super) added: &'static str,
}

/// The definition with this number; none for a message that is not read.
pub(super) fn find(id: u32) -> Option<(usize, &'static Definition)> {
    MESSAGES.iter().enumerate().find(|(_, message)| message.id == id)
}

const fn message(id: u32, name: &'static str, extra: u8, fields: &'static str, added: &'static str) -> Definition {
    Definition { id, name, extra, fields, added }
}

/// The messages that are read.
pub(super) const MESSAGES: [Definition; 15] = [
    message(
        0,
        "HEARTBEAT",
        50,
        "uint32_t custom_mode;uint8_t type;uint8_t autopilot;uint8_t base_mode;uint8_t system_status;uint8_t mavlink_version;",
        "",
    ),
    message(2, "SYSTEM_TIME", 137, "uint64_t time_unix_usec;uint32_t time_boot_ms;", ""),
    message(
        24,
        "GPS_RAW_INT",
        24,
        "uint64_t time_usec;int32_t lat;int32_t lon;int32_t alt;uint16_t eph;uint16_t epv;uint16_t vel;uint16_t cog;uint8_t fix_type;\
         uint8_t satellites_visible;",
        "int32_t alt_ellipsoid;uint32_t h_acc;uint32_t v_acc;uint32_t vel_acc;uint32_t hdg_acc;uint16_t yaw;",
    ),
    message(26, "SCALED_IMU", 170, SCALED_IMU, "int16_t temperature;"),
    message(
        27,
        "RAW_IMU",
        144,
        "uint64_t time_usec;int16_t xacc;int16_t yacc;int16_t zacc;int16_t xgyro;int16_t ygyro;int16_t zgyro;int16_t xmag;int16_t ymag;\
         int16_t zmag;",
        "uint8_t id;int16_t temperature;",
    ),
    message(
        30,
        "ATTITUDE",
        39,
        "uint32_t time_boot_ms;float roll;float pitch;float yaw;float rollspeed;float pitchspeed;float yawspeed;",
        "",
    ),
    message(
        31,
        "ATTITUDE_QUATERNION",
        246,
        "uint32_t time_boot_ms;float q1;float q2;float q3;float q4;float rollspeed;float pitchspeed;float yawspeed;",
        "float[4] repr_offset_q;",
    ),
    message(
        32,
        "LOCAL_POSITION_NED",
        185,
        "uint32_t time_boot_ms;float x;float y;float z;float vx;float vy;float vz;",
        "",
    ),
    message(
        33,
        "GLOBAL_POSITION_INT",
        104,
        "uint32_t time_boot_ms;int32_t lat;int32_t lon;int32_t alt;int32_t relative_alt;int16_t vx;int16_t vy;int16_t vz;uint16_t hdg;",
        "",
    ),
    message(
        74,
        "VFR_HUD",
        20,
        "float airspeed;float groundspeed;float alt;float climb;int16_t heading;uint16_t throttle;",
        "",
    ),
    message(
        85,
        "POSITION_TARGET_LOCAL_NED",
        140,
        "uint32_t time_boot_ms;float x;float y;float z;float vx;float vy;float vz;float afx;float afy;float afz;float yaw;float yaw_rate;\
         uint16_t type_mask;uint8_t coordinate_frame;",
        "",
    ),
    message(
        102,
        "VISION_POSITION_ESTIMATE",
        158,
        "uint64_t usec;float x;float y;float z;float roll;float pitch;float yaw;",
        "float[21] covariance;uint8_t reset_counter;",
    ),
    message(116, "SCALED_IMU2", 76, SCALED_IMU, "int16_t temperature;"),
    message(
        124,
        "GPS2_RAW",
        87,
        "uint64_t time_usec;int32_t lat;int32_t lon;int32_t alt;uint32_t dgps_age;uint16_t eph;uint16_t epv;uint16_t vel;uint16_t cog;\
         uint8_t fix_type;uint8_t satellites_visible;uint8_t dgps_numch;",
        "uint16_t yaw;int32_t alt_ellipsoid;uint32_t h_acc;uint32_t v_acc;uint32_t vel_acc;uint32_t hdg_acc;",
    ),
    message(
        331,
        "ODOMETRY",
        91,
        "uint64_t time_usec;float x;float y;float z;float[4] q;float vx;float vy;float vz;float rollspeed;float pitchspeed;float yawspeed;\
         float[21] pose_covariance;float[21] velocity_covariance;uint8_t frame_id;uint8_t child_frame_id;",
        "uint8_t reset_counter;uint8_t estimator_type;int8_t quality;",
    ),
];

const SCALED_IMU: &str = "uint32_t time_boot_ms;int16_t xacc;int16_t yacc;int16_t zacc;int16_t xgyro;int16_t ygyro;int16_t zgyro;int16_t xmag;\
                          int16_t ymag;int16_t zmag;";

#[cfg(test)]
mod tests {
    use super::super::frame::Checksum;
    use super::*;

    /// The extra byte by the protocol's rule: the checksum over the name and each field of every version, folded to a byte.
    fn derived(message: &Definition) -> u8 {
        let mut sum = Checksum::default();
        sum.add(format!("{} ", message.name).as_bytes());
        for field in message.fields.split(';').filter(|field| !field.is_empty()) {
            let (kind, name) = field.split_once(' ').unwrap();
            let (kind, count) = kind.trim_end_matches(']').split_once('[').unwrap_or((kind, ""));
            sum.add(format!("{kind} {name} ").as_bytes());
            sum.add(&count.parse().map_or(Vec::new(), |count: u8| vec![count]));
        }
        let [low, high] = sum.get().to_le_bytes();
        low ^ high
    }

    #[test]
    fn fields_give_the_published_extra_byte() {
        for message in &MESSAGES {
            assert_eq!(derived(message), message.extra, "{}", message.name);
        }
    }

    #[test]
    fn wire_order_puts_long_fields_first() {
        let size = |field: &str| match field.split(['_', '[', ' ']).next() {
            Some("uint64") => 8,
            Some("uint32" | "int32" | "float") => 4,
            Some("uint16" | "int16") => 2,
            _ => 1,
        };
        for message in &MESSAGES {
            let sizes: Vec<u8> = message.fields.split_terminator(';').map(size).collect();
            assert!(sizes.is_sorted_by(|first, next| first >= next), "{}: {sizes:?}", message.name);
        }
    }
}
