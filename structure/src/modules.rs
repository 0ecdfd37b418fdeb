//! The modules of one crate: their files, the names they define or import, and the paths they mention.
//!
//! ```text
//!   src/lib.rs          mod a;  mod b;               root
//!   src/a/mod.rs        pub use c::Item; mod c;      crate::a        name `Item` -> alias of c::Item
//!   src/a/c.rs          pub struct Item;             crate::a::c     name `Item` -> defined here
//!   src/b.rs            use crate::a::Item;          crate::b        mentions crate::a::Item, which c.rs defines
//! ```
//!
//! Items under `#[cfg(test)]` are left out. Source: *The Rust Reference*, "Modules" (file names of modules)
//! and "Conditional compilation".

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use syn::spanned::Spanned as _;
use syn::visit::Visit;
use syn::{Item, UseTree, Visibility};

use crate::Error;
use crate::attributes::{of_item, only_in_tests, path_attribute};
use crate::paths::{Mention, Mentions, defined_in_macro};

/// A module's index in [`Modules`].
pub(crate) type ModuleId = usize;

/// All modules of a crate; the root is the first.
#[derive(Debug, Default)]
pub struct Modules(pub(crate) Vec<Module>);

#[derive(Debug)]
pub(crate) struct Module {
    pub(crate) file: PathBuf,
    pub(crate) parent: Option<ModuleId>,
    pub(crate) names: BTreeMap<String, Vec<Name>>,
    /// Of `use path::*`.
    pub(crate) globs: Vec<Vec<String>>,
    pub(crate) mentions: Vec<Mention>,
}

/// What a name stands for in a module; a type, a function and a module may share one.
#[derive(Debug, Clone)]
pub(crate) enum Name {
    Module(ModuleId),
    /// Defined in this module's file.
    Item,
    /// Imported or handed on from this path.
    Alias(Vec<String>),
}

/// Where the files of a module's children are looked for.
struct Folder {
    /// Of `mod child;`.
    children: PathBuf,
    /// Of `#[path = "..."] mod child;`.
    attribute: PathBuf,
}

/// Reads the crate whose root file is `root`.
///
/// # Errors
///
/// When a file is missing, unreadable or not valid Rust.
pub fn read(root: &Path) -> Result<Modules, Error> {
    let mut modules = Modules::default();
    modules.read_file(root, None)?;
    Ok(modules)
}

impl Modules {
    /// Whether a module lies, at whatever depth, in one that this file holds.
    pub(crate) fn is_inside(&self, module: ModuleId, file: &Path) -> bool {
        let parent = |id: &ModuleId| self.0.get(*id).and_then(|module| module.parent);
        std::iter::successors(parent(&module), parent)
            .any(|id| self.0.get(id).is_some_and(|module| module.file == file))
    }

    fn add(&mut self, file: &Path, parent: Option<ModuleId>) -> ModuleId {
        self.0.push(Module {
            file: file.to_owned(),
            parent,
            names: BTreeMap::new(),
            globs: Vec::new(),
            mentions: Vec::new(),
        });
        self.0.len() - 1
    }

    fn read_file(&mut self, path: &Path, parent: Option<ModuleId>) -> Result<ModuleId, Error> {
        let read = |cause| Error::Read { path: path.to_owned(), cause };
        let path = path.canonicalize().map_err(read)?;
        let text = std::fs::read_to_string(&path).map_err(read)?;
        let parsed = syn::parse_file(&text).map_err(|cause| Error::Parse {
            path: path.clone(),
            line: cause.span().start().line,
            cause,
        })?;
        let beside = path.parent().unwrap_or(Path::new("")).to_owned();
        let owns_folder = parent.is_none() || path.file_name().is_some_and(|name| name == "mod.rs");
        let children = if owns_folder { beside.clone() } else { path.with_extension("") };
        let module = self.add(&path, parent);
        self.read_items(module, &parsed.items, &Folder { children, attribute: beside })?;
        Ok(module)
    }

    fn read_items(&mut self, module: ModuleId, items: &[Item], folder: &Folder) -> Result<(), Error> {
        for item in items.iter().filter(|item| !only_in_tests(of_item(item))) {
            match item {
                Item::Mod(child) => self.read_child(module, child, folder)?,
                Item::Use(import) => self.read_use(module, import),
                _ => self.read_item(module, item),
            }
        }
        Ok(())
    }

