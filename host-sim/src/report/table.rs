//! A plain-text table with aligned columns, for the terminal and for golden files.
//!
//! A column whose cells are all numbers is aligned to the right, every other one to the left. Width is counted in
//! characters; combining marks (the hat of d̂) take none.

use std::fmt;

/// A header and rows of as many cells; missing cells are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    #[must_use]
    pub fn new<S: Into<String>>(header: impl IntoIterator<Item = S>) -> Self {
        Self { header: header.into_iter().map(cell).collect(), rows: Vec::new() }
    }

    /// Adds a row at the bottom.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(cell).collect());
    }
}

/// A line break inside a cell would tear the table.
fn cell<S: Into<String>>(text: S) -> String {
    text.into().replace(['\n', '\r', '\t'], " ")
}

/// Columns a text takes on a terminal.
fn width(text: &str) -> usize {
    text.chars().filter(|c| !('\u{300}'..='\u{36f}').contains(c)).count()
}

/// A number, or one of the marks that stand for a missing one.
fn is_numeric(text: &str) -> bool {
    text.is_empty() || text == "-" || text.parse::<f64>().is_ok()
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let columns = self.rows.iter().map(Vec::len).fold(self.header.len(), usize::max);
        let get = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let widths: Vec<usize> = (0..columns)
            .map(|j| self.rows.iter().chain([&self.header]).map(|row| width(&get(row, j))).max().unwrap_or(0))
            .collect();
        let to_the_right: Vec<bool> = (0..columns)
            .map(|j| !self.rows.is_empty() && self.rows.iter().all(|row| is_numeric(&get(row, j))))
            .collect();
        let line = |row: &[String]| {
            let mut text = String::new();
            for j in 0..columns {
                let cell = get(row, j);
                let padding = " ".repeat(widths[j] - width(&cell));
                text += if j == 0 { "" } else { "  " };
                text += &if to_the_right[j] { padding + &cell } else { cell + &padding };
            }
            text.trim_end().to_owned()
        };
        writeln!(f, "{}", line(&self.header))?;
        writeln!(f, "{}", widths.iter().map(|&width| "-".repeat(width)).collect::<Vec<_>>().join("  "))?;
        self.rows.iter().try_for_each(|row| writeln!(f, "{}", line(row)))
    }
}

/// `value` with that many significant digits: plain from 1e-4 up to 1e6, in scientific notation beyond.
///
/// ```
/// use host_sim::report::table::significant;
/// assert_eq!(significant(0.048_613, 4), "0.04861");
/// assert_eq!(significant(279.0, 4), "279.0");
/// assert_eq!(significant(7.2948e-5, 4), "7.295e-5");
/// ```
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        // Adding 0 turns -0 into 0.
        return (value + 0.0).to_string();
    }
    // Rounding first: 9.9996 has the exponent of 10.00.
    let after_first = digits.max(1) - 1;
    let rounded = format!("{value:.after_first$e}");
    let exponent: i32 = rounded.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    match rounded.parse::<f64>() {
        Ok(number) if (-4..6).contains(&exponent) => {
            let shift = exponent.unsigned_abs() as usize;
            let decimals = if exponent < 0 { after_first + shift } else { after_first.saturating_sub(shift) };
            format!("{number:.decimals$}")
        }
        _ => rounded,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_align_right_and_text_left() {
        let mut table = Table::new(["claim", "published", "d̂₂"]);
        table.row(["bound on σ*", "0.049", "8.85e-3"]);
        table.row(["peak\nu", "279", ""]);
        let expected = "\
claim        published       d̂₂
-----------  ---------  -------
bound on σ*      0.049  8.85e-3
peak u             279
";
        assert_eq!(table.to_string(), expected);
    }

    #[test]
    fn a_column_with_a_word_in_it_aligns_left() {
        let mut table = Table::new(["value"]);
        table.row(["1"]);
        table.row(["0.185 / 0.049"]);
        assert_eq!(table.to_string(), "value\n-------------\n1\n0.185 / 0.049\n");
    }

    #[test]
    fn ragged_and_empty_tables_still_print() {
        assert_eq!(Table::default().to_string(), "\n\n");
        let mut table = Table::new(["a"]);
        table.row(["x", "1"]);
        table.row::<&str>([]);
        assert_eq!(table.to_string(), "a\n-  -\nx  1\n\n");
    }

    #[test]
    fn significant_digits_survive_rounding_up_to_the_next_power() {
        let cases = [
            (9.9996, "10.00"),
            (-0.000_123_456, "-0.0001235"),
            (0.000_099_999, "9.9999e-5"),
            (44_123.4, "44120"),
            (999_999.9, "1.000e6"),
            (0.0, "0"),
            (-0.0, "0"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
            (f64::MIN_POSITIVE, "2.225e-308"),
        ];
        for (value, expected) in cases {
            let digits = if expected == "9.9999e-5" { 5 } else { 4 };
            assert_eq!(significant(value, digits), expected);
        }
        assert_eq!(significant(0.000_099_999, 4), "0.0001000");
        assert_eq!(significant(3.7, 0), "4");
    }
}
