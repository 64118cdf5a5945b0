//! Files and run directories that appear whole or not at all.
//!
//! Bytes come in; complete files under their final names go out. Imports nothing of donut.
//!
//! A single file is written under a hidden temporary name beside it and renamed. A run directory is
//! claimed before the computation starts ([`RunDir::claim`], which finds an unwritable place at once and leaves nothing
//! there, so that a killed process does not either), filled in a hidden staging directory ([`RunDir::stage`]), and put
//! in place by [`RunDir::commit`].

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process;

use super::error::StoreError;

/// The file whose presence says that a run directory is complete: it is put in place last.
pub const COMPLETION_MARK: &str = "summary.json";
/// The file by which an earlier run is told from somebody's other directory.
pub const RUN_MARK: &str = "plan.json";
/// Files that not every run has: those of an earlier run do not stay beside a run without.
pub const OPTIONAL: [&str; 1] = ["conversation.txt"];

/// Writes `bytes` to `path`, whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let temporary = hidden_beside(path);
    let written = File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&temporary, path));
    written.map_err(|reason| {
        let _ = fs::remove_file(&temporary);
        StoreError::Write { path: path.to_owned(), reason }
    })
}

/// Writes `bytes` to `path` unless something is there already; whole or not at all.
///
/// # Errors
/// [`StoreError::Exists`] if something is there, [`StoreError::Write`] if it cannot be written.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    if path.symlink_metadata().is_ok() {
        return Err(StoreError::Exists { path: path.to_owned() });
    }
    let temporary = hidden_beside(path);
    let made = File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        // Unlike a rename, a link never replaces what came meanwhile; where there are no links, a rename must do.
        .and_then(|()| match fs::hard_link(&temporary, path) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => fs::rename(&temporary, path),
            other => other,
        });
    let _ = fs::remove_file(&temporary);
    made.map_err(|reason| match reason.kind() {
        ErrorKind::AlreadyExists => StoreError::Exists { path: path.to_owned() },
        _ => StoreError::Write { path: path.to_owned(), reason },
    })
}

/// Makes the directory `target` with these files in it, names and bytes, whole or not at all. It must be absent or
/// empty.
///
/// # Errors
/// [`StoreError::NotEmpty`] if it is neither, [`StoreError::Write`] if it cannot be written.
pub fn write_directory(
    target: &Path,
    files: impl IntoIterator<Item = (String, Vec<u8>)>,
) -> Result<(), StoreError> {
    if target.symlink_metadata().is_ok() {
        // Empty directories alone can be removed.
        fs::remove_dir(target).map_err(|_| StoreError::NotEmpty { path: target.to_owned() })?;
    }
    let absolute = std::path::absolute(target).map_err(StoreError::write(target))?;
    let staging = hidden_beside(&absolute);
    let fill = || {
        fs::create_dir_all(&staging)?;
        for (name, bytes) in files {
            fs::write(staging.join(name), bytes)?;
        }
        fs::rename(&staging, &absolute)
    };
    fill().map_err(|reason| {
        let _ = fs::remove_dir_all(&staging);
        StoreError::Write { path: target.to_owned(), reason }
    })
}

/// `DIR/NAME` -> `DIR/.NAME.partial-<process id>`.
fn hidden_beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.partial-{}", process::id()))
}

/// A run directory in the making. Dropped without [`RunDir::commit`], it leaves nothing behind.
#[derive(Debug)]
pub struct RunDir {
    target: PathBuf,
    staging: PathBuf,
    /// Parent directories that had to be made, outermost first.
    made: Vec<PathBuf>,
    committed: bool,
}

impl RunDir {
    /// Claims `target`: it must be absent, empty, or an earlier run, and its place writable.
    pub fn claim(target: &Path) -> Result<Self, StoreError> {
        let existed = target.symlink_metadata().is_ok();
        if existed {
            check_replaceable(target)?;
        }
        let absolute = std::path::absolute(target).map_err(StoreError::write(target))?;
        // An existing directory is staged inside itself: it may be a mount point, or its parent read-only.
        let staging = if existed {
            absolute.join(format!(".partial-{}", process::id()))
        } else {
            hidden_beside(&absolute)
        };
        let mut run = Self { target: absolute, staging, made: Vec::new(), committed: false };
        run.stage()?;
        run.unstage();
        Ok(run)
    }

    /// Makes the staging directory, empty, and says where it is: there the run's files are to be put until
    /// [`RunDir::commit`].
    pub fn stage(&mut self) -> Result<&Path, StoreError> {
        let mut missing = self.target.parent();
        while let Some(directory) = missing.filter(|d| !d.exists()) {
            self.made.insert(0, directory.to_owned());
            missing = directory.parent();
        }
        // A leftover of a killed process that had the same id.
        let _ = fs::remove_dir_all(&self.staging);
        fs::create_dir_all(&self.staging).map_err(StoreError::write(&self.target))?;
        Ok(&self.staging)
    }

    /// Takes back what [`RunDir::stage`] has made.
    fn unstage(&mut self) {
        let _ = fs::remove_dir_all(&self.staging);
        // Innermost first; a directory that has something else in it by now stays.
        for directory in self.made.drain(..).rev() {
            let _ = fs::remove_dir(directory);
        }
    }

