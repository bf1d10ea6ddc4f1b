//! Result folders that are whole or not there: written beside their place, then moved into it.

use crate::failure::Failure;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A result folder being written.
pub struct ResultFolder {
    place: PathBuf,
    partial: PathBuf,
    replace: bool,
}

impl ResultFolder {
    /// Begin the folder that is to stand at `place`. Nothing stays on disk until the first file is written, so that a run
    /// that is stopped while it computes leaves nothing behind.
    ///
    /// # Errors
    /// `place` holds something and `replace` is not set, or it holds something that is no result of this program, or
    /// the folder cannot be created. Nothing is changed then.
    pub fn begin(place: &Path, replace: bool) -> Result<Self, Failure> {
        let unusable = || Failure::Output { path: place.to_owned(), message: "is not a folder name".into() };
        let name = place.file_name().ok_or_else(unusable)?.to_string_lossy();
        let folder = Self {
            partial: place.with_file_name(format!(".{name}.partial-{}", std::process::id())),
            place: place.to_owned(),
            replace,
        };
        folder.may_be_taken()?;
        folder.create().map_err(|error| folder.failed(&error))?;
        folder.discard().map_err(|error| folder.failed(&error))?;
        Ok(folder)
    }

    /// Write one file of the result.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, contents: &[u8]) -> Result<(), Failure> {
        (self.create())
            .and_then(|()| fs::write(self.partial.join(name), contents))
            .map_err(|error| Failure::io(&self.place.join(name), &error))
    }

    /// Move the folder to its place, with what it replaces deleted only after that worked.
    ///
    /// # Errors
    /// The folder cannot be moved; an earlier result is then still where it was.
    pub fn finish(self) -> Result<PathBuf, Failure> {
        // somebody else may have finished there since the beginning
        self.may_be_taken()?;
        let aside = self.partial.with_extension(format!("replaced-{}", std::process::id()));
        let replaces = self.place.exists();
        if replaces {
            fs::rename(&self.place, &aside).map_err(|error| self.failed(&error))?;
        }
        if let Err(error) = fs::rename(&self.partial, &self.place) {
            if replaces {
                fs::rename(&aside, &self.place).map_err(|error| Failure::io(&aside, &error))?;
            }
            return Err(self.failed(&error));
        }
        if replaces {
            fs::remove_dir_all(&aside).map_err(|error| Failure::io(&aside, &error))?;
        }
        Ok(self.place.clone())
    }

    /// Whether the result may stand at its place: nothing is there, or an empty folder, or an earlier result that is to be
    /// replaced. A folder with anything else in it is never deleted.
    fn may_be_taken(&self) -> Result<(), Failure> {
        let refuse = |message: String| Err(Failure::Output { path: self.place.clone(), message });
        let entries = match fs::read_dir(&self.place) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(_) if self.place.is_file() => {
                return refuse("is a file; give --out a folder that is not there yet".into());
            }
            Err(error) => return Err(self.failed(&error)),
        };
        let mut earlier = false;
        for entry in entries {
            let name = entry.map_err(|error| self.failed(&error))?.file_name();
            let name = name.to_string_lossy();
            if !is_result(&name) {
                return refuse(format!("holds \"{name}\", which is no result of lpv; give --out another folder"));
            }
            earlier = true;
        }
        match earlier && !self.replace {
            false => Ok(()),
            true => refuse("holds an earlier result; give --force to replace it, or --out another folder".into()),
        }
    }

    fn create(&self) -> io::Result<()> {
        fs::create_dir_all(&self.partial)
    }

    fn discard(&self) -> io::Result<()> {
        match fs::remove_dir_all(&self.partial) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }

    fn failed(&self, error: &io::Error) -> Failure {
        Failure::Output {
            path: self.place.clone(),
            message: format!("cannot be written: {error}; give --out a folder that can"),
        }
    }
}

/// A result that is one file, whole or not there.
pub struct ResultFile {
    place: PathBuf,
}

/// The option that names a result file.
const OUT: &str = "--out";

impl ResultFile {
    /// Begin the file that is to stand at `place`.
    ///
    /// # Errors
    /// Something stands there and `replace` is not set, or it is no file, or its folder is not there.
    pub fn begin(place: &Path, replace: bool) -> Result<Self, Failure> {
        Self::begin_for(OUT, place, replace)
    }

    /// As [`begin`](Self::begin), for the option `option`.
    pub fn begin_for(option: &str, place: &Path, replace: bool) -> Result<Self, Failure> {
        let refuse = |message: String| Err(Failure::Output { path: place.to_owned(), message });
        if place.is_dir() || place.file_name().is_none() {
            return refuse(format!("is a folder; give {option} a file name"));
        }
        if place.exists() && !replace {
            return refuse(format!("is there already; give --force to replace it, or {option} another file"));
        }
        let folder = place.parent().filter(|parent| !parent.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return refuse(format!(
                "cannot be written: its folder is not there; create it, or give {option} another file"
            ));
        }
        Ok(Self { place: place.to_owned() })
    }

    /// Write it: beside its place first, then moved there.
    ///
    /// # Errors
    /// It cannot be written; what stood there is still there.
    pub fn finish(self, contents: &[u8]) -> Result<(), Failure> {
        let name = self.place.file_name().unwrap_or_default().to_string_lossy();
        let partial = self.place.with_file_name(format!(".{name}.partial-{}", std::process::id()));
        let written = fs::write(&partial, contents).and_then(|()| fs::rename(&partial, &self.place));
        written.map_err(|error| {
            // the failure to write is what there is to report
            let _ = fs::remove_file(&partial);
            Failure::io(&self.place, &error)
        })
    }
}

/// Whether a file of this name is one that this program writes.
fn is_result(name: &str) -> bool {
    let is = |start: &str, end: &str| name.starts_with(start) && name.ends_with(end);
    ["run.json", "report.html", "model.json", "tables.json"].contains(&name)
        || is("design-", ".json")
        || is("trajectory-", ".csv")
        || is("figure-", ".svg")
}

impl Drop for ResultFolder {
    fn drop(&mut self) {
        // gone already when it was moved to its place; otherwise the result is lost, and a left-over folder is all that could be
        // reported
        let _ = self.discard();
    }
}
