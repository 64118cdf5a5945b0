//! `results.jsonl` in a directory that several processes may share, and be killed in.
//!
//! Trials come in, one line each, appended and synchronised to disk under a lock; all lines come back out. Imports
//! store's errors.
//!
//! A killed process can leave one torn line at the end: readers ignore what no line break ends, and the next writer
//! cuts it off. A trial is claimed by a lock on a file of its own, which the operating system gives back when its
//! owner dies; so no trial is run twice at once, and none is lost with its process.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::trial::{Spec, Trial};
use crate::store::StoreError;

/// The file with a line for each trial.
pub const RESULTS: &str = "results.jsonl";
/// The folder with the locks of trials that are being run.
const CLAIMS: &str = ".claims";

/// What can be wrong with a directory of results.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Results are there, and nobody said to go on.
    #[error(
        "{} holds the results of {trials} trials already; add --resume to go on with them, or choose another --out",
        path.display()
    )]
    Exists { path: PathBuf, trials: usize },
    #[error(
        "line {line} of {} is not a result of `donut eval`: {reason}; remove that line, or choose another --out",
        path.display()
    )]
    Line { path: PathBuf, line: usize, reason: serde_json::Error },
    #[error(
        "line {line} of {} comes from another configuration ({found}; these options give {expected}); go on with the \
         options and the version of donut that it was made with, or choose another --out",
        path.display()
    )]
    OtherConfig { path: PathBuf, line: usize, found: String, expected: String },
    #[error("{} holds no results (there is no {RESULTS}); give a directory that `donut eval --out` made", path.display())]
    None { path: PathBuf },
    /// Two results of one trial that cannot both be right, or of two experiments.
    #[error("{} and {} do not belong to one experiment: {reason}", first.display(), second.display())]
    Conflict { first: PathBuf, second: PathBuf, reason: String },
}

/// A directory of results.
#[derive(Clone, Debug)]
pub struct ResultsDir {
    path: PathBuf,
}

/// The right to run a trial; given back when dropped.
#[derive(Debug)]
pub struct Claim {
    _lock: File,
    path: PathBuf,
    done: bool,
}

impl ResultsDir {
    /// Opens a directory, or makes it. Results that are there already are refused unless `resume`.
    pub fn open(path: &Path, resume: bool) -> Result<Self, ResultsError> {
        let dir = Self { path: path.to_owned() };
        let trials = dir.read()?.len();
        if trials > 0 && !resume {
            return Err(ResultsError::Exists { path: path.to_owned(), trials });
        }
        fs::create_dir_all(path).map_err(StoreError::write(path))?;
        Ok(dir)
    }

    /// A directory that is read only; its results must exist.
    pub fn existing(path: &Path) -> Result<Self, ResultsError> {
        if path.join(RESULTS).is_file() {
            Ok(Self { path: path.to_owned() })
        } else {
            Err(ResultsError::None { path: path.to_owned() })
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn file(&self) -> PathBuf {
        self.path.join(RESULTS)
    }

    /// All results, in the order in which they were made.
    pub fn read(&self) -> Result<Vec<Trial>, ResultsError> {
        let path = self.file();
        let mut text = String::new();
        if path.is_file() {
            let read = || {
                let mut file = File::open(&path)?;
                // A writer may be in the middle of a line.
                file.lock_shared()?;
                let mut bytes = Vec::new();
                file.read_to_end(&mut bytes)?;
                // What no line break ends is the torn line of a killed process.
                bytes.truncate(whole_lines(&bytes));
                Ok(String::from_utf8_lossy(&bytes).into_owned())
            };
            text = read().map_err(StoreError::read(&path))?;
        }
        let parse = |(at, line): (usize, &str)| {
            let path = path.clone();
            serde_json::from_str(line).map_err(|reason| ResultsError::Line { path, line: at + 1, reason })
        };
        text.lines().enumerate().map(parse).collect()
    }

    /// Appends a result; it is on the disk when this returns.
    pub fn append(&self, trial: &Trial) -> Result<(), StoreError> {
        let path = self.file();
        let mut line =
            serde_json::to_string(trial).map_err(|reason| StoreError::Json { path: path.clone(), reason })?;
        line.push('\n');
        let write = || {
            let mut file = OpenOptions::new().read(true).append(true).create(true).open(&path)?;
            file.lock()?;
            cut_torn_line(&mut file)?;
            file.write_all(line.as_bytes())?;
            file.sync_data()
        };
        write().map_err(StoreError::write(&path))
    }

    /// Claims a trial; `None` if another process runs it now. Its result may have come in meanwhile: look again.
    pub fn claim(&self, spec: &Spec) -> Result<Option<Claim>, StoreError> {
        let path = self.path.join(CLAIMS).join(spec.name());
        // Whoever finishes last takes the folder away.
        let open = || {
            fs::create_dir_all(self.path.join(CLAIMS))?;
            OpenOptions::new().write(true).create(true).truncate(false).open(&path)
        };
        let file = open().map_err(StoreError::write(&path))?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Claim { _lock: file, path, done: false })),
            Err(fs::TryLockError::WouldBlock) => Ok(None),
            Err(fs::TryLockError::Error(reason)) => Err(StoreError::Write { path, reason }),
        }
    }

    /// Claims a trial that has no result yet; `None` if it has one, or if another process runs it now.
    pub fn claim_pending(&self, spec: &Spec) -> Result<Option<Claim>, ResultsError> {
        let Some(claim) = self.claim(spec)? else { return Ok(None) };
        if self.read()?.iter().any(|trial| spec.is(trial)) {
            claim.settle();
            return Ok(None);
        }
        Ok(Some(claim))
    }

    /// Copies the results of another experiment's trials that are the same as some of `specs` and have no result here:
    /// suites may share trials. Returns how many.
    pub fn take_over(&self, other: &Self, specs: &[Spec]) -> Result<usize, ResultsError> {
        let mut count = 0;
        for trial in other.read()? {
            let same = |spec: &&Spec| spec.is(&trial) && spec.config == trial.config;
            let Some(spec) = specs.iter().find(same) else { continue };
            let Some(claim) = self.claim_pending(spec)? else { continue };
            self.append(&Trial { suite: spec.suite, ..trial })?;
            claim.settle();
            count += 1;
        }
        Ok(count)
    }

    /// Refuses results that another configuration has given to one of the tasks and methods in `specs`.
    pub fn check_config(&self, trials: &[Trial], specs: &[Spec]) -> Result<(), ResultsError> {
        for (at, trial) in trials.iter().enumerate() {
            let same = |s: &&Spec| s.task == trial.task && s.contender.name() == trial.method;
            let other = |found: String, expected: String| {
                Err(ResultsError::OtherConfig { path: self.file(), line: at + 1, found, expected })
            };
            if let Some(spec) = specs.first().filter(|s| s.suite != trial.suite) {
                return other(
                    format!("suite {}", trial.suite.name()),
                    format!("suite {}", spec.suite.name()),
                );
            }
            if let Some(spec) = specs.iter().find(same).filter(|s| s.config != trial.config) {
                return other(trial.config.clone(), spec.config.clone());
            }
        }
        Ok(())
    }

    /// Takes the folder of claims away if nobody holds one.
    pub fn tidy(&self) {
        let _ = fs::remove_dir(self.path.join(CLAIMS));
    }
}

