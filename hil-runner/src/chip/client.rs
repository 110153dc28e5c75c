//! The host's end of the line: asks, asks again, and takes no answer but the
//! right one.
//!
//! One request is under way at a time. An answer counts if its frame is whole
//! and it bears the session and the number of the request; anything else on
//! the line is left alone. Without an answer the request is sent again, after
//! [`Line::patience`], twice that, and so on, or at once where the chip says that
//! it came damaged; the chip carries it out once, however often it comes. After
//! [`GIVE_UP`] without an answer, on a slow line after [`PATIENCES`], the line
//! counts as dead.

use std::time::{Duration, Instant};

use firmware::Settings;
use firmware_link::body::{Header, VERSION};
use firmware_link::frame::{LARGEST_FRAME, Received, Receiver, crc32_on, encode};
use firmware_link::{Events, Identity, Nak, Reply, Request, SourceKind, Status, Step, Stepped};

use super::line::{ChipError, Line};

/// Time that a chip may be silent before the run ends.
pub const GIVE_UP: Duration = Duration::from_secs(3);

/// The same in patiences of the line, where that is longer.
pub const PATIENCES: u32 = 8;

/// An answer to something else.
const UNEXPECTED: &str = "the controller answers something else than was asked";

/// Another identity than that of the session before.
const CHANGED: &str = "the controller's identity has changed since it was greeted: its flash is \
                       another, or it is another controller";

/// A request that fits no frame.
pub(super) fn too_long() -> ChipError {
    "a request does not fit a frame".into()
}

/// Notes of a client on its line. Matters of the moment: they enter no
/// summary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Noticed {
    /// Requests that were answered.
    pub answered: u64,
    /// Times that a request was sent again.
    pub repeated: u64,
    /// Damaged frames, ours at the chip and the chip's here.
    pub damaged: u64,
    /// Whole frames that answered something else.
    pub stray: u64,
}

/// A chip that has answered HELLO.
#[derive(Debug)]
pub struct Client {
    line: Box<dyn Line>,
    receiver: Receiver,
    session: u16,
    /// Of the last request.
    number: u32,
    last_tick: u64,
    identity: Identity,
    /// CRC-32 over the parts of the configuration so far.
    configuration: u32,
    noticed: Noticed,
}

impl Client {
    /// Greets the chip.
    ///
    /// # Errors
    /// [`ChipError`] if nobody answers, or in another version.
    pub fn greet(line: Box<dyn Line>) -> Result<Self, ChipError> {
        let mut client = Self {
            line,
            receiver: Receiver::new(),
            session: 0,
            number: 0,
            last_tick: u64::MAX,
            identity: Identity::default(),
            configuration: 0,
            noticed: Noticed::default(),
        };
        client.begin_session()?;
        Ok(client)
    }

    /// Begins a session: the chip forgets what was.
    ///
    /// # Errors
    /// [`ChipError`] if nobody answers, or in another version.
    pub fn begin_session(&mut self) -> Result<(), ChipError> {
        self.session = next_session(self.session);
        self.number = 0;
        self.last_tick = u64::MAX;
        self.configuration = 0;
        let Reply::Hello(identity) = self.ask(&Request::Hello)? else {
            return Err(UNEXPECTED.into());
        };
        if identity.version != VERSION {
            return Err(ChipError(format!(
                "the controller speaks version {} of the protocol, this program version {VERSION}: \
                 build image and program from the same sources",
                identity.version
            )));
        }
        if identity.timer_hz == 0 {
            return Err("the controller tells a timer of 0 Hz".into());
        }
        // Before it is greeted it has none.
        if self.identity.version != 0 && identity != self.identity {
            return Err(CHANGED.into());
        }
        self.identity = identity;
        Ok(())
    }

    /// The chip at the other end.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The notes on the line so far.
    pub fn noticed(&self) -> Noticed {
        self.noticed
    }

    /// The next request: asks until it is answered.
    ///
    /// # Errors
    /// [`ChipError`]; the session is over then.
    pub fn request(&mut self, request: &Request<'_>) -> Result<Reply, ChipError> {
        if !matches!(request, Request::Status) {
            self.number = self.number.wrapping_add(1);
        }
        let reply = self.ask(request)?;
        match request {
            Request::Step(step) => self.last_tick = step.inputs.tick,
            Request::Settings(_) | Request::Memory(_) | Request::Plan(_) => {
                let body = request.body(0, 0, 0).ok_or_else(too_long)?;
                let payload = body.get(Header::BYTES..).unwrap_or_default();
                let crc = crc32_on(self.configuration, &[request.kind()]);
                self.configuration = crc32_on(crc, payload);
            }
            _ => {}
        }
        Ok(reply)
    }

