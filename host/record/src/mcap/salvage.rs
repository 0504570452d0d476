//! The readable part of a file: its chunks, one after the other, each checked before anything of it is believed.
//!
//! A file is a row of records, each with its kind and length before it. Of these lengths one wrong bit is enough to lose
//! the row; then the next chunk is looked for by what every chunk of ours has in its head, and by its checksum. So damage
//! costs the chunk that it is in. Nothing is allocated for what a length only claims, and what is looked at in vain is
//! bounded.

use super::{metadata_name, seal};
use ::mcap::Attachment;
use ::mcap::records::op;
use ::mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

/// Bytes of kind and length.
const HEAD: u64 = 9;
/// Most bytes of a chunk, packed or not; the writer's are a tenth of it.
const MOST_CHUNK: usize = 16 << 20;
/// Most bytes of any other record that is read.
const MOST_OTHER: u64 = 1 << 20;
/// In the head of each chunk of ours stands how it is packed, this many bytes after its beginning.
const PACKED: &[u8] = b"\x03\0\0\0lz4";
const PACKED_AT: usize = HEAD as usize + 28;
/// Bytes of the whole head, with the packed size at its end.
const SEEN: usize = PACKED_AT + PACKED.len() + 8;
/// Bytes that are searched at once.
const WINDOW: u64 = 1 << 16;
/// Bytes of a footer's content and of the magic behind it.
const FOOTER: usize = 28;
/// The checksum of a chunk's content stands this many bytes after its beginning.
const CRC_AT: usize = 9 + 24;
/// Places of damage that are kept; more are counted.
const PLACES: usize = 16;

/// Somewhere in the file where it can't be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// From this byte on ...
    pub from: u64,
    /// ... up to this one, which can be read again, or the end of the file.
    pub until: u64,
    /// The damage.
    pub problem: &'static str,
}

/// The damage of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    /// The first places that can't be read.
    pub places: Vec<Place>,
    /// The number of damaged places.
    pub place_count: u64,
    /// Bytes that can't be read.
    pub bytes: u64,
    /// Entries that are lost, by the numbers of those that came; what is lost at the end of a file without a summary
    /// is not among them.
    pub lost: u64,
    /// Entries that were left out because they were there twice, or came too late.
    pub repeated: u64,
    /// Entries that are whole and still can't be read.
    pub unreadable: u64,
    /// There is no summary: the program that recorded was killed, or still records, or the end is damaged. What came in the
    /// last half a second may be missing.
    pub unfinished: bool,
}

impl Damage {
    /// Returns `true` if nothing is wrong; an unfinished file may still be whole.
    pub fn is_none(&self) -> bool {
        *self == Self { unfinished: self.unfinished, ..Self::default() }
    }

    pub(super) fn add(&mut self, place: Place) {
        self.bytes += place.until - place.from;
        if let Some(last) = self.places.last_mut().filter(|last| last.until == place.from) {
            last.until = place.until;
            return;
        }
        self.place_count += 1;
        if self.places.len() < PLACES {
            self.places.push(place);
        }
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        let mut tell = |f: &mut fmt::Formatter<'_>, words: String| {
            let told = write!(f, "{separator}{words}");
            separator = "; ";
            told
        };
        for Place { from, until, problem } in &self.places {
            tell(f, format!("bytes {from} to {until}: {problem}"))?;
        }
        if self.place_count > self.places.len() as u64 {
            tell(f, format!("{} more such places", self.place_count - self.places.len() as u64))?;
        }
        for (count, words) in [
            (self.lost, "entries are lost"),
            (self.repeated, "entries were there twice, or came too late, and are left out"),
            (self.unreadable, "entries are whole, but hold nothing that this program can read"),
        ] {
            if count > 0 {
                tell(f, format!("{count} {words}"))?;
            }
        }
        if self.unfinished {
            tell(f, "it was not finished, so that the last half a second may be missing, and other tools may not open it: `blindgrasp recording finish` gives it its end".into())?;
        }
        if separator.is_empty() { write!(f, "nothing") } else { Ok(()) }
    }
}

