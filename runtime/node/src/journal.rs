//! The journal: what a peer must not forget, made durable before it is spoken
//! (D2.7 §1.5: the state of a mission survives the failure of a computer).
//!
//! An append-only file of records: length (4 bytes), CRC-32 of the body (4 bytes),
//! both least significant first, body. Reading ends at the first record that is not
//! whole, and what follows is cut off. That is right for a tail that a crash tore
//! before anybody was told it was durable; but nothing says where the next record
//! begins, so **one flipped bit loses everything behind it, too**. What stands before
//! it stays, and the peer takes a new life and hears the rest again from others.
//!
//! A record that cannot be written is answered so: a failed write, a full disk, a
//! record beyond [`MAX_RECORD_BYTES`]. What a failed write left half done is cut off
//! before anything else is written, or that fails as well.
//!
//! One thread writes and syncs, so that the loop of the peer never waits for a disk.
//! What the records mean is the peer's business.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use tokio::sync::mpsc;

/// The longest record, bytes: a snapshot and a register are below 4 KiB each, and a
/// length beyond this is noise, not a record.
pub const MAX_RECORD_BYTES: usize = 64 * 1024;

/// Stores under way at once: twice what a peer asks for before it promises nothing more
/// ([`skein_peer::peer::MAX_STORES`]), so the loop never waits for the disk.
const MAX_OPEN_STORES: usize = 2 * skein_peer::peer::MAX_STORES;

const HEADER_BYTES: usize = 8;

/// Why the journal cannot be used; the peer does not start.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The file cannot be opened, read or cut.
    #[error("journal {path}: {cause}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// Another process holds it.
    #[error("journal {0} is in use by another peer; give each peer a journal of its own")]
    InUse(PathBuf),
}

/// The answer to one store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Of that store.
    pub token: u64,
    /// Whether the record is durable now.
    pub ok: bool,
}

/// An open journal.
#[derive(Debug)]
pub struct Journal {
    orders: Option<mpsc::Sender<(u64, Vec<u8>)>>,
    answers: mpsc::Receiver<Stored>,
    writer: Option<JoinHandle<()>>,
}

/// What the file held when it was opened.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Bodies in the order they were written.
    pub records: Vec<Vec<u8>>,
    /// Bytes behind the last whole record, cut off.
    pub torn_bytes: u64,
}

impl Journal {
    /// Opens the journal at `path`, creating it where there is none, for this
    /// process alone, and reads it.
    ///
    /// # Errors
    /// When the file cannot be used, or another process does.
    pub fn open(path: &Path) -> Result<(Self, Replayed), JournalError> {
        let io = |cause| JournalError::Io {
            path: path.to_owned(),
            cause,
        };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(io)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse(path.to_owned())),
            Err(TryLockError::Error(cause)) => return Err(io(cause)),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io)?;
        let (records, whole) = replay(&bytes);
        let torn_bytes = (bytes.len() - whole) as u64;
        let end = whole as u64;
        if torn_bytes > 0 {
            file.set_len(end).map_err(io)?;
            file.sync_data().map_err(io)?;
        }
        file.seek(SeekFrom::Start(end)).map_err(io)?;

        let replayed = Replayed {
            records,
            torn_bytes,
        };
        Ok((Self::over(file, end).map_err(io)?, replayed))
    }

    /// A journal whose whole records end at `end` of a disk.
    pub(crate) fn over(disk: impl Disk, end: u64) -> std::io::Result<Self> {
        let (orders, inbox) = mpsc::channel(MAX_OPEN_STORES);
        let (outbox, answers) = mpsc::channel(MAX_OPEN_STORES);
        let tail = Tail {
            disk,
            end,
            torn: false,
        };
        let writer = std::thread::Builder::new()
            .name("journal".to_owned())
            .spawn(move || write_all(tail, inbox, &outbox))?;
        Ok(Self {
            orders: Some(orders),
            answers,
            writer: Some(writer),
        })
    }

    /// Asks for `record` to be made durable; [`Journal::answer`] tells when it is.
    pub async fn store(&self, token: u64, record: Vec<u8>) {
        if let Some(orders) = &self.orders {
            // The writer ends only after its orders do.
            let _ = orders.send((token, record)).await;
        }
    }

    /// The next answer. Cancel-safe.
    pub async fn answer(&mut self) -> Option<Stored> {
        self.answers.recv().await
    }

    /// Waits until all that was asked for is written, and gives the file back.
    pub fn close(mut self) {
        self.orders = None;
        self.answers.close();
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
    }
}

