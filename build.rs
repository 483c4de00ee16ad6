//! Has the linker make the command smaller, where it can.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Functions of the same machine code are kept once (the same generic function for many types is a good part of the command), and the
/// places of pointers as bits, which is a thirtieth of a list of them. LLD and mold know the first, GNU's own linker does not; C libraries
/// of GNU know the second since 2.36.
const SMALLER: [&str; 2] = ["-Wl,--icf=all", "-Wl,-z,pack-relative-relocs"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    // another linker may know other arguments
    let target = std::env::var("TARGET")?.to_uppercase().replace(['-', '.'], "_");
    println!("cargo::rerun-if-env-changed=CARGO_TARGET_{target}_LINKER");
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    if cfg!(feature = "server") {
        let known = SMALLER.iter().filter(|argument| works(argument, &out).unwrap_or(false));
        known.for_each(|argument| println!("cargo::rustc-link-arg-bins={argument}"));
    }
    Ok(())
}

/// True where the linker that is used here knows an argument, and what it links runs: tried with the smallest of programs.
fn works(argument: &str, out: &Path) -> std::io::Result<bool> {
    let own = |name: &str| std::env::var(name).unwrap_or_default();
    // elsewhere the linker is another program, and what it links need not run here
    if own("HOST") != own("TARGET") || own("CARGO_CFG_TARGET_ENV") != "gnu" {
        return Ok(false);
    }
    let (text, program) = (out.join("smallest.rs"), out.join("smallest"));
    std::fs::write(&text, "fn main() {}\n")?;
    let mut rustc = Command::new(own("RUSTC"));
    rustc.args(own("CARGO_ENCODED_RUSTFLAGS").split('\u{1f}').filter(|flag| !flag.is_empty()));
    if let Ok(linker) = std::env::var("RUSTC_LINKER") {
        rustc.arg(format!("-Clinker={linker}"));
    }
    rustc.arg(format!("-Clink-arg={argument}")).arg("-o").arg(&program).arg(&text);
    let quiet = |command: &mut Command| command.stdout(Stdio::null()).stderr(Stdio::null()).status();
    Ok(quiet(&mut rustc)?.success() && quiet(&mut Command::new(&program))?.success())
}
