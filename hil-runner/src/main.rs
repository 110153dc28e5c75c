//! Command line of the servo bench: the controller firmware against the
//! simulated axis, in lockstep.

mod command;

use std::process::ExitCode;

use command::CommandLine;

fn main() -> ExitCode {
    match CommandLine::execute() {
        Ok(all_pass) if all_pass => ExitCode::SUCCESS,
        Ok(_) => ExitCode::from(1),
        Err(error) => {
            command::print_error(&format!("{error:#}\n"));
            ExitCode::from(2)
        }
    }
}
