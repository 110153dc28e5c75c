use super::*;

pub(crate) fn unpacked(gzip: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    io::Read::read_to_end(&mut flate2::read::GzDecoder::new(gzip), &mut bytes).unwrap();
    bytes
}

#[test]
fn modules_are_one_script() {
    let first =
        "// A remark.\nexport const a = 1;\n/** @param {number} x */\nexport function f(x) {\n";
    let second = "import {\n  a, f,\n} from \"./first.js\";\n\n/**\n * Types.\n */\n  /** @type {any} */ (a).b; // stays\n";
    let script = linked(&[first, "}\n", second]);
    let wanted = "const a = 1;\nfunction f(x) {\n}\n\n  /** @type {any} */ (a).b; // stays\n";
    assert_eq!(script, wanted);
    let all = linked(&PLOTS);
    for left in ["\nimport ", "\nexport ", "\n//", " @param "] {
        assert!(!all.contains(left), "{left}");
    }
}

#[test]
fn what_is_packed_unpacks_the_same() {
    let text = "a text ".repeat(1000);
    let short = packed(text.as_bytes()).unwrap();
    assert!(short.len() < text.len() / 10);
    let gzip = BASE64_STANDARD.decode(&short).unwrap();
    assert_eq!(unpacked(&gzip), text.as_bytes());
}
