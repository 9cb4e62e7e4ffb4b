//! The bus's end on a byte stream with the `embedded-io` traits.

// Requirement: B-09

use embedded_io::{Read, Write};

use super::{Bus, Rows};
use crate::wire::Mac;
use crate::{Index, Millis};

/// Bytes read at once: the depth of a serial line's buffer, and little stack.
const CHUNK: usize = 64;

impl<I: Index, M: Mac, R: Rows> Bus<'_, '_, I, M, R> {
    /// Reads once from a serial line or another byte stream and takes the bytes as [`receive`](Self::receive) does: at
    /// most 64, whose number is returned; 0 at the stream's end. Blocks if `line` does: check its `ReadReady` first.
    ///
    /// Cost: O(bytes).
    ///
    /// # Errors
    /// The stream's error; nothing was taken.
    ///
    /// ```
    /// # use dibs_build::{Builder, generate};
    /// # use dibs_nostd::guard::{GuardLimits, Surface};
    /// # use dibs_nostd::{Millis, TreeBytes};
    /// # static HEART: Surface<162> = Surface::new();
    /// # let built = Builder::new().stretch(1.5).build(&generate::heart(320)?.mesh)?;
    /// # let (tree, limits) = (TreeBytes::<u16>::new(built.blob()), GuardLimits::new(300.0, Millis(80)));
    /// # let (mut bus, _) = HEART.start::<_, 32, 64>(tree, limits)?;
    /// # let (now, received, mut sent) = (Millis(100), [0; 3], [0; 256]);
    /// # let (mut receives, mut sends) = (&received[..], &mut sent[..]);
    /// while bus.receive_from(&mut receives, now)? > 0 {}
    /// bus.work(100)?;
    /// let written = bus.send_status_to(&mut sends, now)?;
    /// # assert!(written > 0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn receive_from<L: Read + ?Sized>(
        &mut self,
        line: &mut L,
        now: Millis,
    ) -> Result<usize, L::Error> {
        let mut bytes = [0; CHUNK];
        let count = line.read(&mut bytes)?;
        // A count beyond the buffer, from a faulty stream, is limited to the buffer.
        self.receive(bytes.get(..count).unwrap_or(&bytes), now);
        Ok(count)
    }

    /// Writes the status that is due, framed, to a byte stream, without a flush. Returns the bytes written: 0 if no
    /// status is due, as [`status`](Self::status). A status that the stream takes only in part is lost; the next is due
    /// in 100 ms.
    ///
    /// Cost: at most [`STATUS_FRAMED`](Self::STATUS_FRAMED) bytes, and as many calls of `write`.
    ///
    /// # Errors
    /// The stream's error.
    pub fn send_status_to<L: Write + ?Sized>(
        &mut self,
        line: &mut L,
        now: Millis,
    ) -> Result<usize, L::Error> {
        let mut framed = [0; _];
        let mut rest = self.status_framed(now, &mut framed).unwrap_or_default();
        let mut written = 0_usize;
        // Not `write_all`, which panics if a stream accepts no bytes.
        while !rest.is_empty() {
            let count = line.write(rest)?;
            let Some(after) = rest.get(count..).filter(|_| count > 0) else { break };
            written = written.saturating_add(count);
            rest = after;
        }
        Ok(written)
    }
}
