//! Who is known: users with passwords, and tokens of programs and devices.
//!
//! ```toml
//! [[user]]
//! name = "anna"
//! role = "admin"
//! password = "$argon2id$v=19$m=19456,t=2,p=1$…"
//!
//! [[token]]
//! name = "front reader"
//! roles = ["reader"]
//! door = "front"                # for this one alone; without it for all
//! sha256 = "9f86d081884c7d65…"
//! ```

use serde::{Deserialize, Serialize};

use super::password::is_hash;
use super::roles::Role;
use kehai_tracking::text::printable;

/// Most users, and most tokens: more than any site has, so that nothing is read without end.
const MOST: usize = 1000;

/// Longest name, in letters.
pub(crate) const NAME_MAX: usize = 64;

/// Everybody who is known.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Directory {
    /// People.
    #[serde(default, rename = "user", skip_serializing_if = "Vec::is_empty")]
    pub users: Vec<User>,
    /// Programs and devices.
    #[serde(default, rename = "token", skip_serializing_if = "Vec::is_empty")]
    pub tokens: Vec<Token>,
}

/// A person who logs in.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct User {
    /// By which it logs in.
    pub name: String,
    /// What it may.
    pub role: Role,
    /// What is kept of its password.
    pub password: String,
}

/// What a program or a device shows.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Token {
    /// What it is for, in the log and in lists.
    pub name: String,
    /// What it may: all that any of them may.
    pub roles: Vec<Role>,
    /// The only door that it is for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub door: Option<String>,
    /// Its fingerprint.
    pub sha256: String,
}

/// Why a user or a token cannot be added or removed.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum DirectoryError {
    /// The name will not do.
    #[error("\"{0}\" is no name: 1 to {NAME_MAX} letters that can be read, without spaces at its ends")]
    Name(String),
    /// It is there already.
    #[error("{0} is there already")]
    Twice(String),
    /// It is not there.
    #[error("there is no {0}")]
    Missing(String),
    /// A role of devices for a person.
    #[error("{0}: \"{1}\" is a role of devices: people are view, edit, operator or admin")]
    Devices(String, Role),
    /// A token without a role.
    #[error("{0} has no role")]
    NoRole(String),
    /// What should be a hash is none.
    #[error("{0}: what is kept of its secret is damaged: give it another")]
    Hash(String),
    /// Too many.
    #[error("{MOST} users and {MOST} tokens are the most")]
    Full,
    /// No user would be left who can do everything.
    #[error("{0} is the last admin")]
    LastAdmin(String),
}

impl Directory {
    /// Whether it has neither users nor tokens.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.users.is_empty() && self.tokens.is_empty()
    }

    /// The user of this name.
    #[must_use]
    pub fn user(&self, name: &str) -> Option<&User> {
        self.users.iter().find(|user| user.name == name)
    }

    /// The token with this fingerprint.
    #[must_use]
    pub fn token(&self, fingerprint: &str) -> Option<&Token> {
        self.tokens.iter().find(|token| token.sha256 == fingerprint)
    }

    /// Adds a user.
    ///
    /// # Errors
    /// [`DirectoryError`]; nothing has changed then.
    pub fn add_user(&mut self, user: User) -> Result<(), DirectoryError> {
        self.changed(|changed| changed.users.push(user))
    }

    /// Adds a token.
    ///
    /// # Errors
    /// As [`add_user`](Self::add_user).
    pub fn add_token(&mut self, token: Token) -> Result<(), DirectoryError> {
        self.changed(|changed| changed.tokens.push(token))
    }

    /// Gives a user another password: what is kept of it.
    ///
    /// # Errors
    /// There is no such user.
    pub fn set_password(&mut self, name: &str, password: String) -> Result<(), DirectoryError> {
        match self.users.iter_mut().find(|user| user.name == name) {
            Some(user) => user.password = password,
            None => return Err(DirectoryError::Missing(format!("user {name}"))),
        }
        Ok(())
    }

    /// Removes a user.
    ///
    /// # Errors
    /// There is none of this name, or it is the last admin.
    pub fn remove_user(&mut self, name: &str) -> Result<(), DirectoryError> {
        let is_admin = |user: &&User| user.role == Role::Admin;
        let admins: Vec<&User> = self.users.iter().filter(is_admin).collect();
        // A file without users is open to this machine: the last one goes with the file.
        if matches!(admins[..], [last] if last.name == name) {
            return Err(DirectoryError::LastAdmin(name.to_owned()));
        }
        let before = self.users.len();
        self.users.retain(|user| user.name != name);
        if self.users.len() == before {
            return Err(DirectoryError::Missing(format!("user {name}")));
        }
        Ok(())
    }

    /// Removes a token.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn remove_token(&mut self, name: &str) -> Result<(), DirectoryError> {
        let before = self.tokens.len();
        self.tokens.retain(|token| token.name != name);
        if self.tokens.len() == before {
            return Err(DirectoryError::Missing(format!("token {name}")));
        }
        Ok(())
    }

    /// Whether it can be used.
    ///
    /// # Errors
    /// What is wrong with whom.
    pub fn check(&self) -> Result<(), DirectoryError> {
        if self.users.len() > MOST || self.tokens.len() > MOST {
            return Err(DirectoryError::Full);
        }
        unique("user", self.users.iter().map(|user| &user.name))?;
        unique("token", self.tokens.iter().map(|token| &token.name))?;
        for User { name, role, password } in &self.users {
            let who = || format!("user {name}");
            if !role.is_of_people() {
                return Err(DirectoryError::Devices(who(), *role));
            }
            if !is_hash(password) {
                return Err(DirectoryError::Hash(who()));
            }
        }
        for Token { name, roles, sha256, .. } in &self.tokens {
            let who = || format!("token {name}");
            if roles.is_empty() {
                return Err(DirectoryError::NoRole(who()));
            }
            if sha256.len() != 64 || !sha256.bytes().all(|digit| digit.is_ascii_hexdigit()) {
                return Err(DirectoryError::Hash(who()));
            }
        }
        Ok(())
    }

    fn changed(&mut self, change: impl FnOnce(&mut Self)) -> Result<(), DirectoryError> {
        let mut changed = self.clone();
        change(&mut changed);
        changed.check()?;
        *self = changed;
        Ok(())
    }
}

