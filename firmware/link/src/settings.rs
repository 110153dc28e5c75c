//! An axis' settings as bytes: its words, the lowest byte first. Who reads them
//! checks them: what came over a line is held to the same ranges as what was
//! written by hand.

use heapless::Vec;

use crate::body::{Reader, Wire, Writer};
use crate::frame::LARGEST_BODY;
use firmware::Settings;

/// A part of a configuration.
pub type Payload = Vec<u8, LARGEST_BODY>;

/// All words of the settings.
pub fn write(settings: &Settings) -> Option<Payload> {
    Writer::body(|to| {
        let mut words = settings.to_words();
        words.iter_mut().try_for_each(|word| to.u32(word))
    })
}

/// Reads what [`write()`] wrote; `None` if words are missing or too many.
pub fn read(payload: &[u8]) -> Option<Settings> {
    let mut from = Reader::new(payload);
    let mut words = [0; Settings::WORDS];
    words.iter_mut().try_for_each(|word| from.u32(word))?;
    from.end()?;
    Some(Settings::from_words(words))
}
