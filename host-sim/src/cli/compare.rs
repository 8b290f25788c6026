//! `host-sim compare`: compares edo-smc with baseline controllers, all tuned with the same search budget.

use std::path::PathBuf;

use clap::Args;
use study::Watch;
use study::compare::{Bench, Comparison, Contender, Settings, compare, contenders};
use study::number::significant;

use super::{Console, Failure, JOINT, LEFT, ScenarioText, bad, claim_folder, folder_of, status};
use crate::report::comparison;

#[derive(Args, Debug)]
pub(super) struct CompareOptions {
    /// Scenario with [joint] or [motor] [default: template of new --plant joint].
    file: Option<PathBuf>,
    /// Override a key of the scenario; repeatable. Example: --set encoder.link.bits=16 for a joint, --set
    /// encoder.bits=16 for a motor.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Evaluations of the cost for each control law and noise limit.
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    evaluations: u32,
    /// Seed of the search.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Limits of the current noise, A rms [default: 1/3000, 1/1000 and 1/300 of max_current_a for a joint, 3/1000,
    /// 1/100 and 3/100 for a motor].
    #[arg(long, value_name = "A,B,C", value_delimiter = ',')]
    noise: Vec<f64>,
    /// Output folder of the figures and compare.json [default: out/SCENARIO-compare].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON instead of the table.
    #[arg(long)]
    json: bool,
}

impl Console<'_> {
    pub(super) fn compare(&mut self, options: &CompareOptions) -> Result<u8, Failure> {
        let scenario = ScenarioText::read(options.file.as_deref(), JOINT)?;
        if let Some(limit) = options.noise.iter().find(|limit| !(**limit > 0.0 && limit.is_finite())) {
            return Err(bad(format!("--noise {limit}: expected a number above 0")));
        }
        let bench = Bench::new(&scenario.file, &scenario.text, &options.sets)?;
        let settings = Settings {
            evaluations: options.evaluations as usize,
            seed: options.seed,
            noise_a: if options.noise.is_empty() { bench.noise_limits_a().to_vec() } else { options.noise.clone() },
        };
        let folder = folder_of(options.out.as_ref(), &bench.name, "compare");
        let claim = claim_folder(&folder)?;
        let contenders = contenders(&bench);
        let Some(comparison) = self.tuned(&bench, &contenders, &settings) else { return Ok(status::INTERRUPTED) };
        let entries = &comparison.entries;
        let text = serde_json::to_string_pretty(&comparison);
        let told = |error| Failure::writing(folder.display(), &error);
        // Printed before anything is written: the search took minutes, and a write may fail.
        let kept = text.as_ref().map_or(Ok(()), |text| {
            let path = folder.join("compare.json");
            crate::report::write_whole(&path, |out| writeln!(out, "{text}")).map_err(told)
        });
        if options.json {
            self.say_json(text)?;
        } else {
            self.say(&format!(
                "{}: {}; {} evaluations per law and noise limit, seed {}, tau = {} s, {} corners, recovery from {} rad",
                bench.name,
                bench.title,
                settings.evaluations,
                settings.seed,
                significant(bench.tau_s, 4),
                bench.corners(),
                significant(bench.start_rad, 3)
            ))?;
            self.say(&comparison::table(entries, comparison.of_file.as_ref()).to_string())?;
            let mut over: Vec<&str> =
                entries.iter().filter(|entry| entry.breaks_limit()).map(|entry| entry.law).collect();
            over.dedup();
            if !over.is_empty() {
                self.say(&format!("not ranked, current noise over the limit: {}", over.join(", ")))?;
            }
        }
        kept?;
        comparison::figure(&bench, entries).write(&folder, "compare").map_err(told)?;
        comparison::moves(&bench, &contenders, entries).write(&folder, "move").map_err(told)?;
        drop(claim);
        if !options.json {
            self.say(&format!("files: {}", folder.display()))?;
            let laws = contenders.len();
            self.say(&format!("result: {laws} control laws tuned at {} noise limits", settings.noise_a.len()))?;
        }
        Ok(status::DONE)
    }

    /// Runs the comparison under a progress bar; `None` if it was interrupted.
    fn tuned(&mut self, bench: &Bench, contenders: &[Box<dyn Contender>], settings: &Settings) -> Option<Comparison> {
        let all = contenders.len() * settings.noise_a.len() * settings.evaluations;
        let bar = self.bar(all as u64, LEFT);
        let found = compare(bench, contenders, settings, Watch::new(self.stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        found
    }
}
