//! The libraries that draw a study's pictures, as its page carries them.

/// The libraries that draw pictures, unchanged.
const VEGA: &str = include_str!("../../../assets/vega/vega.min.js");
const VEGA_LITE: &str = include_str!("../../../assets/vega/vega-lite.min.js");
const INTERPRETER: &str = include_str!("../../../assets/vega/vega-interpreter.js");
const LICENSES: [&str; 2] = [
    include_str!("../../../assets/vega/LICENSE"),
    include_str!("../../../assets/vega/LICENSE-BUNDLED"),
];

/// The libraries as one script, with the licences that ask to travel with every
/// copy. The interpreter is a module; here its names are those of the library.
pub(super) fn libraries() -> String {
    let lines = INTERPRETER.lines();
    let others = ["import ", "export ", "//# "];
    let own = lines.filter(|line| !others.iter().any(|start| line.starts_with(start)));
    let interpreter = own.collect::<Vec<_>>().join("\n");
    format!(
        "/*!\n{}\n*/\n{VEGA}\n{VEGA_LITE}\n(() => {{\nconst {{ ascending, isString, DisallowedObjectProperties }} = vega;\n\
         {interpreter}\nvega.expressionInterpreter = expression;\n}})();\n",
        LICENSES.concat().trim()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The one name that the interpreter gives, and those that it takes.
    #[test]
    fn interpreter_is_joined_by_its_names() {
        let imports: Vec<&str> = INTERPRETER
            .lines()
            .filter(|line| line.starts_with("import "))
            .collect();
        let names = "{ ascending, isString, DisallowedObjectProperties }";
        assert_eq!(imports, [format!("import {names} from 'vega-util';")]);
        assert!(INTERPRETER.contains("export { expression as expressionInterpreter };"));
        assert!(libraries().contains(&format!("const {names} = vega;")));
    }
}
