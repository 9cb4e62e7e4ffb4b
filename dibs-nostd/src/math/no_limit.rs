//! An infinite limit in formats without infinity, such as JSON: `null`.

// Requirement: F-03

use serde::de::{Deserialize, Deserializer};
use serde::ser::{Error, Serialize, Serializer};

pub fn serialize<S: Serializer>(limit: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    // JSON has no NaN and no negative infinity either; as `null`, such a limit, which refuses all, would become no
    // limit.
    if limit.is_nan() || *limit == f32::NEG_INFINITY {
        return Err(S::Error::custom("a limit that refuses every frame"));
    }
    Some(*limit).filter(|&limit| limit < f32::INFINITY).serialize(serializer)
}

pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f32::INFINITY))
}