/// Something of a file.
pub(super) enum Piece {
    /// The library that wrote the file.
    Header { profile: String, library: String },
    /// Metadata of ours, with its checksum right.
    Metadata(BTreeMap<String, String>),
    /// An attachment.
    Attachment(Attachment<'static>),
    /// A chunk begins, and it is whole: [`Pieces::inner`] gives what is in it.
    Chunk,
}

/// The bytes at the place of the next record.
enum Found {
    Piece(Piece),
    /// Something that is passed over.
    Nothing,
    /// Nothing that can be believed.
    Damage(&'static str),
}

/// The pieces of a file.
pub(super) struct Pieces {
    file: BufReader<File>,
    length: u64,
    /// The place of the next record.
    at: u64,
    /// Up to here everything was whole, or has been told as damage.
    trusted: u64,
    /// Bytes that may still be looked at in vain.
    budget: u64,
    /// Opens chunks, and looks whether they are whole.
    opener: LinearReader,
    packed: Vec<u8>,
    /// The records of the chunk: kind, length and content of each.
    content: Vec<u8>,
    inner_at: usize,
    damage: Damage,
    ended: bool,
}

impl Pieces {
    /// Begins behind the magic.
    pub(super) fn new(mut file: File) -> io::Result<Self> {
        let length = file.seek(SeekFrom::End(0))?;
        let begin = (::mcap::MAGIC.len() as u64).min(length);
        file.seek(SeekFrom::Start(begin))?;
        Ok(Self {
            file: BufReader::with_capacity(1 << 17, file),
            length,
            at: begin,
            trusted: begin,
            budget: length.saturating_mul(8).saturating_add(256 << 20),
            opener: opener(),
            packed: Vec::new(),
            content: Vec::new(),
            inner_at: 0,
            damage: Damage { unfinished: true, ..Damage::default() },
            ended: false,
        })
    }

    /// Returns the damage so far.
    pub(super) fn damage(&self) -> &Damage {
        &self.damage
    }

    /// To count what is lost.
    pub(super) fn damage_mut(&mut self) -> &mut Damage {
        &mut self.damage
    }

    /// Returns the position in the file, bytes, and its length.
    pub(super) fn position(&self) -> (u64, u64) {
        (self.at.min(self.length), self.length)
    }

    /// The next record of the chunk.
    pub(super) fn inner(&mut self) -> Option<(u8, &[u8])> {
        let (&[kind, a, b, c, d], rest) = self.content.get(self.inner_at..)?.split_first_chunk()?;
        let length = u32::from_le_bytes([a, b, c, d]) as usize;
        self.inner_at += 5 + length;
        Some((kind, rest.get(..length)?))
    }

    /// The next piece; none at the end.
    ///
    /// # Errors
    /// What the file system says.
    pub(super) fn next(&mut self) -> io::Result<Option<Piece>> {
        self.content.clear();
        self.inner_at = 0;
        while !self.ended {
            match self.record()? {
                Found::Piece(piece) => return Ok(Some(piece)),
                Found::Nothing => {}
                Found::Damage(problem) => self.find_chunk(problem)?,
            }
        }
        Ok(None)
    }

