//! Files on their way into a run folder, and those that a killed process left there.
//!
//! Whoever writes a temporary file holds its lock until it has its name. A file that nobody holds is left over; that is asked of
//! the system and not of a clock or of process numbers, which other machines share.

use super::shards::is_at;
use super::{FolderError, io_at};
use std::fs::{File, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};

/// What the name of a temporary file ends with.
const ENDING: &str = ".partial";

/// A file under a name that nobody else uses, locked as long as this is there.
#[derive(Debug)]
pub(super) struct Temporary {
    /// Open for writing.
    pub file: File,
    /// Where it is.
    pub path: PathBuf,
}

impl Temporary {
    /// Makes a file for what will be `name` in `folder`.
    pub fn new(folder: &Path, name: &str) -> Result<Self, FolderError> {
        loop {
            // Process numbers repeat across machines and containers.
            let random = RandomState::new().hash_one(std::process::id());
            let path = folder.join(format!("{name}.{random:016x}{ENDING}"));
            let at = io_at(&path);
            let file = File::create_new(&path).map_err(&at)?;
            match file.try_lock() {
                // Between making and locking it, somebody may have taken it for left over.
                Ok(()) if !is_at(&file, &path).map_err(&at)? => {}
                // A file system without locks: nothing is ever removed there.
                Ok(()) | Err(TryLockError::Error(_)) => return Ok(Self { file, path }),
                Err(TryLockError::WouldBlock) => {}
            }
        }
    }

    /// Removes it; nothing in it is of use.
    pub fn give_up(&self) -> Result<(), FolderError> {
        std::fs::remove_file(&self.path).map_err(io_at(&self.path))
    }
}

/// Removes the temporary files of processes that are no more, in a run folder and its `inputs`; returns how many. What cannot be
/// read or removed stays: it is in nobody's way.
pub(super) fn remove_left_over(folder: &Path) -> usize {
    let inputs = folder.join("inputs");
    let entries = [folder, &inputs].into_iter().filter_map(|at| std::fs::read_dir(at).ok()).flatten();
    let temporary = |path: &PathBuf| path.file_name().and_then(|n| n.to_str()).is_some_and(is_temporary);
    let unlocked = |path: &PathBuf| -> bool {
        let Ok(file) = File::open(path) else { return false };
        file.try_lock().is_ok() && std::fs::remove_file(path).is_ok()
    };
    entries.flatten().map(|entry| entry.path()).filter(temporary).filter(unlocked).count()
}

/// Whether a name is `NAME.0123456789abcdef.partial`; a shard under way has no number there.
fn is_temporary(name: &str) -> bool {
    let random = name.strip_suffix(ENDING).and_then(|rest| rest.rsplit_once('.'));
    random.is_some_and(|(_, random)| random.len() == 16 && random.bytes().all(|b| b.is_ascii_hexdigit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_holds_is_removed_and_what_somebody_writes_stays() {
        let at = tempfile::tempdir().unwrap();
        let folder = at.path();
        std::fs::create_dir(folder.join("inputs")).unwrap();
        let left = [
            "run.json.0123456789abcdef.partial",
            "shard-00003.json.fedcba9876543210.partial",
            "inputs/part.stl.00000000000000ff.partial",
        ];
        let kept = ["shard-00000.mcap.partial", "notes.partial", "run.json", "a.0123456789abcdeg.partial"];
        for name in left.iter().chain(&kept) {
            std::fs::write(folder.join(name), b"half").unwrap();
        }
        let held = Temporary::new(folder, "index.csv").unwrap();
        assert_eq!(remove_left_over(folder), left.len());
        assert!(left.iter().all(|name| !folder.join(name).exists()));
        assert!(kept.iter().all(|name| folder.join(name).exists()));
        assert!(held.path.exists(), "its writer is alive");
        drop(held);
        assert_eq!(remove_left_over(folder), 1, "and now it is not");
        assert_eq!(remove_left_over(&folder.join("nowhere")), 0);
    }

    /// Writers and cleaners in one folder at the same time: every file that was written arrives whole.
    #[test]
    fn a_cleaner_never_takes_what_is_being_written() {
        let at = tempfile::tempdir().unwrap();
        let folder = at.path();
        std::thread::scope(|scope| {
            for writer in 0..3 {
                scope.spawn(move || {
                    for k in 0..200 {
                        let name = format!("file-{writer}-{k}");
                        let temporary = Temporary::new(folder, &name).unwrap();
                        std::io::Write::write_all(&mut &temporary.file, name.as_bytes()).unwrap();
                        std::fs::rename(&temporary.path, folder.join(&name)).unwrap();
                    }
                });
            }
            scope.spawn(|| (0..200).for_each(|_| _ = remove_left_over(folder)));
        });
        for writer in 0..3 {
            for k in 0..200 {
                let name = format!("file-{writer}-{k}");
                assert_eq!(std::fs::read_to_string(folder.join(&name)).unwrap(), name);
            }
        }
    }
}
