//! The checksum of a stored JSON object: XXH3 of the text before it, as its last key.

use super::{PathError, open_own};
use serde::Serialize;
use serde_json::Value;
use std::io::{self, Read};
use std::path::Path;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

const KEY: &str = "checksum";

/// Returns the checksum of a file with this content.
pub fn checksum(content: &[u8]) -> String {
    format!("{:032x}", xxh3_128(content))
}

/// Returns the checksum of a file in a folder of results: XXH3 with 128 bits, in hexadecimal digits.
///
/// # Errors
/// If it cannot be read.
pub fn checksum_of(path: &Path) -> Result<String, PathError> {
    let io = PathError::io(path);
    let file = open_own(path)?.ok_or_else(|| io(io::ErrorKind::NotFound.into()));
    let (mut file, mut hash) = (file?, Xxh3::new());
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer).map_err(&io)? {
            0 => return Ok(format!("{:032x}", hash.digest128())),
            length => hash.update(&buffer[..length]),
        }
    }
}

/// Returns an object as JSON with its checksum.
pub fn sealed(object: &impl Serialize) -> String {
    let mut text = serde_json::to_string(object).unwrap_or_default();
    text.pop();
    let end = ending(text.as_bytes());
    text + &end
}

/// The end of a text that begins so.
fn ending(begin: &[u8]) -> String {
    format!(",\"{KEY}\":\"{}\"}}\n", checksum(begin))
}

/// Whether a text ends as with a checksum, under whatever key: a key that is damaged is no reason to do without.
fn ends_sealed(text: &[u8]) -> bool {
    let text = text.trim_ascii_end().strip_suffix(b"\"}");
    let digits = text.and_then(|text| text.split_last_chunk::<32>());
    digits.is_some_and(|(begin, digits)| begin.ends_with(b":\"") && digits.iter().all(u8::is_ascii_hexdigit))
}

/// Takes the checksum out of an object that was parsed from `text`. Files of version 0.2.0 have none.
///
/// # Errors
/// If the checksum is wrong.
pub fn unseal(object: &mut Value, text: &[u8]) -> Result<(), &'static str> {
    let found = object.as_object_mut().and_then(|keys| keys.remove(KEY));
    let begin = text.len().checked_sub(ending(b"").len());
    let is_right = begin.is_some_and(|begin| text[begin..] == *ending(&text[..begin]).as_bytes());
    if is_right || found.is_none() && !ends_sealed(text) {
        Ok(())
    } else {
        Err("damaged: the checksum differs")
    }
}

/// Parses an object, and takes its checksum out.
///
/// # Errors
/// If it cannot be parsed, or the checksum is wrong.
pub fn parsed(text: &[u8]) -> Result<Value, String> {
    let mut object = serde_json::from_slice(text).map_err(|error| error.to_string())?;
    unseal(&mut object, text)?;
    Ok(object)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Whatever byte changes, the object is the same or is refused.
    #[test]
    fn no_flipped_byte_is_taken() {
        let object = json!({"program": "asobench", "x": [1, 2.5e-3], "text": "a \"b\""});
        let text = sealed(&object);
        assert_eq!(parsed(text.as_bytes()), Ok(object.clone()));
        let plain = object.to_string();
        assert_eq!(parsed(plain.as_bytes()), Ok(object.clone()));
        for place in 0..text.len() {
            for bit in 0..8 {
                let mut damaged = text.clone().into_bytes();
                damaged[place] ^= 1 << bit;
                let same = parsed(&damaged).map_or(true, |found| found == object);
                assert!(same, "byte {place}, bit {bit}");
            }
        }
    }
}
