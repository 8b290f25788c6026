//! Bill of materials (SPDX 2.3, JSON) of the images, and one of the C libraries, in `target/sbom`, validated by the
//! tools of SPDX.
//!
//! Cargo provides the linked crates (no macros, build scripts or tests), and its lock file provides their checksums.
//! The Python wheel has none. The output is reproducible: its date is the date of the commit.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::compiler::{Compiler, TARGET};
use crate::python::Environment;
use crate::step::{Failure, Gate, Invocation, Outcome};
use crate::{capi, firmware};

const RERUN: &str = "cargo xtask sbom";
const FOLDER: &str = "target/sbom";
/// Bill that the validator must reject; beside the folder, whose bills are released.
const BROKEN: &str = "target/broken.spdx.json";
/// Environment of the validator.
const CHECKER: Environment =
    Environment { folder: "target/spdx-tools", packages: &["spdx-tools==0.8.5"], rerun: RERUN };

pub(crate) fn run(gate: &mut Gate) -> Outcome {
    gate.step("bills of materials of images and C libraries", |gate| {
        let failed = |reason: String| Failure { reason, rerun: RERUN.into() };
        gate.empty_folder(FOLDER, RERUN)?;
        CHECKER.ready(gate)?;
        let checker = CHECKER.program("pyspdxtools");
        for (name, manifest, files) in
            [("images", firmware::MANIFEST, firmware::files()), ("archives", capi::MANIFEST, capi::files())]
        {
            let bill = bill(gate, name, manifest, &files).map_err(failed)?;
            let to = format!("{FOLDER}/{name}.spdx.json");
            fs::write(gate.root.join(&to), format!("{bill:#}\n")).map_err(|error| failed(format!("{to}: {error}")))?;
            Invocation::new(&checker, &["--infile", &to]).run(gate)?;
            println!("{to}: {} files of {} packages", files.len(), packages(&bill));
            // The validator must reject a broken bill.
            let mut broken = bill;
            broken["packages"][0]["downloadLocation"] = json!("nowhere");
            fs::write(gate.root.join(BROKEN), broken.to_string())
                .map_err(|error| failed(format!("{BROKEN}: {error}")))?;
            if Invocation::new(&checker, &["--infile", BROKEN]).run(gate).is_ok() {
                return Err(failed(format!("{checker} takes a bill without a place to load a package from")));
            }
        }
        Ok(())
    })
}

/// Returns the bill of everything linked into these files.
fn bill(gate: &Gate, name: &str, manifest: &str, files: &[String]) -> Result<Value, String> {
    let ask =
        ["metadata", "--format-version", "1", "--locked", "--filter-platform", TARGET, "--manifest-path", manifest];
    let answer =
        Invocation::cargo(&ask).answer_in(gate).ok_or(format!("{manifest}: cargo does not tell its packages"))?;
    let metadata: Value = serde_json::from_str(&answer).map_err(|error| format!("{manifest}: {error}"))?;
    let lock = Path::new(manifest).with_file_name("Cargo.lock");
    let lock = fs::read_to_string(gate.root.join(&lock)).map_err(|error| format!("{}: {error}", lock.display()))?;
    let checksums = checksums(&lock);
    let compiler = Compiler::required().map_err(|failure| failure.reason)?.version();

    let (mut packages, mut relations) = (Vec::new(), Vec::new());
    let relation = |from: &str, kind: &str, to: &str| {
        json!({
            "spdxElementId": from,
            "relationshipType": kind,
            "relatedSpdxElement": to,
        })
    };
    for file in files {
        let said = Invocation::new("sha256sum", &[file]).answer_in(gate);
        let sum = said.as_deref().and_then(|said| said.split_whitespace().next()).map(str::to_string);
        let sum = sum.ok_or(format!("{file} is missing: `cargo xtask firmware` and `cargo xtask capi` build them"))?;
        let id = identifier(file);
        packages.push(package(&id, file, env!("CARGO_PKG_VERSION"), env!("CARGO_PKG_LICENSE"), None, Some(&sum)));
        relations.push(relation("SPDXRef-DOCUMENT", "DESCRIBES", &id));
    }
    let core = identifier("core");
    // The core library, which every program contains in part.
    packages.push(package(&core, "core (Rust)", &compiler, "MIT OR Apache-2.0", None, None));
    let root = metadata["resolve"]["root"].as_str().ok_or("no root")?;
    let linked = linked(&metadata, root);
    for found in linked.values() {
        let text = |key: &str| found[key].as_str().unwrap_or_default();
        let (name, version) = (text("name"), text("version"));
        let sum = checksums.get(&(name.to_string(), version.to_string()));
        let from = sum.map(|_| format!("https://crates.io/api/v1/crates/{name}/{version}/download"));
        let license = text("license").replace('/', " OR ");
        packages.push(package(&crate_id(found), name, version, &license, from.as_deref(), sum.map(String::as_str)));
    }
    for file in files {
        let of_crates = linked.values().map(|found| crate_id(found)).chain([core.clone()]);
        relations.extend(of_crates.map(|id| relation(&id, "STATIC_LINK", &identifier(file))));
    }
    let sums: Vec<&str> =
        packages.iter().filter_map(|package| package["checksums"][0]["checksumValue"].as_str()).collect();
    let day = Invocation::new("git", &["log", "-1", "--date=format-local:%Y-%m-%dT%H:%M:%SZ", "--format=%cd"]);
    let created = day.env("TZ", "UTC").answer_in(gate).ok_or("no commit to take the date from")?;
    Ok(json!({
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": format!("{name} {}", env!("CARGO_PKG_VERSION")),
        "documentNamespace": format!("https://spdx.org/spdxdocs/edo-smc-{name}-{}", sums[0]),
        "creationInfo": {"created": created, "creators": ["Tool: cargo xtask sbom"]},
        "packages": packages,
        "relationships": relations,
    }))
}

