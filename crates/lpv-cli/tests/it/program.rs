//! Running the program in a folder of its own.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A double integrator with a limited input, under one controller of each method and one with a filter.
pub const DOUBLE_INTEGRATOR: &str = r#"name = "cart"
title = "A cart"

[plant]
name = "double-integrator"

[weights]
Q_diag = [1, 1]
R_diag = [0.1]

[limits]
min = -1.0
max = 1.0

[simulation]
duration_s = 3.0
sample_time_s = 0.01
record_interval_s = 0.05
seed = 7

[noise]
process_diag = [1e-6]
measurement_diag = [1e-4]

[[set_point]]
time_s = 0.5
x_1 = 0.5

[[controller]]
name = "regulator"
method = "lpvqr"

[[controller]]
name = "saturated"
method = "slpvqr"
gamma = 2

[[controller]]
name = "high-gain"
label = "High gain, γ = 2"
method = "high-gain-slpvqr"
gamma = 2

[[controller]]
name = "filtered"
method = "high-gain-slpvqr"
gamma = 2
noise = true
estimator = "ekf"
"#;

/// The quadrotor over a coarse grid, for a short flight.
pub const QUADROTOR: &str = r#"name = "hop"

[plant]
name = "quadrotor"

[model]
grid_points = 4

[weights]
Q_diag = [1, 1, 100, 1, 1, 50, 50, 50, 50, 1, 1, 100]
R_diag = [0.001, 0.001, 0.001, 0.001]

[limits]
min = 0.0
max = 9.807

[simulation]
duration_s = 0.5
sample_time_s = 0.002
seed = 1

[noise]
process_diag = [1e-4, 1e-4, 1e-4, 1e-4]
measurement_diag = [0.01, 0.01, 0.01, 0.0076, 0.0076, 0.0076]

[[set_point]]
time_s = 0.1
r_x = 0.5
psi_deg = 20

[[controller]]
name = "regulator"
method = "lpvqr"
schedule = "vertices"

[[controller]]
name = "saturated"
method = "slpvqr"
gamma = 10

[[controller]]
name = "filtered"
method = "slpvqr"
gamma = 10
noise = true
estimator = "ekf"
"#;

/// A folder with `scenario.toml` in it, in which the program runs.
pub struct Place {
    folder: TempDir,
}

/// How the program ended.
pub struct Ended {
    /// Its exit code.
    pub code: i32,
    /// What it wrote to standard output.
    pub out: String,
    /// What it wrote to standard error.
    pub err: String,
}

impl Place {
    /// A new folder with the scenario `text`.
    pub fn with(text: impl AsRef<[u8]>) -> Self {
        let place = Self { folder: TempDir::new().unwrap() };
        place.write("scenario.toml", text);
        place
    }

    /// The path of `name` in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Write the file `name`.
    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        fs::write(self.path(name), contents).unwrap();
    }

    /// The text of the file `name`.
    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The file `name` as JSON.
    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// The program with `arguments`, separated by blanks, ready to start in the folder.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lpv"));
        command.args(arguments.split_whitespace()).current_dir(self.folder.path()).env("RUST_BACKTRACE", "1");
        command
    }

    /// Run the program with `arguments`.
    pub fn lpv(&self, arguments: &str) -> Ended {
        Ended::from(self.command(arguments).output().unwrap())
    }

    /// Run the program with `arguments`, which has to succeed without a word on standard error.
    pub fn succeed(&self, arguments: &str) -> String {
        let ended = self.lpv(arguments);
        assert_eq!((ended.code, &*ended.err), (0, ""), "lpv {arguments}");
        ended.out
    }

    /// Every file below the folder and its bytes.
    pub fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let mut files = BTreeMap::new();
        collect(self.folder.path(), "", &mut files);
        files
    }

    /// The names in the folder `name`, in order.
    pub fn list(&self, name: &str) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.path(name))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// The names of the designs in the folder `name`, in order.
    pub fn designs(&self, name: &str) -> Vec<String> {
        self.list(name).into_iter().filter(|name| name.starts_with("design-")).collect()
    }
}

fn collect(folder: &Path, prefix: &str, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{name}/"), files);
        } else {
            files.insert(name, fs::read(entry.path()).unwrap());
        }
    }
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().expect("the program ends by itself"),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

impl Ended {
    /// Ended with `code` and one line on standard error that holds all `words`, in the program's own words: no panic, no
    /// backtrace, no Rust.
    #[track_caller]
    pub fn refuses(&self, code: i32, words: &[&str]) {
        let Self { err, .. } = self;
        assert_eq!(self.code, code, "{err}");
        assert_eq!(err.lines().count(), 1, "one line: {err}");
        assert!(err.starts_with("lpv: "), "{err}");
        for word in words {
            assert!(err.contains(word), "\"{word}\" is missing: {err}");
        }
        for rust in ["panicked", "Some(", "None", "Err(", "usize", "u64", "f64", "struct"] {
            assert!(!err.contains(rust), "\"{rust}\" is Rust: {err}");
        }
    }
}

/// `text` with its only `from` replaced by `to`.
#[track_caller]
pub fn edited(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "\"{from}\" stands once");
    text.replace(from, to)
}

/// JSON that the program printed.
pub fn parsed(out: &str) -> Value {
    serde_json::from_str(out).unwrap()
}
