//! The modules of some crates with the names that each declares and imports, and the files that each file's code names.
//!
//! Sources are parsed, so that `use super::{a, b::C as D}`, a glob, a path in the middle of an expression or of a macro's
//! arguments, and a function named in an attribute (`#[serde(with = "a::b")]`) are the same to the reader as to the compiler.
//! A name is followed through imports to the file that defines it: what a `mod.rs` passes on from a child is the child's.
//! What is compiled for tests only is left out.
//!
//! Not seen: a method called on a value, and a type that is only inferred; neither names a module.

use std::collections::{BTreeMap, BTreeSet};
use syn::buffer::Cursor;
use syn::parse::ParseStream;
use syn::visit::Visit;
use syn::{Attribute, Ident, Item, Meta, UseTree};

/// Text of each file, by its path: `crate/src/…/name.rs`.
pub type Sources = BTreeMap<String, String>;

/// Segments of a path; a leading `::` is an empty one.
type Path = Vec<String>;

/// Crates as modules.
#[derive(Default)]
pub struct Code {
    modules: Vec<Module>,
    /// Index of each crate's root, by the crate's name.
    roots: BTreeMap<String, usize>,
    /// Files that are read, and those that belong to tests.
    pub files: BTreeSet<String>,
    pub test_files: BTreeSet<String>,
}

#[derive(Default)]
struct Module {
    file: String,
    parent: Option<usize>,
    root: usize,
    names: BTreeMap<String, Vec<Binding>>,
    /// Imports inside functions, whose names only this module sees.
    inner_names: BTreeMap<String, Vec<Binding>>,
    globs: Vec<Path>,
    /// Every path that the code names.
    paths: BTreeSet<Path>,
    /// Macros at the level of items may define names that are not seen.
    defines_by_macro: bool,
}

/// What a name stands for in a module.
enum Binding {
    Module(usize),
    Item,
    Import(Path),
}

/// What a path leads to: a module, something defined in a module's file, or something from outside that a module imports.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Target {
    Module(usize),
    Item(usize),
    Foreign(usize),
}

/// What the code of the files names.
#[derive(Default)]
pub struct Named {
    /// (file, file that it names), never of a file to itself.
    pub arrows: BTreeSet<(String, String)>,
    /// The same where the other file only passes on a name from outside, such as a matrix type: it is used, but nothing that
    /// it defines is.
    pub passed_on: BTreeSet<(String, String)>,
    /// (file, first segment of a path that leads out of these crates).
    pub outside: BTreeSet<(String, String)>,
    /// Paths into these crates that lead nowhere: a defect of this reader.
    pub lost: Vec<String>,
}

impl Code {
    /// Read crates, each by its root file: (name, file).
    pub fn read(sources: &Sources, roots: &[(&str, &str)]) -> Self {
        let mut code = Self::default();
        for &(name, file) in roots {
            let root = code.modules.len();
            code.roots.insert(name.into(), root);
            code.read_file(sources, file, None, file.rsplit_once('/').unwrap().0);
        }
        code
    }

    /// Read a file as a module whose children are in `folder`; its index.
    fn read_file(&mut self, sources: &Sources, file: &str, parent: Option<usize>, folder: &str) -> usize {
        let text = sources.get(file).unwrap_or_else(|| panic!("no file {file}"));
        let syntax = syn::parse_file(text).unwrap_or_else(|error| panic!("{file}: {error}"));
        self.files.insert(file.into());
        self.read_module(sources, file, parent, folder, &syntax.items)
    }

