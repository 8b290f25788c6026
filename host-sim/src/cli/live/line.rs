//! Command line of a session, split into words as in a shell.

const QUOTES: [char; 2] = ['\'', '"'];

/// Returns the words of a line, without a comment. Quotes around a whole word are removed. Other quotes stay, because
/// they belong to a TOML value.
pub(super) fn words(line: &str) -> Vec<&str> {
    let (mut words, mut rest) = (Vec::new(), line.trim());
    while !rest.is_empty() && !rest.starts_with('#') {
        let (word, after) = rest.split_at(end_of_word(rest));
        words.push(QUOTES.into_iter().find_map(|quote| word.strip_prefix(quote)?.strip_suffix(quote)).unwrap_or(word));
        rest = after.trim_start();
    }
    words
}

/// Returns the index behind the first word. Blanks and `#` between two quotes belong to the word.
fn end_of_word(text: &str) -> usize {
    let mut at = 0;
    while let Some(next) = text[at..].chars().next().filter(|next| !next.is_whitespace() && *next != '#') {
        at += next.len_utf8();
        if QUOTES.contains(&next) {
            at += text[at..].find(next).map_or(0, |length| length + 1);
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_around_a_word_are_removed_and_quotes_of_toml_stay() {
        for (line, expected) in [
            ("", &[][..]),
            ("  # a comment", &[]),
            ("set 'limits={}'", &["set", "limits={}"]),
            ("set \"drive.margin='standard'\" # now", &["set", "drive.margin='standard'"]),
            ("set 'drive.margin='standard''", &["set", "drive.margin='standard'"]),
            ("set drive.margin='standard' a=1", &["set", "drive.margin='standard'", "a=1"]),
            ("set title=\"a # b\" motor.gear=[2, 1]", &["set", "title=\"a # b\"", "motor.gear=[2,", "1]"]),
            ("trace 'my trip' --force", &["trace", "my trip", "--force"]),
            ("trace \"it's\"", &["trace", "it's"]),
            ("trace don't#x", &["trace", "don't"]),
            ("move '1.0'\t\"2.0\"", &["move", "1.0", "2.0"]),
            ("trace '", &["trace", "'"]),
        ] {
            assert_eq!(words(line), expected, "{line}");
        }
    }
}
