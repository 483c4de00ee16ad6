//! The C interface from C: contract.c is compiled against the header and the library, and run.

use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The library that cargo built beside this test.
fn library(name: &str) -> PathBuf {
    let exe = std::env::current_exe().expect("this program");
    let deps = exe.parent().expect("its folder");
    let places = [deps.join(name), deps.join("..").join(name)];
    places.iter().find(|place| place.is_file()).unwrap_or_else(|| panic!("no {name} in {}", deps.display())).clone()
}

/// Compiles a C file with all warnings as errors.
fn compile(source: &Path, out: &Path, words: &[&str]) {
    let include = Path::new(ROOT).join("include");
    let mut cc = Command::new(std::env::var_os("CC").unwrap_or("cc".into()));
    cc.args([
        "-std=c99",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Wconversion",
        "-Werror",
        "-D_POSIX_C_SOURCE=200809L",
    ]);
    cc.arg("-I").arg(include).arg(source).args(words).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(out);
    let ran = cc.output().expect("a C compiler");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

fn run(program: &Path, words: &[&Path]) -> String {
    let ran = Command::new(program).args(words).output().expect("it runs");
    let (out, err) = (String::from_utf8_lossy(&ran.stdout).into_owned(), String::from_utf8_lossy(&ran.stderr));
    assert!(ran.status.success(), "{out}{err}");
    assert_eq!(err, "", "no call prints");
    out
}

/// The contract holds through the shared library, and a document gives the bits of its netlist.
#[test]
fn contract_holds_in_c() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = Path::new(ROOT).join("tests/contract.c");
    let netlist = Path::new(ROOT).join("../../examples/comb_resonator/comb_resonator.net");
    let bundle = bimorph::netlist::read_bundle(&netlist, &[]).expect("readable");
    let (document, _) = bimorph::netlist::document(&bundle, &[]).expect("a structure");
    let model = folder.path().join("model.json");
    std::fs::write(&model, document.write().expect("a document")).expect("written");
    let (program, library) = (folder.path().join("contract"), library("libbimorph_c.so"));
    let place = library.parent().expect("a folder").display().to_string();
    compile(&source, &program, &[&library.display().to_string(), &format!("-Wl,-rpath,{place}")]);
    let output = run(&program, &[&netlist, &model]);
    let lines: Vec<&str> = output.lines().collect();
    assert_eq!(lines[..4], ["arguments", "analyses", "device", "threads"]);
    assert_eq!(lines[4], lines[5], "a document gives the bits of its netlist");
}

/// The header declares exactly the functions that the library exports, each once, and its sizes are those of the library.
#[test]
fn header_declares_every_function() {
    let header = std::fs::read_to_string(Path::new(ROOT).join("include/bimorph.h")).expect("the header");
    let mut code = String::new();
    let mut rest = header.as_str();
    while let Some((before, after)) = rest.split_once("/*") {
        code.push_str(before);
        rest = after.split_once("*/").expect("a closed comment").1;
    }
    code.push_str(rest);
    let name_before = |at: usize| {
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let start = code[..at].rfind(|c| !word(c)).map_or(0, |k| k + 1);
        code[start..at].to_owned()
    };
    let mut declared: Vec<String> =
        code.match_indices('(').map(|(at, _)| name_before(at)).filter(|name| name.starts_with("bimorph_")).collect();
    declared.sort();
    let mut exported = Vec::new();
    for entry in std::fs::read_dir(Path::new(ROOT).join("src")).expect("sources") {
        let text = std::fs::read_to_string(entry.expect("a file").path()).expect("text");
        for (_, rest) in text.match_indices("extern \"C\" fn ").map(|(at, word)| text.split_at(at + word.len())) {
            exported.push(rest.split('(').next().expect("a name").to_owned());
        }
    }
    exported.sort();
    assert_eq!(declared, exported);
    assert!(declared.len() > 25);
}

/// A C++ compiler reads the header too.
#[test]
fn header_is_cpp() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.cpp");
    std::fs::write(
        &file,
        "#include \"bimorph.h\"\nint main() { return bimorph_abi_version() == BIMORPH_ABI ? 0 : 1; }\n",
    )
    .expect("written");
    let include = Path::new(ROOT).join("include");
    let Ok(ran) = Command::new("c++")
        .args(["-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"])
        .arg(include)
        .arg(&file)
        .output()
    else {
        eprintln!("SKIPPED: no C++ compiler");
        return;
    };
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}
