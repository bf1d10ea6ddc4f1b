//! The reader and the checks on sources of a few lines, with what they have to find.

use super::graph::circles;
use super::modules::{Code, Named, Sources};
use super::table::{Known, Row};
use super::{against_known, against_table};

/// What files of the crate `lpv` name; the first is its root.
fn named(files: &[(&str, &str)]) -> Named {
    let sources: Sources = files.iter().map(|(file, text)| (format!("lpv/src/{file}"), text.to_string())).collect();
    let named = Code::read(&sources, &[("lpv", "lpv/src/lib.rs")]).named();
    assert!(named.lost.is_empty(), "{:?}", named.lost);
    named
}

/// The arrows among files, without their folder.
fn arrows(files: &[(&str, &str)]) -> Vec<String> {
    let short = |file: &str| file.strip_prefix("lpv/src/").unwrap().to_owned();
    named(files).arrows.iter().map(|(from, to)| format!("{} -> {}", short(from), short(to))).collect()
}

/// What `text` names in a file `user.rs` beside a module `a` with a child `b`.
fn found(text: &str) -> Vec<String> {
    let files = [
        ("lib.rs", "mod a; mod user;"),
        ("a/mod.rs", "pub mod b; pub struct A; pub fn f() {} pub use std::fmt::Debug;"),
        ("a/b.rs", "pub struct B; pub enum Kind { One } pub const NUMBER: f64 = 1.0;"),
        ("user.rs", text),
    ];
    arrows(&files).iter().filter_map(|arrow| arrow.strip_prefix("user.rs -> ")).map(str::to_owned).collect()
}

#[test]
fn a_path_is_found_wherever_it_stands() {
    for text in [
        "use crate::a::b::B;",
        "use super::a::b::B;",
        "use self::inner::B; mod inner { pub use super::super::a::b::B; }",
        "use super::{a::b::{B, Kind}};",
        "use super::{a::{b::B as Renamed}};",
        "use super::a::b::{self};",
        "use super::a::b::*;",
        "use crate::a::b::Kind::*;",
        "use super as up; fn f() -> f64 { up::a::b::NUMBER }",
        "fn f() -> f64 { super::a::b::NUMBER }",
        "fn f(x: Option<&crate::a::b::B>) {}",
        "impl From<super::a::b::B> for f64 {}",
        "fn f() { use super::a::b as inner; inner::NUMBER; }",
        "fn f(x: u8) -> u8 { match x { _ if crate::a::b::Kind::One as u8 == x => 1, _ => 0 } }",
        "fn f() { println!(\"{}\", 2.0 * super::a::b::NUMBER); }",
        "macro_rules! m { () => { $crate::a::b::NUMBER } }",
        "struct S { #[serde(with = \"crate::a::b\")] x: f64 }",
        "mod inner { fn f() { super::super::a::b::NUMBER; } }",
        "#[cfg(not(test))] use crate::a::b::B;",
    ] {
        assert_eq!(found(text), ["a/b.rs"], "{text}");
    }
}

#[test]
fn what_only_looks_like_a_path_or_is_for_tests_is_not_found() {
    for text in [
        "// crate::a::b::B\n/// [`crate::a::b::B`]\nfn f() -> &'static str { \"crate::a::b::B\" }",
        "#[cfg(test)] mod tests { use crate::a::b::B; }",
        "#[cfg(all(test, unix))] use crate::a::b::B;",
        "#[test] fn f() { crate::a::b::NUMBER; }",
        "struct S; impl S { #[cfg(test)] fn f() { crate::a::b::NUMBER; } }",
        "pub(in super::super) fn f() { let a = 1.0; let _ = a; }",
        "mod a { pub struct B; } use a::B;",
        "use std::fmt; fn f(_: fmt::Error) {}",
    ] {
        assert_eq!(found(&text.replace("pub(in super::super)", "pub(in super)")), [""; 0], "{text}");
    }
}

#[test]
fn grouped_imports_name_each_file() {
    let text = "use super::{a, a::b::Kind as K}; fn f(_: a::A, _: K) {}";
    assert_eq!(found(text), ["a/b.rs", "a/mod.rs"]);
}

