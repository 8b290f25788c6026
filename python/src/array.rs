//! Arrays of numpy, by way of their bytes.
//!
//! The crate `numpy` is not used: its `ndarray` turns on `std` of `num-traits`, and with it the functions of the
//! platform. Poles and margins would then differ from `host-sim` in their last digits.

use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};

/// Returns an array of this type from the bytes of its entries, row by row.
fn of_bytes<'py>(py: Python<'py>, bytes: &[u8], kind: &str, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    let numpy = py.import("numpy")?;
    // The array is writable, and nothing else refers to its memory.
    let flat = numpy.call_method1("frombuffer", (PyByteArray::new(py, bytes), kind))?;
    flat.call_method1("reshape", (shape.to_vec(),))
}

/// Returns an array of floats, row by row.
pub(crate) fn floats<'py>(
    py: Python<'py>,
    values: impl IntoIterator<Item = f64>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let mut bytes = Vec::with_capacity(8 * shape.iter().product::<usize>());
    values.into_iter().for_each(|value| bytes.extend_from_slice(&value.to_ne_bytes()));
    of_bytes(py, &bytes, "f8", shape)
}

/// Returns a row of unsigned integers.
pub(crate) fn flags(py: Python<'_>, values: impl Iterator<Item = u32>) -> PyResult<Bound<'_, PyAny>> {
    let bytes: Vec<u8> = values.flat_map(u32::to_ne_bytes).collect();
    of_bytes(py, &bytes, "u4", &[bytes.len() / 4])
}

/// Returns the shape of anything that is an array of numbers, and its entries column by column.
pub(crate) fn columns(value: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f64>)> {
    let numpy = value.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (value, "f8"))?;
    let shape = array.getattr("shape")?.extract()?;
    // `F` is the order of the columns.
    let bytes = array.call_method1("tobytes", ("F",))?;
    let bytes = bytes.cast::<PyBytes>()?.as_bytes();
    let number = |chunk: &[u8]| chunk.try_into().map_or(f64::NAN, f64::from_ne_bytes);
    Ok((shape, bytes.chunks_exact(8).map(number).collect()))
}
