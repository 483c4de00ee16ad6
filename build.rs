//! Generates the protocol's Rust code from `proto/`, with a compiler written in Rust: no `protoc` is needed.
//!
//! Without the feature `remote` there is nothing to do, and the code generator is not even a dependency.

#[cfg(not(feature = "remote"))]
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}

#[cfg(feature = "remote")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=proto");
    println!("cargo::rerun-if-changed=build.rs");
    let mut compiler = protox::Compiler::new(["proto"])?;
    compiler.include_source_info(true).include_imports(true).open_file("bimorph/v1/service.proto")?;
    let out = std::path::PathBuf::from(std::env::var("OUT_DIR")?);
    std::fs::write(out.join("bimorph_v1.bin"), compiler.encode_file_descriptor_set())?;
    tonic_prost_build::configure()
        .build_client(true)
        .build_server(cfg!(feature = "server"))
        .btree_map(".")
        .compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}
