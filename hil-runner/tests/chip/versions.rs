//! A chip that speaks another version is told in a sentence, whichever of the two is
//! older.

use std::collections::VecDeque;
use std::io::Read;
use std::time::Duration;

use firmware_link::body::{Header, VERSION};
use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, encode};
use hil_runner::chip::ChipError;
use hil_runner::chip::client::Client;
use hil_runner::chip::line::Line;

/// Answers every request with the IDENTITY of a version that has more, or less, to
/// tell.
#[derive(Debug)]
struct Other {
    version: u8,
    more: usize,
    /// What the rest of an identity has in every byte, and what the next one has more.
    rest: u8,
    drift: u8,
    receiver: Receiver,
    replies: VecDeque<u8>,
}

impl Line for Other {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        for byte in bytes {
            let Some(Received::Body(body)) = self.receiver.take(*byte) else {
                continue;
            };
            let (header, _) = Header::read(body).unwrap();
            let mut reply = vec![0x81];
            reply.extend(header.session.to_le_bytes());
            reply.extend(header.number.to_le_bytes());
            reply.push(self.version);
            reply.resize(reply.len() + self.more, self.rest);
            self.rest += self.drift;
            self.replies
                .extend(encode::<LARGEST_FRAME>(&reply).unwrap());
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, ChipError> {
        self.replies
            .read(buffer)
            .map_err(|error| ChipError(error.to_string()))
    }

    fn patience(&self) -> Duration {
        Duration::ZERO
    }
}

fn greeted(version: u8, more: usize, drift: u8) -> Result<Client, ChipError> {
    Client::greet(Box::new(Other {
        version,
        more,
        rest: 77,
        drift,
        receiver: Receiver::new(),
        replies: VecDeque::new(),
    }))
}

#[test]
fn both_versions_are_told() {
    for version in [VERSION - 1, VERSION + 1, 0, 255] {
        for more in [0, 1, 28, 60] {
            let ChipError(sentence) = greeted(version, more, 0).unwrap_err();
            let expected = format!(
                "the controller speaks version {version} of the protocol, this program version \
                 {VERSION}: build image and program from the same sources"
            );
            assert_eq!(sentence, expected);
        }
    }
    // The contrast: this version, with the rest that it has.
    assert!(greeted(VERSION, 28, 0).is_ok());
}

/// A chip whose image changes while it runs, by a store that has gone astray, is told by
/// the next session.
#[test]
fn an_identity_that_changes_is_told() {
    let again = |drift| greeted(VERSION, 28, drift).unwrap().begin_session();
    let ChipError(sentence) = again(1).unwrap_err();
    assert!(sentence.contains("identity has changed"), "{sentence}");
    // The contrast: the same one.
    assert!(again(0).is_ok());
}
