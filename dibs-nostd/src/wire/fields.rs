//! Little-endian fields of a packet, read and written in sequence.

/// Reads fields from bytes whose length has been checked; zeros past the end.
pub(super) struct Fields<'a>(pub &'a [u8]);

impl Fields<'_> {
    #[inline(always)]
    pub fn take<const SIZE: usize>(&mut self) -> [u8; SIZE] {
        let Some((field, rest)) = self.0.split_first_chunk() else { return [0; SIZE] };
        self.0 = rest;
        *field
    }

    #[inline(always)]
    pub fn u8(&mut self) -> u8 {
        let [value] = self.take();
        value
    }

    #[inline(always)]
    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    #[inline(always)]
    pub fn u24(&mut self) -> u32 {
        let [low, middle, high] = self.take();
        u32::from_le_bytes([low, middle, high, 0])
    }

    #[inline(always)]
    pub fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    #[inline(always)]
    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
}

/// Appends fields to a buffer that is large enough.
pub(super) struct Bytes<'b> {
    pub buffer: &'b mut [u8],
    pub used: usize,
}

impl<'b> Bytes<'b> {
    pub fn put(&mut self, bytes: &[u8]) {
        let end = self.used.saturating_add(bytes.len());
        if let Some(room) = self.buffer.get_mut(self.used..end) {
            for (to, from) in room.iter_mut().zip(bytes) {
                *to = *from;
            }
            self.used = end;
        }
    }

    pub fn written(&self) -> &[u8] {
        self.buffer.get(..self.used).unwrap_or_default()
    }

    pub fn into_written(self) -> Option<&'b [u8]> {
        self.buffer.get(..self.used)
    }
}
