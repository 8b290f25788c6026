//! Python programs that steps of both tiers use, each in a separate environment with exactly the versions listed in its
//! definition.

use crate::step::{Failure, Gate, Invocation, Outcome};

/// Script that prints the installed versions of packages in the form of requirements.
const INSTALLED: &str = "import sys; from importlib.metadata import version; \
                         print(*(f'{name}=={version(name)}' for name in sys.argv[1:]))";

/// PyPI packages in a folder of `target`.
pub(crate) struct Environment {
    pub(crate) folder: &'static str,
    /// Packages as `name==version`.
    pub(crate) packages: &'static [&'static str],
    /// Command that repeats the step.
    pub(crate) rerun: &'static str,
}

impl Environment {
    /// Returns the path of a program of the environment: `python`, or a program of a package.
    pub(crate) fn program(&self, name: &str) -> String {
        format!("{}/bin/{name}", self.folder)
    }

    /// Installs the packages if they are missing.
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
