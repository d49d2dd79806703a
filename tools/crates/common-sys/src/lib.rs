//! The only door from Rust to the C of `common/`: safe functions over its codecs and kernels, and
//! its constants. Nothing here computes; nothing elsewhere says `extern "C"`.

pub mod dense;
pub mod link;
pub mod loader;
pub mod vision;

/// Everything bindgen found: constants are for all to use, functions for this crate only.
#[allow(
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    dead_code,
    unsafe_code,
    clippy::all
)]
mod ffi {
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

/// Constants of `common/`'s headers and of both firmwares' board files, under their C names.
pub mod constants {
    pub use crate::ffi::*;
}
