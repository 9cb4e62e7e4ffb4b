//! Includes the module that `dibs-build` generates for a tree.

// Requirement: P-11

/// Includes the module of a tree that a build script emitted: `include_tree!("heart")` gives `mod heart`.
///
/// The module has the items that depend on the tree:
///
/// | item | is |
/// |---|---|
/// | `TREE` | the bytes in flash, a [`TreeBytes`](crate::TreeBytes): `TREE.validate()` gives the `Tree` |
/// | `Surface`, `start` | the current vertices and their two ends, `Bus` and `Guard`: [`guard`](crate::guard); `start_with_contacts` for [contacts](crate::guard::Guard::contacts) |
/// | `Frames` | a double buffer for its vertices, a [`Frames`](crate::Frames), for your own loop |
/// | `Receiver` | the bus's end of it (feature `bus`), an [`Assembler`](crate::Assembler) that measures stretch in slices; `receiver` makes one |
/// | `Reader` | the control loop's end of it |
/// | `Query` | a [`Query`](crate::Query) with the stack that the tree needs; with the feature `batched`, `BatchedQuery` for large processors |
/// | `Tracker` | a [`Tracker`](crate::Tracker) with that stack; you choose the size of its front |
/// | `VERTICES`, `STACK`, `Index` | the sizes, for your own types |
/// | `CENTRE`, `REACH` | the rest shape's bounding box, if the tree has its rest shape |
///
/// A tree with modes adds `MODES`, their number, and with the feature `modes` a module `modal` with the types for
/// surfaces of that many weights.
///
/// The build script is `fn main() { dibs_build::tree("heart.ply").stretch(1.5).emit("heart") }`.
#[macro_export]
macro_rules! include_tree {
    ($name:literal) => {
        ::core::include!(::core::concat!(::core::env!("OUT_DIR"), "/", $name, ".rs"));
    };
}

/// Items of the generated module that need the feature `bus`.
#[cfg(feature = "bus")]
#[doc(hidden)]
#[macro_export]
macro_rules! if_bus {
    ($($item:item)*) => { $($item)* };
}

/// Nothing: the feature is off.
#[cfg(not(feature = "bus"))]
#[doc(hidden)]
#[macro_export]
macro_rules! if_bus {
    ($($item:item)*) => {};
}

/// Items of the generated module that need the features `bus` and `control`.
#[cfg(all(feature = "bus", feature = "control"))]
#[doc(hidden)]
#[macro_export]
macro_rules! if_guard {
    ($($item:item)*) => { $($item)* };
}

/// Nothing: a feature is off.
#[cfg(not(all(feature = "bus", feature = "control")))]
#[doc(hidden)]
#[macro_export]
macro_rules! if_guard {
    ($($item:item)*) => {};
}

/// Items of the generated module that need the feature `batched`.
#[cfg(feature = "batched")]
#[doc(hidden)]
#[macro_export]
macro_rules! if_batched {
    ($($item:item)*) => { $($item)* };
}

/// Nothing: the feature is off.
#[cfg(not(feature = "batched"))]
#[doc(hidden)]
#[macro_export]
macro_rules! if_batched {
    ($($item:item)*) => {};
}

/// Items of the generated module that need the feature `modes`.
#[cfg(feature = "modes")]
#[doc(hidden)]
#[macro_export]
macro_rules! if_modes {
    ($($item:item)*) => { $($item)* };
}

/// Nothing: the feature is off.
#[cfg(not(feature = "modes"))]
#[doc(hidden)]
#[macro_export]
macro_rules! if_modes {
    ($($item:item)*) => {};
}

/// Items of the generated module that need the feature `nodes`.
#[cfg(feature = "nodes")]
#[doc(hidden)]
#[macro_export]
macro_rules! if_nodes {
    ($($item:item)*) => { $($item)* };
}

/// Nothing: the feature is off.
#[cfg(not(feature = "nodes"))]
#[doc(hidden)]
#[macro_export]
macro_rules! if_nodes {
    ($($item:item)*) => {};
}
