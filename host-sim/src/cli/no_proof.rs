//! The module `proof` without the feature `proof`: returns an error that names the feature.

use std::path::Path;

use scenario::Experiment;

use super::{Console, Failure};

impl Console<'_> {
    #[allow(clippy::unused_self, reason = "the signature of the module `proof`")]
    pub(super) fn proved(
        &self,
        _: &Experiment,
        _: [&str; 2],
        _: Option<&Path>,
        refused: impl Fn(String) -> Failure,
    ) -> Result<(String, Vec<String>), Failure> {
        Err(refused("this program was built without the feature proof".into()))
    }
}
