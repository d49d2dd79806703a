//! One robot: turret, base, and a host at its USB socket.

use common_sys::constants as c;
use common_sys::link::{CONFIG_STATUS_SIZE, ConfigStatus, config_status_decode};
use fx2::Fx2;
use fx2::eeprom::{BootConfig, Eeprom, Identity, c2_image};
use fx2::host::{Host, HostError, Link, Request};
use fx2::image::Image;
use khepera::Base;
use sim::{MS, Ps, US};
use thiserror::Error;

use crate::flash::{self, Flash};
use crate::turret::Turret;

/// How far one CPU may run ahead of the other while both are busy. They only meet in the FPGA, whose
/// report stands still for milliseconds.
const SLICE: Ps = 50 * US;
/// bmRequestType of a vendor request to the device, towards the host.
const VENDOR_IN: u8 = 0xC0;
/// How long the host waits for the firmware to be done with the FPGA, and how often it asks.
const STATUS_BUDGET: Ps = 500 * MS;
const STATUS_PERIOD: Ps = 5 * MS;

/// What a robot is built from: two firmware images and the flash.
#[derive(Clone)]
pub struct Images {
    /// The FX2's program, Intel hex or raw.
    pub fx2: Vec<u8>,
    /// The 68331's program, ELF or S-records.
    pub khepera: Vec<u8>,
    /// The turret's flash, 16 MiB.
    pub flash: Vec<u8>,
}

/// Why a robot cannot be built.
#[derive(Debug, Error)]
pub enum Error {
    /// The FX2's program is unusable.
    #[error("FX2 image: {0}")]
    Fx2(#[from] fx2::image::ImageError),
    /// The 68331's program is unusable.
    #[error("68331 image: {0}")]
    Khepera(#[from] khepera::ImageError),
    /// The flash image is unusable.
    #[error(transparent)]
    Flash(#[from] flash::ImageError),
}

/// Why the host does not know how the FPGA is.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TurretSilent {
    /// The device does not do what USB wants.
    #[error("the turret does not answer on USB: {0}")]
    Usb(#[from] HostError),
    /// It is somebody else.
    #[error("the device on USB is {0:04x}:{1:04x}, not a StereoSot turret: is its EEPROM written?")]
    Stranger(u16, u16),
    /// The status is of another version.
    #[error("the turret's firmware speaks another version of the protocol; flash a matching one")]
    Version,
    /// The firmware never came to a result.
    #[error("the turret's firmware is still configuring the FPGA after {0} ms")]
    Busy(u64),
}

/// A robot, from power-on.
#[derive(Clone)]
pub struct Robot {
    /// The FX2's surroundings: flash, FPGA, EEPROM.
    pub turret: Turret,
    fx2: Fx2,
    /// The base, with motors and console.
    pub base: Base,
}

impl Robot {
    /// A robot at time 0, switched on, with the turret's program in its boot EEPROM.
    ///
    /// # Errors
    /// If one of the images is unusable.
    pub fn new(images: &Images) -> Result<Self, Error> {
        Self::with_eeprom(images, &boot_image(&images.fx2)?)
    }

    /// A robot at time 0, switched on, with these contents of the boot EEPROM: the turret's program is
    /// what is in there, not [`Images::fx2`].
    ///
    /// # Errors
    /// If one of the images is unusable.
    pub fn with_eeprom(images: &Images, eeprom: &[u8]) -> Result<Self, Error> {
        let eeprom = Eeprom::large(c::TURRET_EEPROM_ADDRESS as u8, eeprom)?;
        Ok(Self {
            turret: Turret::new(Flash::from_image(&images.flash)?, eeprom),
            fx2: Fx2::new(fx2::Config::default()),
            base: Base::new(&images.khepera, khepera::Config::default())?,
        })
    }

    /// Time that both CPUs have reached.
    pub fn now(&self) -> Ps {
        self.fx2.now().min(self.base.now())
    }

    /// Enumerate the turret and ask its firmware, until it knows, how the FPGA's configuration went.
    ///
    /// # Errors
    /// If the turret does not answer as docs/SPEC.md wants.
    pub fn ask_turret(&mut self) -> Result<ConfigStatus, TurretSilent> {
        let mut host = Host::new();
        let device = host.enumerate(self)?;
        let (vendor, product) = (device.vendor(), device.product());
        if (u32::from(vendor), u32::from(product)) != (c::USB_VENDOR_ID, c::USB_PRODUCT_ID) {
            return Err(TurretSilent::Stranger(vendor, product));
        }
        let request = Request {
            kind: VENDOR_IN,
            request: c::REQUEST_CONFIG_STATUS as u8,
            value: 0,
            index: 0,
        };
        let end = self.now() + STATUS_BUDGET;
        while self.now() < end {
            let reply = host.control_in(self, request, CONFIG_STATUS_SIZE as u16)?;
            let wire = reply.as_slice().try_into().map_err(|_| TurretSilent::Version)?;
            let status = config_status_decode(wire).ok_or(TurretSilent::Version)?;
            if u32::from(status.result) != c::CONFIG_BUSY {
                return Ok(status);
            }
            self.run_until(self.now() + STATUS_PERIOD);
        }
        Err(TurretSilent::Busy(STATUS_BUDGET / MS))
    }

    /// What the two chips were made to do that they do not allow, or that is not modelled.
    pub fn diagnostics(&self) -> Vec<String> {
        let fx2 = self.fx2.diagnostics().iter().map(|d| format!("FX2: {d:?}"));
        let base = self.base.diagnostics().iter().map(|d| format!("68331: {d:?}"));
        fx2.chain(base).collect()
    }
}

/// What the boot EEPROM holds when a turret leaves the workshop: `program`, Intel hex or raw.
///
/// # Errors
/// If the program is unusable.
pub fn boot_image(program: &[u8]) -> Result<Vec<u8>, Error> {
    let program = Image::parse(program)?;
    program.check(fx2::Ram::K8.bytes())?;
    let identity = Identity {
        vendor: c::USB_VENDOR_ID as u16,
        product: c::USB_PRODUCT_ID as u16,
        device: ((c::USB_API_LEVEL << 8) | c::USB_BOARD_REVISION) as u16,
    };
    Ok(c2_image(&program, identity, BootConfig { fast: true, ..BootConfig::default() }))
}

impl Link for Robot {
    fn fx2(&mut self) -> &mut Fx2 {
        &mut self.fx2
    }

    /// Run both CPUs until `t`. Each may end a little later, by an instruction.
    fn run_until(&mut self, t: Ps) {
        while self.now() < t {
            let end = (self.now() + SLICE).min(t);
            self.fx2.run_until(end, &mut self.turret);
            if self.turret.streams() {
                self.turret.fill_fifo(&mut self.fx2);
            }
            self.base.run_until(end, &mut self.turret);
        }
    }
}
