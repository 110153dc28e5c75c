//! The content security policy of a page: nothing is loaded, and no script runs but those that
//! the program has written.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use sha2::{Digest, Sha256};

/// The policy of a page with these scripts, each as it stands between its tags. One with a
/// simulator may besides run WebAssembly, and a worker of its own text.
pub(crate) fn policy(scripts: &[&str], has_simulator: bool) -> String {
    let mut sources: Vec<String> = scripts.iter().map(|script| source(script)).collect();
    let mut workers = "";
    if has_simulator {
        sources.insert(0, "'wasm-unsafe-eval'".to_owned());
        workers = "; worker-src blob:";
    }
    if sources.is_empty() {
        sources.push("'none'".to_owned());
    }
    let sources = sources.join(" ");
    format!(
        "default-src 'none'; style-src 'unsafe-inline'; img-src data: blob:; \
         script-src {sources}{workers}; base-uri 'none'; form-action 'none'"
    )
}

/// A script by its hash.
fn source(script: &str) -> String {
    let hash = BASE64_STANDARD.encode(Sha256::digest(script));
    format!("'sha256-{hash}'")
}

#[cfg(test)]
pub(crate) mod tests;
