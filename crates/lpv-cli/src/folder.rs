//! Result folders that are whole or not there: written beside their place, then moved into it.

use crate::failure::Failure;
use std::fs;
use std::path::{Path, PathBuf};

/// A result folder being written.
pub struct ResultFolder {
    place: PathBuf,
    partial: PathBuf,
    finished: bool,
}

impl ResultFolder {
    /// Begin the folder that is to stand at `place`.
    ///
    /// # Errors
    /// `place` exists and `replace` is not set, or the folder cannot be created. Nothing is changed then.
    pub fn begin(place: &Path, replace: bool) -> Result<Self, Failure> {
        if place.exists() && !replace {
            return Err(Failure::Output {
                path: place.to_owned(),
                message: "holds an earlier result; give --force to replace it, or --out another folder".into(),
            });
        }
        let unusable = || Failure::Output { path: place.to_owned(), message: "is not a folder name".into() };
        let name = place.file_name().ok_or_else(unusable)?;
        let partial = place.with_file_name(format!(".{}.partial-{}", name.to_string_lossy(), std::process::id()));
        let failed = |error: std::io::Error| Failure::Output {
            path: place.to_owned(),
            message: format!("cannot be written: {error}; give --out a folder that can"),
        };
        fs::create_dir_all(&partial).map_err(failed)?;
        Ok(Self { place: place.to_owned(), partial, finished: false })
    }

    /// Write one file of the result.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, contents: &[u8]) -> Result<(), Failure> {
        let path = self.partial.join(name);
        fs::write(&path, contents).map_err(|error| Failure::io(&path, &error))
    }

    /// Move the folder to its place, with what it replaces deleted only after that worked.
    ///
    /// # Errors
    /// The folder cannot be moved; an earlier result is then still where it was.
    pub fn finish(mut self) -> Result<PathBuf, Failure> {
        let failed = |error: std::io::Error| Failure::io(&self.place, &error);
        let aside = self.partial.with_extension("replaced");
        let replaces = self.place.exists();
        if replaces {
            fs::rename(&self.place, &aside).map_err(failed)?;
        }
        if let Err(error) = fs::rename(&self.partial, &self.place) {
            if replaces {
                fs::rename(&aside, &self.place).map_err(failed)?;
            }
            return Err(failed(error));
        }
        self.finished = true;
        if replaces {
            fs::remove_dir_all(&aside).map_err(|error| Failure::io(&aside, &error))?;
        }
        Ok(self.place.clone())
    }
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        if !self.finished {
            // the result is lost already; a left-over folder is all that could be reported
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}
