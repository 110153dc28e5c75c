//! The controller behind two FIFOs: `to-chip` and `from-chip` in the folder
//! that QEMU runs in. It ends when the host closes `to-chip`.

#![no_std]
#![no_main]

use images::line::Line;
use semihosting::fd::{AsFd, OwnedFd};
use semihosting::process;
use semihosting::sys::arm_compat::{OpenMode, sys_open};
use semihosting::sys::{read, write};

/// A frame or two at once; a step has some twenty bytes.
const AT_ONCE: usize = 64;

#[images::entry]
fn main() -> ! {
    // SAFETY: the image begins here, once.
    let line = unsafe { Line::take_memory() };
    serve(line);
    process::exit(0)
}

/// Until there is nothing to read any more, or no one to write to.
fn serve(line: &mut Line) -> Option<()> {
    // The host opens its ends in the same order: each waits for the other.
    let requests: OwnedFd = sys_open(c"to-chip", OpenMode::RDONLY_BINARY).ok()?;
    let replies: OwnedFd = sys_open(c"from-chip", OpenMode::WRONLY_TRUNC_BINARY).ok()?;
    let mut bytes = [0; AT_ONCE];
    loop {
        let count = read(requests.as_fd(), &mut bytes).ok()?;
        if count == 0 {
            return None;
        }
        for byte in bytes.get(..count)? {
            if let Some(reply) = line.take(*byte) {
                write(replies.as_fd(), &reply).ok()?;
            }
        }
    }
}