    /// The record here.
    fn record(&mut self) -> io::Result<Found> {
        let left = self.length - self.at;
        if left == 0 {
            self.ended = true;
            return Ok(Found::Nothing);
        }
        let mut head = [0; HEAD as usize];
        if left < HEAD {
            return Ok(Found::Damage("the file ends in the middle of something"));
        }
        self.go(self.at)?;
        self.file.read_exact(&mut head)?;
        let kind = head[0];
        let length =
            u64::from_le_bytes([head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8]]);
        if !(1..=op::DATA_END).contains(&kind) {
            return Ok(Found::Damage("no record of MCAP begins here"));
        }
        if length > left - HEAD {
            return Ok(Found::Damage("the file ends in the middle of something, or a length is wrong"));
        }
        let end = self.at + HEAD + length;
        let found = match kind {
            op::CHUNK => {
                if !self.open(length)? {
                    let problem = "a chunk is damaged";
                    if lengths_agree(&self.packed) == Some(true) {
                        // It is its content that is damaged, and it ends where it says.
                        self.damage.add(Place { from: self.trusted, until: end, problem });
                        (self.trusted, self.at) = (end, end);
                        return Ok(Found::Nothing);
                    }
                    // It may have been unpacked in vain.
                    self.budget = self.budget.saturating_sub(length.saturating_add(self.unpacked_size()));
                    return Ok(Found::Damage(problem));
                }
                self.trusted = end;
                Found::Piece(Piece::Chunk)
            }
            op::FOOTER => {
                let mut rest = [0; FOOTER];
                if length != 20 || left < HEAD + FOOTER as u64 {
                    return Ok(Found::Damage("the footer is damaged"));
                }
                self.file.read_exact(&mut rest)?;
                if rest[20..] != *::mcap::MAGIC {
                    return Ok(Found::Damage("the footer is damaged"));
                }
                self.damage.unfinished = rest[..8] == [0; 8];
                self.at += HEAD + FOOTER as u64;
                self.trusted = self.at;
                if self.at < self.length {
                    self.damage.unfinished = true;
                    return Ok(Found::Damage(
                        "something is behind the end: a program was killed while it wrote",
                    ));
                }
                self.ended = true;
                return Ok(Found::Nothing);
            }
            op::HEADER | op::METADATA | op::ATTACHMENT if length <= MOST_OTHER => {
                self.packed.clear();
                (&mut self.file).take(length).read_to_end(&mut self.packed)?;
                match description(kind, &self.packed) {
                    Some(piece) => Found::Piece(piece),
                    None => Found::Nothing,
                }
            }
            _ => Found::Nothing,
        };
        self.at = end;
        Ok(found)
    }

    fn go(&mut self, to: u64) -> io::Result<()> {
        let from = self.file.stream_position()?;
        self.file.seek_relative(to.wrapping_sub(from) as i64)
    }

    /// Opens the chunk of so many bytes that begins here; the file stands behind its kind and length. Says whether it is
    /// whole.
    fn open(&mut self, length: u64) -> io::Result<bool> {
        if length > MOST_CHUNK as u64 {
            return Ok(false);
        }
        self.packed.clear();
        self.packed.push(op::CHUNK);
        self.packed.extend_from_slice(&length.to_le_bytes());
        (&mut self.file).take(length).read_to_end(&mut self.packed)?;
        // Start and end of its times, unpacked size, checksum. One that has no checksum is not believed; one in 2^32
        // chunks of ours has this one.
        let has_checksum = self.packed.get(CRC_AT..CRC_AT + 4).is_some_and(|crc| *crc != [0; 4]);
        let whole = has_checksum && lengths_agree(&self.packed) == Some(true) && self.unpack().is_some();
        if !whole {
            self.opener = opener();
            self.content.clear();
        }
        Ok(whole)
    }

    /// Returns the size that the chunk which was looked at claims to have when unpacked, bytes.
    fn unpacked_size(&self) -> u64 {
        let size = self.packed.get(CRC_AT - 8..CRC_AT).and_then(|bytes| bytes.try_into().ok());
        size.map_or(0, u64::from_le_bytes).min(MOST_CHUNK as u64)
    }

    /// The records of the chunk, once its checksum has been found right.
    fn unpack(&mut self) -> Option<()> {
        let mut given = 0;
        loop {
            match self.opener.next_event()?.ok()? {
                LinearReadEvent::ReadRequest(_) => {
                    let rest = self.packed.get(given..)?;
                    if rest.is_empty() {
                        return Some(());
                    }
                    self.opener.insert(rest.len()).copy_from_slice(rest);
                    self.opener.notify_read(rest.len());
                    given = self.packed.len();
                }
                LinearReadEvent::Record { opcode, data } => {
                    self.content.push(opcode);
                    self.content.extend_from_slice(&u32::try_from(data.len()).ok()?.to_le_bytes());
                    self.content.extend_from_slice(data);
                }
            }
        }
    }

    /// Goes on at the next chunk, or what looks like one, behind what was believed last.
    fn find_chunk(&mut self, problem: &'static str) -> io::Result<()> {
        let from = self.trusted;
        let mut found = self.search(from)?;
        if found == Some(self.at) {
            // This is the one that is damaged.
            found = self.search(self.at + 1)?;
        }
        let until = found.filter(|_| self.budget > 0).unwrap_or(self.length);
        self.damage.add(Place { from, until, problem });
        (self.trusted, self.at) = (until, until);
        self.ended = until == self.length;
        Ok(())
    }

