//! Programs of Python that steps of both tiers ask: each in an environment of its own, which nothing else uses, with
//! the versions that are named here and no others.

use crate::step::{Failure, Gate, Invocation, Outcome};

/// Prints what is installed of the packages that it is asked for, in the words of their requirements.
const INSTALLED: &str = "import sys; from importlib.metadata import version; \
                         print(*(f'{name}=={version(name)}' for name in sys.argv[1:]))";

/// Packages of PyPI in a folder of `target`.
pub(crate) struct Environment {
    pub(crate) folder: &'static str,
    /// `name==version` each.
    pub(crate) packages: &'static [&'static str],
    /// How to come back here.
    pub(crate) rerun: &'static str,
}

impl Environment {
    /// Path of a program in it: `python`, or what a package brought.
    pub(crate) fn program(&self, name: &str) -> String {
        format!("{}/bin/{name}", self.folder)
    }

    /// Are the packages there? If not they are installed.
    pub(crate) fn ready(&self, gate: &Gate) -> Outcome {
        let python = self.program("python");
        let names = self.packages.iter().map(|package| package.split("==").next().unwrap_or(package));
        let installed = Invocation::new(&python, &["-c", INSTALLED]).with(&names.collect::<Vec<_>>());
        if installed.answer_in(gate).is_some_and(|answer| answer == self.packages.join(" ")) {
            println!("{}: {}", self.folder, self.packages.join(" "));
            return Ok(());
        }
        let install = [
            Invocation::new("python3", &["-m", "venv", self.folder]),
            Invocation::new(&python, &["-m", "pip", "install", "--quiet"]).with(self.packages),
            installed,
        ];
        install.iter().try_for_each(|command| command.run(gate)).map_err(|failure| Failure {
            reason: format!(
                "{}\n{} is missing; it needs Python 3.11 or later with its module venv (on Debian: apt-get install \
                 python3-venv) and a way to its package",
                failure.reason,
                self.packages.join(" ")
            ),
            rerun: self.rerun.into(),
        })
    }
}
