//! The firmware at the end of a line, as on a chip: what the certificate talks to.

use std::cell::RefCell;

use firmware::{CAPACITY, SetpointTable};
use firmware_link::{Identity, Server, Target, body::VERSION};

/// A chip that is this image: it has no clock, and no memory to tell of.
#[derive(Debug)]
struct Image;

impl Target for Image {
    fn identity(&self) -> Identity {
        Identity {
            version: VERSION,
            target: *b"wasm\0\0\0\0",
            image_crc: 0,
            flash_bytes: 0,
            ram_bytes: 0,
            table_capacity: u32::try_from(CAPACITY).unwrap_or(u32::MAX),
            // No chip has 0.
            timer_hz: 1,
        }
    }
    fn start(&mut self) {}
    fn elapsed(&mut self) -> u32 {
        0
    }
    fn stack_bytes(&self) -> u32 {
        0
    }
}

/// Server and table of setpoints.
type Chip = (Server, Box<SetpointTable<CAPACITY>>);

thread_local! {
    static CHIP: RefCell<Option<Chip>> = const { RefCell::new(None) };
}

/// The bytes that the firmware answers to bytes of the line.
pub fn serve(bytes: &[u8]) -> Vec<u8> {
    CHIP.with_borrow_mut(|chip| {
        let start = || (Server::START, Box::new(SetpointTable::resting_at(0)));
        let (server, table) = chip.get_or_insert_with(start);
        let mut replies = Vec::new();
        for byte in bytes {
            replies.extend(server.take(*byte, table, &mut Image));
        }
        replies
    })
}