    /// The first place from here on that looks like the head of a chunk.
    fn search(&mut self, from: u64) -> io::Result<Option<u64>> {
        let mut window = Vec::new();
        let mut at = from;
        while self.length.saturating_sub(at) > SEEN as u64 {
            self.go(at)?;
            window.clear();
            (&mut self.file).take(WINDOW).read_to_end(&mut window)?;
            let left = self.length - at;
            let found = window.windows(SEEN).zip(0..).find(|(bytes, k)| looks_like_chunk(bytes, left - k));
            if let Some((_, k)) = found {
                return Ok(Some(at + k));
            }
            // What begins in the last bytes is seen whole next time.
            at += (window.len().saturating_sub(SEEN - 1) as u64).max(1);
        }
        Ok(None)
    }
}

fn opener() -> LinearReader {
    LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MOST_CHUNK),
    )
}

/// Returns `true` if the length of a chunk is what follows from the length of its content; none of what is no chunk.
fn lengths_agree(chunk: &[u8]) -> Option<bool> {
    let number = |at: usize| chunk.get(at..at + 8)?.try_into().ok().map(u64::from_le_bytes);
    let word = chunk.get(PACKED_AT..PACKED_AT + 4)?.try_into().ok().map(u32::from_le_bytes)? as usize;
    let content_at = PACKED_AT.checked_add(4)?.checked_add(word)?.checked_add(8)?;
    let content = number(content_at - 8)?;
    Some(number(1)? == content.checked_add((content_at - HEAD as usize) as u64)?)
}

/// Returns `true` if these bytes may be the head of a chunk; so many are left in the file.
fn looks_like_chunk(bytes: &[u8], left: u64) -> bool {
    let number = |at: usize| {
        bytes.get(at..at + 8).and_then(|bytes| bytes.try_into().ok()).map_or(0, u64::from_le_bytes)
    };
    bytes.first() == Some(&op::CHUNK)
        && bytes.get(PACKED_AT..PACKED_AT + PACKED.len()) == Some(PACKED)
        && number(1) == number(SEEN - 8).saturating_add((SEEN - HEAD as usize) as u64)
        && number(1) <= left - HEAD
}

/// Reads header, metadata and attachments; `None` if they are not what we write.
fn description(kind: u8, mut bytes: &[u8]) -> Option<Piece> {
    if kind == op::ATTACHMENT {
        return attachment(bytes).map(Piece::Attachment);
    }
    let first = string(&mut bytes)?.to_owned();
    if kind == op::HEADER {
        return Some(Piece::Header { profile: first, library: string(&mut bytes)?.into() });
    }
    let mut map = BTreeMap::new();
    bytes = bytes.get(4..)?;
    while !bytes.is_empty() {
        map.insert(string(&mut bytes)?.to_owned(), string(&mut bytes)?.to_owned());
    }
    let sealed = first == metadata_name(&map) && map.get("crc") == Some(&seal(&map));
    sealed.then_some(Piece::Metadata(map))
}

fn attachment(bytes: &[u8]) -> Option<Attachment<'static>> {
    let (all, crc) = bytes.split_last_chunk()?;
    if crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(all) != u32::from_le_bytes(*crc) {
        return None;
    }
    let (log_time, rest) = all.split_first_chunk()?;
    let (create_time, mut rest) = rest.split_first_chunk()?;
    let (name, media_type) = (string(&mut rest)?.to_owned(), string(&mut rest)?.to_owned());
    let (_, data) = rest.split_first_chunk::<8>()?;
    Some(Attachment {
        log_time: u64::from_le_bytes(*log_time),
        create_time: u64::from_le_bytes(*create_time),
        name,
        media_type,
        data: data.to_vec().into(),
    })
}

/// Takes a string, which has its length before it, from the beginning.
pub(super) fn string<'a>(bytes: &mut &'a [u8]) -> Option<&'a str> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (string, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *bytes = rest;
    std::str::from_utf8(string).ok()
}
