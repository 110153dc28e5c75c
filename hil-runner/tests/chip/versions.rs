//! A chip that speaks another version is told in a sentence, whichever of the two is
//! older.

use std::collections::VecDeque;
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
            reply.resize(reply.len() + self.more, 77);
            self.replies
                .extend(encode::<LARGEST_FRAME>(&reply).unwrap());
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], _: Duration) -> Result<usize, ChipError> {
        let count = buffer.len().min(self.replies.len());
        for (place, byte) in buffer.iter_mut().zip(self.replies.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }

    fn patience(&self) -> Duration {
        Duration::ZERO
    }
}

fn greeted(version: u8, more: usize) -> Result<Client, ChipError> {
    Client::greet(Box::new(Other {
        version,
        more,
        receiver: Receiver::new(),
        replies: VecDeque::new(),
    }))
}

#[test]
fn both_versions_are_told() {
    for version in [VERSION - 1, VERSION + 1, 0, 255] {
        for more in [0, 1, 28, 60] {
            let ChipError(sentence) = greeted(version, more).unwrap_err();
            let expected = format!(
                "the controller speaks version {version} of the protocol, this program version \
                 {VERSION}: build image and program from the same sources"
            );
            assert_eq!(sentence, expected);
        }
    }
    // The contrast: this version, with the rest that it has.
    assert!(greeted(VERSION, 28).is_ok());
}
