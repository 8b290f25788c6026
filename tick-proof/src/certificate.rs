//! Certificate of an exported file: the statements and their verdicts, as a text file.

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

use crate::run::Row;

/// Returns the certificate of a file with this name and text, for a design with this title and fingerprint.
/// `sha256sum --check` reads the line with the digest and the name.
pub fn text([file, exported]: [&str; 2], (title, fingerprint): (&str, u32), rows: &[Row], solver: &str) -> String {
    let digest = <[u8; 32]>::from(Sha256::digest(exported)).map(|byte| format!("{byte:02x}")).concat();
    let mut out = format!(
        "Certificate of tick-proof {} for a file of host-sim export --standalone, by its SHA-256:\n\n\
         {digest}  {file}\n\n\
         Of: {title}\nDesign: {fingerprint:08x}\nSolver: {solver}\n\
         Assumes: IEEE 754 binary32, round to nearest even, subnormal numbers, nothing contracted or reordered.\n\
         Shown of the operations that the file is written from (docs/verification.md says what this is not).\n\n",
        env!("CARGO_PKG_VERSION"),
    );
    let wide = rows.iter().map(|row| row.statement.chars().count()).max().unwrap_or(0);
    for row in rows {
        let _ = writeln!(out, "{:wide$}  {}", row.statement, row.verdict);
        for detail in row.details() {
            let _ = writeln!(out, "    {detail}");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use crate::run::Row;
    use crate::solver::Verdict;

    /// The digests are the examples of FIPS 180-4.
    #[test]
    fn a_certificate_has_the_digest_of_the_file_and_every_verdict() {
        let row = |statement, verdict, question: Option<&str>| Row {
            instance: "joint".into(),
            statement,
            verdict,
            question: question.map(String::from),
            asked: 1,
            seconds: 0.1,
        };
        let open = row("finite", Verdict::Undecided("no answer within 1 s".into()), Some("p2"));
        let text = super::text(
            ["abc.h", "abc"],
            ("a joint", 0x0123_abcd),
            &[row("bounded", Verdict::Proved, None), open],
            "Solver 1",
        );
        let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  abc.h";
        let design = "Design: 0123abcd";
        for line in [
            digest,
            design,
            "bounded  PROVED",
            "finite   undecided",
            "    p2: no answer within 1 s",
            "Solver: Solver 1",
        ] {
            assert!(text.lines().any(|one| one == line), "no line `{line}` in\n{text}");
        }
        let two_blocks = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq";
        let long = super::text(["long.h", two_blocks], ("", 0), &[], "");
        assert!(long.contains("248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1  long.h"), "{long}");
    }
}
