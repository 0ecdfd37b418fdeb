//! Who may do what over HTTP: users and their sessions, tokens, roles.
//!
//! ```text
//!   file ─▶ directory: users, tokens
//!               │
//!   request ─▶ who: a session, a token, or none ─▶ roles: may it? ─▶ done, or 401, 403
//!   log-in  ─▶ attempts: not too often? ─▶ password ─▶ sessions
//! ```
//!
//! | file | what |
//! |---|---|
//! | `roles` | roles, actions, and which role may do which |
//! | `directory` | who is known |
//! | `file` | the file of it, beside the site |
//! | `password`, `secret` | what people choose and what is made here, and what is kept of either |
//! | `sessions` | who has logged in |
//! | `attempts` | how often passwords may be tried |
//!
//! As long as no user and no token is known, all may do everything: then the tracker serves its own machine alone. Once one
//! was known it never opens again by itself: while the file is gone or damaged no user gets in, and the way out stays open.

mod attempts;
mod credential;
pub mod directory;
pub mod file;
pub mod password;
pub mod roles;
pub mod secret;
mod sessions;

use std::fmt;
use std::net::IpAddr;
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};

use crate::clock::HostClock;
use crate::owned_file::Stamp;
use attempts::{Attempts, Wait};
pub use credential::Credential;
use directory::{Directory, User};
use file::{AccessFile, AccessFileError};
use password::PasswordError;
use roles::{Action, Role, is_free, may};
use secret::fingerprint;
pub use sessions::LASTS_S;
use sessions::Sessions;

/// Between two looks at whether the file has changed.
const LOOK_US: u64 = 1_000_000;

/// A clock that never goes back, µs.
pub type Clock = Box<dyn Fn() -> u64 + Send + Sync>;

/// Who asks.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Who {
    /// Anybody: neither users nor tokens are known, so all may do everything.
    Anybody,
    /// A client that has neither logged in nor shown a token.
    Nobody,
    /// A user who has logged in.
    Person {
        /// By which name.
        name: String,
        /// As what.
        role: Role,
    },
    /// A program or a device.
    Program {
        /// Its token's name.
        name: String,
        /// What it may.
        roles: Vec<Role>,
        /// The only door that it is for.
        door: Option<String>,
    },
}

/// Why there is no first user.
#[derive(Debug, thiserror::Error)]
pub enum FirstAdminError {
    /// The file.
    #[error(transparent)]
    File(#[from] AccessFileError),
    /// Its password.
    #[error(transparent)]
    Password(#[from] PasswordError),
}

/// Name of the user that is made where there is none.
pub const FIRST: &str = "admin";

/// Adds an admin if there is no user yet: the password, to be said once.
///
/// # Errors
/// [`FirstAdminError`].
pub fn first_admin(file: &AccessFile) -> Result<Option<String>, FirstAdminError> {
    if !file.load()?.users.is_empty() {
        return Ok(None);
    }
    let made = secret::password().map_err(PasswordError::Random)?;
    let password = password::hash(&made)?;
    file.change(|directory| {
        directory.add_user(User { name: FIRST.to_owned(), role: Role::Admin, password })
    })?;
    Ok(Some(made))
}

/// Why a user is not let in.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum LogInError {
    /// There is nothing to log in to.
    #[error("no user has been added: everybody on this machine may do everything")]
    Open,
    /// Wrong, or not known: which of both is not said.
    #[error("this name and this password do not belong together")]
    Wrong,
    /// Too many tries.
    #[error("too many wrong passwords: try again in {0} s")]
    Often(u64),
    /// No randomness.
    #[error("the system has no randomness")]
    Random,
}

impl Who {
    /// Whether it may do this; `door` is the one that it is about.
    #[must_use]
    pub fn may(&self, action: Action, door: Option<&str>) -> bool {
        match self {
            Self::Anybody => true,
            Self::Nobody => is_free(action),
            Self::Person { role, .. } => may(*role, action),
            Self::Program { roles, door: only, .. } => {
                let is_for = only.as_ref().is_none_or(|only| door == Some(only));
                is_free(action) || (is_for && roles.iter().any(|role| may(*role, action)))
            }
        }
    }
}

impl fmt::Display for Who {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Anybody => write!(f, "anybody"),
            Self::Nobody => write!(f, "a client that is not known"),
            Self::Person { name, role } => write!(f, "{name} ({role})"),
            Self::Program { name, roles, door } => {
                let roles: Vec<&str> = roles.iter().map(|role| role.name()).collect();
                write!(f, "token {name} ({}", roles.join(", "))?;
                door.as_ref().map_or(Ok(()), |door| write!(f, " of door {door}"))?;
                write!(f, ")")
            }
        }
    }
}

/// Who is known, and who has logged in. Clones are the same.
#[derive(Clone)]
pub struct Access(Arc<Shared>);

struct Shared {
    file: Option<AccessFile>,
    clock: Clock,
    state: Mutex<State>,
}

struct State {
    known: Known,
    stamp: Option<Stamp>,
    /// Why the system did not let the file of this stamp be read: it is tried again.
    unread: Option<String>,
    looked_us: u64,
    sessions: Sessions,
    attempts: Attempts,
}

