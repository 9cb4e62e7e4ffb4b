//! The program's own tests: it is compiled once, for them and for its user.

mod accuracy;
mod boards;
mod bound;
mod bridged;
mod evidence;
mod path;
mod processors;
mod proofs;
mod records;
mod root;
mod twice;
mod words;
