//! Malformed ELF files against `cycle-bound`: a linked file and files written here. Their code consists of branch
//! instructions and random halfwords. Sections overlap, symbols are wrong, and bytes and words are exchanged. Every
//! query must end with a result or a reason.

use cycle_bound::image::Image;
use cycle_bound::{Answer, Options};
use integration_tests::strategy::{Rng, Trial};
use std::fmt::Write;
use std::time::{Duration, Instant};

#[path = "../../cycle-bound/src/tests/elf.rs"]
mod elf;

/// Time limit to read a file and analyse one function. The usual time is below a millisecond.
const READS: Duration = Duration::from_secs(5);
const SLEW: &[u8] = include_bytes!("../../cycle-bound/tests/slew.elf");
const NAMES: [&str; 6] = ["f", "leaf", "_ZN4core9panicking5panic17h0123456789abcdefE", "$t", "$d", "__aeabi_dadd"];

pub(super) fn run(_: u64, trial: &mut Trial) -> Result<(), String> {
    let rng = &mut trial.rng;
    let (mut file, symbols) = if rng.chance(0.1) { (SLEW.to_vec(), vec!["slew"]) } else { written(rng) };
    for _ in 0..*rng.one_of(&[0, 0, 1, 1, 2, 3, 6]) {
        spoil(&mut file, rng);
    }
    trial.tell(|| {
        file.iter().fold(String::new(), |mut hex, byte| {
            // Writing to a String cannot fail.
            let _ = write!(hex, "{byte:02x}");
            hex
        })
    });
    trial.done += 1;
    let began = Instant::now();
    let image = match Image::read(&file) {
        Ok(image) => image,
        Err(reason) => {
            trial.tell(|| format!("refused: {reason}"));
            return in_time(began);
        }
    };
    for symbol in symbols {
        let rng = &mut trial.rng;
        let loops = (0..rng.integer(0, 3))
            .map(|_| format!("{symbol}+{}={}", 2 * rng.integer(0, 20), rng.bits() >> rng.integer(0, 63)))
            .collect();
        let options = Options { symbol: Some(symbol.into()), loops, lines: rng.chance(0.2), ..Options::default() };
        trial.tell(|| format!("{options:?}"));
        let rng = &mut trial.rng;
        let Ok(mut answer) = Answer::of(&image, &options) else { continue };
        let starts: Vec<u32> = answer.ranges().iter().map(|(start, _)| *start).collect();
        if !starts.is_empty() {
            let executed: Vec<u32> = (0..rng.integer(0, 40))
                .map(|_| rng.one_of(&starts).wrapping_add(2 * rng.integer(0, 8) as u32))
                .collect();
            answer.price(&executed, options.lines.then_some(&image));
        }
        let report = &answer.report;
        trial.tell(|| format!("bound {:?}, declined {:?}", report.bound(), report.declined));
        if report.to_string().is_empty() || serde_json::to_string(report).is_err() {
            return Err(format!("{symbol}: nothing is reported"));
        }
        let least = report.shortest.as_ref().and_then(|path| path.cycles);
        if let (Some(least), Some(bound)) = (least, report.bound())
            && least > bound
        {
            return Err(format!("{symbol}: at least {least} cycles, at most {bound}"));
        }
        in_time(began)?;
    }
    Ok(())
}

fn in_time(began: Instant) -> Result<(), String> {
    if began.elapsed() > READS { Err(format!("it took {:?}", began.elapsed())) } else { Ok(()) }
}

