//! What a request shows of who it is from, out of the texts of its header.
//!
//! ```text
//!   Authorization: Bearer TOKEN        ─▶ a token, also a wrong one
//!   Cookie: a=b; NAME=SESSION; c=d     ─▶ a session, the first of that name
//! ```
//!
//! Source: RFC 6750, part 2.1 (Bearer); RFC 6265, part 4.2.1 (Cookie).

/// What a request shows.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Credential {
    /// Nothing.
    None,
    /// A token.
    Token(String),
    /// A session.
    Session(String),
}

impl Credential {
    /// By the header's `Authorization`, empty if it is no text, and its `Cookie`s: a token before a session.
    #[must_use]
    pub fn of<'a>(
        authorization: Option<&str>,
        cookies: impl IntoIterator<Item = &'a str>,
        cookie_name: &str,
    ) -> Self {
        if let Some(shown) = authorization {
            // What is no token is a wrong one: the program does not pass as the user of a session.
            let token = shown.split_once(' ').filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
            return Self::Token(token.map_or(String::new(), |(_, token)| token.trim().to_owned()));
        }
        let pairs = cookies.into_iter().flat_map(|line| line.split(';'));
        let mut pairs = pairs.filter_map(|pair| pair.trim().split_once('='));
        let session = pairs.find(|(name, _)| *name == cookie_name);
        session.map_or(Self::None, |(_, value)| Self::Session(value.to_owned()))
    }
}
