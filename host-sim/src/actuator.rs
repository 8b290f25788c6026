//! From the controller's demand to the input that the plant feels.

/// One link of the actuating chain.
pub trait Actuator {
    /// Called once per tick with the demand; returns what is really held until the next tick.
    fn drive(&mut self, demand: f64) -> f64;
}

/// Does as it is told.
pub struct Ideal;

impl Actuator for Ideal {
    fn drive(&mut self, demand: f64) -> f64 {
        demand
    }
}