    fn read_child(&mut self, parent: ModuleId, child: &syn::ItemMod, folder: &Folder) -> Result<(), Error> {
        let name = child.ident.to_string();
        let attribute = path_attribute(&child.attrs);
        let id = if let Some((_, items)) = &child.content {
            let children = match attribute {
                Some(path) => folder.children.join(path),
                None => folder.children.join(&name),
            };
            let id = self.add(&self.0[parent].file.clone(), Some(parent));
            self.read_items(id, items, &Folder { attribute: children.clone(), children })?;
            id
        } else {
            let flat = folder.children.join(format!("{name}.rs"));
            let path = match attribute {
                Some(path) => folder.attribute.join(path),
                None if flat.exists() => flat,
                None => folder.children.join(&name).join("mod.rs"),
            };
            self.read_file(&path, Some(parent))?
        };
        self.name(parent, name, Name::Module(id));
        Ok(())
    }

    fn name(&mut self, module: ModuleId, name: String, stands_for: Name) {
        self.0[module].names.entry(name).or_default().push(stands_for);
    }

    /// A private import is a mention; one with a visibility hands a name on and counts where it is used.
    fn read_use(&mut self, module: ModuleId, import: &syn::ItemUse) {
        if import.leading_colon.is_some() {
            return;
        }
        let line = import.span().start().line;
        let handed_on = !matches!(import.vis, Visibility::Inherited);
        for leaf in leaves(&import.tree) {
            if !handed_on {
                self.0[module].mentions.push(Mention { path: leaf.path.clone(), line });
            }
            match leaf.name {
                LeafName::Glob => self.0[module].globs.push(leaf.path),
                LeafName::As(name) => self.name(module, name, Name::Alias(leaf.path)),
            }
        }
    }

    fn read_item(&mut self, module: ModuleId, item: &Item) {
        for name in defined(item) {
            self.name(module, name, Name::Item);
        }
        let mut mentions = Mentions::default();
        mentions.visit_item(item);
        self.0[module].mentions.extend(mentions.found);
        for import in &mentions.inner_uses {
            self.read_use(module, import);
        }
    }
}

struct Leaf {
    path: Vec<String>,
    name: LeafName,
}

enum LeafName {
    As(String),
    Glob,
}

/// `use a::{b, c::*}` names a::b and all of a::c.
fn leaves(tree: &UseTree) -> Vec<Leaf> {
    let below = |first: &syn::Ident, tree| {
        let prefix = |mut leaf: Leaf| {
            leaf.path.insert(0, first.to_string());
            leaf
        };
        leaves(tree).into_iter().map(prefix).collect()
    };
    match tree {
        UseTree::Path(path) => {
            let mut leaves: Vec<Leaf> = below(&path.ident, &path.tree);
            for leaf in &mut leaves {
                // `use a::b::{self}` names the module b.
                if leaf.path.last().is_some_and(|last| last == "self") && leaf.path.len() > 1 {
                    leaf.path.pop();
                    if matches!(&leaf.name, LeafName::As(name) if name == "self") {
                        leaf.name = LeafName::As(path.ident.to_string());
                    }
                }
            }
            leaves
        }
        UseTree::Name(name) => {
            let name = name.ident.to_string();
            vec![Leaf { path: vec![name.clone()], name: LeafName::As(name) }]
        }
        UseTree::Rename(rename) => {
            let name = LeafName::As(rename.rename.to_string());
            vec![Leaf { path: vec![rename.ident.to_string()], name }]
        }
        UseTree::Glob(_) => vec![Leaf { path: Vec::new(), name: LeafName::Glob }],
        UseTree::Group(group) => group.items.iter().flat_map(leaves).collect(),
    }
}

fn defined(item: &Item) -> Vec<String> {
    let ident = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::TraitAlias(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        Item::Macro(item) => match &item.ident {
            Some(ident) => ident,
            None => return defined_in_macro(item.mac.tokens.clone()),
        },
        _ => return Vec::new(),
    };
    vec![ident.to_string()]
}
