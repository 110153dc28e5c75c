//! The parts that all pages have: templates that escape, style, plots, scripts as one, and the
//! policy that lets no other run.

pub(crate) mod policy;

use std::io::{self, Write};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use minijinja::syntax::SyntaxConfig;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

const UPLOT_SCRIPT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../../assets/uplot/LICENSE");
const STYLE: &str = include_str!("../../assets/report.css");

/// The module that unpacks what a page carries packed.
pub(crate) const PACKED: &str = include_str!("../../assets/packed.js");

/// Modules of every page with plots, in the order of their imports.
pub(crate) const PLOTS: [&str; 8] = [
    include_str!("../../assets/chart.js"),
    include_str!("../../assets/curves.js"),
    include_str!("../../assets/views.js"),
    include_str!("../../assets/cursors.js"),
    include_str!("../../assets/save.js"),
    include_str!("../../assets/loops.js"),
    include_str!("../../assets/plane.js"),
    include_str!("../../assets/plots.js"),
];

/// The environment of templates of pages: every value is escaped.
pub(crate) fn environment<'s>() -> Result<Environment<'s>, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_syntax(
        SyntaxConfig::builder()
            .trim_blocks(true)
            .lstrip_blocks(true)
            .keep_trailing_newline(true)
            .build()?,
    );
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    Ok(environment)
}

/// A value as JSON that cannot end the `<script>` it stands in: in JSON `<` occurs in strings
/// only, where the escape means the same.
pub(crate) fn in_script(value: &impl Serialize) -> serde_json::Result<String> {
    Ok(serde_json::to_string(value)?.replace('<', "\\u003c"))
}

/// Bytes as text of a page: gzip in base64, as the page's scripts unpack them.
///
/// # Errors
/// If they cannot be packed.
pub(crate) fn packed(bytes: &[u8]) -> io::Result<String> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(bytes)?;
    Ok(BASE64_STANDARD.encode(gzip.finish()?))
}

/// The style of a page with plots, and `added` to it.
pub(crate) fn style(added: &str) -> String {
    [UPLOT_STYLE, "\n", STYLE, added].concat()
}

/// The one script of a page with plots: uPlot, with the licence that asks to travel with every
/// copy, and all modules, `own` ones last. Their names stand in a block: another script of the
/// page may have the same.
pub(crate) fn script(own: &[&str]) -> String {
    let licence = UPLOT_LICENSE.trim();
    let modules = linked(&[&PLOTS, own].concat());
    format!("\"use strict\";\n/*!\n{licence}\n*/\n{UPLOT_SCRIPT}\n{{\n{modules}}}\n")
}

/// Modules as one classic script, which needs no address to load from: in an order in which
/// each comes before it is used, without imports, the word `export` and lines of comment.
pub(crate) fn linked(modules: &[&str]) -> String {
    let mut script = String::new();
    // The end of what is left out.
    let mut until = None;
    for line in modules
        .iter()
        .flat_map(|module| module.split_inclusive('\n'))
    {
        let text = line.trim();
        let types = text.starts_with("/**") && (text.ends_with("*/") || !text.contains("*/"));
        match until {
            None if line.starts_with("import ") => until = Some(";"),
            None if types => until = Some("*/"),
            None if !text.starts_with("//") => {
                script.push_str(line.strip_prefix("export ").unwrap_or(line));
            }
            _ => {}
        }
        until = until.filter(|end| !text.ends_with(end));
    }
    script
}

#[cfg(test)]
pub(crate) mod tests;