fn package(id: &str, name: &str, version: &str, license: &str, from: Option<&str>, sha256: Option<&str>) -> Value {
    let sums: Vec<Value> = sha256.iter().map(|sum| json!({"algorithm": "SHA256", "checksumValue": sum})).collect();
    json!({
        "SPDXID": id,
        "name": name,
        "versionInfo": version,
        "downloadLocation": from.unwrap_or("NOASSERTION"),
        "filesAnalyzed": false,
        "licenseConcluded": license,
        "licenseDeclared": license,
        "copyrightText": "NOASSERTION",
        "checksums": sums,
    })
}

/// Returns the packages linked into a binary of the root: direct and indirect dependencies, without macros, which run
/// in the compiler.
fn linked<'a>(metadata: &'a Value, root: &str) -> BTreeMap<String, &'a Value> {
    let (mut found, mut open) = (BTreeMap::new(), vec![root.to_string()]);
    let all = |value: &'a Value| value.as_array().map_or(&[][..], Vec::as_slice);
    while let Some(id) = open.pop() {
        let Some(package) = all(&metadata["packages"]).iter().find(|package| package["id"] == *id) else { continue };
        let is_macro = all(&package["targets"]).iter().any(|target| target["kind"] == json!(["proc-macro"]));
        if is_macro || found.insert(id.clone(), package).is_some() {
            continue;
        }
        let nodes = all(&metadata["resolve"]["nodes"]).iter().filter(|node| node["id"] == *id);
        for dependency in nodes.flat_map(|node| all(&node["deps"])) {
            if all(&dependency["dep_kinds"]).iter().any(|kind| kind["kind"].is_null()) {
                open.extend(dependency["pkg"].as_str().map(str::to_string));
            }
        }
    }
    found
}

/// Returns the SHA-256 of each name and version in a lock file.
fn checksums(lock: &str) -> BTreeMap<(String, String), String> {
    let value = |of: &str, key: &str| {
        of.lines().find_map(|line| Some(line.strip_prefix(key)?.strip_prefix(" = \"")?.strip_suffix('"')?.to_string()))
    };
    let sums = lock
        .split("[[package]]")
        .filter_map(|of| Some(((value(of, "name")?, value(of, "version")?), value(of, "checksum")?)));
    sums.collect()
}

/// Returns a valid SPDX element identifier.
fn identifier(of: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    format!("SPDXRef-{}", of.chars().map(plain).collect::<String>())
}

fn crate_id(package: &Value) -> String {
    identifier(&["name", "version"].map(|key| package[key].as_str().unwrap_or_default()).join("-"))
}

fn packages(bill: &Value) -> usize {
    bill["packages"].as_array().map_or(0, Vec::len)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linked_is_what_is_needed_at_run_time_and_no_macro() {
        let package = |id: &str, kind: &str| json!({"id": id, "targets": [{"kind": [kind]}]});
        let needs = |id: &str, kind: Value| json!({"pkg": id, "dep_kinds": [{"kind": kind}]});
        let metadata = json!({
            "packages": [package("root", "bin"), package("a", "lib"), package("m", "proc-macro"), package("b", "lib")],
            "resolve": {"nodes": [
                {"id": "root", "deps": [needs("a", Value::Null), needs("b", json!("build"))]},
                {"id": "a", "deps": [needs("m", Value::Null), needs("root", Value::Null)]},
            ]},
        });
        assert!(linked(&metadata, "root").keys().eq(["a", "root"]));
    }

    #[test]
    fn a_lock_file_has_checksums_of_what_is_loaded() {
        let lock =
            "[[package]]\nname = \"a\"\nversion = \"1.0.0\"\nchecksum = \"12\"\n\n[[package]]\nname = \"ours\"\n";
        assert_eq!(checksums(lock), BTreeMap::from([(("a".into(), "1.0.0".into()), "12".into())]));
    }
}