    fn read_module(
        &mut self,
        sources: &Sources,
        file: &str,
        parent: Option<usize>,
        folder: &str,
        items: &[Item],
    ) -> usize {
        let index = self.modules.len();
        let root = parent.map_or(index, |parent| self.modules[parent].root);
        self.modules.push(Module { file: file.into(), parent, root, ..Module::default() });
        let mut reader = Reader::default();
        let mut names: BTreeMap<String, Vec<Binding>> = BTreeMap::new();
        for item in items {
            let (attributes, name) = head(item);
            let Item::Mod(module) = item else {
                if let Some(name) = name.filter(|_| !is_for_tests(attributes)) {
                    names.entry(name.to_string()).or_default().push(Binding::Item);
                }
                reader.is_inside = !matches!(item, Item::Use(_) | Item::Macro(_));
                reader.visit_item(item);
                continue;
            };
            let name = module.ident.to_string();
            let inner = format!("{folder}/{name}");
            let in_files = [format!("{inner}.rs"), format!("{inner}/mod.rs")];
            let own_file = in_files.into_iter().find(|file| sources.contains_key(file));
            if is_for_tests(attributes) {
                self.test_files.extend(own_file.filter(|_| module.content.is_none()));
                continue;
            }
            let child = match &module.content {
                Some((_, items)) => self.read_module(sources, file, Some(index), &inner, items),
                None => {
                    let own_file = own_file.unwrap_or_else(|| panic!("{file}: no file of module {name}"));
                    self.read_file(sources, &own_file, Some(index), &inner)
                }
            };
            names.entry(name).or_default().push(Binding::Module(child));
        }
        let module = &mut self.modules[index];
        module.defines_by_macro = reader.defines_by_macro;
        module.paths = reader.paths;
        for Import { path, name, is_inside } in reader.imports {
            match name {
                None => module.globs.push(path),
                Some(name) => {
                    let names = if is_inside { &mut module.inner_names } else { &mut names };
                    names.entry(name).or_default().push(Binding::Import(path));
                }
            }
        }
        module.names = names;
        index
    }

    /// Every path of every file, resolved.
    pub fn named(&self) -> Named {
        let mut named = Named::default();
        for (index, module) in self.modules.iter().enumerate() {
            for path in module.paths.iter().chain(&module.globs) {
                let first = path[0].as_str();
                if path.len() == 1 && !module.globs.contains(path) {
                    // a single name is known already by its import, if it does not come through a glob
                    let found = self.through_globs(index, first, true, &mut Vec::new());
                    self.add(&mut named, index, found.iter().flatten());
                    continue;
                }
                let found = self.resolve(index, path, &mut Vec::new());
                let is_ours = matches!(first, "crate" | "self" | "super") || self.roots.contains_key(first);
                match found {
                    Some(targets) => self.add(&mut named, index, &targets),
                    None if is_ours => named.lost.push(format!("{}: {}", module.file, path.join("::"))),
                    None => {
                        let first = path.iter().find(|segment| !segment.is_empty()).unwrap();
                        named.outside.insert((module.file.clone(), first.clone()));
                    }
                }
            }
        }
        named
    }

