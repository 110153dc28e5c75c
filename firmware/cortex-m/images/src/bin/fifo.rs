//! The controller behind two FIFOs: `to-chip` and `from-chip` in the folder
//! that QEMU runs in. It ends when the host closes `to-chip`.

#![no_std]
#![no_main]

use images::host::{self, File, Mode};
use images::line::Line;

/// A frame or two at once; a step has some twenty bytes.
const AT_ONCE: usize = 32;

#[images::entry]
fn main() -> ! {
    // SAFETY: the image begins here, once.
    let mut line = unsafe { Line::take_memory() };
    serve(&mut line);
    host::exit()
}

/// Until there is nothing to read any more, or no one to write to.
fn serve(line: &mut Line) -> Option<()> {
    // The host opens its ends in the same order: each waits for the other.
    let requests = File::open(c"to-chip", Mode::Read)?;
    let replies = File::open(c"from-chip", Mode::Write)?;
    let mut memory = [0; AT_ONCE];
    loop {
        let bytes = requests.read(&mut memory)?;
        if bytes.is_empty() {
            return None;
        }
        for byte in bytes {
            let frame = line.take(*byte);
            if !frame.is_empty() {
                replies.write(frame)?;
            }
        }
    }
}
