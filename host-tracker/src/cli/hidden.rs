//! The value of an option that may hold a password: help does not show it, nor is it said when it cannot be read.
//!
//! ```text
//!   --mqtt mqtt:/me:secret@here   ✗ invalid value '…' for '--mqtt <…>': a broker is mqtt://…
//! ```
//!
//! What the parser says of a service goes to the system's log, which more people read than its options.

use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use clap::{Arg, Command};

/// The parser's error without such a value.
pub fn without_secret(mut error: Error, command: &Command) -> Error {
    let is_hidden = matches!(
        error.get(ContextKind::InvalidArg),
        Some(ContextValue::String(option)) if hides(option, command)
    );
    if is_hidden && error.kind() == ErrorKind::ValueValidation {
        error.insert(ContextKind::InvalidValue, ContextValue::String("…".to_owned()));
    }
    error
}

/// Whether the value of an option is hidden in this command or one below; `option` as help writes it: `--mqtt <URL>`.
fn hides(option: &str, command: &Command) -> bool {
    let long = option.split_whitespace().next().and_then(|word| word.strip_prefix("--"));
    let is_it = |arg: &Arg| long.is_some() && arg.get_long() == long && arg.is_hide_env_values_set();
    command.get_arguments().any(is_it) || command.get_subcommands().any(|below| hides(option, below))
}

#[cfg(test)]
mod tests {
    use clap::value_parser;

    use super::*;

    #[test]
    fn a_value_is_not_said_if_help_hides_it() {
        let number = |name: &'static str| Arg::new(name).long(name).value_parser(value_parser!(u16));
        let run = Command::new("run").args([number("code").hide_env_values(true), number("code-count")]);
        let command = || Command::new("tracker").subcommand(run.clone());
        let said = |option: &str| {
            let error = command().try_get_matches_from(["tracker", "run", option, "secret"]).unwrap_err();
            without_secret(error, &command()).to_string()
        };
        let hidden = said("--code");
        assert!(hidden.contains("invalid value '…' for '--code ") && !hidden.contains("secret"), "{hidden}");
        let shown = said("--code-count");
        assert!(shown.contains("invalid value 'secret'"), "{shown}");
    }
}
