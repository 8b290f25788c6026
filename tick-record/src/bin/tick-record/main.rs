//! `tick-record FOLDER [INSTANCE ..]` writes expected results for `cycle-bound --means`, one text per function. The
//! texts of the ticks of the image `budget` go to the folder `image`, the texts of the C library to `archive`. Without
//! instances it writes all.

mod archive;
#[allow(dead_code, reason = "a joint as a whole has more ways than one record takes")]
mod designs;
mod image;
mod memory;
mod watched;

use std::path::Path;
use std::process::ExitCode;
use std::{env, fs, io};

fn written(folder: &Path, texts: Vec<(String, String)>) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    texts.into_iter().try_for_each(|(name, text)| fs::write(folder.join(name).with_extension("means"), text))
}

fn main() -> ExitCode {
    let Some(folder) = env::args_os().nth(1) else {
        eprintln!("usage: tick-record FOLDER [INSTANCE ..]");
        return ExitCode::from(2);
    };
    let instances: Vec<String> = env::args_os().skip(2).map(|name| name.to_string_lossy().into_owned()).collect();
    let is_wanted = |name: &str| instances.is_empty() || instances.iter().any(|one| one == name);
    let folder = Path::new(&folder);
    let drives = watched::all(&is_wanted);
    let (of_archive, of_image) = (archive::texts(&drives, &is_wanted), image::texts(&drives, &is_wanted));
    let ends = |name: &str| of_archive.iter().any(|(text, _)| text.ends_with(&format!("_{name}")));
    if let Some(name) = instances.iter().find(|name| !ends(name) && of_image.iter().all(|(text, _)| text != *name)) {
        eprintln!("neither the image nor the archive has an instance `{name}`");
        return ExitCode::from(2);
    }
    let all = written(&folder.join("archive"), of_archive);
    match all.and_then(|()| written(&folder.join("image"), of_image)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", folder.display());
            ExitCode::FAILURE
        }
    }
}
