//! Who else has the editor open: two browsers, one of which goes without a word.

mod chromium;
mod described;
mod house;
mod http_client;

use std::net::SocketAddr;
use std::sync::Arc;

use chromium::Page;
use host_tracker::access::roles::Role;
use host_tracker::site_file::SiteFile;
use host_tracker::web::{Server, ServerContext};
use house::{House, PASSWORD, ZONE};
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use serde_json::json;
use tokio::sync::watch;

/// What the editor says of others.
const SAID: &str = "document.querySelector('#edit-others').textContent";

/// Logs in, and opens the editor.
fn edit(house: &House, page: &mut Page, name: &str) {
    page.size(1280, 800, 1);
    page.scheme("light");
    page.open(&format!("http://{}/", house.server.address()));
    page.wait(
        "the log-in page comes",
        "location.pathname === '/login.html' && !document.querySelector('#send').disabled",
    );
    for (field, text) in [("#name", name), ("#password", PASSWORD)] {
        page.click(field);
        page.write(text);
    }
    page.click("#send");
    page.wait("the map comes", "location.pathname === '/' && !document.querySelector('#log-out').hidden");
    show(house);
    page.wait("it is live", "document.querySelector('#link').dataset.state === 'live'");
    page.wait("the site is there", "document.querySelector('#site-name').textContent === 'house'");
    page.click("#edit-open");
    page.wait("the editor is open", "document.querySelector('#edit-others') !== null");
}

fn show(house: &House) {
    house.frames.send_replace(Arc::new(Snapshot { unix_ms: unix_ms(), ..Snapshot::default() }));
}

#[test]
fn an_editor_says_who_else_has_it_open_until_they_leave_or_are_cut_off() {
    let (Some(mut anna), Some(mut ben)) = (chromium::start(), chromium::start()) else { return };
    let house = House::of(ZONE);
    house.add("ben", Role::Edit);
    edit(&house, &mut anna, "anna");
    assert_eq!(anna.value(SAID), json!(""), "no other user");
    edit(&house, &mut ben, "ben");
    anna.wait("anna is told of ben", &format!("{SAID} === 'ben has the editor open, too.'"));
    ben.wait("ben is told of anna", &format!("{SAID} === 'anna has the editor open, too.'"));
    anna.fits_a_phone("presence");
    // It stands while the form is made anew.
    anna.click("#tool-zone");
    anna.wait("it is still said", &format!("{SAID} === 'ben has the editor open, too.'"));
    ben.click("#cancel");
    ben.wait("ben has closed the editor", "!document.body.classList.contains('editing')");
    anna.wait("anna is alone", &format!("{SAID} === ''"));
    ben.click("#edit-open");
    anna.wait("ben is back", &format!("{SAID} === 'ben has the editor open, too.'"));
    assert_eq!((anna.errors.len(), ben.errors.len()), (0, 0), "{:?} {:?}", anna.errors, ben.errors);
    // The whole browser goes, and its connection with it.
    drop(ben);
    anna.wait("whose connection is gone, is gone", &format!("{SAID} === ''"));
}

#[test]
fn windows_of_unknown_users_are_counted() {
    let (Some(mut one), Some(mut other)) = (chromium::start(), chromium::start()) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("house.toml");
    std::fs::write(&path, ZONE).unwrap();
    let (_frames, newest) = watch::channel(Arc::new(Snapshot { unix_ms: unix_ms(), ..Snapshot::default() }));
    let context = ServerContext::alone(newest, SiteFile::load(&path).unwrap());
    let server = Server::start(SocketAddr::from(([127, 0, 0, 1], 0)), context).unwrap();
    for page in [&mut one, &mut other] {
        page.size(1280, 800, 1);
        page.open(&format!("http://{}/", server.address()));
        page.wait("the site is there", "document.querySelector('#site-name').textContent === 'house'");
        page.click("#edit-open");
        page.wait("the editor is open", "document.querySelector('#edit-others') !== null");
    }
    one.wait("it says so", &format!("{SAID} === 'another window has the editor open, too.'"));
    other.wait("to both", &format!("{SAID} === 'another window has the editor open, too.'"));
}
