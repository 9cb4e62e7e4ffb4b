//! `--key FILE`: the key of the packets' tags.

use anyhow::{Context, Result, ensure};
use std::path::Path;

/// Digits of a key of 128 bits.
const DIGITS: usize = 32;

/// Reads a key: 32 hexadecimal digits, with any white space around them. No error quotes the file's content, which may
/// be a key.
pub fn read(path: &Path) -> Result<[u8; 16]> {
    let name = path.display();
    let what = format!(
        "{name}: a key file holds {DIGITS} hexadecimal digits and nothing else, as \
         `openssl rand -hex 16` prints"
    );
    refuse_if_shared(path)?;
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => anyhow::bail!("{name}: cannot be read: {error}"),
    };
    let digits = bytes.trim_ascii();
    ensure!(digits.len() == DIGITS, "{what}; this one has {} characters", digits.len());
    let mut key = [0; 16];
    for (byte, pair) in key.iter_mut().zip(digits.as_chunks::<2>().0) {
        let [high, low] = pair.map(|digit| char::from(digit).to_digit(16));
        let (high, low) = high.zip(low).with_context(|| what.clone())?;
        *byte = (high << 4 | low) as u8;
    }
    Ok(key)
}

/// Refuses a key file that others on this computer can read.
#[cfg(unix)]
fn refuse_if_shared(path: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    // The caller reports a missing file.
    let Ok(metadata) = std::fs::metadata(path) else { return Ok(()) };
    let mode = metadata.permissions().mode() & 0o777;
    let name = path.display();
    ensure!(
        mode & 0o077 == 0,
        "{name}: other users can read or write this key (mode {mode:03o}); `chmod 600 {name}`, and \
         take a new key if others had access"
    );
    Ok(())
}

#[cfg(not(unix))]
fn refuse_if_shared(_: &Path) -> Result<()> {
    Ok(())
}
