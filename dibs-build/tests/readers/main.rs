//! Files of other programs, and placed parts, as one program, so that the library is linked once.

mod placement;
mod writers;
