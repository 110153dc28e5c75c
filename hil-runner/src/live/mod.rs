//! A page with the simulator in it: one file that needs no network, in which every key of a
//! run file can be moved.
//!
//! ```text
//! package hil-web ─────► wasm ──────► LZMA ─┐
//! package hil-unpack ──► wasm ──────► gzip ─┤
//! web/page, assets ────► one script ► gzip ─┼──► page, or a section of another page
//! run file, profile, overrides ─────► JSON ─┘
//! ```
//!
//! The same case gives the same bytes.

mod image;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use hil_core::case::Law;
use hil_core::runfile::{RunFile, RunFileErrors};
use lzma_rust2::{LzmaOptions, LzmaWriter, Write};
use minijinja::{Value, context};
use serde::Serialize;

use crate::files;
use crate::page::policy::policy;
use crate::page::{PACKED, environment, in_script, linked, packed, script, style};

pub use image::{Images, recipe};

const PAGE: &str = include_str!("../../web/page/live.html");
/// Enters the script of a page of its own, after the first modules.
const BEGIN: &str = include_str!("../../web/page/begin.js");
/// How many modules are the first ones.
const FIRST: usize = 2;
const WORKER: &str = include_str!("../../web/page/worker.js");
const STYLE: &str = include_str!("../../web/page/live.css");

/// The section with the simulator, of any page; `live` is what it is filled with.
pub(crate) const TEMPLATE: (&str, &str) = (
    "simulator.html",
    include_str!("../../assets/simulator.html"),
);

/// Modules of a page of its own, besides those of plots, in the order of their imports; the last
/// one begins.
const ALONE: [&str; 10] = ending_with(include_str!("../../web/page/start.js"));
/// The same of a section of another page.
const SECTION: [&str; 10] = ending_with(include_str!("../../web/page/section.js"));

const fn ending_with(last: &str) -> [&str; 10] {
    [
        PACKED,
        include_str!("../../web/page/simulator.js"),
        include_str!("../../web/page/state.js"),
        include_str!("../../web/page/keys.js"),
        include_str!("../../web/page/pictures.js"),
        include_str!("../../web/page/figures.js"),
        include_str!("../../web/page/map.js"),
        include_str!("../../web/page/share.js"),
        include_str!("../../web/page/live.js"),
        last,
    ]
}

/// Modules of a page with a simulator in a section, if it has one.
pub(crate) fn modules(live: Option<&Live>) -> &'static [&'static str] {
    live.map_or(&[], |_| &SECTION)
}

/// The style of the same.
pub(crate) fn added_style(live: Option<&Live>) -> &'static str {
    live.map_or("", |_| STYLE)
}

/// The page could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// The template of the program itself is wrong.
    #[error("the template of the live page failed: {0}")]
    Template(#[from] minijinja::Error),
    /// The page's script could not be packed.
    #[error("the script of the live page cannot be packed: {0}")]
    Packed(#[from] io::Error),
    /// The case could not be written as JSON.
    #[error("the data of the live page failed: {0}")]
    Data(#[from] serde_json::Error),
}

/// A case as its page carries it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveCase {
    /// Its name.
    pub name: String,
    /// The run file as the command line has it.
    pub file: String,
    /// The text of the run file.
    pub text: String,
    /// Texts of the files that it names, by the path that it gives.
    pub beside: BTreeMap<String, String>,
    /// Overrides of the command line.
    pub sets: Vec<String>,
    /// The rungs that are shown over each other, for a ladder.
    pub rungs: Option<Vec<&'static str>>,
}

impl LiveCase {
    /// The case of a run file with overrides.
    ///
    /// # Errors
    /// Everything that is wrong with them.
    pub fn new(file: &str, text: &str, sets: &[String]) -> Result<Self, RunFileErrors> {
        let beside = RefCell::new(BTreeMap::new());
        let read = RunFile::parse(file, text, sets, |file: &str, path: &str| {
            let text = files::profile(file, path)?;
            beside.borrow_mut().insert(path.to_owned(), text.clone());
            Ok(text)
        })?;
        Ok(Self {
            name: read.case.name,
            file: file.to_owned(),
            text: text.to_owned(),
            beside: beside.into_inner(),
            sets: sets.to_owned(),
            rungs: None,
        })
    }

    /// The same on all rungs over each other.
    #[must_use]
    pub fn on_all_rungs(mut self) -> Self {
        self.rungs = Some(Law::ALL.map(Law::name).into());
        self
    }

    /// Sixteen hexadecimal digits that another case does not have.
    fn hash(&self) -> String {
        let all = format!("{:?}", (&self.text, &self.beside, &self.sets));
        files::crc64(all.as_bytes())
    }
}

/// A case with its simulator, for a page.
#[derive(Debug, Clone)]
pub struct Live {
    case: LiveCase,
    /// The images packed, as text.
    simulator: String,
    unpacker: String,
}

impl Live {
    /// A case with the images of its page.
    ///
    /// # Errors
    /// If they cannot be packed.
    pub fn new(case: LiveCase, images: &Images) -> io::Result<Self> {
        Ok(Self {
            case,
            simulator: BASE64_STANDARD.encode(lzma(&images.simulator)?),
            unpacker: packed(&images.unpacker)?,
        })
    }

    /// The page of the case alone.
    ///
    /// # Errors
    /// Only if the program's own template or data is at fault.
    pub fn page(&self) -> Result<String, LiveError> {
        let (first, others) = ALONE.split_at(FIRST);
        let (begin, script) = (linked(&[first, &[BEGIN]].concat()), script(others));
        let page = context! {
            title => &self.case.name,
            policy => Value::from_safe_string(policy(&[&begin, &script], true)),
            generated_by => concat!("hil-runner ", env!("CARGO_PKG_VERSION")),
            style => Value::from_safe_string(style(STYLE)),
            script => Value::from_safe_string(packed(script.as_bytes())?),
            begin => Value::from_safe_string(begin),
            ..self.parts()?
        };
        Ok(environment()?.render_named_str("live.html", PAGE, page)?)
    }

    /// What the template of a section is filled with.
    pub(crate) fn section(&self) -> Result<Value, LiveError> {
        Ok(context! { name => &self.case.name, ..self.parts()? })
    }

    fn parts(&self) -> Result<Value, LiveError> {
        let mut data = serde_json::to_value(&self.case)?;
        data["hash"] = self.case.hash().into();
        data["version"] = env!("CARGO_PKG_VERSION").into();
        Ok(context! {
            data => Value::from_safe_string(in_script(&data)?),
            simulator => Value::from_safe_string(self.simulator.clone()),
            unpacker => Value::from_safe_string(self.unpacker.clone()),
            worker => Value::from_safe_string(WORKER.to_owned()),
        })
    }
}

/// A file of LZMA: a quarter shorter than gzip. Code of WebAssembly has no words of a fixed
/// length, so the place in one tells nothing.
fn lzma(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let options = LzmaOptions {
        lc: 4,
        pb: 0,
        nice_len: LzmaOptions::NICE_LEN_MAX,
        ..LzmaOptions::with_preset(4)
    };
    let length = Some(bytes.len() as u64);
    LzmaWriter::new_use_header(Vec::new(), &options, length)
        .and_then(|mut file| {
            file.write_all(bytes)?;
            file.finish()
        })
        .map_err(|error| io::Error::other(format!("{error:?}")))
}

#[cfg(test)]
mod tests;
