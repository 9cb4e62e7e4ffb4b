//! Checks the documents: figures, public items, packages, dependencies, sizes, the guide, the evidence for a device's
//! file.

mod device;
mod failures;
mod layers;
mod new_user;
mod packages;
mod page;
mod public_api;
mod readme;
mod requirements;
mod sbom;
mod sizes;
