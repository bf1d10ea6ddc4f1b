//! A module uses only what stands to its left in the data flow, and the certificate never calls the solver.

use std::fs;
use std::path::{Path, PathBuf};

const ORDER: [&str; 8] = ["math", "plant", "model", "controller", "synthesis", "certificate", "estimator", "sim"];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

/// The code of a file without its comments: docs may point anywhere.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

#[test]
fn modules_use_only_what_stands_to_their_left() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut checked = 0;
    for (position, module) in ORDER.iter().enumerate() {
        for file in sources(&root.join(module)) {
            let code = code(&file);
            for right in &ORDER[position + 1..] {
                assert!(!code.contains(&format!("crate::{right}")), "{} uses {right}", file.display());
            }
            checked += 1;
        }
    }
    assert!(checked > 20, "the modules are not where this test looks");
}

#[test]
fn solver_is_known_to_synthesis_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for file in sources(&root) {
        let inside = file.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
        let code = code(&file);
        if !inside.starts_with("synthesis") {
            assert!(!code.contains("lmi::"), "{inside} uses the solver");
        }
        if inside.starts_with("sim") {
            assert!(!code.contains("crate::synthesis"), "{inside} designs");
        }
        // dense linear algebra is named in math only
        if !inside.starts_with("math") {
            assert!(!code.contains("faer"), "{inside} names the linear-algebra crate");
        }
    }
}