    /// A request that is answered by having been taken.
    ///
    /// # Errors
    /// [`ChipError`]; the session is over then.
    pub fn take(&mut self, request: &Request<'_>) -> Result<(), ChipError> {
        match self.request(request)? {
            Reply::Taken => Ok(()),
            _ => Err(UNEXPECTED.into()),
        }
    }

    /// Ends the configuration: from now on the chip takes samples, and `events`
    /// have been asked for before the first.
    ///
    /// # Errors
    /// [`ChipError`]; the session is over then.
    pub fn begin(&mut self, source: SourceKind, events: Events) -> Result<(), ChipError> {
        let configuration = self.configuration;
        self.take(&Request::Begin {
            configuration,
            source,
            events,
        })
    }

    /// One sample.
    ///
    /// # Errors
    /// [`ChipError`]; the session is over then.
    pub fn step(&mut self, step: Step) -> Result<Stepped, ChipError> {
        match self.request(&Request::Step(step))? {
            Reply::Stepped(stepped) => Ok(stepped),
            _ => Err(UNEXPECTED.into()),
        }
    }

    /// The chip's own notes on the session.
    ///
    /// # Errors
    /// [`ChipError`]; the session is over then.
    pub fn status(&mut self) -> Result<Status, ChipError> {
        match self.request(&Request::Status)? {
            Reply::Status(status) => Ok(status),
            _ => Err(UNEXPECTED.into()),
        }
    }

    fn ask(&mut self, request: &Request<'_>) -> Result<Reply, ChipError> {
        let body = request.body(self.session, self.number, self.last_tick);
        let frame = body.and_then(|body| encode::<LARGEST_FRAME>(&body));
        let frame = frame.ok_or_else(too_long)?;
        let mut patience = self.line.patience();
        let give_up = GIVE_UP.max(patience * PATIENCES);
        let start = Instant::now();
        self.line.send(&frame)?;
        let mut buffer = [0; 256];
        loop {
            let count = self.line.receive(&mut buffer, patience)?;
            let mut again = count == 0;
            if again {
                // A chip that is slow, not silent, must not drown in repetitions.
                patience = (patience * 2).min(give_up / 4);
            }
            for byte in buffer.iter().take(count) {
                match self.receiver.take(*byte) {
                    None => {}
                    Some(Received::Damaged) => self.noticed.damaged += 1,
                    Some(Received::Body(body)) => match Reply::read(body) {
                        Some((_, Reply::Nak(Nak::Damaged))) => {
                            self.noticed.damaged += 1;
                            again = true;
                        }
                        Some((header, reply))
                            if header.session == self.session && header.number == self.number =>
                        {
                            self.noticed.answered += 1;
                            return match reply {
                                Reply::Nak(nak) => Err(refusal(&nak)),
                                reply => Ok(reply),
                            };
                        }
                        _ => self.noticed.stray += 1,
                    },
                }
            }
            if start.elapsed() > give_up {
                let limit_s = give_up.as_secs();
                let words = format!("the controller has not answered for {limit_s} s");
                return Err(ChipError(words));
            }
            if again {
                self.noticed.repeated += 1;
                // A 0 ends whatever the line has made of the frame before.
                self.line.send(&[0])?;
                self.line.send(&frame)?;
            }
        }
    }
}

/// A session that is not the last one, nor one of a run shortly before.
fn next_session(last: u16) -> u16 {
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let nanoseconds = clock.map_or(0, |since| since.subsec_nanos());
    let [a, b, c, d] = nanoseconds.to_le_bytes();
    match u16::from_le_bytes([a ^ c, b ^ d]) {
        drawn if drawn == last || drawn == 0 => last.wrapping_add(1).max(1),
        drawn => drawn,
    }
}

/// A refusal in words.
fn refusal(nak: &Nak) -> ChipError {
    ChipError(match nak {
        Nak::Session => "the controller has restarted and lost its memory".to_owned(),
        Nak::Number { expected } => {
            format!("the controller has lost its place: it expects request {expected}")
        }
        Nak::Configuration { here } => format!(
            "the controller has another configuration than this run: its CRC-32 is {here:08x}"
        ),
        Nak::Settings { word } => {
            let place = usize::try_from(*word).unwrap_or(usize::MAX);
            let name = Settings::NAMES.get(place).unwrap_or(&"of no name");
            format!("the controller refuses the word {name} of its settings")
        }
        Nak::Plan { stretch } => format!(
            "the controller refuses the planned motion: its stretch {stretch} does not go on where \
             the one before ends, or is none"
        ),
        Nak::Memory => {
            "the motion has more setpoints than the controller's table; a longer sample \
                       time or controller.setpoints = \"generator\" needs fewer"
                .to_owned()
        }
        Nak::Driving => {
            "the controller drives an axis of its own; it serves a bench after a reset \
                         in bench mode"
                .to_owned()
        }
        _ => format!("the controller refuses a request: {nak:?}"),
    })
}
