//! Circles are found in small crates, and what looks like one is not.

use std::collections::BTreeSet;
use std::path::Path;

use structure::{Error, circles, modules};

/// The files of each circle in the crate that these files make.
fn circles(files: &[(&str, &str)]) -> Vec<BTreeSet<String>> {
    users(files, circles::between_files)
}

/// The files that use another one in each circle of the crate that these files make.
fn users(
    files: &[(&str, &str)],
    find: fn(&modules::Modules) -> Vec<circles::Circle>,
) -> Vec<BTreeSet<String>> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    let base = folder.path().canonicalize().unwrap();
    let short = |path: &Path| path.strip_prefix(&base).unwrap().display().to_string();
    let modules = modules::read(&folder.path().join("lib.rs")).unwrap();
    let files = |circle: &circles::Circle| circle.uses.iter().map(|each| short(&each.user)).collect();
    find(&modules).iter().map(files).collect()
}

fn circle(files: &[&str]) -> Vec<BTreeSet<String>> {
    vec![files.iter().map(ToString::to_string).collect()]
}

const A_USES_B: (&str, &str) = ("a.rs", "use crate::b::B;\npub struct A(B);");

#[test]
fn two_files_that_import_each_other_are_a_circle() {
    let files =
        [("lib.rs", "mod a; mod b;"), A_USES_B, ("b.rs", "pub struct B; use super::a::A; fn f(_: A) {}")];
    assert_eq!(circles(&files), circle(&["a.rs", "b.rs"]));
    assert_eq!(users(&files, circles::find), circle(&["a.rs", "b.rs"]), "told once");
}

#[test]
fn one_direction_is_no_circle() {
    let files = [("lib.rs", "pub mod a; pub mod b; pub use a::A;"), A_USES_B, ("b.rs", "pub struct B;")];
    assert_eq!(circles(&files), []);
}

#[test]
fn a_circle_over_three_files_is_named_once() {
    let files = [
        ("lib.rs", "mod a; mod b; mod c;"),
        A_USES_B,
        ("b.rs", "pub struct B(crate::c::C);"),
        ("c.rs", "pub struct C; impl C { fn f() -> Option<crate::a::A> { None } }"),
    ];
    assert_eq!(circles(&files), circle(&["a.rs", "b.rs", "c.rs"]));
}

#[test]
fn folders_that_need_each_other_are_a_circle_though_no_files_are() {
    let files = [
        ("lib.rs", "mod door; mod tracker; use door::doors::Doors; use tracker::Estimate;"),
        ("door/mod.rs", "pub mod doors; pub mod terms;"),
        ("door/doors.rs", "pub struct Doors(crate::tracker::Estimate);"),
        ("door/terms.rs", "pub struct Alarm;"),
        ("tracker.rs", "pub struct Estimate(crate::door::terms::Alarm);"),
    ];
    assert_eq!(circles(&files), []);
    assert_eq!(users(&files, circles::between_subjects), circle(&["door/doors.rs", "tracker.rs"]));
    assert_eq!(users(&files, circles::find), circle(&["door/doors.rs", "tracker.rs"]));
    let one_way =
        files.map(|(name, text)| (name, if name == "door/doors.rs" { "pub struct Doors;" } else { text }));
    assert_eq!(users(&one_way, circles::between_subjects), []);
}

#[test]
fn paths_in_code_macros_and_serde_attributes_count_as_imports_do() {
    for back in [
        "fn f() { crate::a::A::default(); }",
        "fn f() { println!(\"{}\", super::a::A); }",
        "#[serde(with = \"crate::a::A\")] struct S;",
        "fn f() { use super::a; let _ = a::A; }",
        "use super::*; fn f(_: a::A) {}",
        "impl From<super::a::A> for B {}",
        "macro_rules! m { () => { $crate::a::A } }",
    ] {
        let b = format!("pub struct B; {back}");
        let files = [("lib.rs", "mod a; mod b;"), A_USES_B, ("b.rs", b.as_str())];
        assert_eq!(circles(&files), circle(&["a.rs", "b.rs"]), "{back}");
    }
}