    fn add<'t>(&self, named: &mut Named, from: usize, targets: impl IntoIterator<Item = &'t Target>) {
        let from = &self.modules[from].file;
        for target in targets {
            let (to, arrows) = match *target {
                Target::Module(to) | Target::Item(to) => (to, &mut named.arrows),
                Target::Foreign(to) => (to, &mut named.passed_on),
            };
            let to = &self.modules[to].file;
            if to != from {
                arrows.insert((from.clone(), to.clone()));
            }
        }
    }

    /// Where a path leads that stands in module `from`; nothing if out of these crates. `trail` holds the lookups under way:
    /// imports may go in circles.
    fn resolve(
        &self,
        from: usize,
        path: &[String],
        trail: &mut Vec<(usize, String, bool)>,
    ) -> Option<BTreeSet<Target>> {
        let is_last = path.len() == 1;
        let mut here = match path[0].as_str() {
            "crate" => BTreeSet::from([Target::Module(self.modules[from].root)]),
            "self" => BTreeSet::from([Target::Module(from)]),
            "super" => BTreeSet::from([Target::Module(self.modules[from].parent?)]),
            "" => BTreeSet::from([Target::Module(*self.roots.get(path.get(1)?)?)]),
            name => match self.lookup(from, name, is_last, true, trail) {
                Some(found) => found,
                None => BTreeSet::from([Target::Module(*self.roots.get(name)?)]),
            },
        };
        for (k, segment) in path.iter().enumerate().skip(if path[0].is_empty() { 2 } else { 1 }) {
            let is_last = k + 1 == path.len();
            let mut next = BTreeSet::new();
            for target in here {
                match target {
                    // a variant, a constant or a function of a type stands where the type does
                    Target::Item(_) | Target::Foreign(_) => _ = next.insert(target),
                    Target::Module(module) => match segment.as_str() {
                        "self" => _ = next.insert(target),
                        "super" => _ = next.insert(Target::Module(self.modules[module].parent?)),
                        name => next.extend(self.lookup(module, name, is_last, false, trail).into_iter().flatten()),
                    },
                }
            }
            here = next;
        }
        Some(here).filter(|here| !here.is_empty())
    }

    /// What a name is in a module. A module and a function may share a name: what stands last in a path is the function.
    fn lookup(
        &self,
        module: usize,
        name: &str,
        is_last: bool,
        is_own: bool,
        trail: &mut Vec<(usize, String, bool)>,
    ) -> Option<BTreeSet<Target>> {
        let step = (module, name.to_owned(), is_last);
        if trail.contains(&step) {
            return None;
        }
        trail.push(step);
        let here = &self.modules[module];
        let inner = here.inner_names.get(name).filter(|_| is_own);
        let bindings = || here.names.get(name).into_iter().chain(inner).flatten();
        let child = bindings().find_map(|binding| match binding {
            Binding::Module(child) => Some(BTreeSet::from([Target::Module(*child)])),
            _ => None,
        });
        let mut found = BTreeSet::new();
        if is_last || child.is_none() {
            for binding in bindings() {
                match binding {
                    Binding::Module(_) => {}
                    Binding::Item => _ = found.insert(Target::Item(module)),
                    Binding::Import(path) => match self.resolve(module, path, trail) {
                        Some(targets) => found.extend(targets),
                        None if !self.is_circular(module, path, trail) => _ = found.insert(Target::Foreign(module)),
                        None => {}
                    },
                }
            }
        }
        let found = Some(found).filter(|found| !found.is_empty()).or(child);
        let found = found.or_else(|| self.through_globs(module, name, is_last, trail));
        trail.pop();
        found.or_else(|| here.defines_by_macro.then(|| BTreeSet::from([Target::Item(module)])).filter(|_| !is_own))
    }

    /// Whether an import led nowhere only because its own lookup is under way (`mod a; use a::a;`).
    fn is_circular(&self, module: usize, path: &[String], trail: &[(usize, String, bool)]) -> bool {
        trail.contains(&(module, path[0].clone(), path.len() == 1))
    }

    fn through_globs(
        &self,
        module: usize,
        name: &str,
        is_last: bool,
        trail: &mut Vec<(usize, String, bool)>,
    ) -> Option<BTreeSet<Target>> {
        let mut found = BTreeSet::new();
        for glob in &self.modules[module].globs {
            for target in self.resolve(module, glob, trail).into_iter().flatten() {
                if let Target::Module(other) = target {
                    found.extend(self.lookup(other, name, is_last, false, trail).into_iter().flatten());
                }
            }
        }
        Some(found).filter(|found| !found.is_empty())
    }
}

/// An import: its path, and the name that it gives (none: a glob).
struct Import {
    path: Path,
    name: Option<String>,
    is_inside: bool,
}

/// Collects what the items of one module name.
#[derive(Default)]
struct Reader {
    paths: BTreeSet<Path>,
    imports: Vec<Import>,
    /// Within an item: what is imported here is seen here only.
    is_inside: bool,
    defines_by_macro: bool,
}

impl Reader {
    fn import(&mut self, tree: &UseTree, before: &[String]) {
        let with = |name: &Ident| [before, &[name.to_string()]].concat();
        let (path, name) = match tree {
            UseTree::Path(tree) => return self.import(&tree.tree, &with(&tree.ident)),
            UseTree::Group(tree) => return tree.items.iter().for_each(|tree| self.import(tree, before)),
            UseTree::Glob(_) => (before.to_vec(), None),
            UseTree::Name(tree) if tree.ident == "self" => (before.to_vec(), before.last().cloned()),
            UseTree::Name(tree) => (with(&tree.ident), Some(tree.ident.to_string())),
            UseTree::Rename(tree) if tree.ident == "self" => (before.to_vec(), Some(tree.rename.to_string())),
            UseTree::Rename(tree) => (with(&tree.ident), Some(tree.rename.to_string())),
        };
        if name.is_some() {
            self.paths.insert(path.clone());
        }
        self.imports.push(Import { path, name, is_inside: self.is_inside });
    }

