//! Bench mode: the controller on this chip, the plant at the other end of the
//! line. The electronics stay as the reset has left them, off and at 0 V.

use firmware::{CAPACITY, SetpointTable};
use firmware_link::Server;
use firmware_link::frame::{LARGEST_FRAME, Receiver, encode};

use super::chip::Chip;
use super::line::Line;

/// Serves one host after another.
pub(super) fn run(
    mut line: Line,
    mut chip: Chip,
    table: &'static mut SetpointTable<CAPACITY>,
) -> ! {
    let mut receiver = Receiver::new();
    let mut server = Server::new(table);
    loop {
        let byte = line.next_byte();
        let Some(received) = receiver.take(byte) else {
            continue;
        };
        let reply = server.answer(received, &mut chip);
        if let Some(frame) = reply.and_then(|reply| encode::<LARGEST_FRAME>(&reply)) {
            line.send(&frame);
        }
    }
}
