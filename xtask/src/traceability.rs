//! Traceability from an equation to the machine code, in the file `target/traceability.md`. It lists the present lines
//! of its symbols and tests, its proofs, the functions of the images that contain it, their cycle budgets, and their
//! validation. The inputs are docs/paper.md, firmware/budgets.toml and the list of `means`.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::means;
use crate::paper_map::{cells, is_definition, references, row};

pub(crate) const FILE: &str = "target/traceability.md";

/// A function of firmware/budgets.toml.
struct Function<'a> {
    name: &'a str,
    image: &'a str,
    symbol: &'a str,
    bound: &'a str,
}

/// Returns the whole file, from a checked map and a checked list of functions.
pub(crate) fn text(map: &str, budgets: &str, root: &Path) -> String {
    let functions: Vec<Function<'_>> = budgets.split("[[instance]]").skip(1).filter_map(function).collect();
    let on_the_chip: Vec<[&str; 3]> = map.lines().filter_map(row::<3>).collect();
    let mut text = String::from(
        "# From equation to machine code\n\n\
         Made by `cargo xtask paper-map`. Cycles are ceilings, the bound of any call, as `cargo xtask budget` holds\n\
         them; \"the record's terms\" is what `cargo xtask means` shows on every path; `cargo xtask prove` proves.\n",
    );
    for [label, what, symbols, tests] in map.lines().filter_map(cells) {
        let _ = writeln!(text, "\n## {label} {what}");
        for (kind, cell) in [("symbol", symbols), ("test", tests)] {
            for reference in references(cell) {
                let _ = writeln!(text, "* {kind} `{}`", place(reference, root));
            }
            if let Some(reason) = cell.strip_prefix("- ") {
                let _ = writeln!(text, "* no {kind}: {reason}");
            }
        }
        for [_, proof, code] in on_the_chip.iter().filter(|[of, ..]| *of == label) {
            for statement in references(proof) {
                let _ = writeln!(text, "* proved: {statement}");
            }
            let beginnings = references(code);
            for Function { name, image, symbol, bound } in
                functions.iter().filter(|of| beginnings.iter().any(|beginning| of.name.starts_with(beginning)))
            {
                let held = match means::why_not(symbol) {
                    Some(why) => format!("held to no record: {why}"),
                    None => "the record's terms".into(),
                };
                let _ = writeln!(text, "* code `{symbol}` of {image} ({name}): {bound} cycles; {held}");
            }
        }
    }
    text
}

fn function(instance: &str) -> Option<Function<'_>> {
    let of = |key: &str| Some(instance.split_once(&format!("\n{key} = "))?.1.lines().next()?.trim_matches('"'));
    let image = of("image")?.rsplit('/').next()?;
    Some(Function { name: of("name")?, image, symbol: of("symbol")?, bound: of("bound")? })
}

/// Returns `file:line Type::item`, with the line of the last part of the name.
fn place(reference: &str, root: &Path) -> String {
    let Some((file, names)) = reference.split_once("::") else { return reference.into() };
    let text = fs::read_to_string(root.join(file)).unwrap_or_default();
    let name = names.rsplit("::").next().unwrap_or(names);
    match text.lines().position(|line| is_definition(line, name)) {
        Some(at) => format!("{file}:{} {names}", at + 1),
        None => reference.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_equation_is_followed_to_its_functions() {
        let map = "| paper | what | symbol | test |\n|---|---|---|---|\n\
                   | (1) | plant | `src/traceability.rs::Function` | - stated only |\n\
                   | (2) | law | `src/traceability.rs::place` \
                   | `src/traceability.rs::an_equation_is_followed_to_its_functions` |\n\n\
                   | paper | proof | machine code |\n|---|---|---|\n| (2) | `u within` | `motor` |\n";
        let of = |name: &str, symbol: &str| {
            format!(
                "\n[[instance]]\nname = \"{name}\"\nimage = \"a/b/budget\"\nsymbol = \"{symbol}\"\n[x]\nbound = 452\n"
            )
        };
        let budgets = [of("motor", "budget::motor::tick"), of("motor, its sine", "budget::sine::tick")].concat();
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let text = text(map, &budgets, root);
        let (first, second) = text.split_once("\n## (2) law\n").expect("two equations");
        let line = include_str!("traceability.rs").lines().position(|line| line.starts_with("struct Function"));
        let line = line.expect("it stands above") + 1;
        assert!(first.ends_with(&format!(
            "## (1) plant\n* symbol `src/traceability.rs:{line} Function`\n* no test: stated only\n"
        )));
        assert!(second.contains("\n* proved: u within\n"));
        assert!(second.contains("code `budget::motor::tick` of budget (motor): 452 cycles; the record's terms\n"));
        assert!(second.contains("`budget::sine::tick` of budget (motor, its sine): 452 cycles; held to no record"));
    }
}
