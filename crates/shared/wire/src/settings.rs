//! Settings of an operator before a mission: speed, distance from the fence, confidence.
//!
//! Each value has its own range, which is part of the schema. The safety of the values together depends on the
//! platform and is judged by the unit (`autonomy::settings`).

use core::ops::RangeInclusive;

use minicbor::{Decode, Decoder, Encode};

use crate::bounds::Bounds;

/// Ranges of the single values, in their order.
pub const RANGES: [RangeInclusive<u16>; 4] = [500..=3000, 300..=5000, 500..=950, 300..=900];

/// Values for one mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Largest speed, mm/s.
    #[n(0)]
    pub speed_mm_s: u16,
    /// Distance that is kept to the fence beyond the stopping distance, mm.
    #[n(1)]
    pub margin_mm: u16,
    /// Confidence from which a track can be designated, permille.
    #[n(2)]
    pub arm_permille: u16,
    /// Confidence below which a designated track is given up, permille.
    #[n(3)]
    pub keep_permille: u16,
}

impl Settings {
    /// A platform's own values, as near as they can be set.
    pub fn from_bounds(bounds: &Bounds) -> Settings {
        let own_values = [
            bounds.max_speed_mm_s,
            bounds.fence_margin_mm,
            bounds.designation_confidence.into(),
            bounds.designation_keep.into(),
        ];
        let near = |value: u32, range: &RangeInclusive<u16>| {
            value.clamp((*range.start()).into(), (*range.end()).into()) as u16
        };
        let [speed_mm_s, margin_mm, arm_permille, keep_permille] =
            core::array::from_fn(|k| near(own_values[k], &RANGES[k]));
        Settings { speed_mm_s, margin_mm, arm_permille, keep_permille }
    }
}

impl<'b, C> Decode<'b, C> for Settings {
    fn decode(d: &mut Decoder<'b>, _: &mut C) -> Result<Self, minicbor::decode::Error> {
        let fields = d.array()?;
        let mut values = [0; RANGES.len()];
        if fields != Some(values.len() as u64) {
            return Err(minicbor::decode::Error::message("four values expected"));
        }
        for (value, range) in values.iter_mut().zip(&RANGES) {
            *value = d.u16()?;
            if !range.contains(value) {
                return Err(minicbor::decode::Error::message("a value within its range expected"));
            }
        }
        let [speed_mm_s, margin_mm, arm_permille, keep_permille] = values;
        Ok(Settings { speed_mm_s, margin_mm, arm_permille, keep_permille })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec;

    #[test]
    fn value_out_of_range_is_no_setting() {
        let good = Settings { speed_mm_s: 3000, margin_mm: 300, arm_permille: 500, keep_permille: 900 };
        let read = |settings: &Settings| codec::decode::<Settings>(&codec::encode(settings), 64);
        assert_eq!(read(&good), Ok(good), "legal one by one, whatever they are together");
        for bad in [
            Settings { speed_mm_s: 3001, ..good },
            Settings { margin_mm: 299, ..good },
            Settings { arm_permille: 951, ..good },
            Settings { keep_permille: 299, ..good },
        ] {
            assert!(read(&bad).is_err(), "{bad:?}");
        }
    }
}
