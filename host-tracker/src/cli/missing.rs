//! An option that needs another one: which needs which is said. The parser says only what is missing.
//!
//! ```text
//!   run --no-mdns            ✗ --module is missing
//!   run           (without)  ✓ nothing is            ─▶ --no-mdns needs --module <ADDRESS> beside it
//! ```

use std::ffi::OsString;

use clap::Command;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};

/// The command line's words as the parser's error tells of them; none if no option of them needs another.
pub fn said(error: &Error, command: &Command, words: &[OsString]) -> Option<String> {
    let missing = missing(error).into_iter().next()?;
    let is_needed_by = |&option: &usize| {
        // With its value, and without one.
        [1, 2].into_iter().any(|length| {
            let rest = words.iter().take(option).chain(words.iter().skip(option + length));
            match command.clone().try_get_matches_from(rest) {
                Ok(_) => true,
                Err(error) => {
                    error.kind() == ErrorKind::MissingRequiredArgument
                        && !self::missing(&error).contains(&missing)
                }
            }
        })
    };
    let is_option = |&index: &usize| words[index].to_string_lossy().starts_with("--");
    let option = (1..words.len()).filter(is_option).find(is_needed_by)?;
    let option = words[option].to_string_lossy();
    let option = option.split('=').next().unwrap_or_default();
    Some(format!("{option} needs {missing} beside it"))
}

/// What is missing, as help writes it: `--module <ADDRESS>`.
fn missing(error: &Error) -> Vec<String> {
    if error.kind() != ErrorKind::MissingRequiredArgument {
        return Vec::new();
    }
    match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::Strings(missing)) => missing.clone(),
        Some(ContextValue::String(missing)) => vec![missing.clone()],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use clap::{Arg, ArgAction};

    use super::*;

    fn command() -> Command {
        let run = Command::new("run")
            .arg(Arg::new("module").long("module").value_name("ADDRESS"))
            .arg(Arg::new("alone").long("no-mdns").requires("module").action(ArgAction::SetTrue))
            .arg(Arg::new("db").long("db").value_name("FILE"))
            .arg(Arg::new("days").long("keep-days").value_name("N").default_value("7").requires("db"));
        let show = Command::new("show").arg(Arg::new("file").value_name("FILE").required(true));
        Command::new("tracker").subcommands([run, show])
    }

    fn said_of(words: &str) -> Option<String> {
        let words: Vec<OsString> = words.split(' ').map(OsString::from).collect();
        let error = command().try_get_matches_from(&words).unwrap_err();
        said(&error, &command(), &words)
    }

    #[test]
    fn an_option_that_needs_another_is_named_with_it() {
        let needs = |words| said_of(words).unwrap();
        assert_eq!(needs("tracker run --no-mdns"), "--no-mdns needs --module <ADDRESS> beside it");
        assert_eq!(needs("tracker run --keep-days 3"), "--keep-days needs --db <FILE> beside it");
        assert_eq!(
            needs("tracker run --keep-days=3 --module 10.0.0.1"),
            "--keep-days needs --db <FILE> beside it"
        );
        assert_eq!(
            needs("tracker run --no-mdns --keep-days 3"),
            "--no-mdns needs --module <ADDRESS> beside it"
        );
    }

    #[test]
    fn what_is_missing_by_itself_or_otherwise_wrong_is_the_parsers_to_say() {
        assert_eq!(said_of("tracker show"), None);
        assert_eq!(said_of("tracker run --no-such"), None);
        assert_eq!(said_of("tracker nothing"), None);
    }
}
