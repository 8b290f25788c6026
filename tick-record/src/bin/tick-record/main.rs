//! `tick-record FOLDER`: what the ticks of the firmware's image `budget` and the functions of the archive for C are to
//! compute, a text for each in the folders `image` and `archive`, for `cycle-bound --means`.

mod archive;
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
    let Some(folder) = env::args_os().nth(1).filter(|_| env::args_os().len() == 2) else {
        eprintln!("usage: tick-record FOLDER");
        return ExitCode::from(2);
    };
    let folder = Path::new(&folder);
    let drives = watched::all();
    let all = written(&folder.join("archive"), archive::texts(&drives));
    match all.and_then(|()| written(&folder.join("image"), image::texts(&drives))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", folder.display());
            ExitCode::FAILURE
        }
    }
}
