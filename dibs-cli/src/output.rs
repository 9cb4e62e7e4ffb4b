//! Printing to standard output and standard error, which may be a full disk or a closed pipe.
//!
//! Unlike the standard macros, `println!` and `eprintln!` of this program do not panic.

use clap::builder::Styles;
use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;
use std::sync::OnceLock;

/// As the standard macro, but keeps a failure for [`finish`].
macro_rules! println {
    ($($text:tt)*) => { $crate::output::print(format_args!($($text)*)) };
}

/// As the standard macro, but ignores a failure, which cannot be reported.
macro_rules! eprintln {
    ($($text:tt)*) => { $crate::output::warn(format_args!($($text)*)) };
}

/// The error of the first line that could not be printed.
static FAILURE: OnceLock<io::Error> = OnceLock::new();

/// Prints a line of results. After a failure nothing more is printed, but files are still written.
pub fn print(line: fmt::Arguments<'_>) {
    if FAILURE.get().is_none()
        && let Err(error) = writeln!(io::stdout(), "{line}")
    {
        // An error that another thread has recorded came first.
        let _ = FAILURE.set(error);
    }
}

/// Prints bytes of results. Returns whether printing can continue: false after a failure.
pub fn write(bytes: &[u8]) -> bool {
    if FAILURE.get().is_none()
        && let Err(error) = io::stdout().write_all(bytes).and_then(|()| io::stdout().flush())
    {
        let _ = FAILURE.set(error);
    }
    FAILURE.get().is_none()
}

/// Prints clap's answer instead of running a command: a usage error, or the requested help or version.
pub fn answer(error: &clap::Error) -> ExitCode {
    let printed = error.print();
    if let Err(error) = printed
        && error.kind() != ErrorKind::BrokenPipe
    {
        warn(format_args!("error: the results cannot be printed ({error})"));
        return ExitCode::FAILURE;
    }
    u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from)
}

/// Prints a line on standard error; on a terminal its first word is coloured, as in clap's own errors.
pub fn warn(line: fmt::Arguments<'_>) {
    let styles = Styles::styled();
    let line = line.to_string();
    let kinds = [("error:", styles.get_error()), ("warning:", styles.get_invalid())];
    let painted = kinds.into_iter().find_map(|(kind, style)| {
        line.strip_prefix(kind).map(|rest| format!("{style}{kind}{style:#}{rest}"))
    });
    let _ = writeln!(anstream::stderr(), "{}", painted.unwrap_or(line));
}

/// Fails unless all results were printed. A reader that closes the pipe (`dibs inspect --json | head -1`) is not an
/// error.
pub fn finish() -> anyhow::Result<()> {
    let flushed = io::stdout().flush();
    let failure = FAILURE.get().or(flushed.as_ref().err());
    match failure {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => {
            anyhow::bail!("the results cannot be printed ({error})")
        }
        _ => Ok(()),
    }
}
