//! A linked firmware (ELF): code, data within the code, symbols, and the compilers that produced it.
//!
//! The mapping symbols of the ARM ELF supplement separate code (`$t`) from data (`$d`: literal pools, branch tables).

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use object::elf::{SHF_ALLOC, SHF_EXECINSTR, SHF_WRITE, STT_FUNC, STT_OBJECT};
use object::{Architecture, Object, ObjectKind, ObjectSection, ObjectSymbol, SectionFlags, SymbolFlags, SymbolSection};

/// Number of suggested names in a message.
const OFFERED: usize = 3;

/// A function of the symbol table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Linker names; several where the linker merged functions.
    pub symbols: Vec<String>,
    /// Source (demangled) names, in the order of `symbols`.
    pub names: Vec<String>,
    /// First address of the function.
    pub start: u32,
    /// Address behind the last byte, literal pools included.
    pub end: u32,
}

impl Function {
    /// Returns the name for display.
    pub fn name(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }
}

/// A variable or a constant of the symbol table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Data {
    /// Linker name of the variable.
    pub symbol: String,
    /// Source (demangled) name of the variable.
    pub name: String,
    /// Size in bytes.
    pub size: u32,
}

/// A section with code.
#[derive(Clone, Debug, Default)]
struct Section {
    base: u32,
    bytes: Vec<u8>,
    /// Boundaries of code and data; `true` begins code.
    marks: BTreeMap<u32, bool>,
    functions: BTreeMap<u32, Function>,
}

impl Section {
    /// Returns the end address. Reading the file has checked that it does not overflow.
    fn end(&self) -> u32 {
        self.base + self.bytes.len() as u32
    }

    fn holds(&self, address: u32) -> bool {
        (self.base..self.end()).contains(&address)
    }

    /// Adds a function. A function without a size ends where the next one begins.
    fn add_function(&mut self, symbol: &str, start: u32, size: u32) -> Result<(), String> {
        let name = format!("{:#}", rustc_demangle::demangle(symbol));
        let end = start.checked_add(size).filter(|end| *end <= self.end()).ok_or_else(|| {
            format!("`{name}` has {size} bytes from {start:#010x} on, but its section ends at {:#010x}", self.end())
        })?;
        let fresh = Function { symbols: Vec::new(), names: Vec::new(), start, end };
        let function = self.functions.entry(start).or_insert(fresh);
        function.symbols.push(symbol.to_owned());
        function.names.push(name);
        function.end = function.end.max(end);
        Ok(())
    }

    fn close_functions(&mut self) {
        let mut next = self.end();
        for (start, function) in self.functions.iter_mut().rev() {
            if function.end == *start {
                function.end = next;
            }
            next = *start;
        }
    }
}

/// Code and symbols of an ELF file.
#[derive(Clone, Debug, Default)]
pub struct Image {
    sections: Vec<Section>,
    /// Address ranges with several sections, of which one at a time is loaded: overlays.
    overlaid: Vec<Range<u32>>,
    data: Vec<Data>,
    /// Loaded read-only sections: address and bytes.
    constants: Vec<(u32, Vec<u8>)>,
    /// Names of the tools that built the file, section `.comment`.
    tools: Vec<String>,
    elf: Vec<u8>,
}

