//! The quadrotor designs of `lmi`'s example, written by it as `.dat-s`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Both files.
pub fn write(folder: &Path) -> Result<Vec<PathBuf>, super::Failure> {
    let mut files = Vec::new();
    for (name, flag) in [("quadrotor-high-gain", None), ("quadrotor-low-gain", Some("--low-gain"))] {
        let file = folder.join(format!("{name}.dat-s"));
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/release/examples/saturated_regulator");
        let output = Command::new(&example).args(flag).arg("--write").output()?;
        std::fs::write(&file, output.stdout)?;
        files.push(file);
    }
    Ok(files)
}
