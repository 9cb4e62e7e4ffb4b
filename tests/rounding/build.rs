//! Takes the kernels' text from the shipped sources, so that there is no copy of it.
//!
//! The methods are compiled again in this crate, where `f32` and `Vec3` are names of recording types. Two things in them
//! cannot change their type by a name: a literal becomes `f32::literal(..)`, a cast `f32::from_integer(..)`.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use quote::ToTokens;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ImplItem, ImplItemFn, Item, ItemConst, Lit, Type, Visibility, parse_quote};

/// A shipped file, and its constants.
const CONSTANTS: [(&str, &[&str]); 4] = [
    ("math/round.rs", &["U"]),
    ("query/search/slack.rs", &["BOUND", "PLANE", "DOT", "COORDINATES", "FLOOR"]),
    ("query/search/node.rs", &["CLOSEST", "RANGE", "AROUND"]),
    ("nodes/surface.rs", &["ROUNDING"]),
];

/// A shipped file, what its methods become part of, and the methods.
const METHODS: [(&str, &str, &[&str]); 5] = [
    ("tool/sphere.rs", "impl Axis for Sphere", &["axis_to"]),
    ("query/search/node.rs", "impl<T: Axis> Search<T>", &["expand"]),
    ("query/search/leaf.rs", "impl<T: Axis> Search<T>", &["plane_towards", "plane_across"]),
    ("query/plane.rs", "impl Plane", &["has_beyond"]),
    ("nodes/surface.rs", "impl EmbeddedSurface", &["position", "rounding"]),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let (mut constants, mut kernels) = (String::new(), String::new());
    for (file, names) in CONSTANTS {
        let items = items(file)?;
        for name in names {
            constants += &constant(&items, name).ok_or(format!("{file}: no {name}"))?;
        }
    }
    for (file, of, names) in METHODS {
        let items = items(file)?;
        let methods = names.iter().map(|name| method(&items, name, of.contains(" for ")));
        let methods: Option<String> = methods.collect();
        let methods = methods.ok_or(format!("{file}: not one each of {names:?}"))?;
        kernels += &format!("{of} {{ {methods} }}\n");
    }
    let out = env::var("OUT_DIR")?;
    fs::write(Path::new(&out).join("constants.rs"), constants)?;
    fs::write(Path::new(&out).join("kernels.rs"), kernels)?;
    Ok(())
}

fn items(file: &str) -> Result<Vec<Item>, Box<dyn Error>> {
    let path = Path::new("../../dibs-nostd/src").join(file);
    println!("cargo:rerun-if-changed={}", path.display());
    Ok(syn::parse_file(&fs::read_to_string(path)?)?.items)
}

fn constant(items: &[Item], name: &str) -> Option<String> {
    items.iter().find_map(|item| match item {
        Item::Const(item) if item.ident == name => {
            let item = ItemConst { vis: parse_quote!(pub), attrs: Vec::new(), ..item.clone() };
            Some(item.to_token_stream().to_string())
        }
        _ => None,
    })
}

/// The text of a method for recorded numbers; `None` unless there is exactly one of this name.
fn method(items: &[Item], name: &str, is_of_trait: bool) -> Option<String> {
    let blocks = items.iter().filter_map(|item| match item {
        Item::Impl(block) => Some(&block.items),
        _ => None,
    });
    let methods = blocks.flatten().filter_map(|item| match item {
        ImplItem::Fn(method) if method.sig.ident == name => Some(method),
        _ => None,
    });
    let [method] = methods.collect::<Vec<&ImplItemFn>>()[..] else { return None };
    let mut method = method.clone();
    method.vis = if is_of_trait { Visibility::Inherited } else { parse_quote!(pub(crate)) };
    Recorded.visit_impl_item_fn_mut(&mut method);
    Some(method.to_token_stream().to_string())
}

/// Replaces literals and casts.
struct Recorded;

impl VisitMut for Recorded {
    fn visit_expr_mut(&mut self, expression: &mut Expr) {
        visit_mut::visit_expr_mut(self, expression);
        match &*expression {
            Expr::Lit(literal) if matches!(literal.lit, Lit::Float(_)) => {
                *expression = parse_quote!(f32::literal(#literal));
            }
            Expr::Cast(cast) if is_f32(&cast.ty) => {
                let integer = &cast.expr;
                *expression = parse_quote!(f32::from_integer(#integer));
            }
            _ => {}
        }
    }
}

fn is_f32(kind: &Type) -> bool {
    matches!(kind, Type::Path(path) if path.path.is_ident("f32"))
}
