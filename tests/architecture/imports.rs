//! Which file of a crate imports which: no circles, so that each room can be read after those it builds on.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::support::repository::{Source, names_in, rust_sources};

/// A file by the path of its module: `crate::chain::simulate`.
type Module = String;

/// Which of some modules imports which others.
type Imports = BTreeMap<Module, BTreeSet<Module>>;

#[test]
fn files_of_one_crate_import_each_other_without_circles() {
    assert_no_circles("files", &[], |imports| imports);
}

/// Crates whose folders do import each other in circles still, through what the crate's root passes on; their files do not.
const KNOTTED: [&str; 1] = ["correlation"];

/// A file and the folder of its name are one room.
#[test]
fn folders_of_one_crate_import_each_other_without_circles() {
    assert_no_circles("folders", &KNOTTED, of_rooms);
}

fn assert_no_circles(what: &str, but_of: &[&str], seen: impl Fn(Imports) -> Imports) {
    let sources = rust_sources();
    let mut circles = Vec::new();
    for role in names_in(Path::new("crates")).iter().filter(|role| !but_of.contains(&role.as_str())) {
        let found = in_circles(&seen(Files::of(role, &sources).imports()));
        circles.extend(found.into_iter().map(|module| format!("{role}: {module}")));
    }
    assert!(circles.is_empty(), "these {what} import each other in circles:\n{}", circles.join("\n"));
}

/// Imports between the crate's rooms: `crate::chain` for `crate::chain::simulate`.
fn of_rooms(imports: Imports) -> Imports {
    let room = |module: &Module| module.split("::").take(2).collect::<Vec<_>>().join("::");
    let mut between = Imports::new();
    for (module, imported) in imports {
        let others = imported.iter().map(room).filter(|other| *other != room(&module));
        between.entry(room(&module)).or_default().extend(others);
    }
    between
}

