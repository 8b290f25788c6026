//! A certificate: what was proved of an exported file, as text beside it.

use std::fmt::Write as _;

use crate::run::Row;
use crate::sha256;

/// The certificate of a file with this text.
pub fn text(exported: &str, title: &str, rows: &[Row], solver: &str) -> String {
    let mut out = format!(
        "Certificate of tick-proof {}\nOf: {title}\nFile (host-sim export --standalone), SHA-256: {}\n\
         Solver: {solver}\n\
         Assumes: IEEE 754 binary32, round to nearest even, subnormal numbers, nothing contracted or reordered.\n\
         Shown of the operations that the file is written from (docs/proofs.md says what this is not).\n\n",
        env!("CARGO_PKG_VERSION"),
        sha256::hex(exported.as_bytes()),
    );
    let wide = rows.iter().map(|row| row.statement.chars().count()).max().unwrap_or(0);
    for row in rows {
        let _ = writeln!(out, "{:wide$}  {}", row.statement, row.verdict);
        for detail in row.details() {
            let _ = writeln!(out, "    {detail}");
        }
    }
    out
}
