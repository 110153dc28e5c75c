//! An axis' settings as bytes: its words, the lowest byte first. Who reads them
//! checks them: what came over a line is held to the same ranges as what was
//! written by hand.

use heapless::Vec;

use crate::body::Reader;
use crate::frame::LARGEST_BODY;
use firmware::Settings;
use firmware::settings::Words;

/// A part of a configuration.
pub type Payload = Vec<u8, LARGEST_BODY>;

/// All words of the settings.
pub fn write(settings: &Settings) -> Option<Payload> {
    let words = settings.to_words().map(u32::to_le_bytes);
    Vec::from_slice(words.as_flattened()).ok()
}

/// Reads what [`write()`] wrote; `None` if words are missing or too many.
pub fn read(payload: &[u8]) -> Option<Settings> {
    let mut from = Reader::new(payload);
    let mut words = Words::ZERO;
    words.0.iter_mut().for_each(|word| *word = from.u32());
    from.has_ended().then(|| Settings::from_words(words.0))
}
