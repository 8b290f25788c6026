//! `host-sim figures`: reproduces the figures of the paper and checks its claims.
use std::path::Path;

use loop_sim::trace::Ending;
use study::number::significant;
use terminal::stop;
use terminal::table::Table;

use super::{Console, Failure, bad, claim_folder, failed, status};
use crate::figures::{CATALOGUE, Case, ClaimRow, PaperFigure};

impl Console<'_> {
    pub(super) fn figures(&mut self, only: &[String], folder: &Path, json: bool) -> Result<u8, Failure> {
        let chosen = chosen_figures(only)?;
        let _claim = claim_folder(folder)?;
        // A request to stop is checked between two figures: each one is written completely.
        let guards = (stop::keeping(), stop::looking());
        let mut claims = Vec::new();
        for figure in chosen {
            let mut cases = Vec::new();
            let mut title = String::new();
            for (label, mut experiment) in figure.experiments()?.into_iter().chain(figure.further_experiments()?) {
                self.note(&format!("{}: {label}", figure.id));
                let (trace, error) = self.watched(&mut experiment, &mut None);
                if let Some(error) = error {
                    return Err(failed(format!("{}: {error}", figure.id)));
                }
                if matches!(trace.ending, Ending::Interrupted { .. }) {
                    self.note(&format!(
                        "stopped on request; the figures before {} are in {}",
                        figure.id,
                        folder.display()
                    ));
                    return Ok(status::INTERRUPTED);
                }
                if title.is_empty() {
                    title.clone_from(&experiment.title);
                }
                cases.push(Case { label, metrics: experiment.metrics(&trace), trace });
            }
            let reproduction = figure.judge(&title, &cases);
            let told = |error| Failure::writing(folder.join(figure.id).display(), &error);
            reproduction.figure.write(folder, figure.id).map_err(told)?;
            claims.extend(reproduction.claims);
        }
        drop(guards);
        if json {
            self.say_json(serde_json::to_string_pretty(&claims))?;
        } else {
            self.say(&claim_table(&claims).to_string())?;
            for claim in claims.iter().filter(|claim| !claim.remark.is_empty()) {
                self.say(&format!("{}, {}: {}", claim.figure, claim.claim, claim.remark))?;
            }
            self.say(&format!("files: {}", folder.display()))?;
        }
        let lost: Vec<&str> = claims.iter().filter(|claim| claim.is_regression()).map(|claim| claim.claim).collect();
        if lost.is_empty() {
            return Ok(status::DONE);
        }
        Err(failed(format!("claims that held before and no longer hold: {}", lost.join("; "))))
    }
}

fn chosen_figures(only: &[String]) -> Result<Vec<&'static PaperFigure>, Failure> {
    if only.is_empty() {
        return Ok(CATALOGUE.iter().collect());
    }
    let find = |name: &String| {
        CATALOGUE.iter().find(|figure| figure.id == name).ok_or_else(|| {
            let distance = |figure: &&PaperFigure| strsim::damerau_levenshtein(figure.id, name);
            let nearest = CATALOGUE.iter().min_by_key(distance).map_or("", |figure| figure.id);
            bad(format!("--only {name}: there is no such figure; expected fig01 .. fig10, nearest is {nearest}"))
        })
    };
    only.iter().map(find).collect()
}

fn claim_table(claims: &[ClaimRow]) -> Table {
    let mut table = Table::new(["figure", "claim", "published", "reproduced", "unit", "reading", "verdict"]);
    for claim in claims {
        let verdict = match claim.holds {
            _ if claim.is_regression() => "NO LONGER HOLDS",
            Some(true) => "holds",
            Some(false) => "does not hold",
            None if claim.holds_as_drawn => "open; holds as drawn",
            None => "open; does not hold as drawn",
        };
        let verdict = format!("{verdict} ({})", claim.criterion);
        let range = claim.range.map_or_else(String::new, |[least, most]| {
            format!(" ({} .. {})", significant(least, 3), significant(most, 3))
        });
        let reproduced = significant(claim.reproduced, 4) + &range;
        table.row([claim.figure, claim.claim, claim.published, &reproduced, claim.unit, claim.reading, &verdict]);
    }
    table
}