impl Claim {
    /// The trial's result is on the disk: nobody needs the claim again.
    pub fn settle(mut self) {
        self.done = true;
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // Only with the result in place: one who has opened this file but not locked it yet would otherwise run the
        // trial beside one who makes the file anew.
        if self.done {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// The length of the lines that a line break ends.
fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1)
}

/// Cuts off what a killed process has left behind the last line break.
fn cut_torn_line(file: &mut File) -> std::io::Result<()> {
    let length = file.metadata()?.len();
    if length == 0 {
        return Ok(());
    }
    file.seek(SeekFrom::Start(length - 1))?;
    let mut last = [0];
    file.read_exact(&mut last)?;
    if last != *b"\n" {
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(0))?;
        file.read_to_end(&mut bytes)?;
        file.set_len(whole_lines(&bytes) as u64)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::{Config, Contender, Suite};
    use crate::plan::settings::Effort;
    use crate::sim::SimdLevel;
    use crate::task::Overrides;

    fn spec() -> Spec {
        let (effort, overrides, simd) = (Effort::Quick, Overrides::default(), SimdLevel::best());
        let config = Config { seed: 0, effort, overrides, simd };
        let paper = Contender::named("paper").unwrap();
        Spec::all(Suite::SingleTool, &["cut"], &[paper], 1, &config).remove(0)
    }

    #[test]
    fn a_trial_is_claimed_once_and_given_back_when_its_owner_ends() {
        let folder = tempfile::tempdir().unwrap();
        let dir = ResultsDir::open(folder.path(), false).unwrap();
        let first = dir.claim(&spec()).unwrap().expect("free");
        assert!(dir.claim(&spec()).unwrap().is_none(), "taken");
        // An owner that dies without a result leaves its file, not its claim.
        drop(first);
        let second = dir.claim(&spec()).unwrap().expect("free again");
        assert_eq!(fs::read_dir(folder.path().join(CLAIMS)).unwrap().count(), 1);
        second.settle();
        dir.tidy();
        assert!(!folder.path().join(CLAIMS).exists());
        assert!(dir.claim(&spec()).unwrap().is_some(), "the folder is made again");
    }

    #[test]
    fn a_torn_line_is_ignored_and_then_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let dir = ResultsDir::open(folder.path(), false).unwrap();
        let file = folder.path().join(RESULTS);
        fs::write(&file, b"{\"suite\": \"single-to").unwrap();
        assert_eq!(dir.read().unwrap(), []);
        let mut opened = OpenOptions::new().read(true).append(true).open(&file).unwrap();
        cut_torn_line(&mut opened).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"");
        fs::write(&file, b"one\ntwo\nthr\0\0").unwrap();
        let mut opened = OpenOptions::new().read(true).append(true).open(&file).unwrap();
        cut_torn_line(&mut opened).unwrap();
        cut_torn_line(&mut opened).unwrap();
        opened.write_all(b"three\n").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"one\ntwo\nthree\n");
        assert!(matches!(dir.read(), Err(ResultsError::Line { line: 1, .. })));
    }
}