/// The modules from which imports lead back to themselves.
fn in_circles(imports: &Imports) -> Vec<Module> {
    let leads_back = |from: &&Module| {
        let mut open = vec![*from];
        let mut seen = BTreeSet::new();
        while let Some(module) = open.pop() {
            for next in imports.get(module).into_iter().flatten() {
                if next == *from {
                    return true;
                }
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
        false
    };
    imports.keys().filter(leads_back).cloned().collect()
}

/// The files of a crate's product, without their unit tests and comments.
struct Files(BTreeMap<Module, String>);

impl Files {
    fn of(role: &str, sources: &[Source]) -> Self {
        let folder = Path::new("crates").join(role).join("src");
        let module = |source: &Source| {
            let inside = source.path.strip_prefix(&folder).ok()?.with_extension("");
            let names: Vec<String> = inside.iter().map(|name| name.to_string_lossy().into_owned()).collect();
            let is_root = ["lib", "main"].contains(&names.join("::").as_str());
            let path = if is_root { "crate".to_owned() } else { format!("crate::{}", names.join("::")) };
            Some((path, product_of(&source.text)))
        };
        let mut files = BTreeMap::<Module, String>::new();
        // A library and its program are one root.
        for (module, text) in sources.iter().filter_map(module) {
            files.entry(module).or_default().push_str(&text);
        }
        Self(files)
    }

    fn imports(&self) -> Imports {
        self.0.iter().map(|(module, text)| (module.clone(), self.imported(module, text))).collect()
    }

    fn imported(&self, module: &str, text: &str) -> BTreeSet<Module> {
        let uses = text.split("use ").skip(1).filter_map(|rest| rest.split_once(';'));
        let is_use = |tree: &&str| {
            tree.starts_with("crate::") || tree.starts_with("super::") || tree.starts_with("self::")
        };
        let trees = uses.map(|(tree, _)| tree.trim()).filter(is_use);
        let private = trees.filter(|tree| !is_reexported(text, tree));
        let paths = private.flat_map(leaves);
        paths
            .filter_map(|path| self.file_of(&absolute(module, &path), 0))
            .filter(|file| file != module)
            .collect()
    }

    /// The file that a path leads to: through what the files on the way export by `pub use`.
    fn file_of(&self, path: &str, depth: usize) -> Option<Module> {
        let parts: Vec<&str> = path.split("::").collect();
        let longest = (1..=parts.len()).rev().find(|n| self.0.contains_key(&parts[..*n].join("::")))?;
        let (module, rest) = (parts[..longest].join("::"), parts.get(longest));
        let exported = rest.filter(|_| depth < 5).and_then(|name| {
            let text = self.0.get(&module)?;
            let exports = text
                .split("use ")
                .skip(1)
                .filter_map(|rest| rest.split_once(';'))
                .map(|(tree, _)| tree.trim());
            let paths = exports.filter(|tree| is_reexported(text, tree)).flat_map(leaves);
            let named = paths
                .map(|path| absolute(&module, &path))
                .find(|path| path.ends_with(&format!("::{name}")))?;
            self.file_of(&named, depth + 1)
        });
        Some(exported.unwrap_or(module))
    }
}

/// Whether a file passes on what it imports by this tree.
fn is_reexported(text: &str, tree: &str) -> bool {
    ["pub use ", "pub(crate) use ", "pub(super) use "]
        .iter()
        .any(|start| text.contains(&format!("{start}{tree};")))
}

/// The paths of a tree of imports: `a::{b, c::d}` has `a::b` and `a::c::d`.
fn leaves(tree: &str) -> Vec<String> {
    let tree = tree.split(" as ").next().unwrap_or_default().trim();
    let Some((start, inside)) = tree.split_once('{') else { return vec![tree.to_owned()] };
    let inside = inside.rsplit_once('}').map_or(inside, |(inside, _)| inside);
    let mut depth = 0_i32;
    let branches = inside.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    let full =
        branches.map(str::trim).filter(|branch| !branch.is_empty()).map(|branch| format!("{start}{branch}"));
    full.collect::<Vec<_>>().iter().flat_map(|branch| leaves(branch)).collect()
}

/// A path from the crate's root.
fn absolute(module: &str, path: &str) -> String {
    let mut here: Vec<&str> = module.split("::").collect();
    let mut parts: Vec<&str> = path.split("::").collect();
    match parts.first() {
        Some(&"crate") => here.clear(),
        Some(&"self") => {
            parts.remove(0);
        }
        _ => {}
    }
    while parts.first() == Some(&"super") {
        parts.remove(0);
        here.pop();
    }
    here.extend(parts);
    here.join("::")
}

/// A source without its unit tests and comments.
fn product_of(text: &str) -> String {
    let product = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let lines = product.lines().map(|line| line.split("//").next().unwrap_or_default().trim());
    lines.collect::<Vec<_>>().join(" ")
}

#[test]
fn a_circle_is_found_through_what_is_passed_on() {
    let source =
        |path: &str, text: &str| Source { path: format!("crates/x/src/{path}.rs").into(), text: text.into() };
    let straight = [
        source("lib", "mod a; mod b;\npub use crate::a::{One, Two};"),
        source("a", "mod deep;\npub(crate) use self::deep::Three;\npub struct One;"),
        source(
            "a/deep",
            "// use crate::a::One;\npub struct Three;\n#[cfg(test)]\nmod tests { use crate::b::Four; }",
        ),
        source("b", "use crate::{One, Two as Second};\nuse super::a::{\n    Three,\n};"),
    ];
    assert!(in_circles(&Files::of("x", &straight).imports()).is_empty());
    let mut bent = straight;
    bent[2].text = "use crate::b::Four;\npub struct Three;".into();
    let imports = Files::of("x", &bent).imports();
    assert_eq!(in_circles(&imports), ["crate::a::deep", "crate::b"]);
    assert_eq!(in_circles(&of_rooms(imports)), ["crate::a", "crate::b"]);
}
