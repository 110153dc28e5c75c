//! From the text of the packages to the arrows between their files.
//!
//! Counted are `use` and paths that begin with `crate`, `super`, `self`, a
//! package or a module below. A name that a module passes on from another file
//! counts for the file that has it. Unit tests do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use syn::visit::{self, Visit};

use crate::graph::Arrows;

/// Names on the way to an item.
type Names = Vec<String>;

/// The files of a package by their modules.
pub(crate) struct Package {
    name: String,
    files: BTreeMap<Names, File>,
}

/// One file, with the paths that it uses and the names that it passes on.
struct File {
    path: String,
    /// Every path that it uses, from the root of its package or of another.
    used: Vec<Names>,
    /// Names that it passes on, by where they come from; `*` for all of a module.
    passed_on: Vec<(String, Names)>,
}

impl Package {
    /// Every file below a folder.
    pub(crate) fn read(name: &str, shown: &str, folder: &Path) -> Self {
        let mut texts = Vec::new();
        let mut folders = vec![folder.to_owned()];
        while let Some(below) = folders.pop() {
            for entry in std::fs::read_dir(below).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "rs") {
                    let text = std::fs::read_to_string(&path).unwrap();
                    let path = path.strip_prefix(folder).unwrap().to_str().unwrap();
                    texts.push((path.to_owned(), text));
                }
            }
        }
        let texts: Vec<_> = texts
            .iter()
            .map(|(path, text)| (&**path, &**text))
            .collect();
        Self::of_texts(name, shown, &texts)
    }

    /// Files by their path below `folder`, with their text.
    pub(crate) fn of_texts(name: &str, folder: &str, texts: &[(&str, &str)]) -> Self {
        let mut modules: BTreeMap<Names, (&str, syn::File)> = BTreeMap::new();
        for (path, text) in texts {
            let is_test = path
                .split('/')
                .any(|part| part == "tests" || part == "tests.rs");
            if !is_test {
                modules.insert(module(path), (path, syn::parse_file(text).unwrap()));
            }
        }
        let known: BTreeSet<Names> = modules.keys().cloned().collect();
        let files = modules.into_iter().map(|(module, (path, text))| {
            let mut found = Found::new(&module, &known);
            found.visit_file(&text);
            let file = File {
                path: format!("{folder}/{path}"),
                used: found.used,
                passed_on: found.passed_on,
            };
            (module, file)
        });
        Self {
            name: name.to_owned(),
            files: files.collect(),
        }
    }
}

/// The module of a file; that of the program beside a library is `main`.
fn module(path: &str) -> Names {
    let path = path.trim_end_matches(".rs").trim_end_matches("/mod");
    match path {
        "lib" => Vec::new(),
        path => path.split('/').map(str::to_owned).collect(),
    }
}

/// The arrows from file to file.
pub(crate) fn arrows(packages: &[Package]) -> Arrows {
    let mut arrows = Arrows::new();
    for package in packages {
        for file in package.files.values() {
            for used in &file.used {
                let target = target(packages, &package.name, used, 0);
                arrows.extend(
                    target
                        .filter(|target| *target != file.path)
                        .map(|target| (file.path.clone(), target.to_owned())),
                );
            }
        }
    }
    arrows
}

/// The file that has the item at the end of a path, wherever it is passed on.
fn target<'p>(packages: &'p [Package], own: &str, path: &[String], depth: u8) -> Option<&'p str> {
    let (first, rest) = path.split_first()?;
    let name = if first == "crate" { own } else { first };
    let package = packages.iter().find(|package| package.name == name)?;
    let mut length = rest.len();
    while !package.files.contains_key(&rest[..length]) {
        length = length.checked_sub(1)?;
    }
    let file = &package.files[&rest[..length]];
    let Some(item) = rest.get(length).filter(|_| depth < 8) else {
        return Some(&file.path);
    };
    let named = file.passed_on.iter().find(|(name, _)| name == item);
    let passed = named.and_then(|(_, from)| {
        let path = from
            .iter()
            .chain(&rest[length + 1..])
            .cloned()
            .collect::<Names>();
        target(packages, &package.name, &path, depth + 1)
    });
    Some(passed.unwrap_or(&file.path))
}

/// Looks through a file.
struct Found<'m> {
    module: &'m [String],
    known: &'m BTreeSet<Names>,
    used: Vec<Names>,
    passed_on: Vec<(String, Names)>,
}

impl<'m> Found<'m> {
    fn new(module: &'m [String], known: &'m BTreeSet<Names>) -> Self {
        Self {
            module,
            known,
            used: Vec::new(),
            passed_on: Vec::new(),
        }
    }

    /// A path from the root of its package.
    fn absolute(&self, path: &[String]) -> Names {
        let mut module = self.module.to_vec();
        let mut rest = path;
        let below = |name: &String| {
            let mut below = self.module.to_vec();
            below.push(name.clone());
            self.known.contains(&below)
        };
        match path.first() {
            Some(first) if first == "self" => rest = &path[1..],
            Some(first) if first == "super" => {
                while rest.first().is_some_and(|name| name == "super") {
                    module.pop();
                    rest = &rest[1..];
                }
            }
            Some(first) if below(first) => {}
            _ => return path.to_vec(),
        }
        [vec!["crate".to_owned()], module, rest.to_vec()].concat()
    }

    fn tree(&mut self, tree: &syn::UseTree, before: &[String], passes_on: bool) {
        let with = |name: String| [before, &[name]].concat();
        let (path, name) = match tree {
            syn::UseTree::Path(path) => {
                return self.tree(&path.tree, &with(path.ident.to_string()), passes_on);
            }
            syn::UseTree::Group(group) => {
                return group
                    .items
                    .iter()
                    .for_each(|tree| self.tree(tree, before, passes_on));
            }
            syn::UseTree::Name(name) if name.ident == "self" => {
                (before.to_vec(), before.last().cloned().unwrap_or_default())
            }
            syn::UseTree::Name(name) => (with(name.ident.to_string()), name.ident.to_string()),
            syn::UseTree::Rename(name) => (with(name.ident.to_string()), name.rename.to_string()),
            syn::UseTree::Glob(_) => (before.to_vec(), "*".to_owned()),
        };
        let path = self.absolute(&path);
        if passes_on {
            self.passed_on.push((name, path));
        } else {
            self.used.push(path);
        }
    }
}

impl<'ast> Visit<'ast> for Found<'_> {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let passes_on = !matches!(item.vis, syn::Visibility::Inherited);
        if !is_test(&item.attrs) {
            self.tree(&item.tree, &[], passes_on);
        }
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Names = path
            .segments
            .iter()
            .map(|part| part.ident.to_string())
            .collect();
        if names.len() > 1 {
            let absolute = self.absolute(&names);
            self.used.push(absolute);
        }
        visit::visit_path(self, path);
    }
}

/// True of an item that is there for tests alone.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute
                .parse_args::<syn::Path>()
                .is_ok_and(|path| path.is_ident("test"))
    })
}
