//! The `bimorph` command.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
