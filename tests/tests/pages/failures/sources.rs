//! The calls and error variants in the sources.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::{Attribute, ImplItem, Item, ItemEnum, Meta, ReturnType};

use crate::page::REPOSITORY;
use crate::public_api::{is_hidden, is_public};

/// The enums of errors, each with its file in the core.
const ENUMS: [(&str, &str); 12] = [
    ("Error", "error.rs"),
    ("FormatError", "tree/error.rs"),
    ("NodesError", "nodes/error.rs"),
    ("LimitError", "control/failsafe/limits.rs"),
    ("QueryError", "unavailable/query.rs"),
    ("Unavailable", "unavailable/mod.rs"),
    ("ReceiveError", "receive/error.rs"),
    ("PacketError", "wire/error.rs"),
    ("StreamError", "wire/stream.rs"),
    ("StretchError", "stretch/mod.rs"),
    ("PoseError", "surface/pose.rs"),
    ("FilterError", "control/filter/answer.rs"),
];

/// Errors without variants.
pub const STRUCTS: [&str; 2] = ["SplitError", "AcknowledgeError"];

/// A variant: the first sentence of its documentation, and the error that it contains.
pub struct Variant {
    pub says: String,
    pub inner: Option<String>,
}

pub type Enums = BTreeMap<String, BTreeMap<String, Variant>>;

/// Public functions, as `Type::name`, each with the errors that it returns.
pub type Functions = BTreeMap<String, BTreeSet<String>>;

pub fn enums() -> Enums {
    ENUMS.iter().map(|(name, file)| ((*name).to_owned(), variants(name, file))).collect()
}

/// The variants of an enum in a file of the core.
pub fn variants(name: &str, file: &str) -> BTreeMap<String, Variant> {
    let text = source(file);
    let item: ItemEnum = match text.split_once("\nerrors! {") {
        // A macro lists its variants as an enum does.
        Some((_, list)) => syn::parse_str(&format!("enum {name} {{ {list}")).expect("variants"),
        None => {
            let items = syn::parse_file(&text).expect("it compiles").items;
            let found = items.into_iter().find_map(|item| match item {
                Item::Enum(item) if item.ident == name => Some(item),
                _ => None,
            });
            found.unwrap_or_else(|| panic!("no {name} in {file}"))
        }
    };
    let of = |variant: &syn::Variant| {
        let inner = variant.fields.iter().find_map(|field| errors_in(&field.ty).into_iter().next());
        let says = sentence(&variant.attrs);
        (variant.ident.to_string(), Variant { says, inner })
    };
    item.variants.iter().map(of).collect()
}

/// The public functions of the types of `guard` that `public-api.txt` lists.
pub fn functions() -> Functions {
    let listed = fs::read_to_string(Path::new(REPOSITORY).join("docs/evidence/public-api.txt"));
    let listed = listed.expect("the list");
    let types: BTreeSet<&str> =
        listed.lines().filter_map(|line| line.strip_prefix("dibs_nostd::guard::")).collect();
    let mut functions = Functions::new();
    for file in fs::read_dir(Path::new(REPOSITORY).join("dibs-nostd/src/guard")).expect("a folder")
    {
        let path = file.expect("a file").path();
        // A folder of a module only contains its tests.
        if path.is_dir() {
            continue;
        }
        let text = fs::read_to_string(path).expect("a source");
        for item in syn::parse_file(&text).expect("it compiles").items {
            let Item::Impl(item) = item else { continue };
            let syn::Type::Path(path) = &*item.self_ty else { continue };
            let name = path.path.segments.last().expect("a name").ident.to_string();
            if item.trait_.is_some() || !types.contains(name.as_str()) {
                continue;
            }
            for function in item.items {
                let ImplItem::Fn(function) = function else { continue };
                if is_public(&function.vis) && !is_hidden(&function.attrs) {
                    let errors = match &function.sig.output {
                        ReturnType::Default => BTreeSet::new(),
                        ReturnType::Type(_, of) => errors_in(of),
                    };
                    functions.insert(format!("{name}::{}", function.sig.ident), errors);
                }
            }
        }
    }
    functions
}

fn errors_in(of: &syn::Type) -> BTreeSet<String> {
    struct Names(BTreeSet<String>);
    impl Names {
        fn visit(&mut self, of: &syn::Type) {
            match of {
                syn::Type::Tuple(tuple) => tuple.elems.iter().for_each(|of| self.visit(of)),
                syn::Type::Reference(inner) => self.visit(&inner.elem),
                syn::Type::Path(path) => {
                    // The error of a stream is that of its type.
                    let is_own =
                        path.path.segments.len() == 2 && path.path.segments[0].ident == "L";
                    let Some(last) = path.path.segments.last().filter(|_| !is_own) else { return };
                    let name = last.ident.to_string();
                    if name.ends_with("Error") || name == "Unavailable" {
                        self.0.insert(name);
                    }
                    if let syn::PathArguments::AngleBracketed(arguments) = &last.arguments {
                        for argument in &arguments.args {
                            if let syn::GenericArgument::Type(of) = argument {
                                self.visit(of);
                            }
                        }
                    }
                }
                _ => (),
            }
        }
    }
    let mut names = Names(BTreeSet::new());
    names.visit(of);
    names.0
}

/// The first sentence of a documentation, its links as text.
fn sentence(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) => Some(text.value()),
            _ => None,
        },
        _ => None,
    });
    let text = lines.map(|line| line.trim().to_owned()).collect::<Vec<_>>().join(" ");
    let mut parts = text.split("](");
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain += part.split_once(')').map_or(part, |(_, rest)| rest);
    }
    let plain = plain.replace(['[', ']'], "");
    let end = plain.find(". ").map_or(plain.len(), |at| at + 1);
    plain.get(..end).unwrap_or(&plain).to_owned()
}

fn source(file: &str) -> String {
    let path = Path::new(REPOSITORY).join("dibs-nostd/src").join(file);
    fs::read_to_string(path).expect("a source")
}
