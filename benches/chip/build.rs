//! Places the repository's `memory.x` where cortex-m-rt's linker script looks for it, and names the script.

use std::env;
use std::path::Path;

fn main() {
    let here = env::var("CARGO_MANIFEST_DIR").expect("cargo sets the directory of the manifest");
    let root = Path::new(&here).ancestors().nth(2).expect("the repository lies two above");
    println!("cargo::rerun-if-changed={}", root.join("memory.x").display());
    println!("cargo::rustc-link-search={}", root.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
}
