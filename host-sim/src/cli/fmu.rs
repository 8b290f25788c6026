//! Binary of an FMU, by the C compiler of this machine.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{self, Command};

use forms::Fmu;

/// Options of the compiler. Operations are rounded one by one, so the bits are the tick's.
const OPTIONS: [&str; 6] = ["-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden"];

/// Folder that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> io::Result<Self> {
        let path = std::env::temp_dir().join(format!("host-sim-fmu-{}-{name}", process::id()));
        fs::create_dir(&path)?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        _ = fs::remove_dir_all(&self.0);
    }
}

/// Compiles the sources of an FMU. Returns the path in the FMU and the bytes.
///
/// # Errors
/// The system has no folder name in FMI 2.0 here, there is no `cc`, or `cc` fails; in words.
pub(super) fn binary(fmu: &Fmu) -> Result<(String, Vec<u8>), String> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        return Err("a binary is made on Linux x86-64 only".into());
    }
    let name = fmu.identifier();
    let folder = Folder::new(name).map_err(|error| format!("no temporary folder: {error}"))?;
    let bytes = compiled(fmu, &folder.0)?;
    Ok((format!("binaries/linux64/{name}.so"), bytes))
}

fn compiled(fmu: &Fmu, folder: &Path) -> Result<Vec<u8>, String> {
    for (name, text) in fmu.sources() {
        fs::write(folder.join(name), text).map_err(|error| format!("no temporary file: {error}"))?;
    }
    let [source, library] = ["c", "so"].map(|ending| format!("{}.{ending}", fmu.identifier()));
    let mut compiler = Command::new("cc");
    compiler.args(OPTIONS).args(["-o", &library, &source, "-lm"]).current_dir(folder);
    let output = compiler.output().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => "there is no C compiler `cc`".to_owned(),
        _ => format!("cc: {error}"),
    })?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        return Err(format!("cc: {}", why.lines().find(|line| line.contains("error")).unwrap_or(&why)));
    }
    fs::read(folder.join(library)).map_err(|error| format!("cc: {error}"))
}