#[test]
fn a_name_is_followed_to_the_file_that_defines_it() {
    let files = |user| {
        [
            ("lib.rs", "mod facade; mod user;"),
            (
                "facade/mod.rs",
                "mod inner; mod f; pub use inner::*; pub use inner::B as C; pub use f::f; pub use std::fmt::Debug;",
            ),
            ("facade/inner.rs", "pub struct B;"),
            ("facade/f.rs", "pub fn f() {}"),
            ("user.rs", user),
        ]
    };
    let down = ["facade/mod.rs -> facade/f.rs", "facade/mod.rs -> facade/inner.rs"];
    for (user, file) in [
        ("use crate::facade::C;", "facade/inner.rs"),
        ("use crate::facade::B;", "facade/inner.rs"),
        ("use crate::facade::*; fn g(_: B) {}", "facade/inner.rs"),
        // a function beside the module of its name
        ("use crate::facade::f; fn g() { f() }", "facade/f.rs"),
    ] {
        let found = arrows(&files(user));
        assert_eq!(found[..2], down);
        assert!(found.contains(&format!("user.rs -> {file}")), "{user}: {found:?}");
    }
    // a name from outside is defined in no file, but passed on by one
    let named = named(&files("use crate::facade::Debug;"));
    let user = |arrow: &&(String, String)| arrow.0 == "lpv/src/user.rs";
    assert_eq!(named.arrows.iter().filter(user).count(), 0);
    assert_eq!(
        named.passed_on.iter().filter(user).map(|(_, to)| to.as_str()).collect::<Vec<_>>(),
        ["lpv/src/facade/mod.rs"]
    );
}

#[test]
fn what_leads_out_is_kept_with_its_crate() {
    let named = named(&[("lib.rs", "use faer::Mat; fn f() { ::rayon::join(|| (), || ()); }")]);
    let outside: Vec<&str> = named.outside.iter().map(|(_, to)| to.as_str()).collect();
    assert_eq!(outside, ["faer", "rayon"]);
}

#[test]
fn a_path_that_leads_nowhere_is_told() {
    let sources = Sources::from([("lpv/src/lib.rs".into(), "use crate::missing::X;".into())]);
    assert_eq!(Code::read(&sources, &[("lpv", "lpv/src/lib.rs")]).named().lost, ["lpv/src/lib.rs: crate::missing::X"]);
}

/// Three files in a circle, of which the last hides its arrow in a group with another name.
const CIRCLE: [(&str, &str); 4] = [
    ("lib.rs", "mod a; mod b; mod c;"),
    ("a.rs", "pub struct A; fn f(_: crate::b::B) {}"),
    ("b.rs", "pub struct B; fn f() { super::c::g(); }"),
    ("c.rs", "use super::{a::{A as Hidden}}; pub fn g() {} fn h(_: Hidden) {}"),
];

#[test]
fn a_circle_is_caught() {
    let found = named(&CIRCLE).arrows;
    let wrong = against_known(&found, &[]);
    assert_eq!(wrong.len(), 1);
    for arrow in ["a.rs -> lpv/src/b.rs", "b.rs -> lpv/src/c.rs", "c.rs -> lpv/src/a.rs"] {
        assert!(wrong[0].contains(arrow), "{}", wrong[0]);
    }
    let open = [CIRCLE[0], CIRCLE[1], CIRCLE[2], ("c.rs", "pub fn g() {} #[cfg(test)] mod tests { use crate::a::A; }")];
    assert!(circles(&named(&open).arrows).is_empty());
}

#[test]
fn a_known_circle_may_stay_until_it_is_none() {
    let known = [Known { why: "a test", against: &[("lpv/src/c.rs", "lpv/src/a.rs")] }];
    assert_eq!(against_known(&named(&CIRCLE).arrows, &known), [""; 0]);
    let open = [CIRCLE[0], CIRCLE[1], ("b.rs", "pub struct B;"), CIRCLE[3]];
    let wrong = against_known(&named(&open).arrows, &known);
    assert_eq!(wrong, ["lpv/src/c.rs -> lpv/src/a.rs closes no circle any more: take it out of the list"]);
    // a child that uses what its parent defines, below a parent that passes the child on
    let parent = [
        ("lib.rs", "mod a;"),
        ("a/mod.rs", "mod b; pub use b::B; pub struct A;"),
        ("a/b.rs", "use super::A; pub struct B(A);"),
    ];
    assert_eq!(against_known(&named(&parent).arrows, &[]).len(), 1);
}

#[test]
fn an_arrow_that_the_table_does_not_allow_is_caught() {
    let files = [
        ("lib.rs", "mod math; mod plant; mod sim;"),
        ("math.rs", "pub struct M;"),
        ("plant/mod.rs", "mod child;"),
        ("plant/child.rs", "use crate::math::M; pub fn g(_: M) {}"),
        ("sim.rs", "fn f() { crate::math::M; }"),
    ];
    let found = named(&files).arrows;
    let row = |module, uses| Row { module, uses };
    let right = [row("math", &[]), row("plant", &["math"]), row("sim", &["math"])];
    let check = |rows: &[Row]| against_table(&found, &Default::default(), &[("lpv", rows)]);
    assert_eq!(check(&right), [""; 0]);
    assert_eq!(check(&right[..2]), ["lpv: sim uses math, which the table does not allow"]);
    let more = [row("math", &[]), row("plant", &["math"]), row("sim", &["math", "plant"])];
    assert_eq!(check(&more), ["lpv: sim does not use plant any more: take it out of the table"]);
    let order = [row("plant", &["math"]), row("math", &[]), row("sim", &["math"])];
    assert_eq!(check(&order), ["lpv: plant uses math, which stands below it in the table"]);
}
