//! A linked firmware: its code, where data lies in it, the names of its functions and variables, and who compiled it.
//!
//! Mapping symbols of the ARM ELF supplement part code (`$t`) from data (`$d`: literal pools, branch tables).

use std::collections::BTreeMap;

use object::elf::{SHF_EXECINSTR, STT_FUNC, STT_OBJECT};
use object::{Architecture, Object, ObjectKind, ObjectSection, ObjectSymbol, SectionFlags, SymbolFlags};

/// How many names a message offers.
const OFFERED: usize = 3;

/// A function by its symbols.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Names as linked; several where the linker merged functions.
    pub symbols: Vec<String>,
    /// Names as written, in the same order.
    pub names: Vec<String>,
    /// First address.
    pub start: u32,
    /// Address behind its last byte, literal pools included.
    pub end: u32,
}

impl Function {
    /// The name to show.
    pub fn name(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }
}

/// A variable or a constant by its symbol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Data {
    /// Name as linked.
    pub symbol: String,
    /// Name as written.
    pub name: String,
    /// Bytes.
    pub size: u32,
}

/// Code and symbols of an ELF file.
#[derive(Debug, Default)]
pub struct Image {
    /// Executable sections: address and bytes.
    sections: Vec<(u32, Vec<u8>)>,
    /// Where code and data begin: `true` is code.
    marks: BTreeMap<u32, bool>,
    functions: BTreeMap<u32, Function>,
    data: Vec<Data>,
    /// What the tools that made it say of themselves, section `.comment`.
    tools: Vec<String>,
    elf: Vec<u8>,
}

