//! Compiles common/ as common/sources.txt lists it, and turns its headers and the boards' numbers
//! into Rust, so that every constant and wire format is written once.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    // Asked when it runs: cargo may reuse this program for another checkout.
    let here = env::var_os("CARGO_MANIFEST_DIR").expect("cargo says where this crate is");
    let root = Path::new(&here).join("../../..");
    let common = root.join("common");
    let list = common.join("sources.txt");

    let sources = fs::read_to_string(&list).expect("common/sources.txt lists the C sources");
    let mut build = cc::Build::new();
    build.include(&common).std("c99").opt_level(3).warnings(true).extra_warnings(true);
    // The one place where a compiler's own vectoriser may pick instructions at run time; the same
    // switch as in CMake.
    build.define("SOT_MULTIVERSION", "1");
    for source in sources.lines().filter(|l| !l.is_empty() && !l.starts_with('#')) {
        build.file(common.join(source));
    }
    build.compile("common");

    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets OUT_DIR"));
    bindgen::Builder::default()
        .header(Path::new(&here).join("src/all.h").display().to_string())
        .clang_arg(format!("-I{}", common.display()))
        .clang_arg(format!("-I{}", root.display()))
        .use_core()
        .allowlist_file(format!("{}/(common|fx2-firmware|khepera-firmware)/.*", root.display()))
        .derive_default(true)
        .derive_eq(true)
        .layout_tests(false)
        .generate()
        .expect("bindgen reads the headers of common/; it needs Debian's libclang1-14")
        .write_to_file(out.join("bindings.rs"))
        .expect("OUT_DIR is writable");

    for watched in [
        "common",
        "fx2-firmware/board",
        "khepera-firmware/board",
        "khepera-firmware/soccer/belief.h",
    ] {
        println!("cargo:rerun-if-changed={}", root.join(watched).display());
    }
    println!("cargo:rerun-if-changed=src/all.h");
    println!("cargo:rerun-if-changed=build.rs");
}
