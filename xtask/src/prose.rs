//! Counts that keep the prose readable: the style sheet of CONTRIBUTING.md as numbers.
//!
//! Four habits make the text of this project hard to read, and each one is countable: the pronoun *what*, programs that
//! *tell, say, know or ask*, `that of` in place of a noun, and doc comments that are fragments (`/// Of its numbers.`).
//! The unit is one per 1000 words. Published crates have 0.0 to 0.6 *what* and 0.2 to 1.1 *say*.
//!
//! A page of documentation must meet the [targets](TARGETS). A crate must stay below its limits in [`LIMITS`], which
//! `cargo xtask prose --lower` lowers; nothing raises them. A crate without an entry must meet the targets.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::docs::starred;
use crate::links;
use crate::python::Environment;
use crate::scan::files_with;
use crate::step::{Gate, Invocation, Outcome};

/// Spell checker, British English; its exceptions are in `typos.toml`.
const SPELLING: Environment =
    Environment { folder: "target/prose", packages: &["typos==1.52.0"], rerun: "cargo xtask prose" };
/// Limits of the crates that exceed a target, one line each.
const LIMITS: &str = "xtask/prose.toml";
/// Names of the counts, as in [`LIMITS`].
const COUNTS: [&str; 5] = ["what", "say", "that_of", "sentence", "fragments"];
/// The largest counts: three per 1000 words, the mean sentence in words, and fragments in all.
const TARGETS: [f64; 5] = [1.0, 1.5, 0.2, 20.0, 0.0];
/// Longest sentence of a page, words.
const LONGEST: usize = 30;
/// Shortest text whose frequencies mean something, words: below it one word per habit is accepted.
const SHORTEST: usize = 1000;

/// Beginnings of a doc comment that cannot stand alone.
const FRAGMENTS: [&str; 8] = ["Of", "The same", "That of", "Which", "Those", "Its", "Their", "..."];
/// Words of people, not of programs.
const SAYING: [&str; 11] = ["told", "tell", "tells", "say", "says", "said", "know", "knows", "ask", "asks", "asked"];

/// Checks all links, pages and crates.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    SPELLING.ready(gate)?;
    gate.commands("spelling", &[Invocation::new(&SPELLING.program("typos"), &["--format", "brief"])])?;
    gate.check("links between pages", "cargo xtask prose", |gate| links::check(&pages(&gate.root)?))?;
    gate.check("prose", "cargo xtask prose", |gate| checked(&gate.root))
}

/// Checks all pages and crates, then lowers the limits to what was counted.
pub(crate) fn lower(gate: &mut Gate) -> Outcome {
    gate.check("limits of the prose", "cargo xtask prose --lower", |gate| {
        let (crates, limits) = (crates(&gate.root)?, limits(&gate.root)?);
        let lines: Vec<String> = crates
            .iter()
            .filter_map(|(name, count)| {
                let counted = count.rates().map(|rate| (10.0 * rate).ceil() / 10.0);
                let old = limits.get(name).copied().unwrap_or(TARGETS);
                let new: [f64; 5] = std::array::from_fn(|i| counted[i].min(old[i]).max(TARGETS[i]));
                (new != TARGETS).then(|| {
                    let pairs: Vec<String> = COUNTS.iter().zip(new).map(|(key, it)| format!("{key} = {it}")).collect();
                    format!("{name} = {{ {} }}\n", pairs.join(", "))
                })
            })
            .collect();
        let head = "# Counts of the prose in comments, per crate: they only fall (cargo xtask prose --lower).\n";
        fs::write(gate.root.join(LIMITS), head.to_owned() + &lines.concat()).map_err(|e| format!("{LIMITS}: {e}"))?;
        Ok(format!("{} crates above a target", lines.len()))
    })
}

fn checked(root: &Path) -> Result<String, String> {
    let (mut problems, mut words) = (Vec::new(), 0);
    let pages = pages(root)?;
    for (file, text) in &pages {
        let name = &file.strip_prefix(root).unwrap_or(file).display().to_string();
        let count = Count::of_page(text);
        words += count.words;
        problems.extend(count.problems(name, TARGETS));
        problems.extend(starred(text).map(|formula| format!("{name}: write \\ast for the stars of `{formula}`")));
        problems.extend(count.longest.iter().map(|it| format!("{name}: a sentence of over {LONGEST} words: {it}")));
    }
    let (crates, limits) = (crates(root)?, limits(root)?);
    for (name, count) in &crates {
        problems.extend(count.problems(name, limits.get(name).copied().unwrap_or(TARGETS)));
    }
    if problems.is_empty() {
        return Ok(format!("{} pages with {words} words, {} crates", pages.len(), crates.len()));
    }
    Err(format!("{}\nsee the style sheet in CONTRIBUTING.md", problems.join("\n")))
}