#[test]
fn texts_methods_fields_and_comments_do_not_count() {
    for back in [
        "/// See [`crate::a::A`].\nfn f() {}",
        "fn f(x: X) { x.a(); x.a; println!(\"{}\", x.a); }",
        "const T: &str = \"crate::a::A\";",
        "use ::a::A;",
        "#[cfg(test)] mod tests { use crate::a::A; }",
        "#[cfg(all(test, unix))] use crate::a::A;",
    ] {
        let b = format!("pub struct B; {back}");
        let files = [("lib.rs", "mod a; mod b;"), A_USES_B, ("b.rs", b.as_str())];
        assert_eq!(circles(&files), [], "{back}");
    }
}

#[test]
fn a_re_export_is_an_address_and_not_a_use() {
    let files = [
        ("lib.rs", "mod a; mod inner;"),
        ("inner/mod.rs", "mod b; mod c; pub use b::B; pub(crate) use c::C;"),
        ("inner/b.rs", "use super::C; pub struct B(C);"),
        ("inner/c.rs", "pub struct C;"),
        ("a.rs", "use crate::inner::{B, C}; struct A(B, C);"),
    ];
    assert_eq!(circles(&files), []);
}

#[test]
fn a_re_export_hides_no_circle() {
    let files = [
        ("lib.rs", "mod a; mod inner; pub use a::A;"),
        ("inner/mod.rs", "mod b; pub use b::*;"),
        ("inner/b.rs", "use crate::A; pub struct B(A);"),
        ("a.rs", "pub struct A(crate::inner::B);"),
    ];
    assert_eq!(circles(&files), circle(&["a.rs", "inner/b.rs"]));
}

#[test]
fn a_child_that_uses_its_parent_is_a_part_of_it() {
    let parent = "mod b; pub const LEN: usize = 3; pub struct P(b::B);";
    let files = [("lib.rs", "mod p;"), ("p.rs", parent), ("p/b.rs", "pub struct B([u8; super::LEN]);")];
    assert_eq!(circles(&files), []);
}

#[test]
fn children_that_use_each_other_are_a_circle_by_whatever_address() {
    let files = [
        ("lib.rs", "mod p;"),
        ("p.rs", "mod b; mod c; pub use b::B; pub use c::C;"),
        ("p/b.rs", "pub struct B(super::C);"),
        ("p/c.rs", "pub struct C(Option<Box<super::b::B>>);"),
    ];
    assert_eq!(circles(&files), circle(&["p/b.rs", "p/c.rs"]));
}

#[test]
fn inline_modules_belong_to_their_file_and_find_their_own_children() {
    let files = [
        ("lib.rs", "mod a { pub mod deep; pub struct A(super::B); } struct B;"),
        ("a/deep.rs", "pub struct D;"),
    ];
    assert_eq!(circles(&files), []);
    let files = [
        ("lib.rs", "mod a { pub mod deep; pub struct A(deep::D); }"),
        ("a/deep.rs", "pub struct D(Option<super::A>);"),
    ];
    assert_eq!(circles(&files), [], "deep lies in a");
}

#[test]
fn path_attributes_name_the_file() {
    let files = [
        (
            "lib.rs",
            "#[path = \"other/here.rs\"] mod a; #[path = \".\"] mod g { #[path = \"b2.rs\"] pub mod b; }",
        ),
        ("other/here.rs", "pub struct A(crate::g::b::B);"),
        ("b2.rs", "pub struct B(Option<crate::a::A>);"),
    ];
    assert_eq!(circles(&files), circle(&["b2.rs", "other/here.rs"]));
}

#[test]
fn items_that_a_macro_spells_out_are_found() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "counters! { pub struct A { x: crate::b::B } }"),
        ("b.rs", "pub struct B; fn f(_: super::a::A) {}"),
    ];
    assert_eq!(circles(&files), circle(&["a.rs", "b.rs"]));
}

#[test]
fn modules_that_import_all_of_each_other_end() {
    let files = [
        ("lib.rs", "mod a; mod b;"),
        ("a.rs", "use super::b::*; struct A(None);"),
        ("b.rs", "use super::a::*;"),
    ];
    assert_eq!(circles(&files), []);
}

#[test]
fn a_damaged_or_missing_file_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("lib.rs");
    std::fs::write(&root, "\nstruct;").unwrap();
    let error = modules::read(&root).unwrap_err();
    assert!(matches!(&error, Error::Parse { line: 2, path, .. } if path.ends_with("lib.rs")), "{error}");
    std::fs::write(&root, "mod gone;").unwrap();
    let error = modules::read(&root).unwrap_err();
    assert!(matches!(&error, Error::Read { path, .. } if path.ends_with("gone/mod.rs")), "{error}");
}
