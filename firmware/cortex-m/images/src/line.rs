//! Bytes in, frames out: the same for every transport.

use firmware::SetpointTable;
use firmware_link::Server;

use crate::board::TABLE_CAPACITY;
use crate::chip::Chip;

// Both are all zeros, so that they take no flash.
static mut SERVER: Server = Server::START;
static mut TABLE: SetpointTable<TABLE_CAPACITY> = SetpointTable::resting_at(0);

/// Link between a transport and the controller.
#[derive(Debug)]
pub struct Line {
    server: &'static mut Server,
    /// The setpoints.
    table: &'static mut SetpointTable<TABLE_CAPACITY>,
    chip: Chip,
}

impl Line {
    /// The line of this image.
    ///
    /// # Safety
    /// To be called once.
    pub unsafe fn take_memory() -> Self {
        let server = &raw mut SERVER;
        let table = &raw mut TABLE;
        Self {
            // SAFETY: this is the only mention of the server, and made once.
            server: unsafe { &mut *server },
            // SAFETY: likewise of the table.
            table: unsafe { &mut *table },
            chip: Chip::at_start(),
        }
    }

    /// Takes a byte; the frame to send, empty where there is nothing to say.
    pub fn take(&mut self, byte: u8) -> &[u8] {
        self.server.take(byte, self.table, &mut self.chip)
    }
}