impl Image {
    /// Reads a linked ELF file for an ARM core.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let file = object::File::parse(bytes).map_err(|error| format!("not an ELF file: {error}"))?;
        if file.architecture() != Architecture::Arm {
            return Err(format!("a file for {:?}, not for ARM", file.architecture()));
        }
        if file.kind() != ObjectKind::Executable {
            return Err("not linked: calls have no target yet, give the executable".to_owned());
        }
        let mut image = Self { elf: bytes.to_vec(), ..Self::default() };
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(SHF_EXECINSTR) != 0 {
                let data = section.data().map_err(|error| format!("a section cannot be read: {error}"))?;
                image.sections.push((section.address() as u32, data.to_vec()));
            }
        }
        if let Some(Ok(comment)) = file.section_by_name(".comment").map(|section| section.data()) {
            let texts = comment.split(|&byte| byte == 0).filter(|text| !text.is_empty());
            image.tools = texts.map(|text| String::from_utf8_lossy(text).into_owned()).collect();
        }
        for symbol in file.symbols() {
            let Ok(name) = symbol.name() else { continue };
            let SymbolFlags::Elf { st_info, .. } = symbol.flags() else { continue };
            let address = symbol.address() as u32;
            match name.split('.').next() {
                Some("$t") => {
                    image.marks.insert(address, true);
                }
                Some("$d" | "$a") => {
                    image.marks.entry(address).or_insert(false);
                }
                _ if st_info & 0xf == STT_FUNC && image.bytes(address & !1).is_some() => {
                    image.add_function(name, address & !1, symbol.size() as u32);
                }
                _ if st_info & 0xf == STT_OBJECT => image.add_data(name, symbol.size() as u32),
                _ => {}
            }
        }
        image.close_functions();
        Ok(image)
    }

    /// Adds a function; one without a size ends where the next begins.
    fn add_function(&mut self, symbol: &str, start: u32, size: u32) {
        let name = format!("{:#}", rustc_demangle::demangle(symbol));
        let fresh = Function { symbols: Vec::new(), names: Vec::new(), start, end: start };
        let function = self.functions.entry(start).or_insert(fresh);
        function.symbols.push(symbol.to_owned());
        function.names.push(name);
        function.end = function.end.max(start.saturating_add(size));
    }

    fn add_data(&mut self, symbol: &str, size: u32) {
        let name = format!("{:#}", rustc_demangle::demangle(symbol));
        self.data.push(Data { symbol: symbol.to_owned(), name, size });
    }

    fn close_functions(&mut self) {
        let starts: Vec<u32> = self.functions.keys().copied().collect();
        for (at, start) in starts.iter().enumerate() {
            let Some(function) = self.functions.get_mut(start) else { continue };
            if function.end == *start {
                let section =
                    self.sections.iter().find(|(base, data)| (*base..base + data.len() as u32).contains(start));
                let last = section.map_or(*start, |(base, data)| base + data.len() as u32);
                function.end = starts.get(at + 1).map_or(last, |next| (*next).min(last));
            }
        }
    }

    /// The file it was read from.
    pub fn elf(&self) -> &[u8] {
        &self.elf
    }

    /// Code from an address to the end of its section.
    pub fn bytes(&self, address: u32) -> Option<&[u8]> {
        self.sections
            .iter()
            .find_map(|(base, data)| data.get(address.checked_sub(*base)? as usize..))
            .filter(|bytes| !bytes.is_empty())
    }

    /// Is this an address of data among code?
    pub fn is_data(&self, address: u32) -> bool {
        self.marks.range(..=address).next_back().is_some_and(|(_, &code)| !code)
    }

    /// The function that begins there.
    pub fn function_at(&self, start: u32) -> Option<&Function> {
        self.functions.get(&start)
    }

    /// `NAME+0x..` of an address, or the address alone.
    pub fn place(&self, address: u32) -> String {
        match self.functions.range(..=address).next_back() {
            Some((start, function)) if address < function.end => {
                format!("{address:#010x} ({}+{:#x})", function.name(), address - start)
            }
            _ => format!("{address:#010x}"),
        }
    }

    /// A function by its full name, mangled or not, or by a part that no other has.
    ///
    /// # Errors
    /// What there is instead.
    pub fn find(&self, wanted: &str) -> Result<&Function, String> {
        let names = |one: &Function| one.names.iter().chain(&one.symbols).cloned().collect();
        find("function", wanted, &self.functions.values().map(|one| (one, names(one))).collect::<Vec<_>>())
    }

    /// A variable or a constant, by its name as a function by its own.
    ///
    /// # Errors
    /// What there is instead.
    pub fn find_data(&self, wanted: &str) -> Result<&Data, String> {
        let names = |one: &Data| vec![one.name.clone(), one.symbol.clone()];
        find("variable or constant", wanted, &self.data.iter().map(|one| (one, names(one))).collect::<Vec<_>>())
    }

    /// Its compilers, `rustc 1.96.0 (..)`: what the tools that made it say of themselves, without the word "version".
    pub fn compilers(&self) -> Vec<String> {
        let of_linker = |text: &&String| text.starts_with("Linker: ");
        self.tools.iter().filter(|text| !of_linker(text)).map(|text| text.replacen(" version ", " ", 1)).collect()
    }

    /// `0x08000123`, or `SYMBOL`, or `SYMBOL+0x12`.
    ///
    /// # Errors
    /// Why it is no place.
    pub fn parse_place(&self, text: &str) -> Result<u32, String> {
        let number = |text: &str| match text.strip_prefix("0x") {
            Some(hex) => u32::from_str_radix(hex, 16).ok(),
            None => text.parse().ok(),
        };
        if let Some(address) = number(text) {
            return Ok(address);
        }
        let (symbol, offset) = match text.rsplit_once('+') {
            Some((symbol, offset)) => (symbol, number(offset).ok_or_else(|| format!("{offset:?} is no offset"))?),
            None => (text, 0),
        };
        let start = self.find(symbol)?.start;
        start.checked_add(offset).ok_or_else(|| format!("{text} lies behind all addresses"))
    }
}

/// The one of `all`, each with its names, that is called `wanted`.
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
            Err(format!("no {kind} {wanted:?} in it; nearest: {}", offered(&near)))
        }
        several => {
            let more = if several.len() > OFFERED { ", .." } else { "" };
            Err(format!("{wanted:?} is a part of {} names: {}{more}", several.len(), offered(several)))
        }
    }
}

#[cfg(test)]
impl Image {
    /// Functions of given machine code one behind the other from 0x0800_0000 on.
    pub(super) fn of(functions: &[(&str, &[u16])]) -> Self {
        let mut image = Self::default();
        let mut code = Vec::new();
        for (name, halfwords) in functions {
            let start = 0x0800_0000 + code.len() as u32;
            code.extend(halfwords.iter().flat_map(|half| half.to_le_bytes()));
            image.add_function(name, start, 2 * halfwords.len() as u32);
        }
        image.sections.push((0x0800_0000, code));
        image
    }

    /// And a variable of so many bytes.
    pub(super) fn with_variable(mut self, name: &str, size: u32) -> Self {
        self.add_data(name, size);
        self
    }

    /// Made by this tool.
    pub(super) fn made_by(mut self, tool: &str) -> Self {
        self.tools.push(tool.to_owned());
        self
    }

    /// From `address` on there is data.
    pub(super) fn with_data(mut self, address: u32) -> Self {
        self.marks.insert(address, false);
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
