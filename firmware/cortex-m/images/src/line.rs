//! Bytes in, frames out: the same for every transport.

use core::mem::MaybeUninit;

use firmware::SetpointTable;
use firmware_link::Server;
use firmware_link::frame::{Receiver, encode};
use firmware_link::reply::LARGEST_REPLY;
use heapless::Vec;

use crate::board::TABLE_CAPACITY;
use crate::chip::Chip;

/// Bytes of the largest reply on the line: the body, 4 of CRC, the first
/// distance and the end.
pub const LARGEST_REPLY_FRAME: usize = LARGEST_REPLY + 6;

/// The setpoints. All zeros, so that it takes no flash.
static mut TABLE: SetpointTable<TABLE_CAPACITY> = SetpointTable::resting_at(0);

/// The server; what it starts with is written by [`Line::take_memory`].
static mut LINE: MaybeUninit<Line> = MaybeUninit::uninit();

/// Link between a transport and the controller.
#[derive(Debug)]
pub struct Line {
    receiver: Receiver,
    server: Server<'static, TABLE_CAPACITY>,
    chip: Chip,
}

impl Line {
    /// The line of this image.
    ///
    /// # Safety
    /// To be called once.
    pub unsafe fn take_memory() -> &'static mut Self {
        let table = &raw mut TABLE;
        // SAFETY: this is the only mention of the table, and made once.
        let table = unsafe { &mut *table };
        let line = &raw mut LINE;
        // SAFETY: this is the only mention of the line, and made once.
        let line = unsafe { &mut *line };
        line.write(Self {
            receiver: Receiver::new(),
            server: Server::new(table),
            chip: Chip::at_start(),
        })
    }

    /// Takes a byte; the reply, if it ends a frame that has one.
    pub fn take(&mut self, byte: u8) -> Option<Vec<u8, LARGEST_REPLY_FRAME>> {
        let received = self.receiver.take(byte)?;
        let reply = self.server.answer(received, &mut self.chip)?;
        encode(&reply)
    }
}