impl Image {
    /// Reads a linked ELF file for an ARM core.
    ///
    /// # Errors
    /// The reason why the file is invalid.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let file = object::File::parse(bytes).map_err(|error| format!("not an ELF file: {error}"))?;
        if file.architecture() != Architecture::Arm || file.is_64() {
            return Err(format!("a file for {:?}, not for ARM (32 bits)", file.architecture()));
        }
        if file.kind() != ObjectKind::Executable {
            return Err("not linked: calls have no target. Use the linked executable".to_owned());
        }
        let mut image = Self { elf: bytes.to_vec(), ..Self::default() };
        // Section numbers, as symbols use them.
        let mut numbers: BTreeMap<usize, usize> = BTreeMap::new();
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(SHF_EXECINSTR) == 0 {
                if sh_flags & u64::from(SHF_ALLOC | SHF_WRITE) == u64::from(SHF_ALLOC)
                    && let Ok(bytes) = section.data()
                {
                    image.constants.push((section.address() as u32, bytes.to_vec()));
                }
                continue;
            }
            let bytes = section.data().map_err(|error| format!("a section cannot be read: {error}"))?;
            let base = section.address() as u32;
            if u32::try_from(bytes.len()).ok().and_then(|length| base.checked_add(length)).is_none() {
                return Err(format!(
                    "a section of {} bytes at {base:#010x} ends beyond the address space",
                    bytes.len()
                ));
            }
            if !bytes.is_empty() {
                numbers.insert(section.index().0, image.sections.len());
                image.sections.push(Section { base, bytes: bytes.to_vec(), ..Section::default() });
            }
        }
        image.find_overlays();
        if let Some(Ok(comment)) = file.section_by_name(".comment").map(|section| section.data()) {
            let texts = comment.split(|&byte| byte == 0).filter(|text| !text.is_empty());
            image.tools = texts.map(|text| String::from_utf8_lossy(text).into_owned()).collect();
        }
        for symbol in file.symbols() {
            let Ok(name) = symbol.name() else { continue };
            let SymbolFlags::Elf { st_info, .. } = symbol.flags() else { continue };
            let kind = st_info & 0xf;
            if kind == STT_OBJECT {
                image.add_data(name, symbol.size() as u32);
                continue;
            }
            // The lowest bit of a function address marks Thumb code.
            let address = symbol.address() as u32 & !u32::from(kind == STT_FUNC);
            let number = match symbol.section() {
                SymbolSection::Section(index) => numbers.get(&index.0).copied(),
                // An absolute symbol of the linker script: assigned to the section at its address, if only one lies
                // there.
                SymbolSection::Absolute if !image.is_overlaid(address) => {
                    image.sections.iter().position(|section| section.holds(address))
                }
                _ => None,
            };
            let Some(section) = number.map(|number| &mut image.sections[number]) else { continue };
            match name.split('.').next() {
                Some("$t") => {
                    section.marks.insert(address, true);
                }
                Some("$d" | "$a") => {
                    section.marks.entry(address).or_insert(false);
                }
                _ if kind == STT_FUNC && section.holds(address) => {
                    section.add_function(name, address, symbol.size() as u32)?;
                }
                _ => {}
            }
        }
        image.sections.iter_mut().for_each(Section::close_functions);
        Ok(image)
    }

    fn find_overlays(&mut self) {
        let mut ranges: Vec<Range<u32>> = self.sections.iter().map(|section| section.base..section.end()).collect();
        ranges.sort_by_key(|range| range.start);
        // Overlapping sections, merged to one range.
        let mut merged: Vec<(Range<u32>, usize)> = Vec::new();
        for range in ranges {
            match merged.last_mut() {
                Some((before, sections)) if range.start < before.end => {
                    before.end = before.end.max(range.end);
                    *sections += 1;
                }
                _ => merged.push((range, 1)),
            }
        }
        self.overlaid = merged.into_iter().filter(|(_, sections)| *sections > 1).map(|(range, _)| range).collect();
    }

    /// Returns the firmware as it is while this function runs: overlapping sections other than its own are removed.
    pub(crate) fn while_runs(&self, function: &Function) -> Cow<'_, Self> {
        if self.overlaid.is_empty() {
            return Cow::Borrowed(self);
        }
        let of_section = |section: &Section| section.functions.get(&function.start).map(std::ptr::from_ref);
        let is_own = |section: &&Section| of_section(section) == Some(std::ptr::from_ref(function));
        let loaded = |section: &&Section| is_own(section) || !self.is_overlaid(section.base);
        Cow::Owned(Self { sections: self.sections.iter().filter(loaded).cloned().collect(), ..self.clone() })
    }

    /// Returns whether `address` lies in a range of overlapping sections.
    pub(crate) fn is_overlaid(&self, address: u32) -> bool {
        self.overlaid.iter().any(|range| range.contains(&address))
    }

    fn add_data(&mut self, symbol: &str, size: u32) {
        let name = format!("{:#}", rustc_demangle::demangle(symbol));
        self.data.push(Data { symbol: symbol.to_owned(), name, size });
    }

    /// Returns the bytes of the ELF file.
    pub fn elf(&self) -> &[u8] {
        &self.elf
    }

    fn section(&self, address: u32) -> Option<&Section> {
        self.sections.iter().find(|section| section.holds(address))
    }

    /// Returns the code from an address to the end of its section.
    pub fn bytes(&self, address: u32) -> Option<&[u8]> {
        self.section(address).and_then(|section| section.bytes.get((address - section.base) as usize..))
    }

    /// Returns `length` constant bytes at an address: code, or loaded data that is not writable.
    pub(crate) fn constant_bytes(&self, address: u32, length: usize) -> Option<&[u8]> {
        let within = |(base, bytes): &'_ (u32, &'_ [u8])| *base <= address && (address - base) as usize <= bytes.len();
        let code = self.sections.iter().map(|section| (section.base, &section.bytes[..]));
        let data = self.constants.iter().map(|(base, bytes)| (*base, &bytes[..]));
        code.chain(data).filter(within).find_map(|(base, bytes)| bytes.get((address - base) as usize..)?.get(..length))
    }

    /// Returns whether the address holds data among code.
    pub fn is_data(&self, address: u32) -> bool {
        let mark = |section: &Section| section.marks.range(..=address).next_back().is_some_and(|(_, &code)| !code);
        self.section(address).is_some_and(mark)
    }

    /// Returns the function that begins at an address.
    pub fn function_at(&self, start: u32) -> Option<&Function> {
        self.section(start)?.functions.get(&start)
    }

    /// Returns whether both addresses lie in one section.
    pub(crate) fn is_beside(&self, address: u32, other: u32) -> bool {
        self.section(address).is_some_and(|section| section.holds(other))
    }

    /// Returns `NAME+0x..` for an address, or the address alone.
    pub fn place(&self, address: u32) -> String {
        let before = self.section(address).and_then(|section| section.functions.range(..=address).next_back());
        match before {
            Some((start, function)) if address < function.end => {
                format!("{address:#010x} ({}+{:#x})", function.name(), address - start)
            }
            _ => format!("{address:#010x}"),
        }
    }

    /// Finds a function by its full name (mangled or not), by a unique part of a name, or by its first address.
    ///
    /// # Errors
    /// No unique match; the message has the nearest names.
    pub fn find(&self, wanted: &str) -> Result<&Function, String> {
        let functions = || self.sections.iter().flat_map(|section| section.functions.values());
        if let Some(address) = wanted.strip_prefix("0x").and_then(|hex| u32::from_str_radix(hex, 16).ok()) {
            let mut there = functions().filter(|one| one.start == address & !1);
            return match (there.next(), there.next()) {
                (Some(one), None) => Ok(one),
                (None, _) => Err(format!("no function begins at {}", self.place(address))),
                _ => Err(format!("more than one section of the file has a function at {wanted}")),
            };
        }
        let names = |one: &Function| one.names.iter().chain(&one.symbols).cloned().collect::<Vec<_>>();
        let alike: Vec<_> = functions().filter(|one| names(one).iter().any(|name| name == wanted)).collect();
        if let [_, _, ..] = alike[..] {
            let places: Vec<String> = alike.iter().map(|one| format!("{:#010x}", one.start)).collect();
            return Err(format!(
                "{} functions are called {wanted:?}; select one by its address: {}",
                alike.len(),
                places.join(", ")
            ));
        }
        let functions = functions();
        find("function", wanted, &functions.map(|one| (one, names(one))).collect::<Vec<_>>())
    }

    /// Finds a variable or a constant by its full name or by a unique part of it.
    ///
    /// # Errors
    /// No unique match; the message has the nearest names.
    pub fn find_data(&self, wanted: &str) -> Result<&Data, String> {
        let names = |one: &Data| vec![one.name.clone(), one.symbol.clone()];
        find("variable or constant", wanted, &self.data.iter().map(|one| (one, names(one))).collect::<Vec<_>>())
    }

    /// Returns the compilers named in the file, as `rustc 1.96.0 (..)`, without the linker and without the word
    /// "version".
    pub fn compilers(&self) -> Vec<String> {
        let of_linker = |text: &&String| text.starts_with("Linker: ");
        self.tools.iter().filter(|text| !of_linker(text)).map(|text| text.replacen(" version ", " ", 1)).collect()
    }

    /// Parses a place in the code: `0x08000123`, `SYMBOL`, or `SYMBOL+0x12`.
    ///
    /// # Errors
    /// The reason why the text is not a place.
    pub fn parse_place(&self, text: &str) -> Result<u32, String> {
        let number = |text: &str| match text.strip_prefix("0x") {
            Some(hex) => u32::from_str_radix(hex, 16).ok(),
            None => text.parse().ok(),
        };
        if let Some(address) = number(text) {
            return Ok(address);
        }
        let (symbol, offset) = match text.rsplit_once('+') {
            Some((symbol, offset)) => (symbol, number(offset).ok_or_else(|| format!("{offset:?} is not an offset"))?),
            None => (text, 0),
        };
        let start = self.find(symbol)?.start;
        start.checked_add(offset).ok_or_else(|| format!("{text} is beyond the address space"))
    }
}

