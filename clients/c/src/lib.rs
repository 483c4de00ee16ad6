//! The C interface: `include/bimorph.h` declares it and states the rules for errors, memory, threads and versions.
//!
//! `fault` holds codes and the message of each thread, and stops every panic at the border. `memory` turns pointers of the caller into slices and texts.
//! `options`, `model`, `analyses` and `device` hold the functions, one group of the header each. Nothing here computes.
//!
//! This crate has `unsafe` code, since it speaks C; each block says why it holds. A caller has to follow the header: pointers are null or
//! valid for the stated length, and a handle is not used after it was freed.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(clippy::undocumented_unsafe_blocks)]

pub mod analyses;
pub mod device;
pub mod fault;
mod memory;
pub mod model;
pub mod options;

use std::ffi::{CStr, c_char};

/// Version of the binary interface: `BIMORPH_ABI` of the header.
const ABI: u32 = 1;

/// The package version with a zero byte.
const PACKAGE_VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(text) => text,
    Err(_) => c"",
};

/// Version of the binary interface.
// SAFETY: no other symbol of a program has this name.
#[unsafe(no_mangle)]
pub extern "C" fn bimorph_abi_version() -> u32 {
    ABI
}

/// Version of the library.
// SAFETY: no other symbol of a program has this name.
#[unsafe(no_mangle)]
pub extern "C" fn bimorph_version() -> *const c_char {
    PACKAGE_VERSION.as_ptr()
}
