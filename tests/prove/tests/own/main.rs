//! The program's own tests: it is compiled once, for them and for its user.

mod accuracy;
mod bound;
mod bridged;
mod coverage;
mod evidence;
mod figures;
mod path;
mod proofs;
mod records;
mod root;
mod twice;
mod words;
