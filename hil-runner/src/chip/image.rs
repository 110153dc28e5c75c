//! Images of the targets: found, built where they must be, and read.
//!
//! An image is taken from the folder that `MCU_IMAGE_DIR` names, or built from the firmware's
//! sources, see [`image`](crate::image).

use std::fs;
use std::path::{Path, PathBuf};

use firmware_link::frame::crc32_on;
use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};

use super::line::ChipError;
use super::spec::Target;
use crate::image::{Builder, ImageError, Recipe, path_in};

/// The origin of images.
#[derive(Debug, Clone)]
pub struct Finder {
    /// The folder with ready images, `<target>-<fifo|uart|cost>.elf`; nothing is
    /// built where there is one.
    pub ready: Option<PathBuf>,
    /// Builds the others.
    pub builder: Builder,
}

impl Finder {
    /// As the environment says: `MCU_IMAGE_DIR`, and what [`Builder`] reads.
    pub fn from_environment() -> Self {
        Self {
            ready: path_in("MCU_IMAGE_DIR"),
            builder: Builder::from_environment(),
        }
    }

    /// The image of a target by its name, built on the way where it is missing or
    /// stale; `tell` gets one line before that, without its line end.
    ///
    /// # Errors
    /// [`ChipError`] if there is none and it cannot be built.
    pub fn image(
        &self,
        target: Target,
        image: &str,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, ChipError> {
        match self.ready_image(target, image)? {
            Some(path) => Ok(path),
            None => Ok(self.builder.image(&recipe(target), image, tell)?),
        }
    }

    /// Looks for an image of a target, or what could build it.
    ///
    /// # Errors
    /// [`ChipError`] that says what is missing.
    pub fn available(&self, target: Target, image: &str) -> Result<(), ChipError> {
        match self.ready_image(target, image)? {
            Some(_) => Ok(()),
            None => Ok(self.builder.available(&recipe(target), image)?),
        }
    }

    fn ready_image(&self, target: Target, image: &str) -> Result<Option<PathBuf>, ChipError> {
        let Some(folder) = &self.ready else {
            return Ok(None);
        };
        let path = folder.join(format!("{}-{image}.elf", target.name()));
        if path.is_file() {
            return Ok(Some(path));
        }
        Err(ChipError(format!(
            "{} is not there; MCU_IMAGE_DIR must name a folder that has it, or be unset",
            path.display()
        )))
    }
}

impl From<ImageError> for ChipError {
    fn from(ImageError(sentence): ImageError) -> Self {
        Self(sentence)
    }
}

/// The images of a target.
fn recipe(target: Target) -> Recipe {
    Recipe {
        what: format!("image for {}", target.name()),
        triple: target.triple(),
        library: "core",
        workspace: "firmware/cortex-m",
        packages: &["images"],
        profile: "release",
        folder: "chip",
        // The firmware takes its edition and the versions of its dependencies from the
        // project's manifest.
        sources: &[
            "Cargo.toml",
            "firmware/Cargo.toml",
            "firmware/src",
            "firmware/link/Cargo.toml",
            "firmware/link/src",
            "firmware/cortex-m",
        ],
        // The map of memory: not every target has an image.
        own_source: format!("firmware/cortex-m/images/memory/{}.x", target.name()),
        elsewhere: "MCU_IMAGE_DIR may name a folder with ready images",
        images: &["fifo", "uart", "cost"],
    }
}

/// More than the flash of any chip here; a larger gap between two segments is a
/// mistake of the linker script.
const LARGEST_FLASH: usize = 4 << 20;

/// CRC-32 (ISO-HDLC) over the flash of the image in `path`, as the chip itself
/// computes it over its memory: from the first loadable byte to the last one,
/// the initial values of variables included, by load address. A gap is of zeros,
/// as `objcopy -O binary` writes it and QEMU leaves it.
///
/// # Errors
/// [`ChipError`] if the file cannot be read, or is no 32-bit little-endian ELF
/// file with something to load.
pub fn crc32(path: &Path) -> Result<u32, ChipError> {
    let not = |because: String| {
        let path = path.display();
        ChipError(format!("{path} is no image for a chip: {because}"))
    };
    let file = fs::read(path).map_err(|error| not(error.to_string()))?;
    let flash = flash(&file).map_err(not)?;
    Ok(crc32_on(0, &flash))
}

/// The bytes of the flash, from the lowest load address on.
fn flash(file: &[u8]) -> Result<Vec<u8>, String> {
    let wrong = |error: object::read::Error| error.to_string();
    let header = FileHeader32::<LittleEndian>::parse(file).map_err(wrong)?;
    let endian = header.endian().map_err(wrong)?;
    let mut loaded = Vec::new();
    for segment in header.program_headers(endian, file).map_err(wrong)? {
        if segment.p_type(endian) == PT_LOAD && segment.p_filesz(endian) > 0 {
            let bytes = segment
                .data(endian, file)
                .map_err(|()| "a segment lies beyond the end of the file")?;
            loaded.push((segment.p_paddr(endian), bytes));
        }
    }
    loaded.sort_by_key(|&(address, _)| address);
    let &(base, _) = loaded.first().ok_or("it has nothing to load")?;
    let mut flash = Vec::new();
    for (address, bytes) in loaded {
        let at = usize::try_from(address - base).map_err(|error| error.to_string())?;
        if at < flash.len() {
            return Err(format!("two segments are loaded to {address:#010x}"));
        }
        if at.saturating_add(bytes.len()) > LARGEST_FLASH {
            return Err(format!("it is larger than {LARGEST_FLASH} bytes"));
        }
        flash.resize(at, 0);
        flash.extend_from_slice(bytes);
    }
    Ok(flash)
}

#[cfg(test)]
mod tests {
    use super::flash;

