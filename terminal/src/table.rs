//! Plain-text table with aligned columns, for the terminal and for golden files.
//!
//! A column with numbers in all cells is aligned to the right. Every other column is aligned to the left. The width is
//! counted in characters. Combining marks (the hat of d̂) have no width.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Table with a header and rows of equal length. Missing cells are empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Returns a table without rows.
    #[must_use]
    pub fn new<S: Into<String>>(header: impl IntoIterator<Item = S>) -> Self {
        Self { header: header.into_iter().map(cell).collect(), rows: Vec::new() }
    }

    /// Adds a row at the bottom.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(cell).collect());
    }

    /// Returns the names of the columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// Returns the rows from top to bottom.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }
}

/// Replaces line breaks in a cell, which would break the table.
fn cell<S: Into<String>>(text: S) -> String {
    text.into().replace(['\n', '\r', '\t'], " ")
}

/// Returns the number of terminal columns of a text.
fn width(text: &str) -> usize {
    text.chars().filter(|c| !('\u{300}'..='\u{36f}').contains(c)).count()
}

/// Returns true for a number or a mark for a missing number.
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
}
