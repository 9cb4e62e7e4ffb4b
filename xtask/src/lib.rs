//! Builds, runs and installs: the toolchain of the board, the emulator, the programs of the nightly compiler. `cargo
//! xtask` and `tests/prove` use it.

pub mod apt;
pub mod c_firmware;
pub mod c_interface;
pub mod firmware;
pub mod nightly;
pub mod process;
pub mod qemu;
pub mod steps;
pub mod toolchain;
pub mod valgrind;
pub mod workspace;