    /// An ELF file with segments of (load address, bytes), each for elsewhere
    /// in RAM, where it is 8 bytes larger.
    fn elf(segments: &[(u32, &[u8])]) -> Vec<u8> {
        const HEADER: u32 = 52;
        const SEGMENT: u32 = 32;
        let count = u16::try_from(segments.len()).unwrap();
        let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
        for half in [2_u16, 40] {
            file.extend(half.to_le_bytes());
        }
        for word in [1_u32, 0, HEADER, 0, 0] {
            file.extend(word.to_le_bytes());
        }
        for half in [52_u16, 32, count, 40, 0, 0] {
            file.extend(half.to_le_bytes());
        }
        let mut at = HEADER + SEGMENT * u32::from(count);
        for (address, bytes) in segments {
            let size = u32::try_from(bytes.len()).unwrap();
            let virtual_address = address + 0x2000_0000;
            for word in [1, at, virtual_address, *address, size, size + 8, 6, 4] {
                file.extend(u32::to_le_bytes(word));
            }
            at += size;
        }
        for (_, bytes) in segments {
            file.extend_from_slice(bytes);
        }
        file
    }

    #[test]
    fn segments_lie_by_load_address_with_zeros_between() {
        let file = elf(&[(0x108, b"data"), (0x100, b"text"), (0x200, b"")]);
        assert_eq!(flash(&file).unwrap(), b"text\0\0\0\0data");
    }

    #[test]
    fn what_is_no_image_is_refused() {
        assert_eq!(flash(&elf(&[])).unwrap_err(), "it has nothing to load");
        let over = flash(&elf(&[(0, b"text"), (3, b"data")])).unwrap_err();
        assert_eq!(over, "two segments are loaded to 0x00000003");
        let apart = flash(&elf(&[(0, b"text"), (0x2000_0000, b"data")])).unwrap_err();
        assert_eq!(apart, "it is larger than 4194304 bytes");
        let mut short = elf(&[(0, b"text")]);
        short.pop();
        assert_eq!(
            flash(&short).unwrap_err(),
            "a segment lies beyond the end of the file"
        );
        for bytes in [&b""[..], b"#!/bin/sh\n", &[0x7f; 60]] {
            assert!(flash(bytes).is_err());
        }
    }
}