/// Who is known.
#[derive(Clone)]
enum Known {
    /// There were never users or tokens: everything is open.
    Open,
    /// These, perhaps none any more.
    These(Arc<Directory>),
}

impl fmt::Debug for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Access").field("file", &self.0.file).finish_non_exhaustive()
    }
}

impl Access {
    /// Open to everybody, for good: for simulations and tests.
    #[must_use]
    pub fn open() -> Self {
        Self::new(None, Box::new(|| 0))
    }

    /// As the file says.
    #[must_use]
    pub fn of(file: AccessFile) -> Self {
        let clock = HostClock::start();
        Self::timed(file, Box::new(move || clock.now_us()))
    }

    /// The same by another clock, as that of a test.
    #[must_use]
    pub fn timed(file: AccessFile, clock: Clock) -> Self {
        Self::new(Some(file), clock)
    }

    fn new(file: Option<AccessFile>, clock: Clock) -> Self {
        let state = State {
            known: Known::Open,
            stamp: None,
            unread: None,
            looked_us: clock(),
            sessions: Sessions::default(),
            attempts: Attempts::default(),
        };
        let access = Self(Arc::new(Shared { file, clock, state: Mutex::new(state) }));
        if let Some(file) = &access.0.file {
            let mut state = access.0.state.lock();
            state.stamp = file.stamp();
            state.take(file, file.load());
        }
        access
    }

    /// Whether everybody may do everything.
    #[must_use]
    pub fn is_open(&self) -> bool {
        matches!(self.current().0.known, Known::Open)
    }

    /// Who shows this.
    #[must_use]
    pub fn who(&self, credential: &Credential) -> Who {
        let (state, now_us) = self.current();
        let Known::These(directory) = &state.known else { return Who::Anybody };
        let who = match credential {
            Credential::None => None,
            Credential::Token(token) => directory.token(&fingerprint(token)).map(|token| Who::Program {
                name: token.name.clone(),
                roles: token.roles.clone(),
                door: token.door.clone(),
            }),
            Credential::Session(session) => {
                let session = state.sessions.get(&fingerprint(session), now_us);
                session.and_then(|session| {
                    let user = directory.user(&session.user)?;
                    // Another password ends what began by the one before.
                    (user.password == session.password)
                        .then(|| Who::Person { name: user.name.clone(), role: user.role })
                })
            }
        };
        who.unwrap_or(Who::Nobody)
    }

    /// Lets a user in: what the browser shows from now on. Takes some hundredths of a second and 19 MB: one at a time.
    ///
    /// # Errors
    /// [`LogInError`].
    pub fn log_in(&self, from: IpAddr, name: &str, password: &str) -> Result<String, LogInError> {
        let kept = {
            let (mut state, now_us) = self.current();
            let Known::These(directory) = state.known.clone() else { return Err(LogInError::Open) };
            let begun = state.attempts.begin(from, now_us);
            begun.map_err(|Wait { seconds }| LogInError::Often(seconds))?;
            directory.user(name).map(|user| user.password.clone())
        };
        let is_right = password::is(password, kept.as_deref());
        let Some(kept) = kept.filter(|_| is_right) else { return Err(LogInError::Wrong) };
        let session = secret::session().map_err(|_| LogInError::Random)?;
        let (mut state, now_us) = self.current();
        state.attempts.was_right(from);
        state.sessions.begin(fingerprint(&session), name, &kept, now_us);
        Ok(session)
    }

    /// Ends a session.
    pub fn log_out(&self, session: &str) {
        self.0.state.lock().sessions.end(&fingerprint(session));
    }

    /// The newest state, and the time.
    fn current(&self) -> (MutexGuard<'_, State>, u64) {
        let now_us = (self.0.clock)();
        let mut state = self.0.state.lock();
        if let Some(file) = &self.0.file
            && now_us.saturating_sub(state.looked_us) >= LOOK_US
        {
            state.looked_us = now_us;
            let stamp = file.stamp();
            if stamp != state.stamp || state.unread.is_some() {
                state.stamp = stamp;
                state.take(file, file.load());
            }
        }
        (state, now_us)
    }
}

impl State {
    /// What was read of the file counts from now on.
    fn take(&mut self, file: &AccessFile, read: Result<Directory, AccessFileError>) {
        let unread = self.unread.take();
        self.known = match read {
            Ok(directory) if directory.is_empty() && matches!(self.known, Known::Open) => Known::Open,
            Ok(directory) => {
                if directory.users.is_empty() {
                    tracing::warn!("{}: no user can log in", file.path().display());
                }
                Known::These(Arc::new(directory))
            }
            Err(error) => {
                let why = error.to_string();
                // One that is tried again each second is said once.
                if unread.as_ref() != Some(&why) {
                    tracing::error!(
                        "{why}; until it is mended no user is let in, and only the way out is open"
                    );
                }
                self.unread = matches!(error, AccessFileError::System { .. }).then_some(why);
                Known::These(Arc::default())
            }
        };
    }
}

#[cfg(test)]
mod tests;
