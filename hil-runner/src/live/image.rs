//! The simulator as WebAssembly and what unpacks it in a page: built into a release binary, found
//! or built otherwise.

use std::borrow::Cow;

use crate::image::{Builder, ImageError, Recipe};

/// Made by `build.rs`.
#[cfg(simulator)]
const BUILT_IN: Option<[&[u8]; 2]> = Some([
    include_bytes!(concat!(env!("OUT_DIR"), "/hil_web.wasm")),
    include_bytes!(concat!(env!("OUT_DIR"), "/hil_unpack.wasm")),
]);
#[cfg(not(simulator))]
const BUILT_IN: Option<[&[u8]; 2]> = None;

/// The images of a page.
#[derive(Debug, Clone, Default)]
pub struct Images {
    /// Package `hil-web`.
    pub simulator: Cow<'static, [u8]>,
    /// Package `hil-unpack`.
    pub unpacker: Cow<'static, [u8]>,
}

impl Images {
    /// The images. If they must be built, that is told in one line, without its end.
    ///
    /// # Errors
    /// [`ImageError`] if there are none and they cannot be built.
    pub fn find(tell: &mut dyn FnMut(&str)) -> Result<Self, ImageError> {
        let builder = Builder::from_environment();
        let mut image = |name: &str| {
            let path = builder.image(&recipe(), name, tell)?;
            let image = std::fs::read(&path);
            let refused = |error| ImageError(format!("{} cannot be read: {error}", path.display()));
            image.map(Cow::Owned).map_err(refused)
        };
        let [simulator, unpacker] = match BUILT_IN {
            Some(images) => images.map(Cow::Borrowed),
            None => [image(IMAGES[0])?, image(IMAGES[1])?],
        };
        Ok(Self {
            simulator,
            unpacker,
        })
    }
}

const IMAGES: [&str; 2] = ["hil_web.wasm", "hil_unpack.wasm"];

/// Both images.
pub fn recipe() -> Recipe {
    Recipe {
        what: "simulator for web pages".to_owned(),
        triple: "wasm32-unknown-unknown",
        library: "std",
        workspace: "",
        packages: &["hil-web", "hil-unpack"],
        profile: "wasm",
        folder: "wasm",
        sources: &include!("sources.in"),
        own_source: "hil-runner/web/Cargo.toml".to_owned(),
        elsewhere: "a release binary that was built where there are has it in itself",
        images: &IMAGES,
    }
}
