//! Generates the protocol's Rust code from `proto/`, with a compiler written in Rust: no `protoc` is needed.

use std::path::PathBuf;

/// Folder of the protocol.
const PROTO: &str = "../../proto";

/// The messages and both ends of the protocol, and its description for clients that ask for it.
fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed={PROTO}");
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    let mut compiler = protox::Compiler::new([PROTO])?;
    compiler.include_source_info(true).include_imports(true).open_file("bimorph/v1/service.proto")?;
    std::fs::write(out.join("bimorph_v1.bin"), compiler.encode_file_descriptor_set())?;
    tonic_prost_build::configure()
        .build_client(true)
        .build_server(cfg!(feature = "server"))
        .btree_map(".")
        .extern_path(".google.rpc", "::tonic_types::pb")
        .compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}
