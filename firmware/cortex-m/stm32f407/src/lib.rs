//! Parts of the board's image that do not know its chip: the axis that it
//! drives, what its button asks for, how it numbers samples, and what it
//! answers while it drives.
//!
//! The other half of this package, the image itself, puts these on the chip's
//! timers, pins and lines. Here nothing needs one, so the tests run on the host.

#![no_std]

pub mod axis;
mod drive;

pub use drive::{Button, Drive, Planned, Ticks};

use firmware_link::body::Header;
use firmware_link::frame::Received;
use firmware_link::reply::LARGEST_REPLY;
use firmware_link::{Identity, Nak, Reply, Request};
use heapless::Vec;

/// Answers a frame while the axis is driven: HELLO with the identity, everything else with
/// [`Nak::Driving`]. `None` where there is nothing to answer.
pub fn answer_while_driving(
    received: Received<'_>,
    identity: Identity,
) -> Option<Vec<u8, LARGEST_REPLY>> {
    let Received::Body(body) = received else {
        return Reply::Nak(Nak::Damaged).body(0, 0);
    };
    let (header, _) = Header::read(body)?;
    let reply = if header.kind == Request::Hello.kind() {
        Reply::Hello(identity)
    } else {
        Reply::Nak(Nak::Driving)
    };
    reply.body(header.session, header.number)
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: Identity = Identity {
        version: firmware_link::body::VERSION,
        target: *b"f407\0\0\0\0",
        image_crc: 1,
        flash_bytes: 2,
        ram_bytes: 3,
        table_capacity: 4,
        timer_hz: 5,
    };

    fn answer(request: &Request<'_>) -> (Header, Reply) {
        let body = request.body(7, 9, 0).expect("it fits");
        let reply = answer_while_driving(Received::Body(&body), IDENTITY).expect("an answer");
        Reply::read(&reply).expect("a reply")
    }

    #[test]
    fn hello_is_answered_and_the_rest_refused() {
        let (header, reply) = answer(&Request::Hello);
        assert_eq!((header.session, header.number), (7, 9));
        assert_eq!(reply, Reply::Hello(IDENTITY));
        for request in [
            Request::Status,
            Request::Settings(&[]),
            Request::Memory(&[]),
        ] {
            let (header, reply) = answer(&request);
            assert_eq!((header.session, header.number), (7, 9));
            assert_eq!(reply, Reply::Nak(Nak::Driving));
        }
    }

    #[test]
    fn what_is_no_request_is_not_taken_for_one() {
        let reply = answer_while_driving(Received::Damaged, IDENTITY).expect("an answer");
        let (_, reply) = Reply::read(&reply).expect("a reply");
        assert_eq!(reply, Reply::Nak(Nak::Damaged));
        assert_eq!(answer_while_driving(Received::Body(&[1]), IDENTITY), None);
    }
}