/// Counts of a page or a crate.
#[derive(Debug, Default, PartialEq)]
struct Count {
    words: usize,
    sentences: usize,
    what: usize,
    say: usize,
    that_of: usize,
    fragments: usize,
    /// Sentences of over [`LONGEST`] words, abbreviated.
    longest: Vec<String>,
}

impl Count {
    fn of_page(text: &str) -> Self {
        let mut count = Self::default();
        for paragraph in paragraphs(text.lines()) {
            count.add(&paragraph);
        }
        count
    }

    fn add_source(&mut self, text: &str) {
        // A line that is not a doc comment ends the paragraph, as an empty line does.
        let comments = text.lines().map(|line| {
            let line = line.trim_start();
            let doc = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
            doc.filter(|rest| !rest.starts_with('/')).map_or("", |rest| rest.strip_prefix(' ').unwrap_or(rest))
        });
        for paragraph in paragraphs(comments) {
            self.add(&paragraph);
        }
        self.fragments += text.lines().filter(|line| is_fragment(line)).count();
    }

    fn add(&mut self, paragraph: &str) {
        let text = cleaned(paragraph);
        let is_word = |word: &&str| word.chars().any(char::is_alphabetic);
        for sentence in sentences(&text) {
            let words = sentence.split_whitespace().filter(is_word).count();
            self.words += words;
            self.sentences += usize::from(words > 0);
            if words > LONGEST {
                self.longest.push(sentence.chars().take(90).collect());
            }
        }
        let lower = text.to_lowercase();
        let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        self.what += words.iter().filter(|word| **word == "what").count();
        self.say += words.iter().filter(|word| SAYING.contains(word)).count();
        self.that_of += words.windows(2).filter(|pair| ["that", "those"].contains(&pair[0]) && pair[1] == "of").count();
    }

    /// Counts as [`COUNTS`] names them.
    fn rates(&self) -> [f64; 5] {
        let per_1000 = |count: usize| 1000.0 * count as f64 / self.words.max(SHORTEST) as f64;
        let sentence = self.words as f64 / self.sentences.max(1) as f64;
        [per_1000(self.what), per_1000(self.say), per_1000(self.that_of), sentence, self.fragments as f64]
    }

    fn problems(&self, name: &str, limits: [f64; 5]) -> Vec<String> {
        let counted = COUNTS.iter().zip(self.rates()).zip(limits);
        counted
            .filter(|((_, rate), limit)| rate > limit)
            .map(|((key, rate), limit)| format!("{name}: {key} = {rate:.2}, at most {limit}"))
            .collect()
    }
}

/// Paragraphs without code, formulas, tables, headings and pictures. A list item is a paragraph.
fn paragraphs<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut done = Vec::new();
    let mut open = String::new();
    let mut fenced = false;
    for line in lines {
        let line = line.trim();
        let is_fence = line.starts_with("```") || line.starts_with("$$") && line.matches("$$").count() == 1;
        let was_fenced = fenced;
        fenced ^= is_fence || fenced && line.ends_with("$$");
        let starts_with = |begins: &[&str]| begins.iter().any(|begin| line.starts_with(begin));
        let is_prose = !was_fenced && !is_fence && !line.is_empty() && !starts_with(&["#", "|", "<!--", "![", "$$"]);
        let number = line.trim_start_matches(|c: char| c.is_ascii_digit());
        let item = ["* ", "- ", "+ "].iter().find_map(|mark| line.strip_prefix(mark));
        let item = item.or_else(|| number.strip_prefix(". ").filter(|_| number.len() < line.len()));
        if (!is_prose || item.is_some()) && !open.is_empty() {
            done.push(std::mem::take(&mut open));
        }
        if is_prose {
            open = open + item.unwrap_or(line) + " ";
        }
    }
    done.extend((!open.is_empty()).then_some(open));
    done
}

/// Text with one word in place of inline code and formulas, without the targets of links.
fn cleaned(text: &str) -> String {
    let replaced = |text: &str, mark: char, word: &str| {
        let parts = text.split(mark).enumerate();
        parts.map(|(i, part)| if i % 2 == 0 { part } else { word }).collect::<String>()
    };
    let text = replaced(&replaced(text, '`', "code"), '$', "math");
    let mut parts = text.split("](");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + "]" + part.split_once(')').map_or(part, |(_, rest)| rest))
}