    /// Where the run will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Puts the staged files in place. A new directory appears by one rename; in an existing one, files of an
    /// earlier run are replaced one by one, [`COMPLETION_MARK`] removed first and put back last, so that
    /// a run that was interrupted here is seen to be incomplete. Files of other names stay.
    pub fn commit(mut self) -> Result<(), StoreError> {
        if !self.target.exists() {
            fs::rename(&self.staging, &self.target).map_err(StoreError::write(&self.target))?;
            self.committed = true;
            return Ok(());
        }
        // Somebody may have put something there meanwhile.
        check_replaceable(&self.target)?;
        let mark = self.target.join(COMPLETION_MARK);
        if mark.exists() {
            fs::remove_file(&mark).map_err(StoreError::write(&mark))?;
        }
        let mut names: Vec<_> = fs::read_dir(&self.staging)
            .and_then(|entries| entries.map(|e| Ok(e?.file_name())).collect::<std::io::Result<_>>())
            .map_err(StoreError::read(&self.staging))?;
        names.sort_by_key(|name| (name == COMPLETION_MARK, name.clone()));
        for optional in OPTIONAL {
            let place = self.target.join(optional);
            if place.exists() {
                fs::remove_file(&place).map_err(StoreError::write(&place))?;
            }
        }
        for name in names {
            let place = self.target.join(&name);
            fs::rename(self.staging.join(&name), &place).map_err(StoreError::write(&place))?;
        }
        Ok(())
    }
}

impl Drop for RunDir {
    fn drop(&mut self) {
        if !self.committed {
            self.unstage();
        }
    }
}

/// Refuses a file, and a directory that holds something else than a run.
fn check_replaceable(target: &Path) -> Result<(), StoreError> {
    let foreign = || StoreError::NotARun { path: target.to_owned() };
    if !target.is_dir() {
        return Err(foreign());
    }
    let mut entries = fs::read_dir(target).map_err(StoreError::read(target))?;
    let empty = !entries.any(|e| e.is_ok_and(|e| !e.file_name().to_string_lossy().starts_with(".partial-")));
    if empty || target.join(RUN_MARK).is_file() { Ok(()) } else { Err(foreign()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let taken = dir.path().join("taken");
        fs::create_dir(&taken).unwrap();
        assert!(write(&taken, b"new").unwrap_err().to_string().contains("taken"));
        assert_eq!(names(dir.path()), ["taken"]);
        let file = dir.path().join("file");
        write(&file, b"one").unwrap();
        write(&file, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
    }

    #[test]
    fn what_is_there_is_not_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let (file, folder) = (dir.path().join("file"), dir.path().join("folder"));
        write_new(&file, b"one").unwrap();
        let error = write_new(&file, b"two").unwrap_err();
        assert!(matches!(error, StoreError::Exists { .. }), "{error}");
        assert_eq!((fs::read(&file).unwrap(), names(dir.path())), (b"one".to_vec(), vec!["file".to_owned()]));

        let files = || [("a".to_owned(), b"1".to_vec()), ("b".to_owned(), b"2".to_vec())];
        fs::create_dir(&folder).unwrap();
        write_directory(&folder, files()).unwrap();
        assert_eq!(names(&folder), ["a", "b"]);
        let error = write_directory(&folder, files()).unwrap_err();
        assert!(matches!(error, StoreError::NotEmpty { .. }), "{error}");
        write_directory(&file.join("below"), files()).unwrap_err();
        write_directory(&dir.path().join("deep/er"), [("no/such".to_owned(), Vec::new())]).unwrap_err();
        assert_eq!(names(&dir.path().join("deep")), [""; 0]);
    }

    #[test]
    fn an_abandoned_run_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let mut run = RunDir::claim(&dir.path().join("deep/er/out")).unwrap();
        assert_eq!(names(dir.path()), [""; 0], "nor does one that was only claimed, and its process killed");
        fs::write(run.stage().unwrap().join("plan.json"), "{").unwrap();
        assert_eq!(names(dir.path()), ["deep"]);
        drop(run);
        assert_eq!(names(dir.path()), [""; 0]);
    }

    #[test]
    fn a_committed_run_replaces_an_earlier_one_and_keeps_other_files() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        for text in ["first", "second"] {
            let mut run = RunDir::claim(&out).unwrap();
            let staging = run.stage().unwrap();
            fs::write(staging.join(RUN_MARK), text).unwrap();
            fs::write(staging.join(COMPLETION_MARK), text).unwrap();
            if text == "first" {
                fs::write(staging.join(OPTIONAL[0]), text).unwrap();
            }
            run.commit().unwrap();
            assert_eq!(out.join(OPTIONAL[0]).exists(), text == "first");
            fs::write(out.join("notes.txt"), "mine").unwrap();
        }
        assert_eq!(names(&out), ["notes.txt", RUN_MARK, COMPLETION_MARK]);
        assert_eq!(fs::read(out.join(RUN_MARK)).unwrap(), b"second");
        assert_eq!(names(dir.path()), ["out"]);
        drop(RunDir::claim(&out).unwrap());
        assert_eq!(
            fs::read(out.join(COMPLETION_MARK)).unwrap(),
            b"second",
            "an abandoned rerun changes nothing"
        );
    }

    #[test]
    fn of_two_runs_at_once_the_last_to_finish_stays() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let mut first = RunDir::claim(&out).unwrap();
        fs::write(first.stage().unwrap().join(RUN_MARK), "first").unwrap();
        // The same process may not claim a place twice, so the other run is made by hand.
        fs::create_dir(&out).unwrap();
        fs::write(out.join(RUN_MARK), "second").unwrap();
        first.commit().unwrap();
        assert_eq!(fs::read(out.join(RUN_MARK)).unwrap(), b"first");
        assert_eq!(names(dir.path()), ["out"]);
    }

    #[test]
    fn somebody_elses_directory_is_refused_before_anything_is_done() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("thesis.tex"), "").unwrap();
        let refused = RunDir::claim(dir.path()).unwrap_err().to_string();
        assert!(refused.contains("not a donut run") && refused.contains("--out"), "{refused}");
        let below_a_file = RunDir::claim(&dir.path().join("thesis.tex/out")).unwrap_err();
        assert!(matches!(below_a_file, StoreError::Write { .. }));
    }
}
