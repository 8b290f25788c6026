//! Points of a curve in JSON: `y` as base 64 of little-endian f32, `x` as a step, or as base 64 of f64.
//!
//! The step is used if x_k = k step for every point. NaN is kept.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Points in the file.
#[derive(Serialize, Deserialize)]
struct Packed {
    /// Step of x: x_k = k step. `None` if `x` contains the values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    step: Option<f64>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    x: String,
    y: String,
}

pub(in crate::report) fn serialize<S: Serializer>(points: &[(f64, f64)], to: S) -> Result<S::Ok, S::Error> {
    let first = points.get(1).map(|(x, _)| *x);
    let is_step = |step: &f64| {
        step.is_finite() && points.iter().enumerate().all(|(k, (x, _))| x.to_bits() == (k as f64 * step).to_bits())
    };
    let step = first.filter(is_step);
    let x = match step {
        Some(_) => String::new(),
        None => BASE64_STANDARD.encode(points.iter().flat_map(|(x, _)| x.to_le_bytes()).collect::<Vec<u8>>()),
    };
    let y: Vec<u8> = points.iter().flat_map(|(_, y)| (*y as f32).to_le_bytes()).collect();
    Packed { step, x, y: BASE64_STANDARD.encode(y) }.serialize(to)
}

pub(in crate::report) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<(f64, f64)>, D::Error> {
    let Packed { step, x, y } = Packed::deserialize(from)?;
    let bytes = |text: &str| BASE64_STANDARD.decode(text).map_err(D::Error::custom);
    let y: Vec<f64> = bytes(&y)?.as_chunks().0.iter().map(|four| f64::from(f32::from_le_bytes(*four))).collect();
    let x: Vec<f64> = match step {
        Some(step) => (0..y.len()).map(|k| k as f64 * step).collect(),
        None => bytes(&x)?.as_chunks().0.iter().map(|eight| f64::from_le_bytes(*eight)).collect(),
    };
    if x.len() != y.len() {
        return Err(D::Error::custom(format!("{} places, {} values", x.len(), y.len())));
    }
    Ok(x.into_iter().zip(y).collect())
}
