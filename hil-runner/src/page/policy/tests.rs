use super::*;
use crate::page::tests::unpacked;

/// The scripts of a page that a browser would run.
pub(crate) fn scripts(page: &str) -> Vec<String> {
    let after = |start: &str| -> Vec<&str> {
        let parts = page.split(start).skip(1);
        parts
            .map(|rest| rest.split_once("</script>").unwrap().0)
            .collect()
    };
    let packed = after("data-packed=\"script\">");
    let entered = packed.iter().map(|text| {
        let script = unpacked(&BASE64_STANDARD.decode(text).unwrap());
        String::from_utf8(script).unwrap()
    });
    let plain = after("<script>").into_iter().map(str::to_owned);
    plain.chain(entered).collect()
}

/// Whether its policy lets exactly them.
pub(crate) fn is_exact(page: &str) -> bool {
    let (_, rest) = page.split_once("Policy\" content=\"").unwrap();
    let policy = rest.split_once('"').unwrap().0.replace("&#x27;", "'");
    let mut scripts: Vec<String> = scripts(page).iter().map(|script| source(script)).collect();
    let hashes = policy.split([' ', ';']);
    let mut hashes: Vec<&str> = hashes.filter(|part| part.starts_with("'sha")).collect();
    scripts.sort();
    hashes.sort_unstable();
    !policy.contains("script-src 'unsafe-inline'") && hashes == scripts
}

#[test]
fn hash_is_that_of_others() {
    // printf %s 'alert(1)' | openssl dgst -sha256 -binary | base64
    let hash = "'sha256-bhHHL3z2vDgxUt0W3dWQOrprscmda2Y5pLsLg4GF+pI='";
    assert_eq!(source("alert(1)"), hash);
    assert_ne!(source("alert(2)"), hash);
}

#[test]
fn page_without_scripts_has_none() {
    let policy = policy(&[], false);
    assert!(policy.starts_with("default-src 'none'; style-src"));
    assert!(policy.contains("script-src 'none';") && !policy.contains("wasm"));
}