fn unique<'a>(what: &str, names: impl Iterator<Item = &'a String>) -> Result<(), DirectoryError> {
    let mut names: Vec<&str> = names.map(String::as_str).collect();
    let is_name = |name: &&str| {
        !name.is_empty()
            && name.chars().count() <= NAME_MAX
            && printable(name) == **name
            && name.trim().len() == name.len()
    };
    if let Some(wrong) = names.iter().find(|name| !is_name(name)) {
        return Err(DirectoryError::Name(printable(wrong)));
    }
    names.sort_unstable();
    match names.windows(2).find(|pair| matches!(pair, [one, other] if one == other)) {
        Some(pair) => Err(DirectoryError::Twice(format!("{what} {}", pair.first().unwrap_or(&"")))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::password::hash;
    use crate::access::secret::fingerprint;

    fn user(name: &str, role: Role) -> User {
        User { name: name.into(), role, password: hash("correct horse battery").unwrap() }
    }

    fn token(name: &str, roles: &[Role]) -> Token {
        Token { name: name.into(), roles: roles.to_vec(), door: None, sha256: fingerprint(name) }
    }

    #[test]
    fn users_and_tokens_come_and_go() {
        let mut directory = Directory::default();
        directory.add_user(user("anna", Role::Admin)).unwrap();
        directory.add_user(user("bert", Role::View)).unwrap();
        directory.add_token(token("anna", &[Role::Reader, Role::Contact])).unwrap();
        let text = toml::to_string(&directory).unwrap();
        assert_eq!(toml::from_str::<Directory>(&text).unwrap(), directory);
        assert_eq!(directory.token(&fingerprint("anna")).unwrap().name, "anna");
        assert_eq!(directory.remove_user("anna"), Err(DirectoryError::LastAdmin("anna".into())));
        directory.add_user(user("carl", Role::Admin)).unwrap();
        directory.remove_user("anna").unwrap();
        assert_eq!(directory.remove_user("anna"), Err(DirectoryError::Missing("user anna".into())));
        assert!(directory.set_password("anna", String::new()).is_err());
        directory.remove_token("anna").unwrap();
        assert!(directory.remove_token("anna").is_err());
    }

    #[test]
    fn what_cannot_be_is_refused_and_changes_nothing() {
        let mut directory = Directory::default();
        directory.add_user(user("anna", Role::Admin)).unwrap();
        let before = directory.clone();
        assert_eq!(
            directory.add_user(user("anna", Role::View)),
            Err(DirectoryError::Twice("user anna".into()))
        );
        for name in ["", " anna", "a\nb", "\u{1b}[2J", &"a".repeat(65)] {
            assert!(
                matches!(directory.add_user(user(name, Role::View)), Err(DirectoryError::Name(_))),
                "{name:?}"
            );
        }
        let said = directory.add_user(user("lock", Role::Lock)).unwrap_err().to_string();
        assert!(said.contains("\"lock\" is a role of devices"), "{said}");
        assert!(directory.add_token(token("x", &[])).is_err());
        let damaged = Token { sha256: "12".into(), ..token("x", &[Role::View]) };
        assert!(directory.add_token(damaged).is_err());
        let plain = User { password: "secret".into(), ..user("bert", Role::View) };
        assert!(directory.add_user(plain).unwrap_err().to_string().contains("damaged"));
        assert_eq!(directory, before);
        directory.tokens = (0..=MOST).map(|number| token(&format!("{number}"), &[Role::View])).collect();
        assert_eq!(directory.check(), Err(DirectoryError::Full));
        assert!(
            toml::from_str::<Directory>("[[user]]\nname = \"a\"\nrole = \"root\"\npassword = \"\"").is_err()
        );
    }
}
