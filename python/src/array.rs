//! Arrays of numpy, by way of their bytes.
//!
//! The crate `numpy` is not used: its `ndarray` turns on `std` of `num-traits`, and with it the functions of the
//! platform. Poles and margins would then differ from `host-sim` in their last digits.

use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};

/// Returns an array of this type from the bytes of its entries, row by row.
fn of_bytes<'py, const B: usize>(
    py: Python<'py>,
    entries: impl IntoIterator<Item = [u8; B]>,
    kind: &str,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let numpy = py.import("numpy")?;
    let fill = |bytes: &mut [u8]| {
        bytes.as_chunks_mut().0.iter_mut().zip(entries).for_each(|(to, entry)| *to = entry);
        Ok(())
    };
    let bytes = PyByteArray::new_with(py, B * shape.iter().product::<usize>(), fill)?;
    // The array is writable, and nothing else refers to its memory.
    let flat = numpy.call_method1("frombuffer", (bytes, kind))?;
    flat.call_method1("reshape", (shape.to_vec(),))
}

/// Returns an array of floats, row by row.
pub(crate) fn floats<'py>(
    py: Python<'py>,
    values: impl IntoIterator<Item = f64>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    of_bytes(py, values.into_iter().map(f64::to_ne_bytes), "f8", shape)
}

/// Returns a row of unsigned integers.
pub(crate) fn flags(py: Python<'_>, values: impl ExactSizeIterator<Item = u32>) -> PyResult<Bound<'_, PyAny>> {
    let count = values.len();
    of_bytes(py, values.map(u32::to_ne_bytes), "u4", &[count])
}

/// Numbers of an array, column by column, in the memory of Python.
pub(crate) struct Columns<'py> {
    /// Shape of the array.
    pub(crate) shape: Vec<usize>,
    bytes: Bound<'py, PyBytes>,
}

/// Number as its bytes in the memory of Python.
pub(crate) type Raw = [u8; 8];

impl<'py> Columns<'py> {
    /// Reads anything that is an array of numbers.
    pub(crate) fn of(value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let numpy = value.py().import("numpy")?;
        let array = numpy.call_method1("asarray", (value, "f8"))?;
        let shape = array.getattr("shape")?.extract()?;
        // `F` is the order of the columns.
        let bytes = array.call_method1("tobytes", ("F",))?.cast_into()?;
        Ok(Self { shape, bytes })
    }

    /// Returns the numbers as their bytes.
    pub(crate) fn raw(&self) -> &[Raw] {
        self.bytes.as_bytes().as_chunks().0
    }

    /// Returns the numbers.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        self.raw().iter().map(|raw| f64::from_ne_bytes(*raw))
    }
}
