//! Hash over every bit of the results, equal in WebAssembly and on this machine.

use std::ops::ControlFlow;

use loop_sim::trace::Row;

use crate::design;
use crate::request::{Failure, Text, c_file};

/// FNV-1a hash, 64 bits.
struct Hash(u64);

impl Hash {
    fn add(&mut self, bytes: impl IntoIterator<Item = u8>) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn add_row(&mut self, row: &Row) {
        let Row { t_s, x, r, u, u_held, sigma, sigma_star, d, d_hat, health } = row;
        let scalars = [t_s, r, u, u_held, sigma, sigma_star].into_iter();
        let words = scalars.chain(x).chain(d).chain(d_hat).map(|value| value.to_bits());
        self.add(words.chain([u64::from(health.bits())]).flat_map(u64::to_le_bytes));
    }
}

/// Returns the hashes of all rows of the run, of the whole design, of its margins and poles, and of the C file.
fn of(text: &Text) -> Result<[String; 4], Failure> {
    let [mut rows, mut designed, mut margins, mut c] = [0; 4].map(|_: u64| Hash(0xcbf2_9ce4_8422_2325));
    let mut experiment = text.experiment()?;
    // Printed numbers read back exactly.
    designed.add(serde_json::to_string(&study::design(&experiment)?)?.into_bytes());
    c.add(c_file(text)?.0.into_bytes());
    experiment.run(&mut |row| {
        rows.add_row(row);
        ControlFlow::Continue(())
    });
    margins.add(design::margins(&mut experiment)?.to_string().into_bytes());
    Ok([rows, designed, margins, c].map(|hash| format!("{:016x}", hash.0)))
}

/// Returns a line for each scenario of the check: its name and its hashes.
pub fn hashes() -> Vec<String> {
    let named = |name: &str, sets: &[&str]| {
        let plant = if name.starts_with("motor") { "motor" } else { "joint" };
        let toml = scenario::STARTS.iter().find(|(known, _)| *known == plant).map_or("", |(_, text)| *text);
        let sets = sets.iter().map(ToString::to_string).collect();
        let text = Text { toml: toml.into(), name: name.into(), sets, rule: None };
        let hashes = of(&text).map_or_else(|_| "no result".into(), |hashes| hashes.join(" "));
        format!("{name} {hashes}")
    };
    vec![
        named("motor", &[]),
        named("motor-lost", &["fault=[{kind = \"lost\", at_s = 0.5, for_s = 0.02}]", "drive.gain_sets=1"]),
        named("joint", &[]),
        named("joint-stiff", &["joint.stiffness_n_m=900"]),
    ]
}
