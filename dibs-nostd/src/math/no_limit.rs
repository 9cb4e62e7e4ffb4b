//! An infinite limit in formats that have no infinity, as JSON: none.

use serde::de::{Deserialize, Deserializer};
use serde::ser::{Error, Serialize, Serializer};

pub fn serialize<S: Serializer>(limit: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    if limit.is_nan() {
        // JSON has no NaN either, and none would be no limit in place of one that refuses all.
        return Err(S::Error::custom("a limit of NaN"));
    }
    Some(*limit).filter(|&limit| limit < f32::INFINITY).serialize(serializer)
}

pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f32::INFINITY))
}