/// The whole records at the beginning of `bytes`, and how many bytes they take.
fn replay(bytes: &[u8]) -> (Vec<Vec<u8>>, usize) {
    let mut records = Vec::new();
    let mut at = 0;
    while let Some((body, length)) = first_record(&bytes[at..]) {
        records.push(body.to_vec());
        at += length;
    }
    (records, at)
}

fn first_record(bytes: &[u8]) -> Option<(&[u8], usize)> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (crc, rest) = rest.split_first_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    if length > MAX_RECORD_BYTES {
        return None;
    }
    let body = rest.get(..length)?;
    // Zeroes that a file system left behind are no record: an empty one has no use.
    let whole = length > 0 && crc32fast::hash(body) == u32::from_le_bytes(*crc);
    whole.then_some((body, HEADER_BYTES + length))
}

/// Where the writer writes. [`File`] is the one that lasts.
pub(crate) trait Disk: Send + 'static {
    /// Writes behind what is there, and returns when it is durable.
    fn append(&mut self, bytes: &[u8]) -> std::io::Result<()>;
    /// Forgets all but the first `end` bytes.
    fn cut(&mut self, end: u64) -> std::io::Result<()>;
}

impl Disk for File {
    fn append(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.write_all(bytes)?;
        self.sync_data()
    }

    fn cut(&mut self, end: u64) -> std::io::Result<()> {
        self.set_len(end)?;
        self.seek(SeekFrom::Start(end)).map(drop)
    }
}

/// The disk and the end of its last record that is known to be whole.
struct Tail<D> {
    disk: D,
    end: u64,
    /// A failed write may have left something behind the end.
    torn: bool,
}

impl<D: Disk> Tail<D> {
    /// Appends the records and syncs once; on failure none of them is there.
    fn append(&mut self, batch: &[(u64, Vec<u8>)]) -> std::io::Result<()> {
        let mut bytes = Vec::new();
        for (_, body) in batch {
            let length = u32::try_from(body.len()).map_err(std::io::Error::other)?;
            bytes.extend_from_slice(&length.to_le_bytes());
            bytes.extend_from_slice(&crc32fast::hash(body).to_le_bytes());
            bytes.extend_from_slice(body);
        }
        // Behind a torn record nothing would ever be read again.
        self.mend()?;
        self.torn = true;
        let written = self.disk.append(&bytes);
        if written.is_ok() {
            self.torn = false;
            self.end += bytes.len() as u64;
        } else if let Err(cause) = self.mend() {
            tracing::error!(%cause, "the journal's torn end cannot be cut off; it is tried again before the next record");
        }
        written
    }

    fn mend(&mut self) -> std::io::Result<()> {
        if self.torn {
            self.disk.cut(self.end)?;
            self.torn = false;
        }
        Ok(())
    }
}

