//! The control logic.
#![no_std]
