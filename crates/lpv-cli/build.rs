//! Builds the web page of the report from `studio/` with npm, when it is missing or older than its sources.
//!
//! Where npm is missing or fails, the program is built with a plain page instead and a warning says what to install.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// What the page is made from, relative to `studio/`.
const SOURCES: [&str; 6] = ["src", "build.mjs", "package.json", "package-lock.json", "tsconfig.json", ".npmrc"];
const NPM: &str = if cfg!(windows) { "npm.cmd" } else { "npm" };

fn main() {
    let studio = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studio");
    let plain = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/plain-report.html");
    let target = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("report.html");
    println!("cargo:rerun-if-changed={}", plain.display());
    println!("cargo:rerun-if-env-changed=PATH");
    for source in SOURCES {
        println!("cargo:rerun-if-changed={}", studio.join(source).display());
    }
    println!("cargo:rerun-if-changed={}", studio.join("dist/report.html").display());

    let page = page(&studio).unwrap_or_else(|reason| {
        println!("cargo:warning=The report will have no plots and no 3D view: {reason}.");
        println!("cargo:warning=Install Node.js 20 or newer with npm (Debian: apt-get install nodejs npm; others: nodejs.org) and build again.");
        plain
    });
    fs::copy(&page, &target).expect("the report page can be copied to the build folder");
}

/// The page, built if need be; or why there is none.
fn page(studio: &Path) -> Result<PathBuf, String> {
    let page = studio.join("dist/report.html");
    let stamp = studio.join("dist/sources.hash");
    let sources = hash(studio).map_err(|error| format!("{} cannot be read: {error}", studio.display()))?;
    let is_fresh = page.is_file() && fs::read_to_string(&stamp).is_ok_and(|stamp| stamp == sources);
    if !is_fresh {
        if !has_packages(studio) {
            npm(studio, &["ci", "--omit=dev"])?;
        }
        npm(studio, &["run", "build"])?;
        fs::write(&stamp, &sources).map_err(|error| format!("{} cannot be written: {error}", stamp.display()))?;
    }
    Ok(page)
}

/// Whether the packages of the lock file are installed: npm leaves a copy of it when it is done.
fn has_packages(studio: &Path) -> bool {
    let modified = |path: &str| fs::metadata(studio.join(path)).and_then(|data| data.modified());
    match (modified("node_modules/.package-lock.json"), modified("package-lock.json")) {
        (Ok(installed), Ok(locked)) => installed >= locked,
        _ => false,
    }
}

fn npm(studio: &Path, arguments: &[&str]) -> Result<(), String> {
    let spelled = format!("npm {}", arguments.join(" "));
    match Command::new(NPM).args(arguments).current_dir(studio).output() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err("npm is not installed".into()),
        Err(error) => Err(format!("`{spelled}` could not be started: {error}")),
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stderr);
            let last =
                text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it printed nothing").to_owned();
            Err(format!("`{spelled}` in studio/ failed: {last}"))
        }
    }
}

/// A hash of the names and contents of all sources.
fn hash(studio: &Path) -> io::Result<String> {
    let mut hasher = DefaultHasher::new();
    for source in SOURCES {
        hash_path(&studio.join(source), &mut hasher)?;
    }
    Ok(format!("{:016x}", hasher.finish()))
}

fn hash_path(path: &Path, hasher: &mut DefaultHasher) -> io::Result<()> {
    path.file_name().hash(hasher);
    if path.is_dir() {
        let mut entries: Vec<PathBuf> =
            fs::read_dir(path)?.map(|entry| entry.map(|e| e.path())).collect::<io::Result<_>>()?;
        entries.sort();
        entries.iter().try_for_each(|entry| hash_path(entry, hasher))
    } else {
        fs::read(path)?.hash(hasher);
        Ok(())
    }
}