/// Returns a file of one to three code sections full of functions, and the names to analyse.
fn written(rng: &mut Rng) -> (Vec<u8>, Vec<&'static str>) {
    let codes: Vec<Vec<u16>> = (0..rng.integer(1, 3)).map(|_| code(rng)).collect();
    let mut base: u32 = 0x0800_0000;
    let sections: Vec<(u32, &[u16])> = codes
        .iter()
        .map(|code| {
            let at = base;
            // Position after the previous section, equal to it, overlapping it, or at the end of the address space.
            let length = 2 * code.len() as u32;
            let behind = [base.wrapping_add(length), base, base.wrapping_add(length / 2), 0xffff_ff80];
            base = *rng.one_of(&behind) & !1;
            (at, &code[..])
        })
        .collect();
    let symbols: Vec<elf::Symbol<'_>> = NAMES[..rng.integer(1, NAMES.len())]
        .iter()
        .map(|&name| {
            let section = rng.integer(1, sections.len());
            let length = 2 * sections[section - 1].1.len();
            let at = 2 * rng.integer(0, length / 2 - 1);
            let size = if rng.chance(0.9) { rng.integer(0, length - at) } else { rng.bits() as u32 as usize };
            (name, section as u16, if rng.chance(0.3) { 0 } else { at as u32 }, size as u32)
        })
        .collect();
    let names = symbols.iter().map(|symbol| symbol.0).collect();
    (elf::elf(&sections, &symbols), names)
}

/// Returns code of branches, arithmetic and random halfwords.
fn code(rng: &mut Rng) -> Vec<u16> {
    let mut code = Vec::new();
    for _ in 0..rng.integer(1, 60) {
        let near = rng.integer(0, 15) as u16;
        match rng.integer(0, 15) {
            // cmp r0, #; b<cond>, forwards or back
            0 | 1 => code.extend([0x2800 | near, 0xd000 | (rng.integer(0, 13) as u16) << 8 | near]),
            2 => code.push(0xd100 | (0xff - near)),
            // b, forwards or back
            3 => code.push(0xe000 | near),
            4 => code.push(0xe7ff - near),
            // bl, b.w
            5 => code.extend([0xf000, 0xf800 | near]),
            6 => code.extend([0xf7ff, 0xb800 | rng.bits() as u16 & 0x7ff]),
            // cbz; it
            7 => code.extend([0xb100 | near << 3, 0xbf00 | rng.bits() as u16 & 0xff]),
            // tbb, tbh with a table
            8 => {
                code.extend([0x2800 | near & 3, 0xd800 | near, 0xe8df, 0xf000 | near & 0x10]);
                code.extend((0..near & 3).map(|_| rng.integer(0, 20) as u16 * 0x0101));
            }
            // push {r4, lr}, pop {r4, pc}, bx lr, udf, sub sp
            9 => code.push(*rng.one_of(&[0xb510, 0xbd10, 0x4770, 0xde00, 0xb082, 0xb002, 0x4798, 0x4687])),
            // vadd, vdiv, vldr, vmla
            10 | 11 => {
                code.extend(rng.one_of(&[[0xee30, 0x0a20], [0xee80, 0x0a20], [0xed90, 0x0a00], [0xee00, 0x0a81]]));
            }
            12 | 13 => code.push(rng.integer(0, 0xb000) as u16),
            _ => code.push(rng.bits() as u16),
        }
    }
    if rng.chance(0.7) {
        code.push(0x4770);
    }
    code
}

/// Damages one byte, a word, a range or the end of a file.
fn spoil(file: &mut Vec<u8>, rng: &mut Rng) {
    if file.len() < 4 {
        return;
    }
    let at = rng.integer(0, file.len() - 4);
    match rng.integer(0, 9) {
        0..=3 => file[at] = rng.bits() as u8,
        4 | 5 => {
            let edge = *rng.one_of(&[0, 1, 0xff, 0x7fff_ffff, 0x8000_0000, 0xffff_fff0, u32::MAX]);
            file[at & !3..][..4].copy_from_slice(&edge.to_le_bytes());
        }
        6 => file[at..at + 4].fill(*rng.one_of(&[0, 0x7f, 0xff])),
        7 => {
            let from = rng.integer(0, file.len() - 4);
            let word: [u8; 4] = std::array::from_fn(|k| file[from + k]);
            file[at..at + 4].copy_from_slice(&word);
        }
        8 => {
            let bit = rng.integer(0, 7);
            file[at] ^= 1 << bit;
        }
        _ => file.truncate(at),
    }
}
