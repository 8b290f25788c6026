//! Writer of a minimal ELF file, for the tests and for `cargo xtask attack`.

/// A function in a section: name, section number from 1, offset in the section, size.
pub(crate) type Symbol<'a> = (&'a str, u16, u32, u32);

/// Returns a linked ELF file for ARM with these code sections (address and halfwords) and these functions.
pub(crate) fn elf(sections: &[(u32, &[u16])], symbols: &[Symbol<'_>]) -> Vec<u8> {
    let half = |value: u16| value.to_le_bytes().to_vec();
    let word = |value: u32| value.to_le_bytes().to_vec();
    let mut strings = vec![0];
    let mut table = vec![0; 16];
    for &(name, section, offset, size) in symbols {
        let value = sections[usize::from(section) - 1].0.wrapping_add(offset) | 1;
        table.extend([strings.len() as u32, value, size].map(word).concat());
        // A global function.
        table.extend([0x12, 0].iter().chain(&half(section)));
        strings.extend(name.bytes().chain([0]));
    }
    let code = sections.iter().map(|(_, code)| code.iter().flat_map(|one| one.to_le_bytes()).collect());
    let contents: Vec<Vec<u8>> = code.chain([table, strings, b"\0code\0symtab\0strtab\0".to_vec()]).collect();
    let strtab = sections.len() as u32 + 2;
    let mut body = Vec::new();
    // Name, type, flags, address, offset, size, link, info, alignment, size of an entry.
    let mut headers = vec![0; 40];
    for (at, content) in contents.iter().enumerate() {
        body.resize(body.len().next_multiple_of(4), 0);
        let (offset, size) = (52 + body.len() as u32, content.len() as u32);
        let header = match at.checked_sub(sections.len()) {
            None => [1, 1, 6, sections[at].0, offset, size, 0, 0, 4, 0],
            Some(0) => [6, 2, 0, 0, offset, size, strtab, 1, 4, 16],
            Some(_) => [13, 3, 0, 0, offset, size, 0, 0, 1, 0],
        };
        headers.extend(header.map(word).concat());
        body.extend(content);
    }
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    // Executable, ARM, version 1; entry, no segments, sections at the end, flags.
    file.extend([half(2), half(40), word(1), word(0), word(0), word(52 + body.len() as u32), word(0)].concat());
    file.extend([52, 0, 0, 40, contents.len() as u16 + 1, strtab as u16 + 1].map(half).concat());
    file.extend(body);
    file.extend(headers);
    file
}