    /// Paths among tokens, and in strings among them if they are an attribute's.
    fn scan(&mut self, mut cursor: Cursor, is_attribute: bool) {
        let mut path = Path::new();
        // '$' before a name: a macro's variable; colons since the last name
        let (mut is_variable, mut colons) = (false, 0);
        while !cursor.eof() {
            if let Some((name, next)) = cursor.ident() {
                if colons != 2 {
                    self.keep(std::mem::take(&mut path));
                }
                if !is_variable || name == "crate" {
                    path.push(name.to_string());
                }
                (is_variable, colons, cursor) = (false, 0, next);
                continue;
            }
            let punct = cursor.punct();
            let is_colon = punct.as_ref().is_some_and(|(punct, _)| punct.as_char() == ':');
            if is_colon && !path.is_empty() && colons < 2 {
                colons += 1;
            } else {
                self.keep(std::mem::take(&mut path));
                colons = 0;
            }
            is_variable = punct.as_ref().is_some_and(|(punct, _)| punct.as_char() == '$');
            cursor = match (punct, cursor.any_group()) {
                (Some((_, next)), _) => next,
                (None, Some((inside, _, _, next))) => {
                    self.scan(inside, is_attribute);
                    next
                }
                (None, None) => {
                    let (tree, next) = cursor.token_tree().expect("a token");
                    let text = tree.to_string();
                    let quoted = text.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
                    if let Some(path) = quoted.filter(|_| is_attribute).and_then(|text| syn::parse_str(text).ok()) {
                        self.keep(segments(&path));
                    }
                    next
                }
            };
        }
        self.keep(path);
    }

    fn keep(&mut self, path: Path) {
        let is_value_or_type = matches!(path.first().map(String::as_str), None | Some("Self"));
        if !is_value_or_type && path != ["self"] && path != ["crate"] && path != ["super"] {
            self.paths.insert(path);
        }
    }

    /// A parser that scans all tokens and keeps none.
    fn scanner(&mut self, is_attribute: bool) -> impl FnOnce(ParseStream) -> syn::Result<()> {
        move |input| {
            input.step(|cursor| {
                self.scan(*cursor, is_attribute);
                let mut rest = *cursor;
                while let Some((_, next)) = rest.token_tree() {
                    rest = next;
                }
                Ok(((), rest))
            })
        }
    }
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_for_tests(head(item).0) {
            return;
        }
        self.defines_by_macro |= !self.is_inside && matches!(item, Item::Macro(item) if item.ident.is_none());
        syn::visit::visit_item(self, item);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        if !is_for_tests(&function.attrs) {
            syn::visit::visit_impl_item_fn(self, function);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let before = if item.leading_colon.is_some() { vec![String::new()] } else { Vec::new() };
        self.import(&item.tree, &before);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.keep(segments(path));
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.visit_path(&call.path);
        call.parse_body_with(self.scanner(false)).expect("tokens");
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Meta::List(list) = &attribute.meta {
            list.parse_args_with(self.scanner(true)).expect("tokens");
        }
    }

    /// `pub(in super::super)` says who may see, not what is used.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
}

fn segments(path: &syn::Path) -> Path {
    let leading = path.leading_colon.is_some().then(String::new);
    leading.into_iter().chain(path.segments.iter().map(|segment| segment.ident.to_string())).collect()
}

/// Attributes of an item, and its name.
fn head(item: &Item) -> (&[Attribute], Option<&Ident>) {
    match item {
        Item::Const(item) => (&item.attrs, Some(&item.ident)),
        Item::Enum(item) => (&item.attrs, Some(&item.ident)),
        Item::Fn(item) => (&item.attrs, Some(&item.sig.ident)),
        Item::Impl(item) => (&item.attrs, None),
        Item::Macro(item) => (&item.attrs, item.ident.as_ref()),
        Item::Mod(item) => (&item.attrs, Some(&item.ident)),
        Item::Static(item) => (&item.attrs, Some(&item.ident)),
        Item::Struct(item) => (&item.attrs, Some(&item.ident)),
        Item::Trait(item) => (&item.attrs, Some(&item.ident)),
        Item::Type(item) => (&item.attrs, Some(&item.ident)),
        Item::Union(item) => (&item.attrs, Some(&item.ident)),
        Item::Use(item) => (&item.attrs, None),
        _ => (&[], None),
    }
}

/// Whether code is compiled for tests only: `#[test]`, `#[cfg(test)]`, `#[cfg(all(test, …))]`.
fn is_for_tests(attributes: &[Attribute]) -> bool {
    fn needs_test(meta: &Meta) -> bool {
        let nested = || {
            type Metas = syn::punctuated::Punctuated<Meta, syn::Token![,]>;
            meta.require_list().and_then(|list| list.parse_args_with(Metas::parse_terminated)).unwrap_or_default()
        };
        meta.path().is_ident("test") || meta.path().is_ident("all") && nested().iter().any(needs_test)
    }
    attributes.iter().any(|attribute| {
        let condition = || attribute.parse_args::<Meta>().is_ok_and(|meta| needs_test(&meta));
        attribute.path().is_ident("test") || attribute.path().is_ident("cfg") && condition()
    })
}
