//! A position in a file that is text, or text with binary numbers between its words.

use super::raw::{coordinate, excerpt};
use super::scalar::{Endian, Scalar, index};
use super::{Format, ReadErrorKind};

type Result<T> = std::result::Result<T, ReadErrorKind>;

#[derive(Clone)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    format: Format,
    /// The byte order of binary numbers; `None` where numbers are text.
    pub binary: Option<Endian>,
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8], format: Format) -> Self {
        Self { bytes, at: 0, format, binary: None }
    }

    pub fn malformed(&self, what: String) -> ReadErrorKind {
        let line = || 1 + self.bytes[..self.at].iter().filter(|&&byte| byte == b'\n').count();
        ReadErrorKind::Malformed {
            format: self.format,
            line: self.binary.is_none().then(line),
            what,
        }
    }

    pub fn truncated(&self, missing: String) -> ReadErrorKind {
        ReadErrorKind::Truncated { format: self.format, missing }
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The next word, `None` at the end.
    pub fn word(&mut self) -> Option<&'a str> {
        let is_text = self.binary.is_none();
        // Some programs write a zero after the end.
        let is_space = |byte: &&u8| byte.is_ascii_whitespace() || (is_text && **byte == 0);
        self.at += self.rest().iter().take_while(is_space).count();
        let length = self.rest().iter().take_while(|byte| !byte.is_ascii_whitespace()).count();
        let word = &self.rest()[..length];
        self.at += length;
        // A name in another encoding than UTF-8 is no keyword, so its text is not needed.
        (length > 0).then(|| std::str::from_utf8(word).unwrap_or("?"))
    }

    /// The next word; its absence is an error.
    pub fn needed(&mut self, what: &str) -> Result<&'a str> {
        self.word().ok_or_else(|| self.truncated(format!("no {what}")))
    }

    /// The next word in capitals, `None` at the end.
    pub fn keyword(&mut self) -> Option<String> {
        self.word().map(str::to_ascii_uppercase)
    }

    /// Skips so many bytes.
    pub fn skip(&mut self, bytes: usize) -> Result<&'a [u8]> {
        let skipped = self.rest().get(..bytes);
        self.at = (self.at + bytes).min(self.bytes.len());
        skipped.ok_or_else(|| self.truncated("bytes are missing".to_owned()))
    }

    /// Moves to the next line, and returns the rest of this one.
    pub fn line(&mut self) -> String {
        let length = self.rest().iter().take_while(|&&byte| byte != b'\n').count();
        let line = String::from_utf8_lossy(&self.rest()[..length]).trim().to_owned();
        self.at = (self.at + length + 1).min(self.bytes.len());
        line
    }

    /// Skips a section that is not needed, including the word that ends it.
    pub fn skip_to(&mut self, end: &str) -> Result<()> {
        let found = self.rest().windows(end.len()).position(|window| window == end.as_bytes());
        let found = found.ok_or_else(|| self.truncated(format!("no '{end}'")))?;
        self.at += found + end.len();
        Ok(())
    }

    /// The next number, text or binary.
    pub fn number(&mut self, scalar: Scalar) -> Result<f64> {
        let Some(order) = self.binary else { return self.text_number() };
        let Some(bytes) = self.rest().get(..scalar.bytes()) else {
            return Err(self.truncated("numbers are missing".to_owned()));
        };
        self.at += bytes.len();
        Ok(scalar.read(bytes, order))
    }

    /// The next number, which is text even in a binary file.
    pub fn text_number(&mut self) -> Result<f64> {
        let word = self.needed("number where one is expected")?;
        coordinate(word)
            .ok_or_else(|| self.malformed(format!("'{}' is not a number", excerpt(word))))
    }

    /// The next number, which must be a whole number: a count or an index.
    pub fn index(&mut self, scalar: Scalar) -> Result<u64> {
        let number = self.number(scalar)?;
        self.whole(number)
    }

    pub fn text_index(&mut self) -> Result<u64> {
        let number = self.text_number()?;
        self.whole(number)
    }

    pub fn whole(&self, number: f64) -> Result<u64> {
        index(number).ok_or_else(|| self.malformed(format!("{number} is not a count or an index")))
    }

    /// An error unless so many elements, of at least so many bytes each, can follow; called before memory is allocated
    /// for them.
    pub fn check_room(&self, count: u64, bytes: usize, element: &str) -> Result<usize> {
        let most = self.rest().len() as u64 / bytes as u64 + 1;
        if count > most {
            return Err(ReadErrorKind::Count {
                element: element.to_owned(),
                claimed: count,
                found: most,
                at_most: true,
            });
        }
        Ok(count as usize)
    }

    /// The next numbers.
    pub fn numbers(&mut self, count: u64, scalar: Scalar, element: &str) -> Result<Vec<f64>> {
        // In text a number takes at least a digit and a space.
        let bytes = if self.binary.is_some() { scalar.bytes() } else { 2 };
        let count = self.check_room(count, bytes, element)?;
        (0..count).map(|_| self.number(scalar)).collect()
    }

    /// The next numbers if they are wanted; otherwise they are skipped, whatever the text holds in their places.
    pub fn numbers_or_words(
        &mut self,
        count: u64,
        scalar: Scalar,
        is_wanted: bool,
    ) -> Result<Option<Vec<f64>>> {
        if is_wanted {
            return self.numbers(count, scalar, "values").map(Some);
        }
        if self.binary.is_some() {
            let count = self.check_room(count, scalar.bytes(), "values")?;
            self.skip(count * scalar.bytes())?;
        } else {
            for _ in 0..self.check_room(count, 2, "values")? {
                self.needed("value where one is expected")?;
            }
        }
        Ok(None)
    }
}
