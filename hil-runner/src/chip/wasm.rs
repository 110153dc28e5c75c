//! The simulator of web pages under an interpreter: its functions, and the firmware in it at
//! the end of a line.

use std::collections::VecDeque;
use std::fmt;
use std::io::Read;
use std::time::Duration;

use firmware_link::frame::crc32;
use wasmi::{Engine, Instance, Linker, Memory, Module, Store, WasmParams};

use super::line::{ChipError, Line};

/// An image that has been started.
#[derive(Debug)]
pub struct Page {
    store: Store<()>,
    instance: Instance,
    memory: Memory,
    crc: u32,
}

impl Page {
    /// Starts an image.
    ///
    /// # Errors
    /// [`ChipError`] if the bytes are no such image.
    pub fn start(image: &[u8]) -> Result<Self, ChipError> {
        let engine = Engine::default();
        let module = Module::new(&engine, image).map_err(failed)?;
        let mut store = Store::new(&engine, ());
        let instance = Linker::new(&engine)
            .instantiate_and_start(&mut store, &module)
            .map_err(failed)?;
        let memory = instance.get_memory(&store, "memory");
        Ok(Self {
            memory: memory.ok_or_else(|| failed("it exports no memory"))?,
            store,
            instance,
            crc: crc32(image),
        })
    }

    /// CRC-32 of the image.
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// The answer of a function to a request; see package `hil-web`.
    ///
    /// # Errors
    /// [`ChipError`] if the image has no such function, or ends abnormally in it.
    pub fn ask(&mut self, function: &str, request: &[u8]) -> Result<Vec<u8>, ChipError> {
        let length = u32::try_from(request.len()).map_err(failed)?;
        let room = self.call("room", length)?;
        let written = self.memory.write(&mut self.store, room, request);
        written.map_err(failed)?;
        let length = self.call(function, ())?;
        let place = self.call("answer", ())?;
        let mut answer = vec![0; length];
        let read = self.memory.read(&self.store, place, &mut answer);
        read.map_err(failed)?;
        Ok(answer)
    }

    fn call(&mut self, function: &str, given: impl WasmParams) -> Result<usize, ChipError> {
        let instance = self.instance;
        let function = instance.get_typed_func::<_, u32>(&self.store, function);
        let result = function.map_err(failed)?.call(&mut self.store, given);
        usize::try_from(result.map_err(failed)?).map_err(failed)
    }
}

fn failed(because: impl fmt::Display) -> ChipError {
    ChipError(format!("the simulator of web pages fails: {because}"))
}

/// The firmware of an image, as at the end of a chip's line.
#[derive(Debug)]
pub struct PageLine {
    page: Page,
    replies: VecDeque<u8>,
}

impl PageLine {
    /// The line to an image.
    pub fn new(page: Page) -> Self {
        let replies = VecDeque::new();
        Self { page, replies }
    }
}

impl Line for PageLine {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ChipError> {
        self.replies.extend(self.page.ask("serve", bytes)?);
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
