//! Builds, runs and installs the board's toolchain, the emulator and the programs that need the nightly compiler, for
//! `cargo xtask` and `tests/prove`.

pub mod apt;
pub mod c_firmware;
pub mod c_interface;
pub mod firmware;
pub mod nightly;
pub mod process;
pub mod python;
pub mod qemu;
pub mod steps;
pub mod toolchain;
pub mod twice;
pub mod valgrind;
pub mod workspace;
