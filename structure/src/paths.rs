//! The paths that an item mentions, in its code, in the arguments of macros and in attributes of serde.
//!
//! ```text
//!   fn f(a: wire::Report) -> u8 { write!(out, "{}", math::sine(a.x)) }
//!           ~~~~~~~~~~~~                            ~~~~~~~~~~
//! ```
//!
//! A method call names no file and is not found: `track.update()` says nothing of where `update` is written.
//! Neither do links in documentation count.

use proc_macro2::{TokenStream, TokenTree};
use syn::spanned::Spanned as _;
use syn::visit::{self, Visit};

use crate::attributes::only_in_tests;

/// A path and its line in the file, from 1.
#[derive(Debug, Clone)]
pub(crate) struct Mention {
    pub(crate) path: Vec<String>,
    pub(crate) line: usize,
}

/// Gathers mentions from syntax.
#[derive(Default)]
pub(crate) struct Mentions {
    pub(crate) found: Vec<Mention>,
    /// `use` inside of functions.
    pub(crate) inner_uses: Vec<syn::ItemUse>,
}

impl<'ast> Visit<'ast> for Mentions {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            let segments = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.found.push(Mention { path: segments, line: path.span().start().line });
        }
        visit::visit_path(self, path);
    }

    fn visit_item_use(&mut self, import: &'ast syn::ItemUse) {
        if !only_in_tests(&import.attrs) {
            self.inner_uses.push(import.clone());
        }
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        if !only_in_tests(&function.attrs) {
            visit::visit_impl_item_fn(self, function);
        }
    }

    fn visit_field(&mut self, field: &'ast syn::Field) {
        if !only_in_tests(&field.attrs) {
            visit::visit_field(self, field);
        }
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.visit_path(&call.path);
        self.read_tokens(call.tokens.clone(), Texts::Ignored);
    }

    fn visit_attribute(&mut self, attribute: &'ast syn::Attribute) {
        if let syn::Meta::List(list) = &attribute.meta {
            // `#[serde(with = "crate::text")]` names a path in a text.
            let texts = if list.path.is_ident("serde") { Texts::Paths } else { Texts::Ignored };
            self.read_tokens(list.tokens.clone(), texts);
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Texts {
    Ignored,
    Paths,
}

impl Mentions {
    fn read_tokens(&mut self, tokens: TokenStream, texts: Texts) {
        let mut tokens = tokens.into_iter().peekable();
        while let Some(token) = tokens.next() {
            match token {
                TokenTree::Group(group) => self.read_tokens(group.stream(), texts),
                TokenTree::Literal(literal) if texts == Texts::Paths => {
                    let text: Option<syn::LitStr> = syn::parse_str(&literal.to_string()).ok();
                    if let Some(path) = text.and_then(|text| text.parse::<syn::Path>().ok()) {
                        let line = literal.span().start().line;
                        let path = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
                        self.found.push(Mention { path, line });
                    }
                }
                // A field or a method after a dot, or a macro's variable: `$crate` alone is a path.
                TokenTree::Punct(punct) if matches!(punct.as_char(), '.' | '$') => {
                    let member =
                        |next: &TokenTree| matches!(next, TokenTree::Ident(name) if *name != "crate");
                    if tokens.next_if(member).is_some() {
                        rest_of_path(&mut tokens);
                    }
                }
                TokenTree::Ident(first) => {
                    let mut path = vec![first.to_string()];
                    path.extend(rest_of_path(&mut tokens));
                    self.found.push(Mention { path, line: first.span().start().line });
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => {}
            }
        }
    }
}

/// `:: name` as often as it follows.
fn rest_of_path(tokens: &mut std::iter::Peekable<impl Iterator<Item = TokenTree>>) -> Vec<String> {
    let is_colon = |token: &TokenTree| matches!(token, TokenTree::Punct(punct) if punct.as_char() == ':');
    let mut path = Vec::new();
    while tokens.next_if(is_colon).is_some() && tokens.next_if(is_colon).is_some() {
        let Some(TokenTree::Ident(name)) = tokens.next_if(|token| matches!(token, TokenTree::Ident(_)))
        else {
            break;
        };
        path.push(name.to_string());
    }
    path
}

/// The items that a macro call at the level of a module spells out: `code_enum! { pub enum Code { ... } }`.
pub(crate) fn defined_in_macro(tokens: TokenStream) -> Vec<String> {
    const KEYWORDS: [&str; 7] = ["struct", "enum", "fn", "const", "static", "type", "trait"];
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let defines = |pair: &[TokenTree]| match pair {
        [TokenTree::Ident(keyword), TokenTree::Ident(name)] => {
            KEYWORDS.iter().any(|known| keyword == known).then(|| name.to_string())
        }
        _ => None,
    };
    tokens.windows(2).filter_map(defines).collect()
}