/// Finds the element of `all` that has the name `wanted`.
fn find<'a, T>(kind: &str, wanted: &str, all: &[(&'a T, Vec<String>)]) -> Result<&'a T, String> {
    let distance = |name: &str| {
        let last = name.rsplit("::").next().unwrap_or(name);
        strsim::damerau_levenshtein(name, wanted).min(strsim::damerau_levenshtein(last, wanted))
    };
    let exact = |(_, names): &&(&T, Vec<String>)| names.iter().any(|name| name == wanted);
    let part = |(_, names): &&(&T, Vec<String>)| !wanted.is_empty() && names.iter().any(|name| name.contains(wanted));
    let mut found: Vec<_> = all.iter().filter(exact).collect();
    if found.is_empty() {
        found = all.iter().filter(part).collect();
    }
    let offered = |some: &[&(&T, Vec<String>)]| -> String {
        let names = some.iter().take(OFFERED).filter_map(|(_, names)| names.first().map(String::as_str));
        names.collect::<Vec<_>>().join(", ")
    };
    match found.as_slice() {
        [(one, _)] => Ok(one),
        [] => {
            let mut near: Vec<_> = all.iter().collect();
            near.sort_by_key(|(_, names)| names.iter().map(|name| distance(name)).min());
            Err(format!("no {kind} {wanted:?}; nearest: {}", offered(&near)))
        }
        several => {
            let more = if several.len() > OFFERED { ", .." } else { "" };
            Err(format!("{wanted:?} matches {} names: {}{more}", several.len(), offered(several)))
        }
    }
}

