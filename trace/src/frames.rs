//! The records of an MCAP file, one after the other.
//!
//! Responsible for: framing, checksums, whole chunks or none.
//! Not responsible for: what the records say (`reader`).

use std::collections::VecDeque;
use std::io::{self, Read};

use mcap::McapError;
use mcap::records::{Record as Raw, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::reader::ReadError;

/// Longest record of a file that is read, bytes. Chunks are about 1 MiB.
const MAX_RECORD_BYTES: usize = 64 << 20;
/// Most bytes asked of the source at a time.
const READ_BYTES: usize = 64 << 10;
/// Opcode and length in front of each record.
const FRAME_BYTES: usize = 9;

/// Why there is no next record.
pub(crate) enum FrameError {
    /// The file ends in the middle of something.
    Cut,
    /// It cannot be read.
    Read(Unreadable),
}

/// A [`ReadError`] that does not know yet how far the trace read well.
pub(crate) enum Unreadable {
    Io(io::Error),
    Mcap(McapError),
}

impl Unreadable {
    pub(crate) fn at(self, after_ns: u64) -> ReadError {
        match self {
            Self::Io(error) => ReadError::Io(error),
            Self::Mcap(McapError::UnsupportedCompression(how)) => ReadError::Compressed(how),
            Self::Mcap(source) => ReadError::Damaged { after_ns, source },
        }
    }
}

impl From<McapError> for FrameError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::UnexpectedEof => Self::Cut,
            McapError::Io(error) => Self::Read(Unreadable::Io(error)),
            error => Self::Read(Unreadable::Mcap(error)),
        }
    }
}

/// The records of an MCAP file, those inside chunks as well. A chunk is handed out only once it is
/// there as a whole and its checksum is right.
pub(crate) struct Frames<R> {
    /// The first bytes, which were looked at, and the rest.
    source: io::Chain<io::Cursor<Vec<u8>>, R>,
    reader: LinearReader,
    /// Records of the newest chunk that are not handed out yet.
    chunk: VecDeque<(u8, Vec<u8>)>,
}

impl<R: Read> Frames<R> {
    pub(crate) fn new(mut source: R) -> Result<Self, ReadError> {
        let mut head = Vec::new();
        let magic = mcap::MAGIC;
        source
            .by_ref()
            .take(magic.len() as u64)
            .read_to_end(&mut head)
            .map_err(ReadError::Io)?;
        if head != magic {
            let cut = !head.is_empty() && magic.starts_with(&head);
            return Err(if cut {
                ReadError::TooShort
            } else {
                ReadError::Foreign
            });
        }
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        Ok(Self {
            source: io::Cursor::new(head).chain(source),
            reader: LinearReader::new_with_options(options),
            chunk: VecDeque::new(),
        })
    }

    pub(crate) fn next(&mut self) -> Result<Option<(u8, Vec<u8>)>, FrameError> {
        loop {
            if let Some(record) = self.chunk.pop_front() {
                return Ok(Some(record));
            }
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Ok(LinearReadEvent::ReadRequest(bytes))) => self.fill(bytes)?,
                Some(Ok(LinearReadEvent::Record {
                    data,
                    opcode: op::CHUNK,
                })) => {
                    unpack(data, &mut self.chunk)?;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    return Ok(Some((opcode, data.to_vec())));
                }
                Some(Err(error)) => return Err(error.into()),
            }
        }
    }

    fn fill(&mut self, bytes: usize) -> Result<(), FrameError> {
        let space = self.reader.insert(bytes.min(READ_BYTES));
        loop {
            match self.source.read(space) {
                Ok(read) => {
                    self.reader.notify_read(read);
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(FrameError::Read(Unreadable::Io(error))),
            }
        }
    }
}

/// Checks a chunk and cuts it into its records.
fn unpack(chunk: &[u8], records: &mut VecDeque<(u8, Vec<u8>)>) -> Result<(), McapError> {
    let Raw::Chunk { header, data } = mcap::parse_record(op::CHUNK, chunk)? else {
        return Ok(());
    };
    if !header.compression.is_empty() {
        return Err(McapError::UnsupportedCompression(header.compression));
    }
    let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(&data));
    if saved != 0 && saved != calculated {
        return Err(McapError::BadChunkCrc { saved, calculated });
    }
    let mut rest = &data[..];
    while let Some((frame, body)) = rest.split_at_checked(FRAME_BYTES) {
        let mut length = [0; 8];
        length.copy_from_slice(&frame[1..]);
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let Some((body, behind)) = body.split_at_checked(length) else {
            return Err(McapError::UnexpectedEoc);
        };
        records.push_back((frame[0], body.to_vec()));
        rest = behind;
    }
    if rest.is_empty() {
        Ok(())
    } else {
        Err(McapError::UnexpectedEoc)
    }
}
