//! What is around the chip of `sot twin fx2` on its user's desk: somebody who reads its complaints, and
//! what is plugged into its serial ports.

use std::rc::Rc;

use clap::ValueEnum;
use fx2::Fx2;
use fx2::host::Link;
use fx2::symbols::Symbols;
use sim::Ps;

/// Bytes kept of what a serial port has said.
const SAID_MAX: usize = 64 << 10;

/// What is plugged into the serial ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Serial {
    /// Nobody; what they say is told at the end
    Open,
    /// A plug that returns everything
    Loop,
}

/// The desk.
pub struct Desk<L> {
    link: L,
    serial: Serial,
    said: [Vec<u8>; 2],
    symbols: Rc<Symbols>,
    /// Complaints told so far; `None` = they are told at the end.
    told: Option<usize>,
}

impl<L: Link> Desk<L> {
    /// A desk around `link`. With `live`, complaints go to standard error as they come.
    pub fn new(link: L, serial: Serial, symbols: Rc<Symbols>, live: bool) -> Self {
        Self { link, serial, said: [Vec::new(), Vec::new()], symbols, told: live.then_some(0) }
    }

    /// What is on the desk.
    pub fn inner(&self) -> &L {
        &self.link
    }

    /// What the open serial ports have said, not more than 64 KiB each.
    pub fn said(&self) -> [String; 2] {
        self.said.each_ref().map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }

    fn pass_serial(&mut self) {
        for port in 0..2 {
            let bytes = self.link.fx2().take_serial(port);
            if self.serial == Serial::Loop {
                for byte in bytes {
                    self.link.fx2().push_serial(port, byte);
                }
            } else {
                let room = SAID_MAX - self.said[port].len();
                self.said[port].extend(bytes.into_iter().take(room));
            }
        }
    }

    fn tell(&mut self) {
        let Some(told) = &mut self.told else { return };
        for found in self.link.fx2().diagnostics().iter().skip(*told) {
            eprintln!("{}", self.symbols.describe(found));
            *told += 1;
        }
    }
}

impl<L: Link> Link for Desk<L> {
    fn fx2(&mut self) -> &mut Fx2 {
        self.link.fx2()
    }

    fn run_until(&mut self, t: Ps) {
        self.link.run_until(t);
        self.pass_serial();
        self.tell();
    }
}
