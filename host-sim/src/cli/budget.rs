//! `host-sim budget` with the feature `chip`: computes the WCET bound of a function.

use cycle_bound::Reply;

use super::{Console, Failure, bad, target};

pub(super) use cycle_bound::Options as BudgetOptions;

impl Console<'_> {
    pub(super) fn budget(&mut self, options: &BudgetOptions) -> Result<u8, Failure> {
        options.elf.as_deref().map_or(Ok(()), |elf| target::present(elf, "--elf")).map_err(bad)?;
        let Reply { text, remarks, status } = cycle_bound::run(options, self.stop).map_err(bad)?;
        self.say(&text)?;
        for line in &remarks {
            self.note(line);
        }
        Ok(status)
    }
}
