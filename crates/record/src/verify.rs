//! Checking a run folder against what it says of itself.

use crate::VERSION;
use crate::folder::{FolderError, RunFolder, Sidecar, hash_file};
use crate::index::{as_in_first_layout, csv_lines, index_header, index_row};
use crate::reader::ShardReader;
use crate::rig_run::rig_campaign;
use crate::shard::RIG_SOURCE;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// What a check found.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Verification {
    /// Shards that are done and agree with their sidecar.
    pub good_shards: u64,
    /// Shards that are not there yet.
    pub missing_shards: u64,
    /// Samples read back.
    pub samples: u64,
    /// Faults, each naming its file.
    pub faults: Vec<String>,
    /// Shards that a fault is about.
    pub broken_shards: Vec<u64>,
    /// A fault is about the index.
    pub index_is_broken: bool,
}

/// Whether the same sweep makes the shards of a run again: pulls that were measured cannot be computed, and another version of gripgen
/// does not make the same samples.
pub fn can_be_made_again(folder: &RunFolder) -> bool {
    folder.info().source != RIG_SOURCE && folder.info().gripgen_version == VERSION
}

/// Takes away what [`verify`] found to be broken, so that running the sweep again makes it anew: shards with their sidecars, and the
/// index, which is written again when all shards are done: at once, if they are. Returns the files. Of a run that cannot be made again
/// ([`can_be_made_again`]) nothing is taken away but the index of this version.
///
/// # Errors
///
/// A file that cannot be removed.
pub fn repair(folder: &RunFolder, found: &Verification) -> Result<Vec<PathBuf>, FolderError> {
    let again = can_be_made_again(folder);
    let shards = found.broken_shards.iter().filter(|_| again);
    // The sidecar first: a shard without one is a shard that was not made.
    let files = shards.flat_map(|&shard| [folder.sidecar_path(shard), folder.shard_path(shard)]);
    let some = again && !found.broken_shards.is_empty();
    // The index of another version may have columns that this one does not know.
    let own = folder.info().gripgen_version == VERSION;
    let index = (own && found.index_is_broken || some).then(|| folder.path().join("index.csv"));
    let whole = own && found.index_is_broken && found.missing_shards == 0 && found.broken_shards.is_empty();
    let mut removed = Vec::new();
    for path in files.chain(index) {
        match std::fs::remove_file(&path) {
            Ok(()) => removed.push(path),
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            Err(source) => return Err(FolderError::Io { path, source }),
        }
    }
    if whole {
        // The sidecars hold its rows.
        folder.write_index()?;
    }
    Ok(removed)
}

/// Reads every shard of a run: hash and size against the sidecar, checksums, every message, every row of the index.
///
/// `progress` is called after each shard.
///
/// # Errors
///
/// A folder that is no run, or a file of it that cannot be read. All other faults stand in the answer.
pub fn verify(path: &Path, mut progress: impl FnMut(u64)) -> Result<Verification, FolderError> {
    let folder = RunFolder::open(path)?;
    let mut result = Verification::default();
    let mut index = IndexCheck::open(&folder);
    result.faults.extend(check_inputs(&folder));
    if folder.info().source == RIG_SOURCE {
        result.faults.extend(rig_campaign(&folder).err().map(|e| e.to_string()));
    }
    for shard in 0..folder.info().shards {
        let sidecar = match folder.finished(shard) {
            Err(e @ (FolderError::OtherVersion { .. } | FolderError::Mixed { .. })) => {
                // Readers refuse it. It may be whole: it is not broken.
                result.faults.push(e.to_string());
                progress(shard);
                continue;
            }
            found => found?,
        };
        let file = folder.shard_path(shard);
        match sidecar {
            None if file.exists() || folder.sidecar_path(shard).exists() => {
                result.faults.push(misfit(&folder, shard));
                result.broken_shards.push(shard);
            }
            None => result.missing_shards += 1,
            Some(sidecar) => {
                let before = result.faults.len();
                let (sha256, _) = hash_file(&file)?;
                if sha256 != sidecar.sha256 {
                    let problem = format!("its SHA-256 is {sha256}, the sidecar says {}", sidecar.sha256);
                    result.faults.push(format!("{}: {problem}", file.display()));
                }
                match check_shard(&file, &folder, &sidecar) {
                    Ok(samples) => result.samples += samples,
                    Err(fault) => result.faults.push(fault),
                }
                if result.faults.len() == before {
                    result.good_shards += 1;
                } else {
                    result.broken_shards.push(shard);
                }
                index.compare(&sidecar.rows);
            }
        }
        progress(shard);
    }
    if result.missing_shards > 0 && folder.path().join("index.csv").exists() {
        let problem = format!("it is there, but {} shards are not", result.missing_shards);
        result.faults.push(format!("{}: {problem}", folder.path().join("index.csv").display()));
        result.index_is_broken = true;
    }
    if result.missing_shards == 0 && result.faults.is_empty() {
        result.faults.extend(index.finish());
        result.index_is_broken = !result.faults.is_empty();
    }
    Ok(result)
}

