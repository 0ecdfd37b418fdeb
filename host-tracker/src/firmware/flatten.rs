//! What a compiler wrote, as the bytes that flash holds.
//!
//! ```text
//!   ELF: segments with their places in flash ─▶ in their order, gaps as erased flash ─▶ bytes
//!   no ELF                                   ─▶ the bytes as they are
//! ```
//!
//! Source: System V ABI, chapter 5 (program headers: `p_paddr`, `p_filesz`).

use object::Endianness;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

/// Most bytes between two segments: more is another memory, and not of one image.
const GAP_MAX: u32 = 64 * 1024;

/// The bytes of an image.
///
/// # Errors
/// A text: an ELF that is damaged, or spread over several memories.
pub fn flatten(file: Vec<u8>) -> Result<Vec<u8>, String> {
    if !file.starts_with(b"\x7fELF") {
        return Ok(file);
    }
    let data = file.as_slice();
    let damaged = |error| format!("the ELF cannot be read: {error}");
    let header = FileHeader32::<Endianness>::parse(data).map_err(damaged)?;
    let endian = header.endian().map_err(damaged)?;
    let mut segments = Vec::new();
    for segment in header.program_headers(endian, data).map_err(damaged)? {
        let bytes = segment.data(endian, data).map_err(|()| "the ELF is cut off".to_owned())?;
        if segment.p_type(endian) == PT_LOAD && !bytes.is_empty() {
            segments.push((segment.p_paddr(endian), bytes));
        }
    }
    segments.sort_by_key(|(at, _)| *at);
    let mut image = Vec::new();
    let begin = segments.first().map_or(0, |(at, _)| *at);
    for (at, bytes) in segments {
        let offset = (at - begin) as usize;
        if offset < image.len() || offset - image.len() > GAP_MAX as usize {
            return Err(format!("the ELF's segment at {at:#010x} is not of one image with the others"));
        }
        image.resize(offset, 0xff);
        image.extend_from_slice(bytes);
    }
    if image.is_empty() { Err("the ELF has nothing to load".into()) } else { Ok(image) }
}