#[cfg(test)]
impl Image {
    /// Builds a firmware with these functions, one behind the other from 0x0800_0000 on.
    pub(super) fn of(functions: &[(&str, &[u16])]) -> Self {
        Self::default().with_section(0x0800_0000, functions)
    }

    /// Adds a section with these functions, one behind the other from `base` on.
    pub(super) fn with_section(mut self, base: u32, functions: &[(&str, &[u16])]) -> Self {
        let code = functions.iter().flat_map(|(_, halfwords)| halfwords.iter().flat_map(|half| half.to_le_bytes()));
        let mut section = Section { base, bytes: code.collect(), ..Section::default() };
        let mut start = base;
        for (name, halfwords) in functions {
            section.add_function(name, start, 2 * halfwords.len() as u32).expect("within the section");
            start += 2 * halfwords.len() as u32;
        }
        self.sections.push(section);
        self.find_overlays();
        self
    }

    /// Adds a variable of `size` bytes.
    pub(super) fn with_variable(mut self, name: &str, size: u32) -> Self {
        self.add_data(name, size);
        self
    }

    /// Adds a tool to the section `.comment`.
    pub(super) fn made_by(mut self, tool: &str) -> Self {
        self.tools.push(tool.to_owned());
        self
    }

    /// Marks data from `address` on.
    pub(super) fn with_data(mut self, address: u32) -> Self {
        let section = self.sections.iter_mut().find(|section| section.holds(address)).expect("a section");
        section.marks.insert(address, false);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_is_found_by_a_part_of_its_name_that_no_other_has() {
        let image = Image::of(&[("tick_of_order_2", &[0x4770]), ("tick_of_order_3", &[0x4770])]);
        assert_eq!(image.find("order_3").map(|f| f.start), Ok(0x0800_0002));
        assert_eq!(image.find("tick_of_order_2").map(|f| f.start), Ok(0x0800_0000));
        assert_eq!(image.parse_place("order_3+0x4"), Ok(0x0800_0006));
        assert_eq!(image.parse_place("0x08000002"), Ok(0x0800_0002));
        assert_eq!(image.place(0x0800_0003), "0x08000003 (tick_of_order_3+0x1)");
        let several = image.find("tick").expect_err("two");
        assert!(several.contains("2 names: tick_of_order_2, tick_of_order_3"), "{several}");
        let none = image.find("tick_of_ordre_3").expect_err("a slip");
        assert!(none.contains("nearest: tick_of_order_3"), "{none}");
        assert!(image.parse_place("order_3+zero").is_err());
    }

    #[test]
    fn a_mark_holds_up_to_the_next_one() {
        let image = Image::of(&[("f", &[0x4770; 8])]).with_data(0x0800_0004);
        assert!(!image.is_data(0x0800_0002));
        assert!(image.is_data(0x0800_0004) && image.is_data(0x0800_000e));
    }

    #[test]
    fn what_is_no_firmware_is_refused() {
        assert!(Image::read(b"").is_err_and(|reason| reason.contains("ELF")));
        assert!(Image::read(&[0x7f, b'E', b'L', b'F', 1, 1, 1]).is_err());
    }
}