/// Why shard and sidecar do not belong together.
fn misfit(folder: &RunFolder, shard: u64) -> String {
    let (file, sidecar) = (folder.shard_path(shard), folder.sidecar_path(shard));
    let problem = match (file.exists(), sidecar.exists()) {
        (true, false) => "it has no sidecar",
        (false, _) => return format!("{}: the shard it describes is missing", sidecar.display()),
        (true, true) => "its sidecar does not fit it",
    };
    let what = if folder.info().source == RIG_SOURCE { "campaign" } else { "sweep" };
    format!("{}: {problem}; running the {what} again makes it anew", file.display())
}

/// What is wrong with the copies of the files that the run was made from.
fn check_inputs(folder: &RunFolder) -> Vec<String> {
    let copies = folder.info().files_sha256.iter().filter(|(name, _)| name.starts_with("inputs/"));
    let fault = |(name, wanted): (&String, &String)| {
        let path = folder.path().join(name);
        match hash_file(&path) {
            Ok((found, _)) if found == *wanted => None,
            Ok((found, _)) => {
                Some(format!("{}: its SHA-256 is {found}, run.json says {wanted}", path.display()))
            }
            Err(e) => Some(e.to_string()),
        }
    };
    copies.filter_map(fault).collect()
}

fn check_shard(file: &Path, folder: &RunFolder, sidecar: &Sidecar) -> Result<u64, String> {
    let rows = &sidecar.rows;
    let reader = ShardReader::open(file).map_err(|e| e.to_string())?;
    let hash = reader.metadata().get("config_sha256");
    if hash != Some(&folder.info().config_sha256) {
        return Err(format!("{}: it belongs to another configuration ({hash:?})", file.display()));
    }
    let indices = reader.indices();
    let expected = indices.end - indices.start;
    if expected != rows.len() as u64 {
        return Err(format!("{}: {expected} samples, its sidecar has {} rows", file.display(), rows.len()));
    }
    if indices.start != sidecar.first_sample {
        let (found, wanted) = (indices.start, sidecar.first_sample);
        return Err(format!("{}: its first sample is {found}, its sidecar says {wanted}", file.display()));
    }
    reader.config_toml().map_err(|e| e.to_string())?;
    for (index, row) in indices.zip(rows) {
        let record = reader.record(index).map_err(|e| e.to_string())?;
        if reader.is_rig() {
            reader.rest(index).and_then(|_| reader.rig_log(index)).map_err(|e| e.to_string())?;
        }
        reader.film(index).map_err(|e| e.to_string())?;
        let found = index_row(&record.sample, &folder.info().extra_columns);
        // Columns 1 and 2 (shard, in_shard) are filled in by the writer.
        if let Some(i) = (0..found.len()).find(|&i| !(1..=2).contains(&i) && found[i] != row[i]) {
            return Err(format!(
                "{}: sample {index} says `{}`, its sidecar row says `{}`",
                file.display(),
                found[i],
                row[i]
            ));
        }
    }
    Ok(rows.len() as u64)
}

/// Compares `index.csv` with the rows of the sidecars, a shard at a time.
struct IndexCheck {
    path: PathBuf,
    reader: Option<BufReader<File>>,
    fault: Option<String>,
    line: usize,
    /// The file has the columns of the first layout.
    first_layout: bool,
}

impl IndexCheck {
    fn open(folder: &RunFolder) -> Self {
        let path = folder.path().join("index.csv");
        let (mut reader, fault) = match File::open(&path) {
            Ok(file) => (Some(BufReader::new(file)), None),
            Err(e) => (None, Some(e.to_string())),
        };
        let header = index_header(&folder.info().extra_columns);
        let first = csv_lines([&as_in_first_layout(&header)]);
        let begins = |reader: &mut BufReader<File>| reader.fill_buf().is_ok_and(|b| b.starts_with(&first));
        let first_layout = reader.as_mut().is_some_and(begins);
        let mut check = Self { path, reader, fault, line: 1, first_layout };
        check.compare(&[header]);
        check
    }

    fn compare(&mut self, rows: &[Vec<String>]) {
        let (Some(reader), None) = (&mut self.reader, &self.fault) else { return };
        let wanted = match self.first_layout {
            true => csv_lines(&rows.iter().map(|row| as_in_first_layout(row)).collect::<Vec<_>>()),
            false => csv_lines(rows),
        };
        let mut found = vec![0; wanted.len()];
        let read = reader.read_exact(&mut found);
        if read.is_err() || found != wanted {
            let same = found.iter().zip(&wanted).take_while(|(a, b)| a == b).filter(|(a, _)| **a == b'\n');
            self.fault = Some(format!("line {} differs from the sidecars", self.line + same.count()));
        }
        self.line += rows.len();
    }

    fn finish(mut self) -> Option<String> {
        if let (Some(reader), None) = (&mut self.reader, &self.fault)
            && reader.read(&mut [0]).is_ok_and(|n| n > 0)
        {
            self.fault = Some(format!("it goes on after line {}", self.line - 1));
        }
        self.fault.map(|fault| format!("{}: {fault}", self.path.display()))
    }
}
