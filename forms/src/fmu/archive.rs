//! Zip archive with stored entries and fixed times: equal files give equal bytes.

/// Earliest date of the format, 1980-01-01, with the time 0:00 before it.
const DATE: [u8; 4] = [0, 0, 0x21, 0];

/// Returns the archive with these entries. Names are ASCII, and all sizes are below 4 GiB.
pub(super) fn zip(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in entries {
        let offset = out.len() as u32;
        // Version 2.0, no flag, method 0: stored.
        let mut about = vec![20, 0, 0, 0, 0, 0];
        about.extend(DATE);
        about.extend(pil_wire::checksum(bytes).to_le_bytes());
        about.extend([bytes.len() as u32; 2].map(u32::to_le_bytes).concat());
        about.extend((name.len() as u16).to_le_bytes());
        about.extend([0; 2]);
        out.extend(b"PK\x03\x04");
        out.extend(&about);
        out.extend(name.bytes());
        out.extend(*bytes);
        // Made by version 2.0 on a system without permissions.
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&about);
        // No comment, disk 0, no attributes.
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.bytes());
    }
    let (count, offset) = ((entries.len() as u16).to_le_bytes(), out.len() as u32);
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend(count);
    out.extend(count);
    out.extend((directory.len() as u32).to_le_bytes());
    out.extend(offset.to_le_bytes());
    out.extend([0; 2]);
    out
}
