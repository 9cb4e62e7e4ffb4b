//! The documents are true: figures, public items, packages, dependencies, the guide.

mod layers;
mod new_user;
mod packages;
mod public_api;
mod readme;
