//! From the true state to the sample that the controller gets.

/// One link of the measuring chain.
pub trait Sensor {
    /// Called once per tick with the true state; writes the sample. A lost sample is NaN.
    fn measure(&mut self, x: &[f64], sample: &mut [f64]);
}

/// Sees the truth.
pub struct Ideal;

impl Sensor for Ideal {
    fn measure(&mut self, x: &[f64], sample: &mut [f64]) {
        sample.copy_from_slice(x);
    }
}
