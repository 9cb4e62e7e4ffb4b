//! The tests of the program `dibs`, as one program, so that the libraries are linked once.

mod another_mesh;
mod bulk;
mod cli;
mod cli_motion;
mod components;
mod dialects;
mod far;
mod filter;
mod formats;
mod groups;
mod labels;
mod manners;
mod nodes;
mod nodes_motions;
mod overwrite;
mod pace;
mod program;
mod stream;
mod tools;
mod track;
mod view;
mod view_page;
