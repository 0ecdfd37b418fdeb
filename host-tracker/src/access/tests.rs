//! Who is let in, by a file and a clock of the test's own.

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};

use super::directory::Token;
use super::*;
use kehai_tracking::door::inbox::Input;

const S: u64 = 1_000_000;
const PASSWORD: &str = "correct horse battery";
const HERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

struct House {
    access: Access,
    file: AccessFile,
    now_us: Arc<AtomicU64>,
    _folder: tempfile::TempDir,
}

impl House {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = AccessFile::beside(&folder.path().join("home.toml"));
        let now_us = Arc::new(AtomicU64::new(0));
        let clock = Arc::clone(&now_us);
        let access = Access::timed(file.clone(), Box::new(move || clock.load(Ordering::SeqCst)));
        Self { access, file, now_us, _folder: folder }
    }

    fn of_anna() -> Self {
        let house = Self::new();
        house.add("anna", Role::Edit);
        house.pass(S);
        house
    }

    fn add(&self, name: &str, role: Role) {
        let password = password::hash(PASSWORD).unwrap();
        let user = User { name: name.into(), role, password };
        self.file.change(|directory| directory.add_user(user)).unwrap();
    }

    fn pass(&self, time_us: u64) {
        self.now_us.fetch_add(time_us, Ordering::SeqCst);
    }

    fn log_in(&self) -> Credential {
        Credential::Session(self.access.log_in(HERE, "anna", PASSWORD).unwrap())
    }
}

#[test]
fn who_is_added_while_it_runs_shuts_it_and_it_never_opens_again() {
    let house = House::new();
    assert!(house.access.is_open());
    assert_eq!(house.access.who(&Credential::None), Who::Anybody);
    assert_eq!(house.access.log_in(HERE, "anna", PASSWORD), Err(LogInError::Open));
    house.add("anna", Role::Admin);
    house.pass(S);
    assert!(!house.access.is_open());
    assert_eq!(house.access.who(&Credential::None), Who::Nobody);
    assert_ne!(house.access.who(&house.log_in()), Who::Nobody);
    for text in [None, Some("[[user"), Some("")] {
        match text {
            None => fs::remove_file(house.file.path()).unwrap(),
            Some(text) => fs::write(house.file.path(), text).unwrap(),
        }
        house.pass(S);
        assert_eq!(house.access.who(&Credential::None), Who::Nobody, "{text:?}");
        assert!(!house.access.is_open());
        assert_eq!(house.access.log_in(HERE, "anna", PASSWORD), Err(LogInError::Wrong));
    }
}

#[test]
fn a_file_that_could_not_be_read_for_a_moment_is_read_again_though_it_is_the_same() {
    let house = House::of_anna();
    let anna = house.log_in();
    let failed = |error: std::io::Error| AccessFileError::System { file: house.file.path().into(), error };
    let moment = std::io::Error::other("too many open files");
    house.access.0.state.lock().take(&house.file, Err(failed(moment)));
    assert_eq!(house.access.who(&anna), Who::Nobody);
    house.pass(S);
    assert_eq!(house.access.who(&anna), Who::Person { name: "anna".into(), role: Role::Edit });
}

#[test]
fn a_damaged_file_lets_no_user_in_from_the_beginning_but_the_way_out_is_free() {
    let folder = tempfile::tempdir().unwrap();
    let file = AccessFile::beside(&folder.path().join("home.toml"));
    fs::write(file.path(), "[[user").unwrap();
    let access = Access::of(file);
    let who = access.who(&Credential::None);
    assert_eq!(who, Who::Nobody);
    assert!(who.may(Action::Tell(Input::Exit), Some("front")) && !who.may(Action::Look, None));
}

#[test]
fn a_session_ends_by_time_log_out_password_and_removal() {
    let house = House::of_anna();
    let anna = Who::Person { name: "anna".into(), role: Role::Edit };
    let [first, second] = [house.log_in(), house.log_in()];
    assert_eq!([house.access.who(&first), house.access.who(&second)], [anna.clone(), anna.clone()]);
    let Credential::Session(shown) = &first else { unreachable!() };
    assert_eq!(house.access.who(&Credential::Token(shown.clone())), Who::Nobody, "it is no token");
    house.access.log_out(shown);
    assert_eq!([house.access.who(&first), house.access.who(&second)], [Who::Nobody, anna.clone()]);
    house.pass(12 * 3600 * S - 1);
    assert_eq!(house.access.who(&second), anna);
    house.pass(1);
    assert_eq!(house.access.who(&second), Who::Nobody, "12 hours are over");

    let third = house.log_in();
    let other = password::hash("another good password").unwrap();
    house.file.change(|directory| directory.set_password("anna", other)).unwrap();
    house.pass(S);
    assert_eq!(house.access.who(&third), Who::Nobody, "another password");
    let fourth = Credential::Session(house.access.log_in(HERE, "anna", "another good password").unwrap());
    assert_eq!(house.access.who(&fourth), anna);
    house.file.change(|directory| directory.remove_user("anna")).unwrap();
    house.pass(S);
    assert_eq!(house.access.who(&fourth), Who::Nobody, "removed");
}

#[test]
fn wrong_passwords_are_limited_and_the_right_one_with_them() {
    let house = House::of_anna();
    for number in 0..10 {
        let name = if number % 2 == 0 { "anna" } else { "stranger" };
        assert_eq!(house.access.log_in(HERE, name, "wrong"), Err(LogInError::Wrong));
    }
    assert_eq!(house.access.log_in(HERE, "anna", PASSWORD), Err(LogInError::Often(30)));
    assert!(house.access.log_in(IpAddr::from([192, 168, 1, 7]), "anna", PASSWORD).is_ok(), "another address");
    house.pass(30 * S);
    assert!(house.access.log_in(HERE, "anna", PASSWORD).is_ok());
}

#[test]
fn a_token_is_for_its_roles_and_its_door() {
    let house = House::of_anna();
    let shown = secret::token().unwrap();
    let token = Token {
        name: "front".into(),
        roles: vec![Role::Reader, Role::Contact],
        door: Some("front".into()),
        sha256: fingerprint(&shown),
    };
    house.file.change(|directory| directory.add_token(token)).unwrap();
    house.pass(S);
    let who = house.access.who(&Credential::Token(shown.clone()));
    assert_eq!(who.to_string(), "token front (reader, contact of door front)");
    let tell = |input, door| who.may(Action::Tell(input), Some(door));
    assert!(tell(Input::Card, "front") && tell(Input::Contact, "front"));
    assert!(
        !tell(Input::Card, "back") && !tell(Input::Number, "front") && !who.may(Action::LookAtDoor, None)
    );
    assert!(tell(Input::Exit, "back"));
    assert_eq!(house.access.who(&Credential::Token(format!("{shown}a"))), Who::Nobody);
    assert_eq!(house.access.who(&Credential::Session(shown)), Who::Nobody, "it is no session");
}

#[test]
fn the_first_admin_is_made_once() {
    let house = House::new();
    let password = first_admin(&house.file).unwrap().unwrap();
    house.pass(S);
    assert!(house.access.log_in(HERE, FIRST, &password).is_ok());
    assert!(first_admin(&house.file).unwrap().is_none());
    assert!(house.access.log_in(HERE, FIRST, &password).is_ok());
}
