//! Images for the chip: build and size.

use object::elf::{SHF_ALLOC, SHF_WRITE};
use object::{Object, ObjectSection, SectionFlags, SectionKind};

use crate::compiler::{TARGET, build};
use crate::step::{Gate, Invocation, Outcome};

/// Manifest of the firmware, a separate workspace.
pub(crate) const MANIFEST: &str = "firmware/Cargo.toml";
const IMAGES: [&str; 5] = ["pil", "drive", "motor", "budget", "assembly"];

/// Returns the paths of the images.
pub(crate) fn files() -> Vec<String> {
    IMAGES.iter().map(|image| format!("firmware/target/{TARGET}/release/{image}")).collect()
}

/// Checks format and lints of the firmware.
pub(crate) fn lint(gate: &mut Gate) -> Outcome {
    gate.commands("format, firmware", &[Invocation::cargo(&["fmt", "--manifest-path", MANIFEST, "--check"])])?;
    // clippy belongs to the active toolchain, which may lack the chip's core library, so the host's library replaces
    // it. Only the release profile aborts on a panic, as a program without std must.
    let clippy = Invocation::cargo(&["clippy", "--release", "--manifest-path", MANIFEST, "--", "-D", "warnings"]);
    gate.commands("lints, firmware", &[clippy])
}

/// Builds the images and prints their sizes.
pub(crate) fn run(gate: &mut Gate) -> Outcome {
    images(gate, &IMAGES)
}

/// Builds the images except the last one, which compares assembly with the tick over a million ticks and belongs to the
/// deep tier. In the fast tier, tests of `tick-assembly` make this comparison for every kind of assembly.
pub(crate) fn without_assembly(gate: &mut Gate) -> Outcome {
    images(gate, &IMAGES[..4])
}

fn images(gate: &mut Gate, images: &[&str]) -> Outcome {
    let bins: Vec<&str> = images.iter().flat_map(|image| ["--bin", image]).collect();
    let build = build(&gate.root, MANIFEST)?.with(&bins);
    gate.commands(&format!("images for {TARGET}"), &[build])?;
    gate.check("sizes of the images", "cargo xtask firmware", |gate| {
        let directory = gate.root.join("firmware/target").join(TARGET).join("release");
        let mut table = vec![format!("{:<10}{:>10}{:>10}", "bytes", "flash", "RAM")];
        for image in images {
            let path = directory.join(image);
            let elf = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            let Size { flash, ram } = size(&elf).map_err(|error| format!("{}: {error}", path.display()))?;
            table.push(format!("{image:<10}{flash:>10}{ram:>10}"));
        }
        Ok(table.join("\n"))
    })
}

/// Memory use of an image, bytes.
#[derive(Debug, PartialEq, Eq)]
struct Size {
    /// Flash: code, constants, and initial values of variables.
    flash: u64,
    /// RAM: variables; the rest is stack.
    ram: u64,
}

/// Returns the size from the loaded sections. Sections with contents are in flash, writable sections are in RAM, and
/// initialised variables are in both.
fn size(elf: &[u8]) -> Result<Size, object::Error> {
    let mut size = Size { flash: 0, ram: 0 };
    for section in object::File::parse(elf)?.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        let is = |flag: u32| sh_flags & u64::from(flag) != 0;
        if is(SHF_ALLOC) && section.kind() != SectionKind::UninitializedData {
            size.flash += section.size();
        }
        if is(SHF_ALLOC) && is(SHF_WRITE) {
            size.ram += section.size();
        }
    }
    Ok(size)
}

#[cfg(test)]
mod tests {
    use object::elf::{SHT_NOBITS, SHT_PROGBITS, SHT_STRTAB};

    use super::*;

    /// Returns a 32-bit ELF file with sections of these types, flags and sizes; the last section holds their names. The
    /// contents of the sections overlap the head of the file.
    fn elf(sections: &[(u32, u32, u32)]) -> Vec<u8> {
        let half = |value: u16| value.to_le_bytes().to_vec();
        let word = |value: u32| value.to_le_bytes().to_vec();
        let mut bytes = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        // Executable, ARM, version 1; no entry, no segments; sections after this head of 52 bytes, 40 bytes each.
        bytes.extend([half(2), half(40), word(1), word(0), word(0), word(52), word(0)].concat());
        bytes.extend([52, 0, 0, 40, sections.len() as u16 + 1, sections.len() as u16].map(half).concat());
        bytes.extend([0; 40]);
        for &(kind, flags, size) in sections {
            bytes.extend([0, kind, flags, 0, 0, size, 0, 0, 1, 0].map(word).concat());
        }
        bytes
    }

    #[test]
    fn variables_with_a_first_value_count_twice_and_debug_information_not_at_all() {
        let code = (SHT_PROGBITS, SHF_ALLOC, 70);
        let data = (SHT_PROGBITS, SHF_ALLOC | SHF_WRITE, 8);
        let bss = (SHT_NOBITS, SHF_ALLOC | SHF_WRITE, 100);
        let debug = (SHT_PROGBITS, 0, 60);
        let names = (SHT_STRTAB, 0, 50);
        let size = size(&elf(&[code, data, bss, debug, names])).expect("well formed");
        assert_eq!(size, Size { flash: 78, ram: 108 });
    }

    #[test]
    fn what_is_no_image_is_refused() {
        assert!(size(b"no image").is_err());
    }
}