/// Sentences and clauses: a mark of punctuation ends one, and a blank follows it.
fn sentences(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut from = 0;
    for (at, mark) in text.match_indices(['.', '!', '?', ':', ';']) {
        let end = at + mark.len();
        if text[end..].starts_with(char::is_whitespace) {
            found.push(&text[from..end]);
            from = end;
        }
    }
    found.push(&text[from..]);
    found
}

/// Whether a line is a doc comment of one line that does not make sense alone, such as `/// Of its numbers.`
fn is_fragment(line: &str) -> bool {
    let Some(text) = line.trim_start().strip_prefix("/// ") else { return false };
    FRAGMENTS.iter().filter_map(|begin| text.strip_prefix(begin)).any(|rest| {
        let inner = rest.strip_suffix('.').unwrap_or("..");
        !rest.starts_with(char::is_alphanumeric) && inner.len() <= 60 && !inner.contains('.')
    })
}

/// Reads the documentation. `docs/decisions` and crate READMEs are included.
fn pages(root: &Path) -> Result<BTreeMap<PathBuf, String>, String> {
    let files = files_with(root, "md").map_err(|error| format!("the pages cannot be read: {error}"))?;
    let read = |file: &Path| fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()));
    files.into_iter().map(|file| read(&file).map(|text| (file, text))).collect()
}

/// Counts of each crate: the folders below the root with a manifest, each with the crates inside it.
fn crates(root: &Path) -> Result<BTreeMap<String, Count>, String> {
    let mut found: BTreeMap<String, Count> = BTreeMap::new();
    for file in files_with(root, "rs").map_err(|error| format!("the sources cannot be read: {error}"))? {
        let text = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let path = file.strip_prefix(root).unwrap_or(&file);
        let folder = path.iter().next().map_or_else(String::new, |folder| folder.to_string_lossy().into_owned());
        found.entry(folder).or_default().add_source(&text);
    }
    Ok(found)
}

/// Reads [`LIMITS`].
fn limits(root: &Path) -> Result<BTreeMap<String, [f64; 5]>, String> {
    let text = fs::read_to_string(root.join(LIMITS)).map_err(|error| format!("{LIMITS}: {error}"))?;
    parsed(&text)
}

fn parsed(text: &str) -> Result<BTreeMap<String, [f64; 5]>, String> {
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    lines
        .map(|line| {
            let wrong = || format!("{LIMITS}: expected CRATE = {{ what = 1.0, .. }}, found {line}");
            let (name, rest) = line.split_once(" = {").ok_or_else(wrong)?;
            let mut values = [0.0; 5];
            for (value, key) in values.iter_mut().zip(COUNTS) {
                let (_, after) = rest.split_once(&format!("{key} = ")).ok_or_else(wrong)?;
                let number = after.split([',', ' ']).next().unwrap_or_default();
                *value = number.parse().map_err(|_| wrong())?;
            }
            Ok((name.to_owned(), values))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Count, is_fragment, parsed};

    #[test]
    fn words_habits_and_sentences_are_counted() {
        let page = "# What is left out\n\nWhat it says, `what` and $what$. The error\nis that of [what](what.md).\n\n\
                    ```text\nwhat\n```\n\n* A list. Two sentences.\n| what | said |\n";
        let count = Count::of_page(page);
        assert_eq!((count.what, count.say, count.that_of), (2, 1, 1), "{count:?}");
        assert_eq!((count.words, count.sentences, count.fragments), (16, 4, 0), "{count:?}");
        let long = Count::of_page(&format!("{} end. Short.", "word ".repeat(30)));
        assert_eq!((long.longest.len(), long.words), (1, 32));
    }

    #[test]
    fn comments_count_and_code_does_not() {
        let mut count = Count::default();
        count.add_source("//! What it is.\nlet what = \"what\"; // what\n/// Tells what.\n/// Of its numbers.\n");
        assert_eq!((count.what, count.say, count.fragments), (2, 1, 1), "{count:?}");
        assert!(is_fragment("    /// The same since the base.") && is_fragment("/// Of its numbers."));
        assert!(!is_fragment("/// Offset of the base.") && !is_fragment("/// Returns the base. Of it more later."));
    }

    #[test]
    fn a_limit_that_is_exceeded_is_a_problem() {
        let count = Count::of_page(&"What it is. ".repeat(400));
        let limits = parsed("# head\nx = { what = 400, say = 1.5, that_of = 0.2, sentence = 20, fragments = 0 }\n");
        let limits = limits.expect("limits")["x"];
        assert!(count.problems("x", limits).is_empty());
        assert_eq!(count.problems("x", super::TARGETS), ["x: what = 333.33, at most 1"]);
        assert!(parsed("x = 3").is_err() && parsed("x = { what = a }").is_err());
    }
}