/// The writer thread: one sync for all that waits.
fn write_all<D: Disk>(
    mut tail: Tail<D>,
    mut inbox: mpsc::Receiver<(u64, Vec<u8>)>,
    outbox: &mpsc::Sender<Stored>,
) {
    while let Some(first) = inbox.blocking_recv() {
        let mut batch = vec![first];
        while let Ok(next) = inbox.try_recv() {
            batch.push(next);
        }
        let (writable, oversize): (Vec<_>, Vec<_>) = batch
            .into_iter()
            .partition(|(_, body)| (1..=MAX_RECORD_BYTES).contains(&body.len()));
        let written = if writable.is_empty() {
            Ok(())
        } else {
            tail.append(&writable)
        };
        if let Err(cause) = &written {
            tracing::error!(%cause, "the journal cannot be written; the promises it should hold are withheld");
        }
        for (token, body) in oversize {
            tracing::error!(
                bytes = body.len(),
                "a record that the journal cannot hold; what it was to promise is withheld"
            );
            let _ = outbox.blocking_send(Stored { token, ok: false });
        }
        for (token, _) in writable {
            let _ = outbox.blocking_send(Stored {
                token,
                ok: written.is_ok(),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn store_all(path: &Path, bodies: &[&[u8]]) {
        let (mut journal, _) = Journal::open(path).unwrap();
        for (token, body) in (0..).zip(bodies) {
            journal.store(token, body.to_vec()).await;
            assert_eq!(journal.answer().await, Some(Stored { token, ok: true }));
        }
        journal.close();
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn what_was_stored_comes_back_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        store_all(&path, &[b"one", b"two"]).await;
        store_all(&path, &[b"three"]).await;
        let (journal, replayed) = Journal::open(&path).unwrap();
        journal.close();
        assert_eq!(
            replayed.records,
            [b"one".to_vec(), b"two".to_vec(), b"three".to_vec()]
        );
        assert_eq!(replayed.torn_bytes, 0);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_tail_torn_at_any_byte_is_cut_off_and_written_over() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        store_all(&path, &[b"first", b"second"]).await;
        let whole = std::fs::read(&path).unwrap();
        let first = HEADER_BYTES + b"first".len();
        for cut in first..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            store_all(&path, &[b"third"]).await;
            let (journal, replayed) = Journal::open(&path).unwrap();
            journal.close();
            assert_eq!(
                replayed.records,
                [b"first".to_vec(), b"third".to_vec()],
                "cut at {cut}"
            );
        }
    }

    #[test]
    fn a_flipped_bit_loses_what_is_behind_it_and_keeps_what_is_before() {
        let bodies = [b"alpha".as_slice(), b"beta", b"gamma"];
        let mut bytes = Vec::new();
        let mut begins = Vec::new();
        for body in bodies {
            begins.push(bytes.len());
            bytes.extend_from_slice(&u32::try_from(body.len()).unwrap().to_le_bytes());
            bytes.extend_from_slice(&crc32fast::hash(body).to_le_bytes());
            bytes.extend_from_slice(body);
        }
        for bit in 0..bytes.len() * 8 {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let hit = begins.iter().rposition(|b| *b <= bit / 8).unwrap();
            let (records, whole) = replay(&bad);
            assert_eq!(records, bodies[..hit], "bit {bit}");
            assert_eq!(whole, begins[hit], "bit {bit}");
        }
    }

    /// A disk that does as its plan says: how many bytes of a write reach it, and
    /// whether it can be cut.
    struct Flaky {
        file: File,
        writes: Vec<Option<usize>>,
        cuts: Vec<bool>,
    }

    impl Disk for Flaky {
        fn append(&mut self, bytes: &[u8]) -> std::io::Result<()> {
            match self.writes.remove(0) {
                None => Disk::append(&mut self.file, bytes),
                Some(n) => {
                    Disk::append(&mut self.file, &bytes[..n])?;
                    Err(std::io::ErrorKind::StorageFull.into())
                }
            }
        }

        fn cut(&mut self, end: u64) -> std::io::Result<()> {
            if self.cuts.remove(0) {
                Disk::cut(&mut self.file, end)
            } else {
                Err(std::io::ErrorKind::Other.into())
            }
        }
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn what_a_failed_write_left_harms_no_later_record() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        let disk = Flaky {
            file: File::create(&path).unwrap(),
            writes: vec![None, Some(7), Some(8), None, None],
            // After the second failure the half record can be cut only in the end.
            cuts: vec![true, false, false, true],
        };
        let mut journal = Journal::over(disk, 0).unwrap();
        let stores = [
            ("a", true),
            ("b", false),
            ("c", false),
            ("d", false),
            ("e", true),
            ("f", true),
        ];
        for (token, (body, ok)) in (0..).zip(stores) {
            journal.store(token, body.as_bytes().to_vec()).await;
            assert_eq!(journal.answer().await, Some(Stored { token, ok }), "{body}");
        }
        journal.close();
        let (journal, replayed) = Journal::open(&path).unwrap();
        journal.close();
        assert_eq!(replayed.torn_bytes, 0);
        assert_eq!(replayed.records, [b"a", b"e", b"f"]);
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn on_a_full_disk_every_record_is_refused() {
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut journal = Journal::over(full, 0).unwrap();
        for token in 0..3 {
            journal.store(token, b"x".to_vec()).await;
            assert_eq!(journal.answer().await, Some(Stored { token, ok: false }));
        }
        journal.close();
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_second_peer_on_the_same_journal_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        let (journal, _) = Journal::open(&path).unwrap();
        assert!(matches!(Journal::open(&path), Err(JournalError::InUse(_))));
        journal.close();
        assert!(Journal::open(&path).is_ok());
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn an_oversize_record_is_refused_and_harms_no_other() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j");
        let (mut journal, _) = Journal::open(&path).unwrap();
        journal.store(1, vec![0; MAX_RECORD_BYTES + 1]).await;
        assert_eq!(
            journal.answer().await,
            Some(Stored {
                token: 1,
                ok: false
            })
        );
        journal.store(2, b"x".to_vec()).await;
        assert_eq!(journal.answer().await, Some(Stored { token: 2, ok: true }));
        journal.close();
    }
}
